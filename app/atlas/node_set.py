"""A scene cut into leaf tiles, ready for the GPU: plain arrays, made in any thread. See lightmap.py for what they mean."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import TILE, Charts
from app.atlas.materials import texel_colours
from app.atlas.receivers import TileTexels, receivers
from app.atlas.texels import Leaves, TexelSurfaces, faces_tangents, texel_surfaces, uniform_leaves
from app.errors import UserError
from app.scene.model import F32, F64, Scene

Array = NDArray[np.generic]
ScalarT = TypeVar("ScalarT", bound=np.generic)

MAX_FACETS = (1 << 24) - 2  # item ids are held as floats, see common/item.glsl
TABLE_WIDTH = 2048  # columns of the facet table
UNCHARTED = 16777215.0  # item of a side that has no texels, see common/item.glsl


@dataclass(frozen=True, eq=False)
class Frame:
    """World [m] to solver frame (radius 1) and back: x_world = centre + scale·x_local."""

    centre: F64
    scale: float

    @staticmethod
    def of(scene: Scene) -> Frame:
        lower, upper = scene.bounds
        return Frame((lower + upper) / 2, float(np.linalg.norm(upper - lower) / 2))

    def local_from_world(self, points: F64) -> F64:
        return (points - self.centre) / self.scale

    def world_from_local(self, points: F64) -> F64:
        return self.centre + points * self.scale


class NodeSet:
    """Leaf tiles side by side in one rectangle of ``columns``×``rows`` tiles, and the tables that go with them.

    arrays: texture name -> (height, width, components) array as the texture holds it; vertices: the triangles' vertex buffer;
    flat_spans, shaped_tiles: the receivers, see receivers.py.
    Raises UserError where facets and materials do not fit the 32 bits of a texel's ids.
    """

    def __init__(self, scene: Scene, charts: Charts) -> None:
        self.scene, self.charts = scene, charts
        self.frame = Frame.of(scene)
        self.material_bits = max(1, (len(scene.materials) - 1).bit_length())
        if charts.facet_count > min(MAX_FACETS, (1 << (32 - self.material_bits)) - 2):
            raise UserError(f"{charts.facet_count} facets × {len(scene.materials)} materials do not fit 32 bits")
        self.leaves: Leaves = uniform_leaves(charts)
        self.surfaces: TexelSurfaces = on_their_faces(scene, charts, texel_surfaces(scene, charts, self.leaves))
        self.tiles = len(self.leaves.x)
        self.columns = max(1, int(np.ceil(np.sqrt(self.tiles))))
        self.rows = max(1, -(-self.tiles // self.columns))
        self.size = (self.columns * TILE, self.rows * TILE)
        self.texel_count = int((self.surfaces.face >= 0).sum())  # that cover a surface
        self.albedo_tiles, self.emission_tiles = texel_colours(scene, charts, self.leaves, self.surfaces)
        self.arrays = self._texel_arrays() | self._tables()
        self.flat_spans, self.shaped_tiles = self._receivers()
        self.occluders = occluders(scene, charts, self.frame)
        self.vertices = _vertices(scene, charts, self.frame)

    def tiles_from_image(self, image: Array) -> Array:
        """A node-set image (height, width, c) as tiles (tiles, 16, 16, c)."""
        cells = image.reshape(self.rows, TILE, self.columns, TILE, -1).swapaxes(1, 2)
        return cells.reshape(-1, TILE, TILE, image.shape[-1])[: self.tiles]

    def image_from_tiles(self, tiles: Array) -> Array:
        """Tiles (tiles, 16, 16, c) as a node-set image (height, width, c)."""
        grid = np.zeros((self.rows * self.columns, *tiles.shape[1:]), tiles.dtype)
        grid[: self.tiles] = tiles
        cells = grid.reshape(self.rows, self.columns, TILE, TILE, -1).swapaxes(1, 2)
        return np.ascontiguousarray(cells).reshape(self.rows * TILE, self.columns * TILE, -1)

    def atlas_image(self, tiles: NDArray[ScalarT]) -> NDArray[ScalarT]:
        """Tiles (tiles, 16, 16, …) laid out in the virtual atlas (H, W, …), row 0 at v = 0; 0 between charts."""
        width, height = self.charts.size
        cells = np.zeros((height // TILE, width // TILE, *tiles.shape[1:]), tiles.dtype)
        cells[self.leaves.y, self.leaves.x] = tiles
        return np.swapaxes(cells, 1, 2).reshape(height, width, *tiles.shape[3:])

    def atlas_rect(self, corner: tuple[int, int], size: int) -> tuple[float, float, float, float]:
        """The square of ``size`` texels at ``corner`` of the node set, as (u, v, u, v) in the virtual atlas."""
        tile = min((corner[1] // TILE) * self.columns + corner[0] // TILE, self.tiles - 1)
        u = float(self.leaves.x[tile] * TILE + corner[0] % TILE)
        v = float(self.leaves.y[tile] * TILE + corner[1] % TILE)
        return u, v, u + size, v + size

    def material_table(self, scene: Scene) -> F32:
        """(materials, 2, 4): albedo ρ, exitance E = πL [W/m²]."""
        table = np.zeros((len(scene.materials), 2, 4), np.float32)
        table[:, 0, :3] = [m.albedo for m in scene.materials]
        table[:, 1, :3] = np.pi * np.array([m.emission for m in scene.materials])
        return table

    def _texel_arrays(self) -> dict[str, Array]:
        s, charts = self.surfaces, self.charts
        covered = s.face >= 0
        position = np.where(covered[..., None], self.frame.local_from_world(s.position), 0.0)
        area = s.area[..., None] / self.frame.scale**2
        facet = (charts.face_facet[s.face] + 1).astype(np.uint32)
        material = self.scene.material_ids[charts.face_triangle[s.face]].astype(np.uint32)
        ids = np.where(covered, facet << np.uint32(self.material_bits) | material, np.uint32(0))
        out = {
            "t_position_area": np.concatenate([position, area], -1).astype(np.float32),
            "t_normal_ids": np.stack([octahedral(s.normal), ids.astype(np.uint32)], -1),
        }
        for name, tiles in (("t_albedo", self.albedo_tiles), ("t_emission", self.emission_tiles)):
            if tiles is not None:
                out[name] = np.concatenate([tiles, np.ones_like(tiles[..., :1])], -1).astype(np.float16)
        return {name: self.image_from_tiles(tiles) for name, tiles in out.items()}

    def _tables(self) -> dict[str, Array]:
        width, height = (side // TILE for side in self.charts.size)
        pages = np.zeros((height, width, 1), np.uint32)
        pages[self.leaves.y, self.leaves.x, 0] = np.arange(1, self.tiles + 1)
        return {
            "t_pages": pages,
            "t_facets": self._facet_table(),
            "t_materials": self.material_table(self.scene),
        }

    def _facet_table(self) -> F32:
        """(rows, TABLE_WIDTH, 4): per facet, from 1, two entries: ∂p/∂u and ∂p/∂v."""
        rows = -(-2 * (self.charts.facet_count + 1) // TABLE_WIDTH)
        table = np.zeros((rows * TABLE_WIDTH, 4), np.float32)
        dpdu, dpdv = self._facet_tangents()
        table[2 : 2 * len(dpdu) + 2 : 2, :3] = dpdu
        table[3 : 2 * len(dpdv) + 3 : 2, :3] = dpdv
        return table.reshape(rows, TABLE_WIDTH, 4)

    def _receivers(self) -> tuple[F32, F32]:
        s, charts = self.surfaces, self.charts
        dpdu, dpdv = self._facet_tangents()
        material = np.zeros(charts.facet_count, np.int32)
        material[charts.face_facet] = self.scene.material_ids[charts.face_triangle]
        return receivers(
            TileTexels(
                position=self.frame.local_from_world(s.position),
                normal=s.normal,
                area=s.area / self.frame.scale**2,
                facet=np.where(s.face >= 0, charts.face_facet[s.face], -1).astype(np.int32),
                dpdu=dpdu,
                dpdv=dpdv,
                material=material,
                x=self.leaves.x,
                y=self.leaves.y,
                columns=self.columns,
            )
        )

    def _facet_tangents(self) -> tuple[F64, F64]:
        """∂p/∂u and ∂p/∂v of each facet (facets, 3), solver frame per atlas texel."""
        out = np.zeros((2, self.charts.facet_count, 3))
        out[:, self.charts.face_facet] = faces_tangents(self.scene, self.charts)
        return out[0] / self.frame.scale, out[1] / self.frame.scale


FOLD = 1e-4  # of a texel's width: further off the plane of its leading face, a mean of faces is off the surface


def on_their_faces(scene: Scene, charts: Charts, surfaces: TexelSurfaces) -> TexelSurfaces:
    """Texels that fold over several faces, put onto the one that they show most of, with its normal. Their mean lies inside or
    outside of the surface, where the surface itself would hide it."""
    covered = surfaces.face >= 0
    face = surfaces.face[covered]
    triangle = charts.face_triangle[face]
    normal = scene.normals_areas[0][triangle] * np.where(charts.face_back[face], -1.0, 1.0)[:, None]
    position = surfaces.position[covered]
    height = np.abs(((position - scene.corners[triangle, 0]) * normal).sum(-1))
    folded = height > FOLD * np.sqrt(surfaces.area[covered])
    positions, normals = surfaces.position.copy(), surfaces.normal.copy()
    positions[covered] = np.where(folded[:, None], surfaces.leading[covered], position)
    normals[covered] = normal
    return dataclasses.replace(surfaces, position=positions, normal=normals)


def octahedral(normals: NDArray[np.floating]) -> NDArray[np.uint32]:
    """Unit normals (…, 3) as 2×snorm16 on the octahedron, as GLSL's unpackSnorm2x16 reads them [Cigolle14]."""
    n = normals / np.maximum(np.abs(normals).sum(-1, keepdims=True), 1e-30)
    sign = np.where(n[..., :2] >= 0, 1.0, -1.0)
    folded = np.where(n[..., 2:] < 0, (1 - np.abs(n[..., 1::-1])) * sign, n[..., :2])
    packed = np.round(folded * 32767).astype(np.int32).astype(np.uint32) & np.uint32(0xFFFF)
    return np.asarray(packed[..., 0] | packed[..., 1] << np.uint32(16), np.uint32)


