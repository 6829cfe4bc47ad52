"""Patches are squares of texels, and clusters are groups of them: what light is exchanged between.

Patches that face the same way, lie in one cube of space and are all open or all enclosed are a cluster; eight such cubes make
the cube of the next level, as in the hierarchy of [Smits94]. What is outside of a window faces as walls inside do: as one
cluster, the light in a room would be lost to the open. Texels are put in an order in which every patch and every cluster is a
range, so that what a ray hit is one number, its place in that order, at all levels at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.lightmap.tile_pool import TilePool
from app.scene.model import F64, Material

I64 = NDArray[np.int64]
Look = Callable[[I64], F64]
FEWEST = 48  # clusters of a level, above which no further one is made
CELL_BITS = 18  # of a cube's place along each axis
OPEN = 0.5  # share of rays, more of which leave the scene from outside of a house than from its inside
AROUND = 6  # bits of a Morton code: openness is of what is in one chart and in a cube of 8 edges of a patch


@dataclass(frozen=True, eq=False)
class Patches:
    """Nodes are numbered level by level, the patches (level 0) first.

    order (texels,) i64: y << 16 | x in the tile pool, of each texel in order. start, end (n,) i64: range in the order of each
    node; level (n,); centre (n, 3) [solver space]; area (n,) [solver space]; children (n, 2) i64: the range of nodes of the level
    below, empty of patches. roots: nodes of the highest level. edge: of a patch, the root of its mean area [solver space].
    """

    order: I64
    start: I64
    end: I64
    level: I64
    centre: F64
    area: F64
    children: I64
    roots: I64
    edge: float
    texel_area: F64
    face: NDArray[np.int32]
    colour: F64 | None

    def __len__(self) -> int:
        return len(self.start)

    @property
    def count(self) -> int:
        """Patches."""
        return int((self.level == 0).sum())

    def albedo(self, materials: tuple[Material, ...], material_ids: Any, face_triangle: Any) -> F64:
        """(n, 3) mean albedo of each node, over its area."""
        factor = np.array([m.albedo for m in materials])[material_ids[face_triangle[self.face]]]
        tinted = factor if self.colour is None else factor * self.colour
        return self.mean(tinted)

    def mean(self, values: F64) -> F64:
        """(n, c) mean over each node's area of values (texels, c) in order."""
        sums = np.zeros((len(values) + 1, values.shape[1]))
        np.cumsum(values * self.texel_area[:, None], axis=0, out=sums[1:])
        return np.asarray((sums[self.end] - sums[self.start]) / self.area[:, None])


def patch_count(pool: TilePool, level: int) -> int:
    """Patches there would be of squares of 2^level texels along each edge."""
    return len(np.unique(_squares(pool, level, *_covered(pool))))


def patches_of(pool: TilePool, level: int, look: Look) -> Patches:
    """All patches, squares of 2^level texels along each edge, and the clusters above them. look: which share of rays is lost
    from texels (n,), y << 16 | x in the tile pool."""
    slot, y, x = _covered(pool)
    surfaces, space = pool.surfaces, pool.space
    area = surfaces.area[slot, y, x] / space.scale**2
    position = space.local_from_world(surfaces.position[slot, y, x])
    patch = np.unique(_squares(pool, level, slot, y, x), return_inverse=True)[1].reshape(-1)
    whole = np.bincount(patch, area)
    centre, normal = (
        np.stack([np.bincount(patch, area * v[:, c]) for c in range(3)], 1) / whole[:, None]
        for v in (position, surfaces.normal[slot, y, x].astype(np.float64))
    )
    edge = float(np.sqrt(whole.mean()))
    corner = pool.corners(slot)
    px = (corner[:, 1] + y) << 16 | (corner[:, 0] + x)
    side = np.argmax(np.abs(normal), axis=1)
    facing = 2 * side + (np.take_along_axis(normal, side[:, None], 1)[:, 0] < 0)
    cell = np.floor((centre - centre.min(0)) / (2 * edge)).astype(np.int64)
    code = morton(np.minimum(cell, (1 << CELL_BITS) - 1))
    first = np.unique(patch, return_index=True)[1]
    chart = pool.charts.face_chart[surfaces.face[slot, y, x][first]].astype(np.int64)
    place = np.unique(np.stack([chart, code >> AROUND], 1), axis=0, return_inverse=True)[1].reshape(-1)
    openness = np.bincount(place, look(px[first])) / np.bincount(place)
    kind = 2 * facing + (openness > OPEN)[place]
    key = (kind << 3 * CELL_BITS) | code
    by_place = np.lexsort((patch, key[patch]))
    nodes = _levels(key[patch[by_place]], patch[by_place])
    texel_area = area[by_place]
    sums = np.concatenate([[0.0], np.cumsum(texel_area)])
    moments = np.concatenate([np.zeros((1, 3)), np.cumsum(texel_area[:, None] * position[by_place], axis=0)])
    node_area = sums[nodes.end] - sums[nodes.start]
    colours = pool.albedo_tiles
    return Patches(
        order=px[by_place],
        start=nodes.start,
        end=nodes.end,
        level=nodes.level,
        centre=(moments[nodes.end] - moments[nodes.start]) / node_area[:, None],
        area=node_area,
        children=nodes.children,
        roots=np.flatnonzero(nodes.level == nodes.level.max()),
        edge=edge,
        texel_area=texel_area,
        face=surfaces.face[slot, y, x][by_place],
        colour=None if colours is None else colours[slot, y, x][by_place].astype(np.float64),
    )


