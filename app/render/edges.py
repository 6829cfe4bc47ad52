"""Where leaves meet leaves of another level: the border texels there are not copies, see app/shaders/render/edges.frag.glsl."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.lightmap.quadtree import SIDES
from app.lightmap.tile_pool import TilePool
from app.scene.model import F64

CORNERS = ((-1, -1), (1, -1), (-1, 1), (1, 1))
Ints = NDArray[np.int64]


class Kind(NamedTuple):
    """Of border texels that are made alike. follows: they are half an edge beside a coarser leaf; else they are half of one
    beside a finer leaf, or a corner beside a leaf of another level."""

    follows: bool
    corner: bool

    def along(self, tile: int, border: int) -> int:
        """Texels in a row of one instance, which has ``border`` rows along the edge."""
        return border if self.corner else tile // 2


KINDS = Kind(False, False), Kind(False, True), Kind(True, False)


def unequal_edges(pool: TilePool, border: int, slots: Ints) -> dict[Kind, F64]:
    """(n, 5) instances of each of KINDS in the leaves of these slots: the slot; their lower corner [display texels, of tiles that
    have a border of so many texels]; towards the neighbour, -1, 0 or 1 along u and v."""
    slots = slots[pool.used[slots]]
    level = pool.leaves.level[slots]
    side = 1 << (pool.depth - level.astype(np.int64))  # pages along an edge of each leaf
    left, bottom = pool.leaves.x[slots] * side, pool.leaves.y[slots] * side
    corner = np.stack([slots % pool.columns, slots // pool.columns], 1) * (pool.tile + 2 * border)
    found: dict[Kind, list[F64]] = {kind: [np.empty((0, 5))] for kind in KINDS}
    for outward, half in _parts():
        near = _slots_at(pool, *(p + _page(d, h, side) for p, d, h in zip((left, bottom), outward, half, strict=True)))
        finer = np.where(near >= 0, pool.leaves.level[near] - level, 0)
        place = [_first(d, h, pool.tile, border) for d, h in zip(outward, half, strict=True)]
        if all(outward):
            parts = {Kind(False, True): finer != 0}
        else:
            parts = {Kind(False, False): finer > 0, Kind(True, False): finer < 0}
        for kind, unequal in parts.items():
            which = np.flatnonzero(unequal)
            rest = np.tile(np.array(outward, np.float64), (len(which), 1))
            found[kind].append(np.column_stack([slots[which], corner[which] + place, rest]))
    return {kind: np.concatenate(parts) for kind, parts in found.items()}


def reached_from(pool: TilePool, slots: Ints, texels: int) -> Ints:
    """These slots, and those of leaves that reach or touch the leaves in them within so many of their own texels."""
    used = np.flatnonzero(pool.used)
    leaves, size = pool.leaves.only(used), 0.5 ** pool.leaves.level[used]
    margin = size * texels / pool.tile
    low, high = (np.stack([leaves.x + k, leaves.y + k]) * size + (2 * k - 1) * margin for k in (0, 1))
    parents = pool.leaves.only(slots[pool.used[slots]])  # of leaves that came together there is one
    up = np.minimum(parents.level, 1)
    found = np.zeros(len(used), bool)
    for level, x, y in np.unique(np.stack([parents.level - up, parents.x >> up, parents.y >> up], 1), axis=0).tolist():
        edge = 0.5**level
        beside = [(low[k] <= (at + 1) * edge) & (high[k] >= at * edge) for k, at in enumerate((x, y))]
        found |= beside[0] & beside[1]
    return np.union1d(slots, used[found])


def _parts() -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Half edges and corners: outward along u and v, and which half along the axis that does not lead outward."""
    for dx, dy in SIDES:
        for half in (0, 1):
            yield (dx, dy), (half * (dx == 0), half * (dy == 0))
    for outward in CORNERS:
        yield outward, (0, 0)


def _slots_at(pool: TilePool, x: Ints, y: Ints) -> Ints:
    """The slots of these pages; -1 where no leaf is."""
    pages = pool.slot_tables["t_pages"][..., 0]
    height, width = pages.shape
    inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
    found = pages[np.where(inside, y, 0), np.where(inside, x, 0)].astype(np.int64) - 1
    return np.where(inside, found, -1)


def _page(outward: int, half: int, side: Ints) -> Ints:
    """Along one axis, the page beyond each leaf, or the one in the middle of a half of it; from its first page on."""
    if outward:
        return side if outward > 0 else np.full_like(side, -1)
    return side // 4 + half * (side // 2)


def _first(outward: int, half: int, tile: int, border: int) -> int:
    """Along one axis, the first display texel in a tile."""
    if outward:
        return border + tile if outward > 0 else 0
    return border + half * (tile // 2)
