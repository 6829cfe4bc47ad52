"""Pack charts into one atlas: a skyline of column heights that each chart drops onto, tallest first.

A chart is known by its outline in columns of ALIGN texels, bottom and top, so that an irregular chart settles into
its neighbours' hollows. Outlines include the gap, at the right and at the top; origins are multiples of ALIGN.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import ALIGN, GAP
from app.errors import UserError
from app.scene.model import F64, I32
from app.util.background import Report

MAX_SIDE = 16384  # texels: the least maximum texture size of desktop hardware with OpenGL 4.1
FILL = 0.9  # share of the atlas that outlines usually fill; only sets the aspect
ASPECTS = (1.0, 0.9, 1.1, 0.85, 1.15, 0.95, 1.05, 0.8, 1.2, 0.75, 1.25, 0.7, 1.3)  # widths to try, against a square
SMALL = 6  # blocks of ALIGN texels: charts within so many a side go where larger ones leave room
DROPS = 6000  # charts dropped in all these tries
OFTEN = 256  # charts dropped between two reports

I64 = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Outlines:
    """Per chart a run of columns: ``bottom`` and ``top`` [texels] at ``starts[c]`` up to ``starts[c + 1]``.

    solid (c,): how many of its columns hold surface; one more may hold only its gap.
    """

    starts: I64
    solid: I64
    bottom: I64
    top: I64


def outlines(uv: F64, chart: I64, count: int) -> Outlines:
    """The outlines of charts from their triangles.

    uv (f, 3, 2) [texels] from the chart's own origin, not negative; chart (f,) i64 in [0, count).
    """
    return outlines_of_edges(uv.reshape(-1, 2), np.roll(uv, -1, axis=1).reshape(-1, 2), np.repeat(chart, 3), count)


def outlines_of_edges(p: F64, q: F64, owner: I64, count: int) -> Outlines:
    """The outlines of charts from edges of triangles, p to q (e, 2), of charts owner (e,): at least those at its border."""
    swap = p[:, 0] > q[:, 0]
    p, q = np.where(swap[:, None], q, p), np.where(swap[:, None], p, q)
    first = np.floor(p[:, 0]).astype(np.int64) // ALIGN
    right = np.ceil(q[:, 0]).astype(np.int64)
    last = np.maximum((right + GAP - 1) // ALIGN, first)
    columns, solid = np.zeros(count, np.int64), np.zeros(count, np.int64)
    np.maximum.at(columns, owner, last + 1)
    np.maximum.at(solid, owner, (right + ALIGN - 1) // ALIGN)
    starts = np.concatenate([[0], np.cumsum(columns)])
    bottom = np.full(starts[-1], np.iinfo(np.int64).max)
    top = np.zeros(starts[-1], np.int64)
    spans = last - first + 1
    edge = np.repeat(np.arange(len(p)), spans)
    column = first[edge] + np.arange(len(edge)) - np.repeat(np.cumsum(spans) - spans, spans)
    # heights of the edge over the texels that claim this column
    width = q[:, 0] - p[:, 0]
    slope = np.divide(q[:, 1] - p[:, 1], width, out=np.zeros_like(width), where=width > 0)
    near = np.clip(ALIGN * column - GAP, p[edge, 0], q[edge, 0])
    far = np.clip(ALIGN * (column + 1), p[edge, 0], q[edge, 0])
    upright = width[edge] == 0
    a = p[edge, 1] + (near - p[edge, 0]) * slope[edge]
    b = np.where(upright, q[edge, 1], p[edge, 1] + (far - p[edge, 0]) * slope[edge])
    # the slope of a nearly upright edge is inexact: stay between its ends
    low_end, high_end = np.minimum(p[:, 1], q[:, 1])[edge], np.maximum(p[:, 1], q[:, 1])[edge]
    a, b = np.clip(a, low_end, high_end), np.clip(b, low_end, high_end)
    slot = starts[owner[edge]] + column
    low = np.floor(np.minimum(a, b)).astype(np.int64)
    np.minimum.at(bottom, slot, low)
    np.maximum.at(top, slot, np.maximum(np.ceil(np.maximum(a, b)).astype(np.int64), low + 1) + GAP)
    empty = top == 0
    bottom[empty], top[empty] = 0, GAP  # cannot happen to a connected chart
    return Outlines(starts, np.maximum(solid, 1), bottom, top)


def pack(shapes: Outlines, tile: int, report: Report | None = None) -> tuple[I32, tuple[int, int]]:
    """Origins (c, 2) i32 of the charts [texels] and the atlas's size (W, H), multiples of ``tile``.

    Several widths are tried, fewer the more charts there are; the smallest atlas wins. report(share) is called now and then and
    may raise to cancel.
    Raises UserError when a side would be longer than MAX_SIDE.
    """
    columns = np.diff(shapes.starts)
    total = float((shapes.top - shapes.bottom).sum()) * ALIGN
    least = int(shapes.solid.max()) * ALIGN
    tries = int(np.clip(DROPS // len(columns), 1, len(ASPECTS)))
    widths = {_round_up(max(np.sqrt(total / FILL) * aspect, least), tile) for aspect in ASPECTS[:tries]}
    tell = report or (lambda share: None)
    packed = []
    for k, width in enumerate(sorted(widths)):

        def telling(share: float, k: int = k) -> None:
            tell((k + share) / len(widths))

        packed.append((_pack_across(shapes, width, tile, telling), width))
    (origins, down), across = min(packed, key=lambda p: p[0][1] * p[1])
    if max(across, down) > MAX_SIDE:
        raise UserError(
            f"the atlas needs {across} x {down} texels: the limit is {MAX_SIDE} a side; lower --density or --texels"
        )
    return origins.astype(np.int32), (across, down)


def _pack_across(shapes: Outlines, across: int, tile: int, report: Report) -> tuple[I64, int]:
    """Origins (c, 2) in an atlas of this width, and the height that takes."""
    starts, bottom, top = shapes.starts, shapes.bottom, shapes.top
    columns = np.diff(starts)
    height = np.maximum.reduceat(top, starts[:-1])
    small = (columns <= SMALL) & (height <= SMALL * ALIGN)
    skyline = np.zeros(across // ALIGN + 1, np.int64)  # the last column only takes gaps that stick out
    origins = np.empty((len(columns), 2), np.int64)

    def drop(charts: I64) -> None:
        before = len(columns) - len(charts) if charts is not large else 0
        for nth, c in enumerate(charts[np.lexsort((-columns[charts], -height[charts]))].tolist(), before):
            if nth % OFTEN == 0:
                report(nth / len(columns))
            run = slice(starts[c], starts[c + 1])
            x, y = _drop(skyline, bottom[run], across // ALIGN - int(shapes.solid[c]) + 1)
            origins[c] = x * ALIGN, y
            skyline[x : x + columns[c]] = y + top[run]

    large = np.flatnonzero(~small)
    drop(large)
    blocks = np.stack([columns, -(-height // ALIGN)], axis=1)
    left = _fill_holes(shapes, origins, large, np.flatnonzero(small), blocks, len(skyline), tile)
    filled = np.setdiff1d(np.flatnonzero(small), left)
    for k in range(SMALL):
        wide = filled[columns[filled] > k]
        np.maximum.at(skyline, origins[wide, 0] // ALIGN + k, (origins[wide, 1] + height[wide]))
    drop(left)
    return origins, _round_up(int((origins[:, 1] + height).max()) - GAP, tile)


def _fill_holes(shapes: Outlines, origins: I64, large: I64, small: I64, blocks: I64, across: int, tile: int) -> I64:
    """Put small charts, as boxes of blocks (c, 2), where large ones leave room; returns those that found none.

    across: columns of the atlas with the one for gaps. Boxes of one size go in lattice by lattice: those of one phase
    cannot touch each other.
    """
    if not len(large) or not len(small):
        return small
    count = np.diff(shapes.starts)[large]
    slot = np.repeat(shapes.starts[large] - (np.cumsum(count) - count), count) + np.arange(count.sum())
    base = np.repeat(origins[large], count, axis=0)
    column = base[:, 0] // ALIGN + slot - np.repeat(shapes.starts[large], count)
    first = (base[:, 1] + shapes.bottom[slot]) // ALIGN
    last = -(-(base[:, 1] + shapes.top[slot]) // ALIGN)
    rows = _round_up((int(last.max()) - 1) * ALIGN, tile) // ALIGN + 1  # the last one only takes gaps that stick out
    edges = np.zeros((rows + 1, across), np.int64)
    np.add.at(edges, (first, column), 1)
    np.add.at(edges, (last, column), -1)
    free = np.cumsum(edges, axis=0)[:rows] == 0
    free[:, -1] = free[-1] = False
    left = []
    sizes = np.unique(blocks[small], axis=0)
    for wide, tall in sizes[np.argsort(-np.prod(sizes, axis=1), kind="stable")]:
        waiting = small[(blocks[small] == (wide, tall)).all(axis=1)]
        for phase in range(wide * tall):
            spots = _free_spots(free, wide, tall, phase)[: len(waiting)]
            origins[waiting[: len(spots)]] = spots[:, ::-1] * ALIGN
            waiting = waiting[len(spots) :]
            for k in range(wide * tall):
                free[spots[:, 0] + k // wide, spots[:, 1] + k % wide] = False
            if not len(waiting):
                break
        left.append(waiting)
    return np.concatenate(left)


def _free_spots(free: NDArray[np.bool_], wide: int, tall: int, phase: int) -> I64:
    """(n, 2) row and column of the free boxes of one phase of the lattice of such boxes."""
    window = free[phase // wide :, phase % wide :]
    rows, columns = window.shape[0] // tall, window.shape[1] // wide
    lattice = window[: rows * tall, : columns * wide].reshape(rows, tall, columns, wide).all(axis=(1, 3))
    return np.argwhere(lattice) * (tall, wide) + (phase // wide, phase % wide)


def _drop(skyline: I64, bottom: I64, places: int) -> tuple[int, int]:
    """Where a chart comes to rest lowest: one of the first columns, and the height, a multiple of ALIGN."""
    wide = len(bottom)
    if wide > 2 and not bottom.any():
        # a flat bottom: running maximum by doubling
        rest, have = skyline, 1
        while have < wide:
            step = min(have, wide - have)
            rest, have = np.maximum(rest[:-step], rest[step:]), have + step
    else:
        rest = skyline[:places] - bottom[0]
        for k in range(1, wide):
            np.maximum(rest, skyline[k : k + places] - bottom[k], out=rest)
    x = int(rest[:places].argmin())
    return x, _round_up(max(int(rest[x]), 0), ALIGN)


def _round_up(value: float, multiple: int) -> int:
    return int(np.ceil(value / multiple)) * multiple
