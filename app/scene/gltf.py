"""glTF 2.0 and GLB (Khronos glTF 2.0 specification) as a Scene.

Every node with a mesh becomes an object. Read: triangles, strips and fans, all component types, sparse accessors, node
hierarchies, instances (also EXT_mesh_gpu_instancing), materials and their pictures (``gltf_materials``), TEXCOORD_0 and 1,
normals, COLOR_0 as a factor of the albedo, morph targets and skins as they stand (``gltf_pose``), perspective cameras, lights of
KHR_lights_punctual, a sky of EXT_lights_image_based (``gltf_sky``). Counted and left out: points and lines, skins whose joints
are in no scene.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.scene.colorimetry import LUMENS_PER_WATT
from app.scene.gltf_draco import decompress
from app.scene.gltf_file import GltfFile
from app.scene.gltf_materials import UNKNOWN_ALBEDO, read_materials
from app.scene.gltf_pose import joint_matrices, morphed, skinning, turned_normals
from app.scene.gltf_schema import Light as GltfLight
from app.scene.gltf_schema import Mesh, Node, Primitive
from app.scene.gltf_sky import read_sky
from app.scene.lights import Light
from app.scene.model import F64, Camera, Material, Scene
from app.scene.outline import Outline, colour_textures
from app.scene.validate import Part, check_triangle_count, validate
from app.util.background import Report, share_of, unheard
from app.util.words import counted

TRIANGLES, STRIP, FAN = 4, 5, 6
VALUES = {"TEXCOORD_0": ("VEC2",), "TEXCOORD_1": ("VEC2",), "NORMAL": ("VEC3",), "COLOR_0": ("VEC3", "VEC4")}


@dataclass(frozen=True, eq=False)
class Shape:
    """A primitive in its own space, or posed by its joints in the world; ``material`` None where the file names none.

    number: which of its mesh's primitives. vertices (n,): which of the file's vertices those of the triangles are.
    """

    number: int
    vertices: NDArray[np.int64]
    positions: F64
    triangles: NDArray[np.int64]
    material: int | None
    uv0: NDArray[Any] | None
    uv1: NDArray[Any] | None
    normals: NDArray[Any] | None
    colours: NDArray[Any] | None


@dataclass(frozen=True, eq=False)
class Placed:
    """A shape once for each of (k, 4, 4) matrices. node: of the document; skinned: its joints place it."""

    shape: Shape
    worlds: F64
    object_id: int
    material: int
    node: int
    skinned: bool

    @property
    def triangles(self) -> int:
        return len(self.worlds) * len(self.shape.triangles)


@np.errstate(all="ignore")
def load_gltf(path: Path, report: Report = unheard) -> Scene:
    """Read a .glb or .gltf file. report(share) is called now and then and may raise to cancel. SceneError for anything that makes
    it unusable."""
    reader = GltfReader(GltfFile(path))
    reader.walk(share_of(report, 0.0, 0.4))
    materials, notes = reader.read_materials()
    parts = []
    for nth, placed in enumerate(reader.placed):
        report(0.5 + 0.1 * nth / len(reader.placed))
        parts.append(part_of(placed))
    notes, objects, rest = [*reader.warnings(), *notes], reader.objects, share_of(report, 0.6, 1.0)
    sky = read_sky(reader.file)
    scene = validate(path, path.stem, parts, objects, materials, reader.cameras, notes, reader.lights, rest)
    return scene if sky is None else scene.with_sky(sky)


@np.errstate(all="ignore")
def outline_gltf(path: Path, most: int) -> Outline | None:
    """Of a file with more than so many triangles; None where it has no more. Nothing is placed, and nothing checked that only a
    Scene must be. SceneError as for ``load_gltf``."""
    reader = GltfReader(GltfFile(path))
    reader.walk()
    if sum(placed.triangles for placed in reader.placed) <= most:
        return None
    materials, notes = reader.read_materials()
    sky = read_sky(reader.file)
    sides = [1 + materials[placed.material].double_sided for placed in reader.placed]
    areas = [n * _area(placed) for n, placed in zip(sides, reader.placed, strict=True)]
    scales = [materials[placed.material].lightmap_scale for placed in reader.placed]
    boxes = np.concatenate([_boxes(placed) for placed in reader.placed if placed.triangles])
    return Outline(
        name=path.stem,
        triangles=sum(placed.triangles for placed in reader.placed),
        sides=sum(n * placed.triangles for n, placed in zip(sides, reader.placed, strict=True)),
        area=sum(areas),
        texel_area=sum(area * scale**2 for area, scale in zip(areas, scales, strict=True)),
        lower=boxes.min(axis=(0, 1)),
        upper=boxes.max(axis=(0, 1)),
        objects=len(reader.objects),
        materials=len(materials),
        emitting_materials=sum(m.emits for m in materials),
        textures=colour_textures(materials, coloured=any(p.shape.colours is not None for p in reader.placed)),
        lights=tuple(reader.lights),
        cameras=tuple(camera.name for camera in reader.cameras),
        sky=None if sky is None else sky.kind,
        warnings=(*reader.warnings(), *notes),
        exact=False,
    )


class GltfReader:
    """Walks the node tree of one file and collects shapes as they are placed, objects and cameras."""

    def __init__(self, file: GltfFile) -> None:
        self.file = file
        self.placed: list[Placed] = []
        self.objects: list[str] = []
        self.cameras: list[Camera] = []
        self.lights: list[Light] = []
        self.used_materials: set[int] = set()
        self.nodes: dict[int, F64] = {}  # world-from-node of the scene's nodes, parents first
        self._shapes: dict[tuple[int, int | None, tuple[float, ...]], list[Shape]] = {}
        self._triangle_count = 0
        self.unpainted = 0  # primitives without material
        self._not_triangles = self._skinned = self._not_pinholes = self._faded = 0

    def warnings(self) -> list[str]:
        notes = [
            (self._not_triangles, "primitive", "primitives", "without triangles left out"),
            (self.unpainted, "primitive", "primitives", "without material: grey with albedo 0.5"),
            (self._skinned, "skinned mesh", "skinned meshes", "without joints in the scene: shown without pose"),
            (self._faded, "primitive", "primitives", "with alpha of vertices: not seen through"),
            (self._not_pinholes, "camera", "cameras", "without perspective left out"),
        ]
        return [f"{counted(n, one, many)} {text}" for n, one, many, text in notes if n]

    def read_materials(self) -> tuple[list[Material], list[str]]:
        """After the walk: all materials, with the pictures of those that are used, and warnings."""
        materials, notes = read_materials(self.file, self.used_materials)
        if self.unpainted:
            materials.append(Material("no material", UNKNOWN_ALBEDO))
        return materials, notes

    def walk(self, report: Report = unheard) -> None:
        """Visit every node of the default scene once, parents first. report: as of ``load_gltf``."""
        document, nodes = self.file.document, self.file.document.nodes
        if document.scenes:
            roots = self.file.pick(document.scenes, document.scene, "scene").nodes
        else:
            children = {child for node in nodes for child in node.children}
            roots = [i for i in range(len(nodes)) if i not in children]
            if nodes and not roots:
                raise self.file.error("the nodes form a cycle")
        stack = [(root, np.eye(4)) for root in reversed(roots)]
        while stack:
            index, world_from_parent = stack.pop()
            node = self.file.pick(nodes, index, "node")
            if index in self.nodes:
                raise self.file.error(f"node {index} is reached twice: the nodes form a cycle, or it has two parents")
            self.nodes[index] = world_from_parent @ _parent_from_node(node)
            stack.extend((child, self.nodes[index]) for child in reversed(node.children))
        for nth, (index, world_from_node) in enumerate(self.nodes.items()):
            report(nth / len(self.nodes))
            self._visit(index, nodes[index], world_from_node)

    def _visit(self, index: int, node: Node, world_from_node: F64) -> None:
        if node.extensions.light is not None:
            lights = self.file.document.extensions.punctual.lights
            light = self.file.pick(lights, node.extensions.light.light, "light")
            self.lights.append(_light(light, node.name or light.name or f"light {index}", world_from_node))
        if node.camera is not None:
            camera = self.file.pick(self.file.document.cameras, node.camera, "camera")
            if camera.perspective is None:
                self._not_pinholes += 1
            else:
                name = node.name or camera.name or f"camera {node.camera}"
                self.cameras.append(Camera(name, world_from_node, camera.perspective.yfov))
        if node.mesh is None:
            return
        mesh = self.file.pick(self.file.document.meshes, node.mesh, "mesh")
        joints = None
        if node.skin is not None:
            skin = self.file.pick(self.file.document.skins, node.skin, "skin")
            joints = joint_matrices(self.file, skin, self.nodes)
            self._skinned += joints is None
        # Joints alone place a skin (glTF 2.0, 3.7.3.3).
        worlds = np.eye(4)[None] if joints is not None else world_from_node @ self._instances(node)
        self.objects.append(node.name or mesh.name or f"node {index}")
        key = node.mesh, None if joints is None else node.skin, tuple(node.weights or mesh.weights)
        if key not in self._shapes:
            self._shapes[key] = self._read(mesh, f"mesh {node.mesh}", joints, key[2])
        for shape in self._shapes[key]:
            self._triangle_count += len(worlds) * len(shape.triangles)
            check_triangle_count(self.file.path, self._triangle_count)
            material = len(self.file.document.materials) if shape.material is None else shape.material
            owner = len(self.objects) - 1
            self.placed.append(Placed(shape, worlds, owner, material, index, joints is not None))

    def _instances(self, node: Node) -> F64:
        """(k, 4, 4) node-from-instance matrices; one identity without EXT_mesh_gpu_instancing."""
        if node.extensions.instancing is None:
            return np.eye(4)[None]
        attributes = node.extensions.instancing.attributes
        kinds = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}
        values = {name: self.file.accessor(attributes[name], kinds[name]) for name in kinds if name in attributes}
        counts = {self.file.pick(self.file.document.accessors, i, "accessor").count for i in attributes.values()}
        if len(counts) != 1:
            raise self.file.error("EXT_mesh_gpu_instancing: the attributes need the same number of elements")
        k = counts.pop()
        return _transforms(
            values.get("TRANSLATION", np.zeros((k, 3))),
            values.get("ROTATION", np.tile([0.0, 0.0, 0.0, 1.0], (k, 1))),
            values.get("SCALE", np.ones((k, 3))),
        )

    def _read(self, mesh: Mesh, where: str, joints: F64 | None, weights: tuple[float, ...]) -> list[Shape]:
        """The shapes of a mesh's primitives, with these weights of their morph targets and these matrices of their joints."""
        shapes = []
        for k, primitive in enumerate(mesh.primitives):
            shape = self._shape(primitive, k, f"{where} primitive {k}", joints, weights)
            if shape is not None:
                shapes.append(shape)
        return shapes

    def _shape(
        self, primitive: Primitive, number: int, where: str, joints: F64 | None, weights: tuple[float, ...]
    ) -> Shape | None:
        attributes = primitive.attributes
        if primitive.mode < TRIANGLES or "POSITION" not in attributes:
            self._not_triangles += 1
            return None
        decompress(self.file, primitive, where)
        positions = self.file.accessor(attributes["POSITION"], "VEC3")
        count = len(positions)
        values: list[NDArray[Any] | None] = []
        for name, kinds in VALUES.items():
            value = self.file.accessor(attributes[name], *kinds) if name in attributes else None
            if value is not None and len(value) != count:
                raise self.file.error(f"{where}: {len(value)} {name} for {count} POSITION")
            values.append(value)
        corners = np.arange(count)
        if primitive.indices is not None:
            corners = self.file.accessor(primitive.indices, "SCALAR")[:, 0]
            if corners.dtype.kind != "u":
                raise self.file.error(f"{where}: indices must be unsigned whole numbers")
            if len(corners) and int(corners.max()) >= count:
                raise self.file.error(f"{where}: index {corners.max()} is out of range: there are {count} vertices")
        if primitive.mode == TRIANGLES and len(corners) % 3:
            raise self.file.error(f"{where}: {len(corners)} corners are no whole number of triangles")
        if primitive.material is None:
            self.unpainted += 1
        else:
            painted = self.file.pick(self.file.document.materials, primitive.material, "material")
            self.used_materials.add(primitive.material)
            alpha = values[-1][:, 3:] if values[-1] is not None and painted.alpha_mode != "OPAQUE" else np.ones(1)
            self._faded += bool(alpha.min(initial=1.0) < 1.0)
        positions = morphed(self.file, primitive, weights, "POSITION", positions, where)
        uv0, uv1, normals, colours = values
        if normals is not None:
            normals = morphed(self.file, primitive, weights, "NORMAL", normals, where)
        triangles = _triangles(corners.astype(np.int64), primitive.mode)
        placing = None if joints is None else skinning(self.file, primitive, joints, count, where)
        if placing is not None:
            linear = placing[:, :3, :3]
            positions = np.einsum("nij,nj->ni", linear, positions.astype(np.float64)) + placing[:, :3, 3]
            normals = None if normals is None else turned_normals(linear, normals)
            mirrored = (np.linalg.det(linear) < 0.0)[triangles].sum(axis=1) > 1
            triangles = np.where(mirrored[:, None], triangles[:, [0, 2, 1]], triangles)
        return _compact(number, positions, triangles, primitive.material, [uv0, uv1, normals, colours])


