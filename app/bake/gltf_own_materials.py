"""Materials of a glTF file with what a bake adds: the lightmap's name, one-sided copies where both sides are lit, and edits."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

from app.bake.gltf_carry import CarriedGlb, drop
from app.scene.model import Material

SPECULAR = "KHR_materials_specular"
WITHOUT_SPECULAR = (
    "KHR_materials_unlit",
    "KHR_materials_pbrSpecularGlossiness",
)  # these have no such lobe to leave out
STRENGTH = "KHR_materials_emissive_strength"
GLOSSINESS = "KHR_materials_pbrSpecularGlossiness"
SCALE = "lightmap_scale"  # of extras


class OwnMaterials:
    """The materials of a document, each in its place as it is needed first; others of the same name follow behind all.

    before, now: the scene's materials as they were read, and as they are. lightmaps: the files of
    its pages; textures: the glTF textures of these, if there are any.
    """

    def __init__(
        self,
        glb: CarriedGlb,
        before: tuple[Material, ...],
        now: tuple[Material, ...],
        lightmaps: Sequence[str],
        textures: Sequence[int],
    ) -> None:
        self._glb, self._before, self._now, self._lightmaps, self._textures = glb, before, now, lightmaps, textures
        self._given: list[dict[str, Any]] = glb.given.get("materials", [])
        self._written: dict[tuple[int, bool, bool, int, int | None], int] = {}
        self._placed: set[int] = set()

    def __len__(self) -> int:
        return len(self._given)

    def uses_second(self, material: int) -> bool:
        """Whether any of its textures lies in TEXCOORD_1."""
        return bool(_second_uses(self._given[material]))

    def index(self, material: int, *, double_sided: bool, lit: bool, page: int, moved: int | None) -> int:
        """The glTF material. page: of the lightmap; moved: the set of texture coordinates that TEXCOORD_1 is now, if it moved."""
        key = material, double_sided, lit, page, moved
        if key not in self._written:
            item = self._item(*key)
            if material in self._placed:
                self._written[key] = self._glb.add("materials", item)
            else:
                self._placed.add(material)
                self._glb.document["materials"][material] = item
                self._written[key] = material
        return self._written[key]

    def _item(self, material: int, double_sided: bool, lit: bool, page: int, moved: int | None) -> dict[str, Any]:
        item = copy.deepcopy(self._given[material])
        item.pop("doubleSided", None)
        if double_sided:
            item["doubleSided"] = True
        if moved is not None:
            for use in _second_uses(item):
                use["texCoord"] = moved
        self._edit(item, self._before[material], self._now[material])
        if lit:
            extras = item.get("extras")
            item["extras"] = {**(extras if isinstance(extras, dict) else {}), "lightmap": self._lightmaps[page]}
            extensions = item.setdefault("extensions", {})
            if not any(name in extensions for name in WITHOUT_SPECULAR):
                extensions.setdefault(SPECULAR, {"specularFactor": 0.0})
                self._glb.use_extension(SPECULAR)
            if self._textures:
                extensions["MOZ_lightmap"] = {"index": self._textures[page], "texCoord": 1, "intensity": 1.0}
                self._glb.use_extension("MOZ_lightmap")
            if not extensions:
                item.pop("extensions")
        return item

    def _edit(self, item: dict[str, Any], before: Material, now: Material) -> None:
        """Put in what was edited since the file was read."""
        if (now.albedo, now.opacity) != (before.albedo, before.opacity):
            surface, name = item.setdefault("pbrMetallicRoughness", {}), "baseColorFactor"
            if GLOSSINESS in item.get("extensions", {}):
                surface, name = item["extensions"][GLOSSINESS], "diffuseFactor"
            surface[name] = [*now.albedo, now.opacity]
            if now.opacity < 1.0 and item.get("alphaMode", "OPAQUE") == "OPAQUE":
                item["alphaMode"] = "BLEND"
        if now.emission != before.emission:
            strength = max(1.0, *now.emission)
            item["emissiveFactor"] = [c / strength for c in now.emission]
            drop(item, "extensions", STRENGTH)
            if strength > 1.0:
                item.setdefault("extensions", {})[STRENGTH] = {"emissiveStrength": strength}
                self._glb.use_extension(STRENGTH)
        if now.lightmap_scale != before.lightmap_scale:
            extras = item.get("extras")
            item["extras"] = {**(extras if isinstance(extras, dict) else {}), SCALE: now.lightmap_scale}


def _second_uses(item: Any) -> list[dict[str, Any]]:
    """All parts of a material that say ``texCoord: 1``."""
    if isinstance(item, list):
        return [use for one in item for use in _second_uses(one)]
    if not isinstance(item, dict):
        return []
    own = [item] if item.get("texCoord") == 1 else []
    return own + [use for name, one in item.items() if name != "extras" for use in _second_uses(one)]
