"""Fragments are the pieces of triangles in the cells of a grid, texels or tiles of them: each triangle cut by its lines, exactly.

Which cells a triangle meets is known row by row. At a place p inside of its edge from a, with (du, dv) to the next corner
counter-clockwise, dv (a_u - p_u) - du (a_v - p_v) > 0. Along a row that is linear in x, for the nearest corner of each cell and
for the farthest: so one division by dv says which cells the edge leaves out, and another which ones it cuts.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.sides import least, most, runs
from app.atlas.unit_square import SLIVER, area_and_centroid
from app.scene.model import F64
from app.util.ahead import ahead

BLOCK = 1 << 15  # cells in work at a time: a processor's cache holds them
SLACK = 0.1 * SLIVER  # of an edge's length: a cell that lies so near to it is on its one side
LEVEL = 1e-300  # in place of 0, what an edge along the rows rises

I64 = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Fragments:
    """Pieces of triangles in cells: (n,) pair, cell x and y; share of the cell's area; centroid u, v in the atlas."""

    pair: I64
    x: I64
    y: I64
    share: F64
    u: F64
    v: F64

    def only(self, which: Mask) -> Fragments:
        """Those that are marked."""
        pair, x, y = self.pair[which], self.x[which], self.y[which]
        return Fragments(pair, x, y, self.share[which], self.u[which], self.v[which])


@dataclass(frozen=True, eq=False)
class Windows:
    """Pairs of a face and a leaf that it meets: (p,) face, leaf, whether it fills it, and the leaf's first texel; tile: the
    edge of a leaf [texels]."""

    face: I64
    leaf: I64
    full: Mask
    left: I64
    bottom: I64
    tile: int

    def __len__(self) -> int:
        return len(self.face)

    def slot(self, part: Fragments) -> I64:
        """Where the fragments' texels are stored."""
        row, column = part.y - self.bottom[part.pair], part.x - self.left[part.pair]
        return np.asarray((self.leaf[part.pair] * self.tile + row) * self.tile + column)

    def only(self, pairs: slice | I64) -> Windows:
        """Those of the pairs."""
        face, leaf, left, bottom = (of[pairs] for of in (self.face, self.leaf, self.left, self.bottom))
        return Windows(face, leaf, self.full[pairs], left, bottom, self.tile)

    def by_leaf(self) -> Windows:
        """The pairs of each leaf one after another."""
        return self.only(np.argsort(self.leaf, kind="stable"))


class Cutter:
    """Cuts triangles uv (f, 3, 2) by the unit grid; with windows, each pair only inside its leaf, else pairs are triangles."""

    def __init__(self, uv: F64, windows: Windows | None = None) -> None:
        self._uv, self._face = uv, np.arange(len(uv)) if windows is None else windows.face
        low, high = bounds(uv)
        self._alone = (high - low == 1).all(axis=1)[self._face]  # whole triangles in one cell
        self._low, high = low[self._face], high[self._face]
        if windows is not None:
            corner = np.stack([windows.left, windows.bottom], axis=1)
            self._low, high = np.maximum(self._low, corner), np.minimum(high, corner + windows.tile)
        self._wide = np.maximum(high - self._low, 0)
        self._full = None if windows is None else windows.full
        self._cells = self._wide.prod(axis=1)

    def blocks(self, groups: I64 | None = None) -> list[slice]:
        """All pairs, in runs of about BLOCK cells; groups (p,), in ascending order: of pairs that no run parts."""
        ends = np.cumsum(self._cells)
        at = np.searchsorted(ends, np.arange(BLOCK, ends[-1] if len(ends) else 0, BLOCK))
        if groups is not None:
            at = np.unique(np.searchsorted(groups, groups[at]))
        bounds = [0, *at[at > 0].tolist(), len(ends)]
        return [slice(*pair) for pair in itertools.pairwise(bounds)] if len(ends) else []

    def parts(self) -> Iterator[Fragments]:
        """Of all pairs, a block at a time."""
        for pairs, part in zip(self.blocks(), ahead(self.of, self.blocks()), strict=True):
            yield dataclasses.replace(part, pair=part.pair + pairs.start)

    def of(self, pairs: slice) -> Fragments:
        """Of some pairs, by their numbers among these, one after another, row by row."""
        u, v = np.ascontiguousarray(self._uv[self._face[pairs]].transpose(2, 1, 0))
        (left, bottom), (across, up) = self._low[pairs].T, self._wide[pairs].T
        full, alone = None if self._full is None else self._full[pairs], self._alone[pairs]
        doubled = (u[1] - u[0]) * (v[2] - v[0]) - (v[1] - v[0]) * (u[2] - u[0])
        pair, row = runs(np.zeros_like(up), up)
        first, end, whole_from, whole_to = _spans(u - left, v - bottom, np.sign(doubled), across, pair, row)
        if full is not None and full.any():
            filled = full[pair]
            first, whole_from = np.where(filled, 0, first), np.where(filled, 0, whole_from)
            end, whole_to = np.where(filled, across[pair], end), np.where(filled, across[pair], whole_to)
        line, column = runs(first, np.maximum(end, first))
        whole = (column >= whole_from[line]) & (column < whole_to[line])
        pair, y = pair[line], (row + bottom[pair])[line]
        x = column + left[pair]
        share, u_mean, v_mean = np.ones(len(x)), np.full(len(x), 0.5), np.full(len(x), 0.5)
        for some, measure in ((alone[pair], _all_of), (~(whole | alone[pair]), area_and_centroid)):
            at = np.flatnonzero(some)
            if len(at):
                # (3, n): each cell is [0, 1]². np.take keeps rows together in memory, where u[:, at] would not
                own = (np.take(plane, pair[at], axis=1) - cell[at] for plane, cell in ((u, x), (v, y)))
                share[at], u_mean[at], v_mean[at] = measure(*own)
        keep = share > (SLIVER * np.minimum(np.abs(doubled) / 2, 1.0))[pair]
        if not keep.all():
            return Fragments(pair, x, y, share, x + u_mean, y + v_mean).only(keep)
        return Fragments(pair, x, y, share, x + u_mean, y + v_mean)