def _compact(
    number: int,
    positions: NDArray[Any],
    triangles: NDArray[np.int64],
    material: int | None,
    values: list[NDArray[Any] | None],
) -> Shape:
    """Without the vertices that no triangle uses: primitives often share one large vertex array."""
    used = np.zeros(len(positions), bool)
    used[triangles] = True
    if not used.all():
        triangles = (np.cumsum(used) - 1)[triangles]
        positions = positions[used]
        values = [None if v is None else v[used] for v in values]
    return Shape(number, np.flatnonzero(used), positions.astype(np.float64), triangles, material, *values)


def _triangles(corners: NDArray[np.int64], mode: int) -> NDArray[np.int64]:
    """(m, 3) triangles of a list, strip or fan of corners (glTF 2.0, 3.7.2.1)."""
    if mode == TRIANGLES:
        return corners.reshape(-1, 3)
    i = np.arange(max(len(corners) - 2, 0))
    if mode == STRIP:
        return corners[np.stack([i, i + 1 + i % 2, i + 2 - i % 2], axis=1)]
    return corners[np.stack([i + 1, i + 2, np.zeros_like(i)], axis=1)]


def _light(light: GltfLight, name: str, world_from_node: F64) -> Light:
    """A light in W/sr or W/m², whatever the scale of its node; it shines along -z."""
    red, green, blue = (c * light.intensity / LUMENS_PER_WATT for c in light.color)
    x, y, z = world_from_node[:3, 3].tolist()
    u, v, w = (-world_from_node[:3, 2] / np.linalg.norm(world_from_node[:3, 2])).tolist()
    spot = light.spot
    return Light(
        name,
        light.type,
        (red, green, blue),
        (x, y, z),
        (u, v, w),
        spot.inner_cone_angle,
        spot.outer_cone_angle,
        light.range or math.inf,
        light.extras.radius,
        light.extras.angle,
    )


