"""What a glTF material has besides what light depends on, carried from the file of a mesh into another document: roughness,
metal, normal map and occlusion, with their pictures byte for byte."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from app.bake.glb import GlbBuilder
from app.bake.gltf_carry import kind_of
from app.errors import SceneError
from app.scene.gltf_file import GltfFile
from app.scene.model import Material

FACTORS = ("metallicFactor", "roughnessFactor")
OF_SURFACE, OF_MATERIAL = ("metallicRoughnessTexture",), ("normalTexture", "occlusionTexture")
OF_TEXTURE = ("scale", "strength")
TRANSFORM = "KHR_texture_transform"
PICTURES = ("image/png", "image/jpeg")  # that glTF allows without an extension
GLOSSINESS = "KHR_materials_pbrSpecularGlossiness"  # instead of a surface with roughness and metal


class Looks:
    """Puts it into materials of a GLB. Each file is read once, each picture written once; what cannot be read is left out."""

    def __init__(self, glb: GlbBuilder) -> None:
        self._glb = glb
        self._files: dict[Path, tuple[GltfFile, dict[str, Any]] | None] = {}
        self._textures: dict[tuple[Path, int], int | None] = {}

    def texcoords(self, material: Material) -> set[int]:
        """The sets of texture coordinates that its maps need."""
        given = self._given(material)
        maps = [] if given is None else [part[name] for part, names in _places(given) for name in names if name in part]
        return {_set_of(info) for info in maps}

    def put(self, item: dict[str, Any], material: Material, slots: dict[int, int]) -> None:
        """Into the glTF material ``item``. slots: the n of the TEXCOORD_n that holds each set."""
        given = self._given(material)
        if given is None or material.gltf is None:
            return
        surface = item["pbrMetallicRoughness"]
        if GLOSSINESS not in given.get("extensions", {}):
            surface |= {name: given.get("pbrMetallicRoughness", {}).get(name, 1.0) for name in FACTORS}
        for into, (part, names) in zip((surface, item), _places(given), strict=True):
            for name in names:
                info = self._info(material.gltf[0], part.get(name), slots)
                if info is not None:
                    into[name] = info

    def _given(self, material: Material) -> dict[str, Any] | None:
        """The material as its file has it; None for one of no file."""
        if material.gltf is None:
            return None
        path, number = material.gltf
        if path not in self._files:
            try:
                file = GltfFile(path)
                self._files[path] = file, json.loads(file.text)
            except SceneError:
                self._files[path] = None
        read = self._files[path]
        materials = [] if read is None else read[1].get("materials", [])
        return materials[number] if number < len(materials) else None

    def _info(self, path: Path, info: dict[str, Any] | None, slots: dict[int, int]) -> dict[str, Any] | None:
        """How a map is used, of the texture here."""
        if info is None or _set_of(info) not in slots:
            return None
        texture = self._texture(path, info["index"])
        if texture is None:
            return None
        made = {name: info[name] for name in OF_TEXTURE if name in info}
        made |= {"index": texture, "texCoord": slots[_set_of(info)]}
        transform = info.get("extensions", {}).get(TRANSFORM)
        if transform is not None:
            made["extensions"] = {TRANSFORM: {name: v for name, v in transform.items() if name != "texCoord"}}
            self._glb.use_extension(TRANSFORM)
        return made

    def _texture(self, path: Path, number: int) -> int | None:
        if (path, number) not in self._textures:
            try:
                self._textures[path, number] = self._carried(path, number)
            except (SceneError, LookupError, TypeError):
                self._textures[path, number] = None
        return self._textures[path, number]

    def _carried(self, path: Path, number: int) -> int | None:
        """The texture of a file with its picture and sampler; None where its picture is none that can be taken. Raises
        SceneError, LookupError and TypeError for what the file does not have."""
        read = self._files[path]
        assert read is not None
        file, document = read
        given = document["textures"][number]
        image = file.document.images[given["source"]]
        data = None if image.uri is None else file.resource(image.uri)
        data = bytes(file.view(image.buffer_view)) if image.buffer_view is not None else data
        kind = None if data is None else kind_of(data)
        if data is None or kind not in PICTURES:
            return None
        picture = {"bufferView": self._glb.add_view(data, {}), "mimeType": kind}
        made = {"source": self._glb.add("images", picture | ({"name": image.name} if image.name else {}))}
        if "sampler" in given:
            made["sampler"] = self._glb.add("samplers", dict(document["samplers"][given["sampler"]]))
        return self._glb.add("textures", made)


def _places(given: dict[str, Any]) -> tuple[tuple[dict[str, Any], tuple[str, ...]], ...]:
    """Where maps are: the surface of a material, and itself."""
    return (given.get("pbrMetallicRoughness", {}), OF_SURFACE), (given, OF_MATERIAL)


def _set_of(info: dict[str, Any]) -> int:
    """The set of texture coordinates that a map is placed by."""
    transform = info.get("extensions", {}).get(TRANSFORM, {})
    return int(transform.get("texCoord", info.get("texCoord", 0)))


__all__ = ["Looks"]
