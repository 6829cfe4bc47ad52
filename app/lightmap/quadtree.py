"""A texture quadtree has one leaf of t×t texels for each square of the atlas that is smooth [Coombe03, 4.1].

A tile (level, x, y) splits into the four of the next level that it covers; those that meet no surface do not exist. Leaves that
share a chart and an edge differ by one level at most, so that interpolation across the edge meets two texels with one.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.texels import Leaves, uniform_leaves
from app.lightmap.tile_pool import Moves, TilePool
from app.lightmap.tiles import Tiles
from app.scene.model import Scene
from app.util.state import State, StateError

Tile = tuple[int, int, int]  # level, x, y
SIDES = ((-1, 0), (1, 0), (0, -1), (0, 1))
WHOLE_CHART = 16  # texels along the longer edge of a chart that emits: fewer make a lamp of too few shooters
MAX_DEPTH = 6  # of leaves below the roots
FIRST_ROOM = 1 << 17  # texels
SMALLEST = 4  # texels along the longer edge of any chart: one patch that shoots


@dataclass(frozen=True, eq=False)
class Change:
    """Pairs of leaves, by slot: a parent and one of its children (n,) each. If ``split`` the parents went and the children came,
    else the other way round. corner (n, 2): of the child in its parent, 0 or 1 along u and v."""

    parents: NDArray[np.int64]
    children: NDArray[np.int64]
    corner: NDArray[np.int64]
    split: bool


class Quadtree:
    """The leaves of a tile pool by their place, and which of them may change."""

    def __init__(self, pool: TilePool) -> None:
        self.pool = pool
        self.slots: dict[Tile, int] = {}
        self._below: dict[Tile, int] = {}
        for slot in np.flatnonzero(pool.used).tolist():
            self._enter(self.tile(slot), slot)
        self._first = frozenset(self.slots)
        self._charts_of: dict[Tile, frozenset[int]] = {}
        self._free = [int(s) for s in np.flatnonzero(~pool.used)[::-1]]
        self._faces = faces_of_roots(pool.charts)

    def tile(self, slot: int) -> Tile:
        leaves = self.pool.leaves
        return int(leaves.level[slot]), int(leaves.x[slot]), int(leaves.y[slot])

    def __len__(self) -> int:
        return len(self.slots)

    def resize(self, slots: int) -> Moves:
        """Have so many slots, no fewer than leaves: those that lie beyond move into free ones."""
        used = self.pool.used
        old = slots + np.flatnonzero(used[slots:])
        free = np.setdiff1d(np.arange(slots), np.flatnonzero(used))
        moves = Moves(slots, min(slots, len(used)), old, free[: len(old)])
        self.pool.resize(moves)
        for slot in moves.new.tolist():
            self.slots[self.tile(slot)] = slot
        self._free = free[len(old) :][::-1].tolist()
        return moves

    @property
    def room(self) -> int:
        """Slots that are free."""
        return len(self._free)

    def splits(self, slots: Iterable[int], depth: int) -> list[int]:
        """Those of these leaves above ``depth``, and the coarser neighbours that must split with them: coarse ones first."""
        wanted: dict[int, None] = {}
        pending = list(slots)
        while pending:
            slot = pending.pop()
            if slot in wanted or self.tile(slot)[0] >= depth:
                continue
            wanted[slot] = None
            pending.extend(self._coarser_neighbours(slot))
        by_level = sorted(wanted, key=lambda s: self.tile(s)[0])
        return by_level

    def state(self) -> State:
        """The leaves of all slots, and the order in which slots are taken and given."""
        leaves = self.pool.leaves
        taken = np.array(list(self.slots.values()), np.int64)
        return State(
            arrays={
                "leaves": np.stack([leaves.level, leaves.x, leaves.y], 1).astype(np.int32)[taken],
                "taken": taken,
                "free": np.array(self._free, np.int64),
            }
        )

    def restore(self, state: State) -> None:
        """Hold the leaves of a ``state``, of as many slots, instead of those that are there. Raises StateError."""
        free, taken = state.array("free", np.int64, -1), state.array("taken", np.int64, -1)
        leaves = state.array("leaves", np.int32, len(taken), 3)
        if not np.array_equal(np.sort(np.concatenate([free, taken])), np.arange(self.pool.tiles)):
            raise StateError("leaves and slots do not go together")
        level, (columns, rows) = leaves[:, 0], (side // self.pool.tile for side in self.pool.charts.size)
        if not ((level >= 0) & (level <= MAX_DEPTH)).all() or (leaves[:, 1:] < 0).any():
            raise StateError("leaves of no such level")
        if (leaves[:, 1] >> level >= columns).any() or (leaves[:, 2] >> level >= rows).any():
            raise StateError("leaves outside of the atlas")
        tiles = Tiles.cut(self.pool.scene, self.pool.charts, Leaves(*(np.ascontiguousarray(c) for c in leaves.T)))
        self.pool.free(np.flatnonzero(self.pool.used))
        self.pool.put(taken, tiles)
        self.slots.clear()
        self._below.clear()
        for slot in taken.tolist():
            self._enter(self.tile(slot), slot)
        self._free = free.tolist()

    def uneven(self) -> list[int]:
        """Leaves that are too coarse for a neighbour."""
        return [slot for tile, slot in self.slots.items() if self._meets_finer(tile, self._charts_in(slot))]

    def split(self, slots: list[int]) -> Change:
        """Replace leaves of the tile pool by their children."""
        parents = np.array(slots, np.int64)
        leaves = self.pool.leaves.only(parents)
        dx, dy = np.tile([0, 1, 0, 1], len(parents)), np.tile([0, 0, 1, 1], len(parents))
        children = Leaves(
            (leaves.level.repeat(4) + 1).astype(np.int32),
            (2 * leaves.x.repeat(4) + dx).astype(np.int32),
            (2 * leaves.y.repeat(4) + dy).astype(np.int32),
        )
        tiles = Tiles.cut(self.pool.scene, self.pool.charts, children, self._faces_near(leaves))
        exists = (tiles.surfaces.face >= 0).any((1, 2))
        fresh = self._replace(parents, tiles.only(np.flatnonzero(exists)))
        return Change(parents.repeat(4)[exists], fresh, np.stack([dx, dy], 1)[exists], split=True)

    def merges(self, slots: NDArray[np.int64]) -> list[list[int]]:
        """Siblings, all of them among ``slots``, whose parent would not be coarser than its neighbours allow."""
        siblings: dict[Tile, list[int]] = {}
        for slot in slots:
            level, x, y = self.tile(int(slot))
            if level > 0:
                siblings.setdefault((level - 1, x // 2, y // 2), []).append(int(slot))
        return [s for parent, s in siblings.items() if self._below_first(parent) and self._may_merge(parent, s)]

    def merge(self, siblings: list[list[int]]) -> Change:
        """Replace siblings by their parents."""
        children = np.array([slot for leaves in siblings for slot in leaves], np.int64)
        first = np.array([leaves[0] for leaves in siblings], np.int64)
        leaves = self.pool.leaves.only(first)
        corner = np.stack([self.pool.leaves.x[children] % 2, self.pool.leaves.y[children] % 2], 1).astype(np.int64)
        parents = Leaves(leaves.level - 1, leaves.x // 2, leaves.y // 2)
        tiles = Tiles.cut(self.pool.scene, self.pool.charts, parents, self._faces_near(parents))
        fresh = self._replace(children, tiles)
        return Change(fresh.repeat([len(slots) for slots in siblings]), children, corner, split=False)

    # -- inside --------------------------------------------------------------------------------------------------------

    def _replace(self, old: NDArray[np.int64], tiles: Tiles) -> NDArray[np.int64]:
        """Slots of the new tiles, the old ones' among them: merging needs no room. LightTransfer reads their light first."""
        for slot in old.tolist():
            self._leave(self.tile(slot))
        self.pool.free(old)
        self._free.extend(old[::-1].tolist())  # what is split and merged again is where it was
        fresh = np.array([self._free.pop() for _ in range(len(tiles))], np.int64)
        self.pool.put(fresh, tiles)
        for slot in fresh.tolist():
            self._enter(self.tile(slot), slot)
        return fresh

    def _faces_near(self, leaves: Leaves) -> NDArray[np.int64]:
        """Faces that may meet these leaves: those of their root tiles."""
        roots = {(int(x) >> int(k), int(y) >> int(k)) for k, x, y in zip(leaves.level, leaves.x, leaves.y, strict=True)}
        found = [self._faces[root] for root in sorted(roots) if root in self._faces]
        return np.unique(np.concatenate(found)) if found else np.empty(0, np.int64)

    def _charts_in(self, slot: int) -> frozenset[int]:
        tile = self.tile(slot)
        if tile not in self._charts_of:
            face = self.pool.surfaces.face[slot]
            self._charts_of[tile] = frozenset(np.unique(self.pool.charts.face_chart[face[face >= 0]]).tolist())
        return self._charts_of[tile]

    def _coarser_neighbours(self, slot: int) -> list[int]:
        """Leaves next to this one that are coarser and show a chart of it."""
        level, x, y = self.tile(slot)
        found = []
        for dx, dy in SIDES:
            if level > 0 and ((x + dx) >> 1, (y + dy) >> 1) != (x >> 1, y >> 1):
                near = self.slots.get((level - 1, (x + dx) >> 1, (y + dy) >> 1))
                if near is not None and self._charts_in(near) & self._charts_in(slot):
                    found.append(near)
        return found

    def _below_first(self, tile: Tile) -> bool:
        """Whether the tile is one of those at the start, or a part of one."""
        level, x, y = tile
        return any((level - k, x >> k, y >> k) in self._first for k in range(level + 1))

    def _may_merge(self, parent: Tile, siblings: list[int]) -> bool:
        level, x, y = parent
        for child in range(4):
            tile = (level + 1, 2 * x + (child & 1), 2 * y + (child >> 1))
            if tile in self.slots and self.slots[tile] not in siblings:
                return False
            if self._is_split(tile):
                return False
        return not self._meets_finer(parent, frozenset().union(*(self._charts_in(slot) for slot in siblings)))

    def _meets_finer(self, tile: Tile, charts: frozenset[int]) -> bool:
        """Whether a neighbour that shows one of these charts is finer than this tile by two levels or more."""
        level, x, y = tile
        return any(
            near[0] > level + 1 and bool(self._charts_in(self.slots[near]) & charts)
            for dx, dy in SIDES
            for near in self._along_side((level, x + dx, y + dy), (-dx, -dy))
        )

    def _along_side(self, tile: Tile, side: tuple[int, int]) -> Iterator[Tile]:
        """The leaves in this tile that meet one of its SIDES."""
        level, x, y = tile
        if tile in self.slots:
            yield tile
        elif self._is_split(tile):
            across = max(*side, 0)
            for along in (0, 1):
                corner = (across, along) if side[0] else (along, across)
                yield from self._along_side((level + 1, 2 * x + corner[0], 2 * y + corner[1]), side)

    def _is_split(self, tile: Tile) -> bool:
        """Whether there are leaves below this tile."""
        return self._below.get(tile, 0) > 0

    def _enter(self, tile: Tile, slot: int) -> None:
        self.slots[tile] = slot
        self._count(tile, 1)

    def _leave(self, tile: Tile) -> None:
        del self.slots[tile]
        self._count(tile, -1)

    def _count(self, tile: Tile, change: int) -> None:
        """Keep the number of leaves below every tile."""
        level, x, y = tile
        for k in range(1, level + 1):
            above = (level - k, x >> k, y >> k)
            self._below[above] = self._below.get(above, 0) + change


