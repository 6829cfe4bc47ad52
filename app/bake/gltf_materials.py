"""Materials, textures and samplers of a scene as glTF, each picture and sampler written once."""

from __future__ import annotations

import dataclasses
import io
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from app.bake.glb import GlbBuilder
from app.bake.gltf_looks import Looks
from app.scene.model import F32, F64, Material, Texture

WRAPS = {"repeat": 10497, "clamp": 33071, "mirror": 33648}
NEAREST, LINEAR, LINEAR_MIPMAP_LINEAR = 9728, 9729, 9987


class MaterialWriter:
    """Adds materials to a GLB on demand. lightmaps: the files that hold the irradiance, one for each page; textures: the glTF
    textures that name them, if there are any."""

    def __init__(
        self, glb: GlbBuilder, materials: tuple[Material, ...], lightmaps: Sequence[str], textures: Sequence[int]
    ) -> None:
        self._glb, self._materials, self._lightmaps, self._lightmap_textures = glb, materials, lightmaps, textures
        self._written: dict[tuple[int, bool, bool, int], int] = {}
        self._images: dict[int, int] = {}
        self._looks = Looks(glb)
        self._with_alpha = [_with_alpha(material) for material in materials]
        self._samplers: dict[tuple[int, int, bool], int] = {}
        self._textures: dict[tuple[int, int], int] = {}

    def texcoords(self, material: int, *, lit: bool) -> dict[int, int]:
        """The scene's UV sets (0 or 1) that a material needs, and the n of the glTF TEXCOORD_n that holds each.

        TEXCOORD_1 is the lightmap's. A second set moves to 0 if its material needs no other, else to 2 where it is lit.
        """
        m = self._materials[material]
        used = {t.texcoord for t in (self._with_alpha[material][0], m.emission_texture) if t is not None}
        used |= self._looks.texcoords(m) & {0, 1}
        if used == {1}:
            return {1: 0}
        return {0: 0, 1: 2 if lit else 1} if 1 in used else {0: 0}

    def index(self, material: int, *, double_sided: bool, lit: bool, page: int) -> int:
        """The glTF material of a scene's material, as it is or one-sided, with or without a page of the lightmap."""
        key = (material, double_sided, lit, page)
        if key not in self._written:
            self._written[key] = self._glb.add("materials", self._material(*key))
        return self._written[key]

    def _material(self, material: int, double_sided: bool, lit: bool, page: int) -> dict[str, Any]:
        m, slots = self._materials[material], self.texcoords(material, lit=lit)
        texture, opacity = self._with_alpha[material]
        surface: dict[str, Any] = {
            "baseColorFactor": [*m.albedo, opacity],
            "metallicFactor": 0.0,
            "roughnessFactor": 1.0,
        }
        if texture is not None:
            surface["baseColorTexture"] = self._texture_info(texture, slots)
        item: dict[str, Any] = {"name": m.name, "pbrMetallicRoughness": surface, "doubleSided": double_sided}
        self._looks.put(item, m, slots)
        if m.opacity_cutoff is not None:
            item |= {"alphaMode": "MASK", "alphaCutoff": m.opacity_cutoff}
        elif not m.opaque:
            item["alphaMode"] = "BLEND"
        extensions: dict[str, Any] = {}
        if m.emits:
            strength = max(1.0, *m.emission)
            item["emissiveFactor"] = [c / strength for c in m.emission]
            if strength > 1.0:
                extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
            if m.emission_texture is not None:
                item["emissiveTexture"] = self._texture_info(m.emission_texture, slots)
        if m.lightmap_scale != 1.0:
            item["extras"] = {"lightmap_scale": m.lightmap_scale}
        if lit:
            item.setdefault("extras", {})["lightmap"] = self._lightmaps[page]
            extensions["KHR_materials_specular"] = {"specularFactor": 0.0}
            if self._lightmap_textures:
                extensions["MOZ_lightmap"] = {"index": self._lightmap_textures[page], "texCoord": 1, "intensity": 1.0}
        if extensions:
            item["extensions"] = extensions
        for name in extensions:
            self._glb.use_extension(name)
        return item

    def _texture_info(self, texture: Texture, slots: dict[int, int]) -> dict[str, Any]:
        info: dict[str, Any] = {"index": self._texture(texture), "texCoord": slots[texture.texcoord]}
        if not np.array_equal(texture.uv_transform, np.eye(2, 3)):
            info["extensions"] = {"KHR_texture_transform": texture_transform(texture.uv_transform)}
            self._glb.use_extension("KHR_texture_transform")
        return info

    def _texture(self, texture: Texture) -> int:
        image = self._images.get(id(texture.pixels))
        if image is None:
            image = self._glb.add_image(png_bytes(texture.pixels), texture.name)
            self._images[id(texture.pixels)] = image
        wrap_u, wrap_v = (WRAPS[w] for w in texture.wrap)
        sampler = self._samplers.get((wrap_u, wrap_v, texture.bilinear))
        if sampler is None:
            filters = (LINEAR, LINEAR_MIPMAP_LINEAR) if texture.bilinear else (NEAREST, NEAREST)
            item = {"magFilter": filters[0], "minFilter": filters[1], "wrapS": wrap_u, "wrapT": wrap_v}
            sampler = self._samplers[wrap_u, wrap_v, texture.bilinear] = self._glb.add("samplers", item)
        if (image, sampler) not in self._textures:
            self._textures[image, sampler] = self._glb.add("textures", {"source": image, "sampler": sampler})
        return self._textures[image, sampler]


