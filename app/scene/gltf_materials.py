"""glTF materials as diffuse surfaces.

The albedo is the base colour as it stands, also of metals: without a mirror term, what a metal reflects leaves
diffusely. Emission is emissiveFactor × emissiveStrength [W/(sr m²)] × texture. Opacity is the alpha of the base colour, unless
alphaMode is OPAQUE, times 1 - transmission (KHR_materials_transmission), whose tint is ignored. Roughness, normal maps and the
alpha of vertices have no effect. A picture that cannot be read counts as white, so the factor alone is used; where that is white,
too, the albedo is 0.5.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Literal

import numpy as np

from app.scene.gltf_file import GltfFile
from app.scene.gltf_schema import Image, TextureInfo, TextureTransform
from app.scene.gltf_schema import Material as GltfMaterial
from app.scene.gltf_schema import Texture as GltfTexture
from app.scene.images import ImageError, read_channel, read_image, without_pictures
from app.scene.model import F32, F64, RGB, Material, Texture
from app.util.words import counted

WRAPS = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
NEAREST = 9728
Channel = Literal["R", "A"]
UNKNOWN_ALBEDO: RGB = (0.5, 0.5, 0.5)


def read_materials(file: GltfFile, used: set[int]) -> tuple[list[Material], list[str]]:
    """All materials in order, and the warnings of the ``used`` ones; only their pictures are decoded."""
    reader = _Reader(file)
    materials = []
    for i, source in enumerate(file.document.materials):
        if i in used:
            materials.append(reader.material(i, source))
        else:
            materials.append(Material(name=source.name or f"material {i}"))
    return materials, reader.warnings([file.document.materials[i] for i in sorted(used)])


class _Reader:
    """Decodes each picture once and remembers what could not be had."""

    def __init__(self, file: GltfFile) -> None:
        self.file = file
        self._pixels: dict[int, F32 | None] = {}
        self._channels: dict[tuple[int, Channel], F32 | None] = {}
        self._without_picture = 0
        self._far_texcoords = 0

    def warnings(self, used: list[GltfMaterial]) -> list[str]:
        images = self.file.document.images
        missing, broken = list[str](), list[str]()
        for i, pixels in self._pixels.items():
            if pixels is None:
                file = images[i].uri if (images[i].uri or "data:")[:5] != "data:" else None
                lost = missing if file and image_data(self.file, images[i]) is None else broken
                lost.append(file or images[i].name or f"image {i}")
        unlit = sum(m.extensions.unlit is not None for m in used)
        notes = [
            (self._without_picture, "texture", "textures", "without a picture that can be read: ignored"),
            (self._far_texcoords, "texture", "textures", "with TEXCOORD_2 or higher: ignored"),
            (unlit, "unlit material", "unlit materials", "treated as diffuse"),
        ]
        said = [f"{counted(n, one, many)} {text}" for n, one, many, text in notes if n]
        if missing or broken:
            instead = "the material's factor is used, or albedo 0.5 without it"
            said.insert(0, f"{without_pictures(missing, broken)}: {instead}")
        return said

    def material(self, index: int, source: GltfMaterial) -> Material:
        rough, gloss = source.pbr_metallic_roughness, source.extensions.specular_glossiness
        factor, info = rough.base_color_factor, rough.base_color_texture
        if gloss is not None:
            factor, info = gloss.diffuse_factor, gloss.diffuse_texture
        albedo_texture = self._texture(info)
        r, g, b, alpha = factor or (1.0, 1.0, 1.0, 1.0)
        lost = info is not None and albedo_texture is None and min(r, g, b) >= 1.0  # white stands for its picture
        strength = source.extensions.emissive_strength
        k = 1.0 if strength is None else strength.emissive_strength
        er, eg, eb = source.emissive_factor
        emits = k * max(source.emissive_factor) > 0.0
        opacity, opacity_texture, cutoff = self._opacity(source, alpha, info)
        return Material(
            name=source.name or f"material {index}",
            albedo=UNKNOWN_ALBEDO if lost else (r, g, b),
            emission=(k * er, k * eg, k * eb),
            albedo_texture=albedo_texture,
            emission_texture=self._texture(source.emissive_texture) if emits else None,
            double_sided=source.double_sided,
            opacity=opacity,
            opacity_texture=opacity_texture,
            opacity_cutoff=cutoff,
            lightmap_scale=source.extras.lightmap_scale,
        )

    def _opacity(
        self, source: GltfMaterial, alpha: float, info: TextureInfo | None
    ) -> tuple[float, Texture | None, float | None]:
        """Opacity, its texture and its cutoff. Where alpha has a texture, one of the transmission counts by its mean."""
        opacity, texture, cutoff = 1.0, None, None
        if source.alpha_mode in ("MASK", "BLEND"):
            opacity, texture = alpha, self._one_channel(info, "A")
            cutoff = source.alpha_cutoff if source.alpha_mode == "MASK" else None
        glass = source.extensions.transmission
        if glass is None or cutoff is not None:
            return opacity, texture, cutoff
        passing = self._one_channel(glass.transmission_texture, "R")
        if passing is None:
            return opacity * (1.0 - glass.transmission_factor), texture, None
        kept = np.asarray(1.0 - glass.transmission_factor * passing.pixels, np.float32)
        if texture is None:
            return opacity, dataclasses.replace(passing, pixels=kept), None
        return opacity * float(kept.mean()), texture, None

    def _one_channel(self, info: TextureInfo | None, channel: Channel) -> Texture | None:
        """A texture's red or alpha; None without it."""
        made = self._texture(info)
        if info is None or made is None:
            return None
        index = self._source(self.file.pick(self.file.document.textures, info.index, "texture"))
        assert index is not None
        if (index, channel) not in self._channels:
            data = image_data(self.file, self.file.pick(self.file.document.images, index, "image"))
            assert data is not None
            self._channels[index, channel] = read_channel(data, channel)
        pixels = self._channels[index, channel]
        return None if pixels is None else dataclasses.replace(made, pixels=pixels)

    def _texture(self, info: TextureInfo | None) -> Texture | None:
        if info is None:
            return None
        texture = self.file.pick(self.file.document.textures, info.index, "texture")
        source = self._source(texture)
        if source is None:
            self._without_picture += 1
            return None
        image = self.file.pick(self.file.document.images, source, "image")
        pixels = self._image(source, image)
        if pixels is None:
            return None
        transform = info.extensions.transform or TextureTransform()
        texcoord = info.tex_coord if transform.tex_coord is None else transform.tex_coord
        if texcoord > 1:
            self._far_texcoords += 1
            return None
        made = Texture(image.name or f"image {source}", pixels, texcoord=texcoord, uv_transform=uv_transform(transform))
        if texture.sampler is None:
            return made
        sampler = self.file.pick(self.file.document.samplers, texture.sampler, "sampler")
        wrap = (WRAPS[sampler.wrap_s], WRAPS[sampler.wrap_t])
        return dataclasses.replace(made, wrap=wrap, bilinear=sampler.mag_filter != NEAREST)

    def _image(self, index: int, image: Image) -> F32 | None:
        if index not in self._pixels:
            data = image_data(self.file, image)
            try:
                self._pixels[index] = None if data is None else read_image(data)
            except ImageError:
                self._pixels[index] = None
        return self._pixels[index]

    def _source(self, texture: GltfTexture) -> int | None:
        webp = texture.extensions.webp
        return texture.source if webp is None or webp.source is None else webp.source


def uv_transform(transform: TextureTransform) -> F64:
    """(2, 3) offset · rotation · scale of KHR_texture_transform.

    The rotation's sign is that of its own example and of the known implementations; the listing in its text has it the
    other way round (KhronosGroup/glTF issue 1563).
    """
    c, s = math.cos(transform.rotation), math.sin(transform.rotation)
    (sx, sy), (tx, ty) = transform.scale, transform.offset
    return np.array([[c * sx, s * sy, tx], [-s * sx, c * sy, ty]])


def image_data(file: GltfFile, image: Image) -> bytes | None:
    """A picture as it is in the file, or in one that the file names; None where there is none."""
    if image.buffer_view is not None:
        return bytes(file.view(image.buffer_view))
    return None if image.uri is None else file.resource(image.uri)