def morton(cell: I64) -> I64:
    """(n,) the bits of three numbers (n, 3) of CELL_BITS bits in turn [Morton66]."""
    out = np.zeros(len(cell), np.int64)
    for bit in range(CELL_BITS):
        for axis in range(3):
            out |= ((cell[:, axis] >> bit) & 1) << (3 * bit + axis)
    return out


def _covered(pool: TilePool) -> tuple[I64, I64, I64]:
    """Slot, row and column of each texel that covers a surface."""
    slot, y, x = np.nonzero((pool.surfaces.face >= 0) & (pool.surfaces.area > 0) & pool.used[:, None, None])
    return slot, y, x


def _squares(pool: TilePool, level: int, slot: I64, y: I64, x: I64) -> I64:
    """(texels,) a number for each texel, the same in squares of 2^level texels along each edge of one chart."""
    tile, charts = pool.tile, pool.charts
    v, u = (
        (pool.leaves.y[slot].astype(np.int64) * tile + y) >> level,
        (pool.leaves.x[slot] * np.int64(tile) + x) >> level,
    )
    chart = charts.face_chart[pool.surfaces.face[slot, y, x]].astype(np.int64)
    columns, rows = int(u.max(initial=0)) + 1, int(v.max(initial=0)) + 1
    return np.asarray((chart * rows + v) * columns + u)


@dataclass(frozen=True, eq=False)
class _Nodes:
    start: I64
    end: I64
    level: I64
    children: I64


def _levels(key: I64, patch: I64) -> _Nodes:
    """The ranges of patches, and of clusters level by level, of texels in order. key: facing and openness, and Morton code of the
    cube."""
    bounds = [np.flatnonzero(np.concatenate([[True], patch[1:] != patch[:-1]]))]
    first = [0]
    children = [np.zeros((len(bounds[0]), 2), np.int64)]
    shift, cell = 0, key & ((1 << 3 * CELL_BITS) - 1)
    while len(bounds[-1]) > FEWEST and (shift == 0 or cell.max() >> (shift - 3)):
        code = (key >> 3 * CELL_BITS << 3 * CELL_BITS) | cell >> shift
        starts = np.flatnonzero(np.concatenate([[True], code[1:] != code[:-1]]))
        below = np.searchsorted(bounds[-1], np.concatenate([starts, [len(key)]]))
        base = first[-1]
        first.append(base + len(bounds[-1]))
        children.append(np.stack([below[:-1], below[1:]], 1) + base)
        bounds.append(starts)
        shift += 3
    return _Nodes(
        start=np.concatenate(bounds),
        end=np.concatenate([np.concatenate([b[1:], [len(key)]]) for b in bounds]),
        level=np.repeat(np.arange(len(bounds)), [len(b) for b in bounds]),
        children=np.concatenate(children),
    )