def _parent_from_node(node: Node) -> F64:
    if node.matrix is not None:
        return np.array(node.matrix, np.float64).reshape(4, 4).T
    matrix: F64 = _transforms(np.array([node.translation]), np.array([node.rotation]), np.array([node.scale]))[0]
    return matrix


def _transforms(translation: NDArray[Any], rotation: NDArray[Any], scale: NDArray[Any]) -> F64:
    """(k, 4, 4) matrices of k translations, rotations (quaternions x y z w, normalised here) and scales."""
    q = rotation.astype(np.float64)
    length = np.linalg.norm(q, axis=1, keepdims=True)
    x, y, z, w = np.where(length > 0.0, q / length, [0.0, 0.0, 0.0, 1.0]).T
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrices = np.tile(np.eye(4), (len(q), 1, 1))
    matrices[:, :3, :3] = np.moveaxis(turn, 2, 0) * scale[:, None, :]
    matrices[:, :3, 3] = translation
    return matrices


def part_of(placed: Placed) -> Part:
    """All copies of the shape; mirrored ones keep their front."""
    shape, worlds = placed.shape, placed.worlds
    k, n, m = len(worlds), len(shape.positions), len(shape.triangles)
    linear = worlds[:, :3, :3]
    positions = np.einsum("kij,nj->kni", linear, shape.positions) + worlds[:, None, :3, 3]
    mirrored = np.linalg.det(linear) < 0.0
    triangles = np.where(mirrored[:, None, None], shape.triangles[:, [0, 2, 1]], shape.triangles)
    triangles = triangles + n * np.arange(k)[:, None, None]
    normals = None
    if shape.normals is not None:
        normals = turned_normals(linear[:, None], shape.normals).reshape(-1, 3)
    return Part(
        positions.reshape(-1, 3),
        triangles.reshape(k * m, 3),
        placed.object_id,
        placed.material,
        None if shape.uv0 is None else np.tile(shape.uv0, (k, 1)),
        None if shape.uv1 is None else np.tile(shape.uv1, (k, 1)),
        normals,
        None if shape.colours is None else np.tile(shape.colours[:, :3], (k, 1)),
    )


def _boxes(placed: Placed) -> F64:
    """(k, 2, 3) lower and upper corner of a box around each copy: around the shape's own box, turned."""
    low, high = placed.shape.positions.min(axis=0), placed.shape.positions.max(axis=0)
    linear, middle, half = placed.worlds[:, :3, :3], (low + high) / 2, (high - low) / 2
    centre, reach = linear @ middle + placed.worlds[:, :3, 3], np.abs(linear) @ half
    return np.stack([centre - reach, centre + reach], axis=1)


def _area(placed: Placed) -> float:
    """Of all copies [m²], as if each were scaled evenly."""
    a, b, c = np.moveaxis(placed.shape.positions[placed.shape.triangles], 1, 0)
    area = float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2
    scale: F64 = np.abs(np.linalg.det(placed.worlds[:, :3, :3])) ** (2 / 3)
    return area * float(scale.sum())