OCCLUDER = np.dtype([("in_position", "f4", 3), ("in_sides", "f4", 2)])
OCCLUDER_FORMAT = {"in_position": "3f", "in_sides": "2f"}


def occluders(scene: Scene, charts: Charts, frame: Frame) -> tuple[Array, Array]:
    """What a shooter sees: vertices (v,) OCCLUDER and triangles (m, 3) u32.

    in_sides: the items of front and back, facet from 1 or UNCHARTED, of the one triangle that has this vertex last (flat values
    come from there). The other two corners share any vertex in their place: one vertex per triangle, not three.
    """
    count = len(scene.triangles)
    sides = np.full((count, 2), UNCHARTED, np.float32)
    sides[charts.face_triangle, charts.face_back.astype(int)] = charts.face_facet + 1
    last = scene.triangles[:, 2]
    vertex_at = np.full(len(scene.positions), -1, np.int64)
    vertex_at[last] = np.arange(count)
    bare = np.setdiff1d(scene.triangles, last)
    vertex_at[bare] = count + np.arange(len(bare))
    vertices = np.zeros(count + len(bare), OCCLUDER)
    vertices["in_position"] = frame.local_from_world(scene.positions[np.concatenate([last, bare])])
    vertices["in_sides"][:count] = sides
    triangles = np.column_stack([vertex_at[scene.triangles[:, :2]], np.arange(count)])
    return vertices, triangles.astype(np.uint32)