def quadtree_pool(scene: Scene, charts: Charts, report: Callable[[float], None] | None = None) -> TilePool:
    """The tile pool to begin with: few leaves, and room for as many again. report: as of ``texel_surfaces``."""
    leaves = first_leaves(scene, charts, MAX_DEPTH)
    pool = TilePool(
        scene, charts, leaves, adaptive=True, slots=max(FIRST_ROOM // charts.tile**2, 2 * len(leaves)), report=report
    )
    tree = Quadtree(pool)
    while slots := tree.uneven():
        if tree.room < 4 * len(slots):
            tree.resize(pool.tiles + 4 * len(slots))
        tree.split(slots)
    return pool


def first_leaves(scene: Scene, charts: Charts, depth: int) -> Leaves:
    """Root tiles, split where a chart in them would have too few texels to shoot from: small polygons and lamps stay uniform."""
    longer = charts.chart_rects[:, 2:].max(1, initial=1)
    emits = np.array([m.emits for m in scene.materials])[scene.material_ids[charts.face_triangle]]
    want = np.full(charts.chart_count, SMALLEST)
    want[charts.face_chart[emits]] = WHOLE_CHART
    level = np.clip(np.ceil(np.log2(want / longer)), 0, depth).astype(np.int64)
    leaves = uniform_leaves(charts)
    for k in range(depth):
        deeper = charts.with_faces(np.flatnonzero(level[charts.face_chart] > k))
        keys = {(x, y) for x, y in zip(*_places(uniform_leaves(deeper, k)), strict=True)}
        splits = np.array(
            [lv == k and (x, y) in keys for lv, x, y in zip(leaves.level, *_places(leaves), strict=True)], bool
        )
        if not splits.any():
            continue
        below = uniform_leaves(charts, k + 1)
        parents = {(x, y) for x, y in zip(*_places(leaves.only(splits)), strict=True)}
        children = np.array([(x // 2, y // 2) in parents for x, y in zip(*_places(below), strict=True)], bool)
        leaves = _joined(leaves.only(~splits), below.only(children))
    return leaves


def faces_of_roots(charts: Charts) -> dict[tuple[int, int], NDArray[np.int64]]:
    """The faces whose bounds meet each root tile."""
    low = np.floor(charts.face_uv.min(1) / charts.tile).astype(np.int64)
    high = np.floor(charts.face_uv.max(1) / charts.tile).astype(np.int64)
    found: dict[tuple[int, int], list[int]] = {}
    for face, ((x0, y0), (x1, y1)) in enumerate(zip(low.tolist(), high.tolist(), strict=True)):
        for y in range(y0, y1 + 1):
            for x in range(x0, x1 + 1):
                found.setdefault((x, y), []).append(face)
    return {root: np.array(faces, np.int64) for root, faces in found.items()}


def _places(leaves: Leaves) -> tuple[list[int], list[int]]:
    return leaves.x.tolist(), leaves.y.tolist()


def _joined(a: Leaves, b: Leaves) -> Leaves:
    return Leaves(*(np.concatenate([getattr(a, f.name), getattr(b, f.name)]) for f in dataclasses.fields(Leaves)))
