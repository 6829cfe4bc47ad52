"""A tile pool is a scene cut into leaf tiles, ready for the GPU: plain arrays, made in any thread. textures.py says what they
mean."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.texels import Leaves, TexelSurfaces, faces_tangents, uniform_leaves
from app.atlas.visible_mesh import VisibleMesh, visible_mesh
from app.errors import UserError
from app.lightmap.surfaces import face_normals
from app.lightmap.tile_shapes import SHAPE, TileTexels, tile_shapes
from app.lightmap.tiles import Tiles
from app.scene.model import F32, F64, Scene
from app.util.ahead import ahead

Array = NDArray[np.generic]
ScalarT = TypeVar("ScalarT", bound=np.generic)

MAX_FACETS = (1 << 24) - 2  # item ids are held as floats, see common/item.glsl
TABLE_WIDTH = 2048  # columns of the facet table
BLOCK = 128  # tiles in work at a time
FACET_ENTRIES = 4  # of a facet in it, as in common/facet.glsl


@dataclass(frozen=True, eq=False)
class SolverSpace:
    """World [m] to solver space (radius 1) and back: x_world = centre + scale·x_local."""

    centre: F64
    scale: float

    @staticmethod
    def of(scene: Scene) -> SolverSpace:
        lower, upper = scene.bounds
        return SolverSpace((lower + upper) / 2, float(np.linalg.norm(upper - lower) / 2))

    def local_from_world(self, points: F64) -> F64:
        return (points - self.centre) / self.scale

    def world_from_local(self, points: F64) -> F64:
        return self.centre + points * self.scale


@dataclass(frozen=True, eq=False)
class Moves:
    """How a tile pool gets so many ``slots``: the first ``staying`` are as before, but that leaves which lay beyond them, in the
    slots ``old`` (n,), are now in those of ``new`` (n,), which were free."""

    slots: int
    staying: int
    old: NDArray[np.int64]
    new: NDArray[np.int64]

    def array(self, array: Any, value: float) -> Any:
        """What was kept for each slot, as it is to be kept now; ``value`` in slots that are new."""
        if self.slots == self.staying == len(array):
            return array
        moved = np.full((self.slots, *array.shape[1:]), value, array.dtype)
        moved[: self.staying] = array[: self.staying]
        moved[self.new] = array[self.old]
        return moved


class TilePool:
    """Leaf tiles side by side in one rectangle of ``columns``×``rows`` slots, and the tables that go with them.

    tile: edge of a leaf [texels], t below; tiles: number of slots; used (tiles,) bool: those that hold a leaf; adaptive: whether
    leaves may be of several levels; depth: the level in which pages are counted, that of the finest leaf or one more.
    leaves, surfaces, albedo_tiles, emission_tiles, shapes (SHAPE): of every slot, empty where it is not used.
    usual_light: median of H to come on what the first camera sees, RGB (3,) [W/m²], by a forecast of the scene as it is here;
    None: not known.
    dpdu, dpdv (facets, 3): ∂p/∂u and ∂p/∂v of each facet, solver space per texel of level 0.
    Raises UserError where facets and materials do not fit the 32 bits of a texel's ids.
    """

    def __init__(
        self,
        scene: Scene,
        charts: Charts,
        leaves: Leaves | None = None,
        *,
        adaptive: bool = False,
        slots: int = 0,
        report: Callable[[float], None] | None = None,
    ) -> None:
        """leaves: by default all of level 0; slots: room for so many, at least. report: as of ``texel_surfaces``."""
        self.usual_light: F64 | None = None
        self.scene, self.charts, self.adaptive, self.tile = scene, charts, adaptive, charts.tile
        self.space = SolverSpace.of(scene)
        self.material_bits = max(1, (len(scene.materials) - 1).bit_length())
        if charts.facet_count > min(MAX_FACETS, (1 << (32 - self.material_bits)) - 2):
            raise UserError(f"{charts.facet_count} facets × {len(scene.materials)} materials do not fit 32 bits")
        self.dpdu, self.dpdv = self._facet_tangents()
        self._facet_material = np.zeros(charts.facet_count, np.int32)
        self._facet_material[charts.face_facet] = scene.material_ids[charts.face_triangle]
        cut = Tiles.cut(scene, charts, uniform_leaves(charts) if leaves is None else leaves, report=report)
        self._hold(cut, max(len(cut), slots))

    def _hold(self, cut: Tiles, slots: int) -> None:
        """Let the first of so many slots hold these tiles, whose arrays are the pool's from now on."""
        count, nowhere = len(cut), np.empty(0, np.int64)
        self.columns = max(1, int(np.ceil(np.sqrt(slots))))
        self.leaves, self.surfaces = cut.leaves, cut.surfaces
        self.albedo_tiles, self.emission_tiles = cut.albedo, cut.emission
        self.shapes, self.used = np.zeros(count, SHAPE), np.zeros(count, bool)
        self._texels = np.zeros(count, np.int64)  # of each slot, that cover a surface
        self.depth = 0
        self._pages = np.zeros([side // self.tile for side in self.charts.size[::-1]], np.uint32)
        self.resize(Moves(slots, count, nowhere, nowhere))
        self._take_in(np.arange(count), cut)

    def resize(self, moves: Moves) -> None:
        """Have another number of slots, in rows as long as before, with the leaves where ``moves`` has them."""
        self.leaves = _moved(self.leaves, moves, -1)
        self.surfaces = _moved(self.surfaces, moves, 0)
        if self.albedo_tiles is not None:
            self.albedo_tiles = moves.array(self.albedo_tiles, 1.0)
        if self.emission_tiles is not None:
            self.emission_tiles = moves.array(self.emission_tiles, 1.0)
        self.shapes, self.used = moves.array(self.shapes, 0), moves.array(self.used, False)
        self._texels = moves.array(self._texels, 0)
        self.surfaces.face[moves.staying :] = -1
        self.tiles, self.rows = moves.slots, max(1, -(-moves.slots // self.columns))
        self.size = (self.columns * self.tile, self.rows * self.tile)
        self._turn_pages(moves.new, moves.new + 1)

    # -- leaves that come and go ---------------------------------------------------------------------------------------

    def put(self, slots: NDArray[np.int64], tiles: Tiles) -> None:
        """Let these slots hold these tiles."""
        for mine, given in ((self.leaves, tiles.leaves), (self.surfaces, tiles.surfaces)):
            for field in dataclasses.fields(mine):
                getattr(mine, field.name)[slots] = getattr(given, field.name)
        for own, colours in ((self.albedo_tiles, tiles.albedo), (self.emission_tiles, tiles.emission)):
            if own is not None:
                own[slots] = 1.0 if colours is None else colours
        self._take_in(slots, tiles)

    def _take_in(self, slots: NDArray[np.int64], tiles: Tiles) -> None:
        """What follows from these tiles, which these slots hold."""
        self._texels[slots] = (tiles.surfaces.face >= 0).sum((1, 2))
        some = [slice(first, first + BLOCK) for first in range(0, len(tiles), BLOCK)]
        for part, shapes in zip(some, ahead(lambda part: self._shapes(tiles.only(part)), some), strict=True):
            self.shapes[slots[part]] = shapes
        self.used[slots] = True
        self._fit_pages()
        self._turn_pages(slots, slots + 1)
        if self.emission_tiles is not None:  # finer texels hold other shares of an image
            self.__dict__.pop("emission_weights", None)

    def free(self, slots: NDArray[np.int64]) -> None:
        """Let these slots hold nothing."""
        self.used[slots] = False
        self._turn_pages(slots, np.zeros_like(slots))
        self.leaves.level[slots] = self.leaves.x[slots] = self.leaves.y[slots] = -1
        self.surfaces.face[slots] = -1
        self.surfaces.area[slots] = 0.0

    def _fit_pages(self) -> None:
        """Count pages in the level of the finest leaf; in finer ones too, until they are two levels finer."""
        finest = int(self.leaves.level.max(initial=0))
        if finest > self.depth:
            times = 1 << (finest - self.depth)
            self._pages = self._pages.repeat(times, 0).repeat(times, 1)
        elif finest < self.depth - 1:
            step = 1 << (self.depth - finest)
            self._pages = np.ascontiguousarray(self._pages[::step, ::step])
        else:
            return
        self.depth = finest

    def _turn_pages(self, slots: NDArray[np.int64], numbers: NDArray[np.int64]) -> None:
        """Write these numbers where the leaves of these slots are."""
        self.__dict__.pop("_leaf_table", None)
        height, width = self._pages.shape
        for level in np.unique(self.leaves.level[slots]).tolist():
            mine = self.leaves.level[slots] == level
            side = 1 << (self.depth - level)
            cells = self._pages.reshape(height // side, side, width // side, side).swapaxes(1, 2)
            cells[self.leaves.y[slots[mine]], self.leaves.x[slots[mine]]] = numbers[mine, None, None]

    def page_blocks(self, slots: NDArray[np.int64]) -> Iterator[tuple[tuple[int, int, int, int], Array]]:
        """The rectangle (x, y, width, height) of pages of each tile of level 0 where these slots hold leaves, and the pages."""
        leaves, side = self.leaves.only(slots[self.used[slots]]), 1 << self.depth
        for x, y in np.unique(np.stack([leaves.x >> leaves.level, leaves.y >> leaves.level], 1), axis=0).tolist():
            rows, columns = slice(y * side, (y + 1) * side), slice(x * side, (x + 1) * side)
            yield (x * side, y * side, side, side), np.ascontiguousarray(self._pages[rows, columns])

    @functools.cached_property
    def visible_mesh(self) -> VisibleMesh:
        """The triangles as they are seen: for pictures, and from points."""
        return visible_mesh(self.scene, self.charts, self.space.local_from_world(self.scene.positions))

    @functools.cached_property
    def emission_weights(self) -> F64:
        """(materials, 3) [m²]: the area of each material, weighted with its emission texture."""
        covered = np.flatnonzero(self.surfaces.face >= 0)
        material = self.scene.material_ids[self.charts.face_triangle].take(self.surfaces.face.take(covered))
        area, count = self.surfaces.area.take(covered), len(self.scene.materials)
        if self.emission_tiles is None:
            return np.repeat(np.bincount(material, area, count)[:, None], 3, axis=1)
        tints = self.emission_tiles.reshape(-1, 3).take(covered, axis=0).T
        return np.stack([np.bincount(material, area * tint, count) for tint in tints], axis=1)

    @property
    def slots_in_use(self) -> int:
        """Up to the last that holds a leaf."""
        return int(np.flatnonzero(self.used)[-1]) + 1 if self.used.any() else 0

    @property
    def texel_count(self) -> int:
        """Texels that cover a surface."""
        return int(self._texels[self.used].sum())

    @property
    def slot_texels(self) -> NDArray[np.int64]:
        """(tiles,) texels of each slot that cover a surface."""
        return np.where(self.used, self._texels, 0)

    def uniform_texels(self, depth: int) -> int:
        """About as many as there would be if all leaves were of that level."""
        used = np.flatnonzero(self.used)
        return int((self._texels[used] * 4.0 ** (depth - self.leaves.level[used])).sum())

    @property
    def arrays(self) -> dict[str, Array]:
        """Texture name -> (height, width, components) array as the texture holds it."""
        none, tile, columns = self.tile_arrays(np.empty(0, np.int64)), self.tile, self.columns
        images = {name: np.zeros((self.rows, tile, columns, tile, of.shape[-1]), of.dtype) for name, of in none.items()}

        def fill(row: int) -> None:
            slots = np.arange(row * columns, min((row + 1) * columns, self.tiles))
            for name, tiles in self.tile_arrays(slots).items():
                images[name][row, :, : len(slots)] = tiles.swapaxes(0, 1)

        for _ in ahead(fill, range(self.rows)):
            pass
        wide = {name: image.reshape(*self.size[::-1], -1) for name, image in images.items()}
        return {**wide, **self._tables()}

    @property
    def pages_per_texel(self) -> float:
        """Along an edge, of the page table, for each texel of level 0."""
        return float(2**self.depth) / self.tile

    def corner(self, slot: int) -> tuple[int, int]:
        """Column and row of a slot's first texel."""
        return slot % self.columns * self.tile, slot // self.columns * self.tile

    def corners(self, slots: NDArray[np.int64]) -> NDArray[np.int64]:
        """(n, 2) column and row of each slot's first texel."""
        return np.stack([slots % self.columns, slots // self.columns], 1) * self.tile

    def tiles_from_image(self, image: Array) -> Array:
        """A tile-pool image (height, width, c) as tiles (tiles, t, t, c)."""
        cells = image.reshape(self.rows, self.tile, self.columns, self.tile, -1).swapaxes(1, 2)
        return cells.reshape(-1, self.tile, self.tile, image.shape[-1])[: self.tiles]

    def image_from_tiles(self, tiles: Array) -> Array:
        """Tiles (tiles, t, t, c) as a tile-pool image (height, width, c)."""
        grid = np.zeros((self.rows * self.columns, *tiles.shape[1:]), tiles.dtype)
        grid[: self.tiles] = tiles
        cells = grid.reshape(self.rows, self.columns, self.tile, self.tile, -1).swapaxes(1, 2)
        return np.ascontiguousarray(cells).reshape(self.rows * self.tile, self.columns * self.tile, -1)

    def slot_at(self, uv: tuple[float, float]) -> int:
        """The slot of the leaf at a place of the virtual atlas [texels of level 0]; -1 where there is none."""
        return int(self.slots_at(np.array([uv]))[0])

    def slots_at(self, uv: F64) -> NDArray[np.int64]:
        """(n,) the same at places (n, 2)."""
        cell = np.floor(uv * self.pages_per_texel).astype(np.int64)
        inside = np.all((cell >= 0) & (cell < self._pages.shape[::-1]), axis=1)
        column, row = np.where(inside[:, None], cell, 0).T
        return np.where(inside, self._pages[row, column].astype(np.int64) - 1, -1)

    def atlas_rect(self, corner: tuple[int, int], size: int) -> tuple[float, float, float, float]:
        """The square of ``size`` texels at ``corner`` of the tile pool, as (u, v, u, v) in the virtual atlas."""
        slot = min((corner[1] // self.tile) * self.columns + corner[0] // self.tile, self.tiles - 1)
        texel = 0.5 ** max(int(self.leaves.level[slot]), 0)
        u = float(self.leaves.x[slot] * self.tile + corner[0] % self.tile) * texel
        v = float(self.leaves.y[slot] * self.tile + corner[1] % self.tile) * texel
        return u, v, u + size * texel, v + size * texel

    def material_table(self, scene: Scene) -> F32:
        """(materials, 2, 4): albedo ρ, exitance E = πL [W/m²]."""
        table = np.zeros((len(scene.materials), 2, 4), np.float32)
        table[:, 0, :3] = [m.albedo for m in scene.materials]
        table[:, 1, :3] = np.pi * np.array([m.emission for m in scene.materials])
        return table

    def tile_arrays(self, slots: NDArray[np.int64]) -> dict[str, Array]:
        """Texture name -> (n, t, t, components) of these slots, as the texture holds them."""
        charts, face = self.charts, self.surfaces.face[slots]
        covered = face >= 0
        position = np.where(covered[..., None], self.space.local_from_world(self.surfaces.position[slots]), 0.0)
        area = self.surfaces.area[slots][..., None] / self.space.scale**2
        facet = (charts.face_facet[face] + 1).astype(np.uint32)
        material = self.scene.material_ids[charts.face_triangle[face]].astype(np.uint32)
        ids = np.where(covered, facet << np.uint32(self.material_bits) | material, np.uint32(0))
        out: dict[str, Array] = {
            "t_position_area": np.concatenate([position, area], -1).astype(np.float32),
            "t_normal_ids": np.stack([self._packed_normals[face], ids.astype(np.uint32)], -1),
        }
        for name, tiles in (("t_albedo", self.albedo_tiles), ("t_emission", self.emission_tiles)):
            if tiles is not None:
                out[name] = np.concatenate([tiles[slots], np.ones_like(tiles[slots][..., :1])], -1).astype(np.float16)
        return out

    @property
    def slot_tables(self) -> dict[str, Array]:
        """Tables that follow the leaves. t_pages (H, W, 1) u32: the slot, from 1, of each cell of t×t texels of level ``depth``;
        t_leaves (rows, columns, 4) f32: x, y [tiles of its level] and size of a texel [texels of level 0] of each slot, 0
        where it is free."""
        return {"t_pages": self._pages[..., None], "t_leaves": self._leaf_table}

    @functools.cached_property
    def _leaf_table(self) -> F32:
        leaves = np.zeros((self.rows * self.columns, 4), np.float32)
        size = np.where(self.used, 0.5**self.leaves.level, 0.0)
        leaves[: self.tiles, :3] = np.column_stack([self.leaves.x, self.leaves.y, size])
        return leaves.reshape(self.rows, self.columns, 4)

    def _tables(self) -> dict[str, Array]:
        return self.slot_tables | {"t_facets": self._facet_table(), "t_materials": self.material_table(self.scene)}

    def _facet_table(self) -> F32:
        """(rows, TABLE_WIDTH, 4): per facet, from 1, see common/facet.glsl: ∂p/∂u per texel of level 0 and its chart; ∂p/∂v; its
        plane; where its chart's lower corner would be."""
        charts, count = self.charts, self.charts.facet_count
        rows = -(-FACET_ENTRIES * (count + 1) // TABLE_WIDTH)
        table = np.zeros((rows * TABLE_WIDTH, 4), np.float32)
        of_u, of_v, of_plane, of_corner = (
            table[FACET_ENTRIES + k :: FACET_ENTRIES][:count] for k in range(FACET_ENTRIES)
        )
        of_u[:, :3], of_v[:, :3] = self.dpdu, self.dpdv
        of_u[charts.face_facet, 3] = charts.face_chart
        normal = np.cross(self.dpdu, self.dpdv)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
        of_plane[:, :3] = normal
        corner = self.space.local_from_world(self.scene.corners[charts.face_triangle, 0])
        of_plane[charts.face_facet, 3] = np.einsum("ij,ij->i", normal[charts.face_facet], corner)
        u, v = charts.face_uv[:, 0, 0], charts.face_uv[:, 0, 1]
        along = self.dpdu[charts.face_facet] * u[:, None] + self.dpdv[charts.face_facet] * v[:, None]
        of_corner[charts.face_facet, :3] = corner - along
        return table.reshape(rows, TABLE_WIDTH, 4)

    def _shapes(self, tiles: Tiles) -> NDArray[np.void]:
        """(n,) SHAPE of each of these tiles."""
        s, charts = tiles.surfaces, self.charts
        texels = TileTexels(
            position=self.space.local_from_world(s.position),
            normal=s.normal,
            area=s.area / self.space.scale**2,
            facet=np.where(s.face >= 0, charts.face_facet[s.face], -1).astype(np.int32),
            size=np.exp2(-tiles.leaves.level.astype(np.float64)),
            dpdu=self.dpdu,
            dpdv=self.dpdv,
        )
        return tile_shapes(texels, self._facet_material)

    @functools.cached_property
    def _packed_normals(self) -> NDArray[np.uint32]:
        """(f + 1,) those of faces, and last what stands where there is none."""
        return octahedral(np.append(face_normals(self.scene, self.charts), np.zeros((1, 3)), 0).astype(np.float32))

    def _facet_tangents(self) -> tuple[F64, F64]:
        """∂p/∂u and ∂p/∂v of each facet (facets, 3), solver space per atlas texel."""
        out = np.zeros((2, self.charts.facet_count, 3))
        out[:, self.charts.face_facet] = faces_tangents(self.scene, self.charts)
        return out[0] / self.space.scale, out[1] / self.space.scale


ArraysT = TypeVar("ArraysT", Leaves, TexelSurfaces)


def _moved(arrays: ArraysT, moves: Moves, value: float) -> ArraysT:
    return type(arrays)(*(moves.array(getattr(arrays, field.name), value) for field in dataclasses.fields(arrays)))


def octahedral(normals: NDArray[np.floating]) -> NDArray[np.uint32]:
    """Unit normals (…, 3) as 2×snorm16 on the octahedron, as GLSL's unpackSnorm2x16 reads them [Cigolle14]."""
    n = normals / np.maximum(np.abs(normals).sum(-1, keepdims=True), 1e-30)
    sign = np.where(n[..., :2] >= 0, 1.0, -1.0)
    folded = np.where(n[..., 2:] < 0, (1 - np.abs(n[..., 1::-1])) * sign, n[..., :2])
    packed = np.round(folded * 32767).astype(np.int32).astype(np.uint32) & np.uint32(0xFFFF)
    return np.asarray(packed[..., 0] | packed[..., 1] << np.uint32(16), np.uint32)


__all__ = ["Array", "Moves", "ScalarT", "SolverSpace", "TilePool", "octahedral"]