VERTEX = np.dtype([("in_position", "f4", 3), ("in_uv_front", "f4", 2), ("in_uv_back", "f4", 2), ("in_ids", "u4", 4)])
VERTEX_FORMAT = {"in_position": "3f", "in_uv_front": "2f", "in_uv_back": "2f", "in_ids": "4u"}


def _vertices(scene: Scene, charts: Charts, frame: Frame) -> Array:
    """All triangles, unwelded (3·triangles,) VERTEX: position in the solver frame; atlas texel of front and back, -1 without a
    chart; ids: facet from 1 of front and back (0 without a chart), material, triangle."""
    count = len(scene.triangles)
    data = np.zeros((count, 3), VERTEX)
    data["in_position"] = frame.local_from_world(scene.corners)
    data["in_uv_front"] = data["in_uv_back"] = -1.0
    for side, uv in enumerate(("in_uv_front", "in_uv_back")):
        faces = np.flatnonzero(charts.face_back == bool(side))
        triangles = charts.face_triangle[faces]
        data[uv][triangles] = charts.face_uv[faces]
        data["in_ids"][triangles, :, side] = charts.face_facet[faces, None] + 1
    data["in_ids"][:, :, 2] = scene.material_ids[:, None]
    data["in_ids"][:, :, 3] = np.arange(count)[:, None]
    return data.reshape(-1)


__all__ = ["OCCLUDER_FORMAT", "VERTEX_FORMAT", "Frame", "NodeSet", "ScalarT", "octahedral"]
