"""The glTF file that a scene came from, with what a bake adds: TEXCOORD_1 in the atlas, and the lightmap's name.

Nodes, names, materials, pictures and animations stay, see gltf_carry.py. Primitives are written anew, since vertices are split
where charts end: each of their attributes goes along, TANGENT, COLOR_0 with its alpha and those of programs too. A TEXCOORD_1
that a material uses moves to the next set that is free. Each instance of a mesh has its own light, so its own mesh; instances
of EXT_mesh_gpu_instancing become children of their node. What the file has not, as a ceiling light, follows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypedDict

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.points import barycentric
from app.bake.gltf_carry import CarriedGlb, drop
from app.bake.gltf_materials import MaterialWriter
from app.bake.gltf_own_materials import OwnMaterials
from app.bake.gltf_writer import (
    about_lightmap,
    add_cameras,
    add_light,
    add_objects,
    add_primitive,
    grouped,
    lightmap_texture,
    sides_of,
)
from app.scene.gltf import GltfReader, Placed, part_of
from app.scene.gltf_file import GltfFile
from app.scene.model import F32, F64, Scene

Ints = NDArray[np.int64]
EXACT = 1e-6  # of a weight: as near to a corner, it is that corner
OFF = 1e-4  # of the scene's size, that corners may be off the file's triangles
POSED = ("POSITION", "NORMAL")  # attributes as morph targets and joints have placed them
NOT_POSED = ("JOINTS", "WEIGHTS")


def is_of_gltf(scene: Scene) -> bool:
    """Whether a scene is that of a glTF file, and knows which of its triangles are which."""
    suffix = "" if scene.source is None else scene.source.suffix.lower()
    return suffix in (".glb", ".gltf") and scene.listed is not None


@np.errstate(all="ignore")
def edited_glb_bytes(
    scene: Scene, unedited: Scene, charts: Charts, lightmaps: Sequence[str], *, moz_lightmap: bool
) -> bytes:
    """The whole GLB file. unedited: the scene as it was read; lightmaps: see gltf_writer.py. Raises SceneError where its file is
    another one by now."""
    assert scene.source is not None
    reader = GltfReader(GltfFile(scene.source))
    reader.walk()
    return _Editor(reader, scene, unedited, charts, lightmaps, moz_lightmap).to_bytes()


class _How(TypedDict):
    """Which of the glTF materials that a material becomes."""

    double_sided: bool
    lit: bool
    page: int


class _Editor:
    def __init__(
        self,
        reader: GltfReader,
        scene: Scene,
        unedited: Scene,
        charts: Charts,
        lightmaps: Sequence[str],
        moz_lightmap: bool,
    ) -> None:
        self._reader, self._file, self._scene, self._unedited = reader, reader.file, scene, unedited
        self._lightmaps = lightmaps
        self._glb = CarriedGlb(self._file)
        textures = [lightmap_texture(self._glb, name) for name in lightmaps] if moz_lightmap else ()
        self._own = OwnMaterials(self._glb, unedited.materials, scene.materials, lightmaps, textures)
        self._added = MaterialWriter(self._glb, scene.materials, lightmaps, textures)
        self._sides = sides_of(scene, charts, len(lightmaps))

    def to_bytes(self) -> bytes:
        assert self._scene.listed is not None
        number = self._scene.listed[self._sides.triangle]
        order = np.argsort(number, kind="stable")
        edges = np.cumsum([0, *(placed.triangles for placed in self._reader.placed)])
        if len(number) and number.max() >= edges[-1]:
            raise self._changed()
        bounds = np.searchsorted(number[order], edges)
        primitives: dict[tuple[int, int], list[dict[str, Any]]] = {}
        frames: dict[tuple[int, int], F64] = {}
        for nth, placed in enumerate(self._reader.placed):
            rows = order[bounds[nth] : bounds[nth + 1]]
            self._add_placed(placed, rows, number[rows] - edges[nth], primitives, frames)
        self._keep_lines(primitives)
        for (node, instance), items in primitives.items():
            self._hang(node, instance, items, frames.get((node, instance)))
        glb, scene = self._glb, self._scene
        roots = self._in_metres(list(glb.roots))
        roots += add_objects(glb, scene, self._sides.only(order[: bounds[0]]), self._added, np.zeros(3))
        roots += self._cameras_and_lights()
        extras = glb.scene.get("extras")
        about = {**(extras if isinstance(extras, dict) else {}), "lightmap": about_lightmap(self._lightmaps)}
        glb.add("scenes", {"name": scene.name, **glb.scene, "nodes": roots, "extras": about})
        glb.document["scene"] = 0
        return glb.to_bytes()

    def _changed(self) -> Exception:
        return self._file.error("has other triangles than when it was opened")

    def _add_placed(
        self,
        placed: Placed,
        rows: Ints,
        listed: Ints,
        primitives: dict[tuple[int, int], list[dict[str, Any]]],
        frames: dict[tuple[int, int], F64],
    ) -> None:
        """The sides that come from one shape, whose triangles are ``listed``, for each instance and material."""
        if not len(rows):
            return
        sides, scene = self._sides.only(rows), self._scene
        count = len(placed.shape.triangles)
        instance, triangle = np.divmod(listed, count)
        part = part_of(placed)
        world = np.asarray(part.positions)[np.asarray(part.triangles)[listed]]
        place = self._scene.world_from_file
        source = world @ place[:3, :3].T + place[:3, 3]
        corners = scene.corners[sides.triangle]
        weights = np.stack([barycentric(corners[:, k], source) for k in range(3)], axis=1)
        off = np.abs(np.einsum("tkc,tcx->tkx", weights, source) - corners).max()
        if not off <= OFF * np.abs(corners).max():
            raise self._changed()
        mirrored = np.linalg.det(placed.worlds[:, :3, :3]) < 0
        material = scene.material_ids[sides.triangle]
        keys = np.stack([instance, material, sides.double_sided, sides.lit, sides.page], axis=1)
        for (one, painted, double_sided, lit, page), mine in grouped(keys):
            # a mirrored instance is wound the other way in its own space
            flat = placed.shape.triangles[triangle[mine]]
            vertex = flat[:, [0, 2, 1]] if mirrored[one] else flat
            back = sides.back[mine]
            at = _Corners(vertex, weights[mine], np.where((back != mirrored[one])[:, None], [0, 2, 1], [0, 1, 2]), back)
            item = self._primitive(placed, at, sides.uv[mine], painted, bool(double_sided), bool(lit), page)
            primitives.setdefault((placed.node, one), []).append(item)
            frames[placed.node, one] = placed.worlds[one]

    def _primitive(
        self, placed: Placed, at: _Corners, uv: F64, material: int, double_sided: bool, lit: bool, page: int
    ) -> dict[str, Any]:
        given = self._given_primitive(placed)
        shape = placed.shape
        own = material < len(self._own)
        second = own and self._own.uses_second(material)
        sets = sum(name.startswith("TEXCOORD_") for name in given["attributes"])
        moved = max(2, sets) if lit and second and "TEXCOORD_1" in given["attributes"] else None
        posed = placed.skinned or bool(given.get("targets"))
        attributes = {"POSITION": at.values(shape.positions)}
        if shape.normals is not None:
            attributes["NORMAL"] = at.directions(shape.normals)
        for name, accessor in given["attributes"].items():
            if name in POSED or name.startswith(NOT_POSED) or (posed and name == "TANGENT"):
                continue
            if name == "TEXCOORD_1" and (lit or not (second or sets > 2)):
                if moved is None:
                    continue
                name = f"TEXCOORD_{moved}"
            values = self._file.accessor(accessor, "SCALAR", "VEC2", "VEC3", "VEC4")[shape.vertices]
            attributes[name] = at.tangents(values) if name == "TANGENT" else at.values(values)
        if lit:
            attributes["TEXCOORD_1"] = at.listed(uv)
        item = add_primitive(self._glb, attributes)
        item |= {name: given[name] for name in ("extras",) if name in given}
        if not own:
            item["material"] = self._added.index(material, double_sided=double_sided, lit=lit, page=page)
            return item
        how: _How = {"double_sided": double_sided, "lit": lit, "page": page}
        item["material"] = self._own.index(material, **how, moved=moved)
        variants = given.get("extensions", {}).get("KHR_materials_variants")
        if variants is not None:
            mappings = [
                {**m, "material": self._own.index(m["material"], **how, moved=moved)} for m in variants["mappings"]
            ]
            item["extensions"] = {"KHR_materials_variants": {**variants, "mappings": mappings}}
        return item

    def _given_primitive(self, placed: Placed) -> dict[str, Any]:
        mesh = self._glb.given["nodes"][placed.node]["mesh"]
        given: dict[str, Any] = self._glb.given["meshes"][mesh]["primitives"][placed.shape.number]
        return given

    def _keep_lines(self, primitives: dict[tuple[int, int], list[dict[str, Any]]]) -> None:
        """Points and lines, as they are."""
        for node in self._reader.nodes:
            mesh = self._glb.given["nodes"][node].get("mesh")
            for given in self._glb.given["meshes"][mesh]["primitives"] if mesh is not None else ():
                if given.get("mode", 4) < 4 and "extensions" not in given and "targets" not in given:
                    item = dict(given)
                    item["attributes"] = {name: self._glb.accessor(i) for name, i in given["attributes"].items()}
                    if "indices" in given:
                        item["indices"] = self._glb.accessor(given["indices"])
                    primitives.setdefault((node, 0), []).append(item)

    def _hang(self, node: int, instance: int, primitives: list[dict[str, Any]], frame: F64 | None) -> None:
        """Give a node its mesh; an instance or a posed mesh becomes a node of its own."""
        glb, nodes = self._glb, self._glb.document["nodes"]
        given = glb.given["nodes"][node]
        source = glb.given["meshes"][given["mesh"]]
        kept = {name: source[name] for name in ("name", "extras") if name in source}
        mesh = glb.add("meshes", {**kept, "primitives": primitives})
        if "skin" in given and frame is not None:
            name = {"name": given["name"]} if "name" in given else {}
            glb.roots = [*glb.roots, glb.add("nodes", {**name, "mesh": mesh})]
        elif "EXT_mesh_gpu_instancing" in given.get("extensions", {}) and frame is not None:
            local = np.linalg.inv(self._reader.nodes[node]) @ frame
            child = {"mesh": mesh, "matrix": local.T.reshape(-1).tolist()}
            name = {"name": f"{given['name']} {instance + 1}"} if "name" in given else {}
            nodes[node].setdefault("children", []).append(glb.add("nodes", {**name, **child}))
        else:
            nodes[node]["mesh"] = mesh

    def _in_metres(self, roots: list[int]) -> list[int]:
        """The roots, below one that turns and scales them where the file has another unit or another axis up."""
        place = self._scene.world_from_file
        if np.array_equal(place, np.eye(4)):
            return roots
        return [self._glb.add("nodes", {"matrix": place.T.reshape(-1).tolist(), "children": roots})]

    def _cameras_and_lights(self) -> list[int]:
        """Nodes of cameras where the file has none, and of all lights where they were edited."""
        glb, scene, roots = self._glb, self._scene, []
        if not self._reader.cameras:
            roots += add_cameras(glb, scene)
        if scene.lights != self._unedited.lights:
            for node in glb.document["nodes"]:
                drop(node, "extensions", "KHR_lights_punctual")
            drop(glb.document, "extensions", "KHR_lights_punctual")
            roots += [add_light(glb, light) for light in scene.lights if light.emits]
        return roots


class _Corners:
    """Corners of written triangles: what each vertex of a file's primitive has, taken to them.

    vertex (t, 3): of the primitive; weights (t, 3, 3): of these that make each corner; order (t, 3): in which the corners are
    written; back (t,): whether the side is its triangle's back.
    """

    def __init__(self, vertex: Ints, weights: F64, order: Ints, back: NDArray[np.bool_]) -> None:
        self._vertex, self._weights, self._order, self._back = vertex, weights, order, back
        self._at = weights.argmax(axis=2)
        self._between = weights.max(axis=2) < 1 - EXACT

    def listed(self, values: F64) -> F32:
        """(3t, w) of values (t, 3, w) of the corners, as written."""
        ordered = np.take_along_axis(values, self._order[..., None], axis=1)
        return ordered.reshape(-1, values.shape[2]).astype(np.float32)

    def values(self, values: NDArray[Any]) -> F32:
        """(3t, w) of values (n, w) of the vertices."""
        return self.listed(self._taken(values))

    def directions(self, values: NDArray[Any]) -> F32:
        """Of normals (n, 3), which are of length 1, and look the other way at the back."""
        return self.listed(_unit(self._taken(values)) * self._facing)

    def tangents(self, values: NDArray[Any]) -> F32:
        """Of tangents (n, 4): at the back, their fourth component turns with the normal."""
        taken = self._taken(values)
        sign = np.where(taken[..., 3:] < 0, -1.0, 1.0) * self._facing
        return self.listed(np.concatenate([_unit(taken[..., :3]), sign], axis=2))

    @property
    def _facing(self) -> F64:
        return np.where(self._back, -1.0, 1.0)[:, None, None]

    def _taken(self, values: NDArray[Any]) -> F64:
        corners = values[self._vertex].astype(np.float64)
        taken = np.take_along_axis(corners, self._at[..., None], axis=1)
        mixed = np.einsum("tkc,tcw->tkw", self._weights, corners)
        return np.where(self._between[..., None], mixed, taken)


def _unit(vectors: F64) -> F64:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.where(length > 0, vectors / length, np.array([0.0, 0.0, 1.0]))
