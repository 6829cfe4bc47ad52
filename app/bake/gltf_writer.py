"""The scene with its lightmap as GLB: original materials, TEXCOORD_1 in the atlas, and the lightmap's file by name.

``extras.lightmap`` of the glTF scene names file, quantity and unit, that of each lit material the file alone: the light is an EXR
file, which glTF does not allow as an image, and readers that parse all images would refuse the scene. MOZ_lightmap (Mozilla
Hubs), {"index": texture, "texCoord": 1, "intensity": 1}, which names that file as a texture all the same, is written where it is
asked for. Both mean irradiance that the renderer multiplies by albedo/π, as three.js' ``lightMap``. (three.js' EXRLoader puts the
last scanline first: set ``flipY = true`` on what it returns.)

Lit materials have no specular lobe (KHR_materials_specular): light was reflected diffusely, and renderers that share it out
between both lobes would darken it by what the specular one takes.

Every triangle has its own lightmap area:

- both sides lit: written twice, front and back (reversed), each one-sided;
- one side lit: written once, that side in front, as two-sided as its material is;
- no side lit: written once, without TEXCOORD_1 and without lightmap: nothing but its own emission is seen.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app import __version__
from app.atlas.charts import Charts
from app.bake.glb import GlbBuilder
from app.bake.gltf_materials import MaterialWriter
from app.scene.cameras import look_at
from app.scene.colorimetry import LUMENS_PER_WATT
from app.scene.lights import Light
from app.scene.model import F32, F64, Camera, Scene

# Positions are 32-bit floats: beyond this distance from the origin, in radii of the scene, nodes carry the offset, so
# that never more than 3 of the 24 bits are lost to it.
FAR = 4.0
NEAR_PLANE = 1e-3  # of the scene's radius: glTF cameras must have one, the scene's have none


@dataclass(frozen=True, eq=False)
class Sides:
    """The triangle sides to write, (k,) each. uv (k, 3, 2) in [0, 1] of a page of the lightmap, in the triangle's corner order; 0
    if not lit. page: the number of that."""

    triangle: NDArray[np.int64]
    back: NDArray[np.bool_]
    lit: NDArray[np.bool_]
    double_sided: NDArray[np.bool_]
    uv: F64
    page: NDArray[np.int64]

    def only(self, rows: NDArray[np.int64]) -> Sides:
        return Sides(**{name: values[rows] for name, values in vars(self).items()})


def glb_bytes(scene: Scene, charts: Charts, lightmaps: Sequence[str], *, moz_lightmap: bool = False) -> bytes:
    """The whole GLB file. lightmaps: the names of the EXR files beside it, one for each page that the charts' atlas is cut into.
    moz_lightmap: name them as textures, too."""
    glb = GlbBuilder(f"glowtree {__version__}")
    textures = [lightmap_texture(glb, name) for name in lightmaps] if moz_lightmap else ()
    materials = MaterialWriter(glb, scene.materials, lightmaps, textures)

    nodes = add_objects(glb, scene, sides_of(scene, charts, len(lightmaps)), materials, offset_of(scene))
    nodes += add_cameras(glb, scene)
    nodes += [add_light(glb, light) for light in scene.lights if light.emits]
    glb.add("scenes", {"name": scene.name, "nodes": nodes, "extras": {"lightmap": about_lightmap(lightmaps)}})
    glb.document["scene"] = 0
    return glb.to_bytes()


def offset_of(scene: Scene) -> F64:
    """Where nodes put their meshes (3,) [m]: 0, unless the scene is far from there."""
    centre, radius = _middle(scene)
    return centre if np.linalg.norm(centre) > FAR * radius else np.zeros(3)


def _middle(scene: Scene) -> tuple[F64, float]:
    lower, upper = scene.bounds
    return (lower + upper) / 2, float(np.linalg.norm(upper - lower)) / 2


def about_lightmap(files: Sequence[str]) -> dict[str, Any]:
    """What the glTF scene says of the lightmap."""
    named = {"file": files[0]} if len(files) == 1 else {"files": list(files)}
    return {**named, "quantity": "irradiance", "unit": "W/m2", "texCoord": 1, "firstRow": "v = 0"}


def lightmap_texture(glb: GlbBuilder, uri: str) -> int:
    """The lightmap's file as a glTF texture, whatever format it has."""
    image = glb.add("images", {"uri": uri, "name": "irradiance"})
    sampler = glb.add("samplers", {"magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071})
    return glb.add("textures", {"source": image, "sampler": sampler, "name": "irradiance"})


def sides_of(scene: Scene, charts: Charts, pages: int = 1) -> Sides:
    """Which sides of which triangles are written, front before back: see above. pages: that the atlas is cut into."""
    face = np.full((len(scene.triangles), 2), -1)
    face[charts.face_triangle, charts.face_back.astype(int)] = np.arange(len(charts.face_triangle))
    front_lit, back_lit = face[:, 0] >= 0, face[:, 1] >= 0
    assert not (back_lit & ~scene.sides).any(), "a chart at the back of a one-sided triangle"
    front, back = np.flatnonzero(front_lit | ~back_lit), np.flatnonzero(back_lit)
    triangle = np.concatenate([front, back])
    side = np.repeat([0, 1], [len(front), len(back)])
    written = face[triangle, side]
    lit = written >= 0
    uv = np.zeros((len(triangle), 3, 2))
    uv[lit] = charts.face_uv[written[lit]] / np.array(charts.size) * (1, pages)
    page = np.floor(uv[..., 1].mean(axis=1)).astype(np.int64)
    uv[..., 1] -= page[:, None]
    return Sides(
        triangle=triangle,
        back=side == 1,
        lit=lit,
        double_sided=scene.sides[triangle] & ~(front_lit & back_lit)[triangle],
        uv=uv,
        page=page,
    )


def add_objects(glb: GlbBuilder, scene: Scene, sides: Sides, materials: MaterialWriter, offset: F64) -> list[int]:
    """One node and mesh for each object that has triangles, one primitive for each glTF material; returns the nodes."""
    keys = np.stack(
        [
            scene.object_ids[sides.triangle],
            scene.material_ids[sides.triangle],
            sides.double_sided,
            sides.lit,
            sides.page,
        ],
        axis=1,
    )
    primitives: dict[int, list[dict[str, Any]]] = {}
    for (obj, material, double_sided, lit, page), rows in grouped(keys):
        vertices = _vertices(scene, sides, rows, materials.texcoords(material, lit=bool(lit)), bool(lit), offset)
        primitive = add_primitive(glb, vertices)
        primitive["material"] = materials.index(material, double_sided=bool(double_sided), lit=bool(lit), page=page)
        primitives.setdefault(obj, []).append(primitive)
    nodes = []
    for obj, items in primitives.items():
        name = scene.objects[obj]
        node: dict[str, Any] = {"name": name, "mesh": glb.add("meshes", {"name": name, "primitives": items})}
        if offset.any():
            node["translation"] = offset.tolist()
        nodes.append(glb.add("nodes", node))
    return nodes


def grouped(keys: NDArray[np.int64]) -> Iterator[tuple[list[int], NDArray[np.int64]]]:
    """Each different row of keys (n, k), in order, and which rows are like it."""
    if len(keys):
        groups, group_of = np.unique(keys, axis=0, return_inverse=True)
        order = np.argsort(group_of.reshape(-1), kind="stable")
        yield from zip(groups.tolist(), np.split(order, np.cumsum(np.bincount(group_of.reshape(-1)))[:-1]), strict=True)


def _vertices(
    scene: Scene, sides: Sides, rows: NDArray[np.int64], texcoords: dict[int, int], lit: bool, offset: F64
) -> dict[str, F32]:
    """Attribute name → (3k, 2|3) f32, three vertices per side, counter-clockwise from where the side is seen."""
    triangle, back = sides.triangle[rows], sides.back[rows]
    order = np.where(back[:, None], [0, 2, 1], [0, 1, 2])
    attributes: dict[str, NDArray[Any]] = {"POSITION": scene.corners[triangle] - offset}
    if scene.normals is not None:
        attributes["NORMAL"] = scene.normals[triangle] * np.where(back, -1.0, 1.0)[:, None, None]
    if scene.colours is not None:
        attributes["COLOR_0"] = scene.colours[triangle]
    for source, slot in texcoords.items():
        uv = (scene.uv0, scene.uv1)[source]
        if uv is not None:
            attributes[f"TEXCOORD_{slot}"] = uv[triangle]
    if lit:
        attributes["TEXCOORD_1"] = sides.uv[rows]
    return {
        name: np.take_along_axis(values, order[:, :, None], axis=1).astype(np.float32).reshape(-1, values.shape[2])
        for name, values in attributes.items()
    }


def add_primitive(glb: GlbBuilder, attributes: dict[str, F32]) -> dict[str, Any]:
    """A primitive of attributes (3k, 1 to 4) f32, of three vertices for each triangle. Equal ones become one, in the order in
    which they come first."""
    rows = np.ascontiguousarray(np.concatenate(list(attributes.values()), axis=1)) + 0.0  # -0.0 and 0.0 are one vertex
    whole = rows.view(np.dtype((np.void, rows.itemsize * rows.shape[1])))[:, 0]
    _, first, inverse = np.unique(whole, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    kept = first[order]
    written = {name: glb.add_vertices(values[kept], bounds=name == "POSITION") for name, values in attributes.items()}
    if "TEXCOORD_1" in written:
        written.setdefault("TEXCOORD_0", written["TEXCOORD_1"])  # sets must be numbered from 0 (glTF 2.0, 3.7.2.1)
    return {"attributes": written, "indices": glb.add_indices(rank[inverse])}


def add_cameras(glb: GlbBuilder, scene: Scene) -> list[int]:
    """A node for each camera of the scene."""
    near = NEAR_PLANE * _middle(scene)[1]
    return [_add_camera(glb, camera, near) for camera in scene.cameras]


def _add_camera(glb: GlbBuilder, camera: Camera, near: float) -> int:
    perspective = {"yfov": camera.yfov, "znear": near}
    index = glb.add("cameras", {"name": camera.name, "type": "perspective", "perspective": perspective})
    matrix = camera.world_from_camera.T.reshape(-1).tolist()
    return glb.add("nodes", {"name": camera.name, "camera": index, "matrix": matrix})


def add_light(glb: GlbBuilder, light: Light) -> int:
    """A node with the light in cd or lx (KHR_lights_punctual)."""
    strength = max(light.intensity)
    item: dict[str, Any] = {
        "name": light.name,
        "type": light.kind,
        "color": [c / strength for c in light.intensity],
        "intensity": strength * LUMENS_PER_WATT,
    }
    if light.kind == "spot":
        item["spot"] = {"innerConeAngle": light.inner, "outerConeAngle": light.outer}
    if not light.from_afar and math.isfinite(light.range):
        item["range"] = light.range
    if light.radius or light.angle:
        item["extras"] = {"radius": light.radius, "angle": light.angle}
    matrix = look_at(np.array(light.position), np.array(light.position) + np.array(light.direction))
    extension = {"KHR_lights_punctual": {"light": glb.add_light(item)}}
    return glb.add("nodes", {"name": light.name, "matrix": matrix.T.reshape(-1).tolist(), "extensions": extension})