def bounds(uv: F64) -> tuple[I64, I64]:
    """(f, 2) each: the first cell of each triangle's box, and the one beyond the last."""
    low = np.floor(least(uv)).astype(np.int64)
    return low, np.maximum(np.ceil(most(uv)).astype(np.int64), low + 1)


def _all_of(u: F64, v: F64) -> tuple[F64, F64, F64]:
    """Area and centroid (u, v) of triangles u, v (3, n)."""
    doubled = (u[1] - u[0]) * (v[2] - v[0]) - (v[1] - v[0]) * (u[2] - u[0])
    return np.abs(doubled) / 2, (u[0] + u[1] + u[2]) / 3, (v[0] + v[1] + v[2]) / 3


def _spans(u: F64, v: F64, winding: F64, across: I64, pair: I64, row: I64) -> tuple[I64, I64, I64, I64]:
    """Of rows of cells (r,) of triangles u, v (3, n) of either winding (n,): the first cell that is met and the one beyond the
    last, and those of the cells that are filled, from 0 to ``across`` (n,). pair: the triangle of each row."""
    du, dv = ((np.roll(side, -1, axis=0) - side) * winding for side in (u, v))
    length = np.abs(du) + np.abs(dv)
    slack = SLACK * length * np.minimum(length.max(axis=0), 1.0)
    rise = np.where(dv == 0, LEVEL, dv)
    inside = dv * u - du * v
    near, far = inside + np.maximum(du, 0) - np.minimum(dv, 0) - slack, inside + np.minimum(du, 0) - np.maximum(dv, 0)
    rises = np.take(rise > 0, pair, axis=1)
    rise, along = np.take(rise, pair, axis=1), np.take(du, pair, axis=1) * row
    with np.errstate(over="ignore"):
        # where the edge crosses
        met, filled = ((np.take(corner, pair, axis=1) + along) / rise for corner in (near, far + slack))
    wide = across[pair]
    first, end = np.where(rises, -1.0, np.floor(met)) + 1, np.where(rises, np.ceil(met), np.inf)
    whole_from, whole_to = np.where(rises, 0.0, np.ceil(filled)), np.where(rises, np.floor(filled), np.inf) + 1
    lows = (np.minimum(np.maximum(side.max(axis=0), 0.0), wide).astype(np.int64) for side in (first, whole_from))
    highs = (np.minimum(np.maximum(side.min(axis=0), 0.0), wide).astype(np.int64) for side in (end, whole_to))
    (first_, whole_from_), (end_, whole_to_) = lows, highs
    return first_, end_, whole_from_, whole_to_