def _with_alpha(material: Material) -> tuple[Texture | None, float]:
    """The texture of the base colour, with the opacity's as its alpha, and the alpha factor. Where both have other texture
    coordinates, which glTF has no way to say, the opacity's mean is in the factor."""
    albedo, opacity = material.albedo_texture, material.opacity_texture
    if opacity is None:
        return albedo, material.opacity
    if albedo is None:
        white = np.ones((*opacity.pixels.shape[:2], 3), np.float32)
        return dataclasses.replace(opacity, pixels=np.concatenate([white, opacity.pixels], 2)), material.opacity
    if albedo.texcoord != opacity.texcoord or not np.array_equal(albedo.uv_transform, opacity.uv_transform):
        return albedo, material.opacity * float(opacity.pixels.mean())
    shape = np.maximum(albedo.pixels.shape[:2], opacity.pixels.shape[:2])
    pixels = np.concatenate([_enlarged(albedo.pixels, shape), _enlarged(opacity.pixels, shape)], 2)
    return dataclasses.replace(albedo, pixels=pixels), material.opacity


def _enlarged(pixels: F32, shape: NDArray[np.int64]) -> F32:
    """A picture with that many rows and columns, by its nearest pixels."""
    rows, columns = (np.arange(now) * old // now for now, old in zip(shape, pixels.shape, strict=False))
    return np.asarray(pixels[rows[:, None], columns])


def png_bytes(pixels: F32) -> bytes:
    """A linear picture (h, w, 3) in [0, 1], or with an alpha (h, w, 4), as an 8-bit sRGB PNG."""
    out = io.BytesIO()
    colours = srgb8_from_linear(pixels[..., :3])
    alpha = np.round(255.0 * np.clip(pixels[..., 3:], 0.0, 1.0)).astype(np.uint8)
    Image.fromarray(np.concatenate([colours, alpha], 2)).save(out, "PNG")
    return out.getvalue()


def srgb8_from_linear(linear: F32) -> NDArray[np.uint8]:
    """The sRGB transfer curve (IEC 61966-2-1), rounded to 8 bits; the inverse of decoding for 8-bit pictures."""
    x = np.clip(linear, 0.0, 1.0)
    srgb = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return np.round(255.0 * srgb).astype(np.uint8)


def texture_transform(matrix: F64) -> dict[str, Any]:
    """A (2, 3) UV transform as KHR_texture_transform: translation · rotation · scale, so without shear.

    The extension's rotation matrix is [cos r, sin r; -sin r, cos r].
    """
    (a, b, x), (c, d, y) = matrix.tolist()
    if math.hypot(a, c) >= math.hypot(b, d):
        rotation, scale_u = math.atan2(-c, a), math.hypot(a, c)
        scale_v = (a * d - b * c) / scale_u if scale_u else 0.0
    else:
        rotation, scale_v = math.atan2(b, d), math.hypot(b, d)
        scale_u = (a * d - b * c) / scale_v
    return {"offset": [x, y], "rotation": rotation, "scale": [scale_u, scale_v]}
