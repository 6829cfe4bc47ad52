"""The nodes of a tree as a table of texels, RGBA32UI, that visibility/rays.glsl walks.

A child is named by its entry, or as a leaf by ~(first slot << COUNT_BITS | triangles). Its box is one texel,

    lower.xyz | upper.xyz << 16, name        whole cells of a grid of 2^16 along each side of the scene

or, where many boxes are so much smaller than the scene that whole cells would blow them up, two:

    lower.xyz, name    upper.xyz, 0          floats

Entry 0 of a table with a grid is no node: it holds the grid's corner, and cells in a length of 1, as floats.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.gpu import glsl_constant
from app.scene.model import F64
from app.visibility.bvh import Bvh
from app.visibility.bvh_split import half_area

COUNT_BITS = int(glsl_constant("visibility/rays.glsl", "COUNT_BITS"))
CELLS = 1 << 16
GUARD = 1 / 16  # cells about each box: the origin of a ray is rounded to 2^-24 of the grid, 2^-8 of a cell
BLOWN_UP = 1.25  # area of the median box in whole cells, over its own: from there on they cost more steps than texels they save

Words = NDArray[np.uint32]


def node_table(bvh: Bvh) -> tuple[Words, bool]:
    """(entries, texels, 4), and whether boxes are of cells."""
    lower, upper = bvh.nodes[:, ::2, :3].astype(np.float64), bvh.nodes[:, 1::2, :3].astype(np.float64)
    reference, count = (bvh.nodes[:, row::2, 3].astype(np.int64) for row in (0, 1))
    empty = reference < 0
    corner, cells = _grid(lower[~empty], upper[~empty])
    first, last = (lower - corner) * cells - GUARD, (upper - corner) * cells + GUARD
    first, last = np.floor(first).clip(0, CELLS - 1), np.ceil(last).clip(0, CELLS - 1)
    own, grown = half_area(lower, upper), half_area(first / cells, last / cells)
    gridded = bool(np.median((grown / np.maximum(own, 1e-300))[~empty]) <= BLOWN_UP) if not empty.all() else True
    name = np.where(count > 0, ~(reference << COUNT_BITS | count), reference + gridded)
    name[empty] = ~0
    if not gridded:
        table = bvh.nodes.view(np.uint32).copy()
        table[:, ::2, 3] = name.astype(np.int32).view(np.uint32)
        table[:, 1::2, 3] = 0
        return table, False
    first[empty], last[empty] = CELLS - 1, CELLS - 1
    table = np.zeros((len(bvh.nodes) + 1, 2, 4), np.uint32)
    table[0, :, :3] = np.stack([corner, cells]).astype(np.float32).view(np.uint32)
    table[1:, :, :3] = first.astype(np.uint32) | last.astype(np.uint32) << np.uint32(16)
    table[1:, :, 3] = name.astype(np.int32).view(np.uint32)
    return table, True


def _grid(lower: F64, upper: F64) -> tuple[F64, F64]:
    """Its corner (3,) and cells in a length of 1 (3,), both exact in single precision, over all boxes and a cell more."""
    if not len(lower):
        return np.zeros(3), np.ones(3)
    least, extent = lower.min(0), np.ptp(np.concatenate([lower, upper]), axis=0)
    cells = (CELLS - 4) / np.maximum(extent, max(extent.max() / CELLS, 1e-30))
    cells = cells.astype(np.float32).astype(np.float64)
    corner = (least - 2 / cells).astype(np.float32).astype(np.float64)
    return corner, cells
