"""Where to part the triangles of each of many nodes: the least cost by the surface area heuristic, over all nodes at once.

Triangles come node by node. A node of many is parted between bins along each axis [Wald07], a small one between any two of its
triangles in the order of their centres.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from app.scene.model import F32, F64

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

FloatsT = TypeVar("FloatsT", F32, F64)

BINS = 16  # along each axis
WIDTHS = (2, 4, 8, 16)  # triangles of nodes that are parted exactly, up to each of these together
CHUNK = 1 << 13  # nodes at once, so that their tables stay in the caches


@dataclass(frozen=True, eq=False)
class Boxes:
    """lower, upper (n, 3) f32 of n boxes."""

    lower: F32
    upper: F32

    def take(self, which: Ints) -> Boxes:
        return Boxes(self.lower[which], self.upper[which])

    @property
    def centres(self) -> F32:
        """(n, 3), times two."""
        return self.lower + self.upper


def half_area(lower: FloatsT, upper: FloatsT) -> FloatsT:
    """Half of the surface of boxes (..., 3); 0 of an empty one, whose lower corner is above its upper one."""
    x, y, z = np.moveaxis(np.maximum(upper - lower, 0), -1, 0)
    return x * y + y * z + z * x  # type: ignore[no-any-return]


def split_nodes(boxes: Boxes, counts: Ints) -> tuple[NDArray[np.float32], Mask]:
    """Nodes with ``counts`` (k,) triangles each, whose boxes follow one another: A_left n_left + A_right n_right (k,), infinite
    where no place parts the centres, and whether a triangle (n,) goes to the right."""
    cost = np.full(len(counts), np.inf, np.float32)
    right = np.zeros(len(boxes.lower), bool)
    first, sizes = np.cumsum(counts) - counts, np.searchsorted(WIDTHS, counts)
    for size in np.unique(sizes[counts > 1]).tolist():
        mine = np.flatnonzero((sizes == size) & (counts > 1))
        for some in np.split(mine, np.arange(CHUNK, len(mine), CHUNK)):
            rows = _rows(first[some], counts[some])
            split = _split_exactly if size < len(WIDTHS) else _split_binned
            cost[some], right[rows] = split(boxes.take(rows), counts[some])
    return cost, right


def _rows(first: Ints, counts: Ints) -> Ints:
    """Runs of so many indices each, from ``first`` on."""
    return np.asarray(np.arange(counts.sum()) + np.repeat(first - (np.cumsum(counts) - counts), counts))


def _split_binned(boxes: Boxes, counts: Ints) -> tuple[NDArray[np.float32], Mask]:
    nodes, first = len(counts), np.cumsum(counts) - counts
    node = np.repeat(np.arange(nodes), counts)
    centres = boxes.centres
    least = np.minimum.reduceat(centres, first)
    extent = np.maximum.reduceat(centres, first) - least
    scale = np.where(extent > 0, np.float32(BINS * (1 - 1e-5)) / np.maximum(extent, np.float32(1e-30)), np.float32(0))
    bins = ((centres - least[node]) * scale[node]).astype(np.int64)
    cell = (node[:, None] * 3 + np.arange(3)) * BINS + bins  # of each triangle, along each axis
    cells = nodes * 3 * BINS
    filled = np.bincount(cell.reshape(-1), minlength=cells).reshape(nodes, 3, BINS)
    lower = np.full((3, cells), np.inf, np.float32)
    upper = np.full((3, cells), -np.inf, np.float32)
    for axis in range(3):
        for along in range(3):
            np.minimum.at(lower[along], cell[:, axis], boxes.lower[:, along])
            np.maximum.at(upper[along], cell[:, axis], boxes.upper[:, along])
    shape = (nodes, 3, BINS, 3)
    costs = _costs(lower.T.reshape(shape), upper.T.reshape(shape), filled)
    best = costs.reshape(nodes, -1).argmin(1)
    axis, after = best // (BINS - 1), best % (BINS - 1)
    cost = np.take_along_axis(costs.reshape(nodes, -1), best[:, None], 1)[:, 0]
    return cost, bins[np.arange(len(bins)), axis[node]] > after[node]


def _split_exactly(boxes: Boxes, counts: Ints) -> tuple[NDArray[np.float32], Mask]:
    nodes, width = len(counts), int(counts.max())
    place = np.arange(width) < counts[:, None]  # a row for each node, as long as the longest
    lower = np.full((nodes, width, 3), np.inf, np.float32)
    upper = np.full((nodes, width, 3), -np.inf, np.float32)
    centres = np.full((nodes, width, 3), np.inf, np.float32)
    lower[place], upper[place], centres[place] = boxes.lower, boxes.upper, boxes.centres
    order = np.argsort(centres.swapaxes(1, 2), axis=2)  # (nodes, 3, width)
    row = np.arange(nodes)[:, None, None]
    costs = _costs(lower[row, order], upper[row, order], np.broadcast_to(place[:, None], order.shape))
    ranked = np.take_along_axis(centres.swapaxes(1, 2), order, 2)
    costs[ranked[..., 1:] <= ranked[..., :-1]] = np.inf  # equal centres stay together
    best = costs.reshape(nodes, -1).argmin(1)
    axis, after = best // (width - 1), best % (width - 1)
    cost = np.take_along_axis(costs.reshape(nodes, -1), best[:, None], 1)[:, 0]
    right = np.zeros((nodes, width), bool)
    np.put_along_axis(right, order[np.arange(nodes), axis], np.arange(width) > after[:, None], 1)
    return cost, right[place]


def _costs(lower: F32, upper: F32, filled: NDArray[np.generic]) -> NDArray[np.float32]:
    """A_left n_left + A_right n_right (nodes, 3, cells - 1) of parting after each cell but the last; boxes (nodes, 3, cells, 3),
    of ``filled`` (nodes, 3, cells) triangles."""
    left = half_area(np.minimum.accumulate(lower, 2), np.maximum.accumulate(upper, 2))
    back = (slice(None), slice(None), slice(None, None, -1))
    right = half_area(np.minimum.accumulate(lower[back], 2), np.maximum.accumulate(upper[back], 2))[back]
    before = np.cumsum(filled, 2, dtype=np.float32)
    after = before[..., -1:] - before
    costs = left[..., :-1] * before[..., :-1] + right[..., 1:] * after[..., :-1]
    costs[(before[..., :-1] == 0) | (after[..., :-1] == 0)] = np.inf
    return np.asarray(costs)
