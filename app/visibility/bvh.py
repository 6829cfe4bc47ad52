"""A bounding volume hierarchy is a binary tree of boxes over triangles, so that a ray meets few of them.

It is built from the root down, a level at a time over all nodes of the level at once (bvh_split.py), by the surface area
heuristic: a ray that meets a box of area A meets one in it of area A_c with probability A_c / A [MacDonald90], so that a node
costs

    A STEP + A_left n_left + A_right n_right

What no place can part (coincident centres), or would make the tree too deep, is halved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from app.scene.model import F32, F64
from app.visibility.bvh_split import Boxes, Ints, Mask, half_area, split_nodes

ScalarT = TypeVar("ScalarT", bound=np.generic)

LEAF = 4  # triangles, at most
STEP = 2.0  # cost of a node, in triangles
DEEPEST = 28  # levels of inner nodes, where halving allows it: a ray's stack holds as many
NOWHERE = 1e30  # along each axis
# Of the largest coordinate: corners are rounded to it on the GPU, and what runs along a side of a box is inside of it
MARGIN = 2.0**-24


@dataclass(frozen=True, eq=False)
class Bvh:
    """nodes (m, 4, 4) f32: lower.xyz, reference; upper.xyz, count; of the first child, then of the second. A child with a count
    is a leaf of so many triangles from the slot ``reference`` on; without one it is the inner node ``reference``, or -1: nothing.
    order (n,) i32: the triangle in each slot; cost: boxes and triangles that a ray through all of it meets, about; depth: inner
    nodes above a leaf, at most."""

    nodes: F32
    order: NDArray[np.int32]
    cost: float
    depth: int


def build_bvh(corners: F64, tell: Callable[[float], None] | None = None) -> Bvh:
    """Of triangles with corners (n, 3, 3). tell: is given the share that is done, now and then; what it raises ends the work."""
    count = len(corners)
    boxes = Boxes(corners.min(1).astype(np.float32), corners.max(1).astype(np.float32))
    tree = _Tree(count)
    if count < 2:
        tree.add_level(np.array([-1]))
        tree.add_leaves(np.zeros(count, np.int64), np.arange(count), np.ones(count, np.int64))
    else:
        _grow(tree, boxes, tell or (lambda share: None))
    return tree.finish(corners)


class _Tree:
    """Nodes as they are made: references and counts (n, 2) of their children, used up to the last of ``levels``, the first node
    of each level and the end of the last; order: of leaves that are made."""

    def __init__(self, count: int) -> None:
        self.references = np.full((max(count, 1), 2), -1, np.int64)
        self.counts = np.zeros((max(count, 1), 2), np.int64)
        self.order = np.zeros(count, np.int32)
        self.levels = [0]

    def add_leaves(self, parent: Ints, first: Ints, counts: Ints) -> None:
        """parent: twice the node that they are children of, one more for its second child; first: their slots."""
        self.references.reshape(-1)[parent] = first
        self.counts.reshape(-1)[parent] = counts

    def add_level(self, parent: Ints) -> None:
        """Inner nodes, of whom the root has no parent: -1."""
        begin = self.levels[-1]
        if len(parent):
            below = parent >= 0
            self.references.reshape(-1)[parent[below]] = begin + np.flatnonzero(below)
            self.levels.append(begin + len(parent))

    def finish(self, corners: F64) -> Bvh:
        """Fit the boxes, from the leaves up."""
        last = self.levels[-1]
        references, counts = self.references[:last], self.counts[:last]
        lower, upper = np.full((last, 2, 3), np.inf), np.full((last, 2, 3), -np.inf)
        leaves = counts > 0
        first = references[leaves]
        if len(first):
            by_slot = np.argsort(first)
            where = tuple(index[by_slot] for index in np.nonzero(leaves))
            lower[where] = np.minimum.reduceat(corners.min(1)[self.order], first[by_slot])
            upper[where] = np.maximum.reduceat(corners.max(1)[self.order], first[by_slot])
        inner = (counts == 0) & (references >= 0)
        for start, end in reversed(list(zip(self.levels[:-2], self.levels[1:-1], strict=True))):
            node, side = np.nonzero(inner[start:end])
            child = references[start:end][node, side]
            lower[start + node, side], upper[start + node, side] = lower[child].min(1), upper[child].max(1)
        return Bvh(
            nodes=_packed(lower, upper, references, counts, MARGIN * float(np.abs(corners).max(initial=0.0))),
            order=self.order,
            cost=_cost(lower, upper, counts),
            depth=len(self.levels) - 1,
        )


def _grow(tree: _Tree, boxes: Boxes, tell: Callable[[float], None]) -> None:
    """Part the nodes of one level after the other. Of a level, triangles come node by node, from the slots ``first`` on."""
    count = len(boxes.lower)
    items, counts, first, parent = np.arange(count), np.array([count]), np.array([0]), np.array([-1])
    whole = _to_do(counts)
    while len(counts):
        level = len(tree.levels) - 1
        cost, right = split_nodes(boxes, counts)
        is_leaf = _leaves(boxes, counts, cost) & (parent >= 0)
        leaf = np.repeat(is_leaf, counts)
        slots = np.arange(len(items)) + np.repeat(first - (np.cumsum(counts) - counts), counts)
        tree.order[slots[leaf]] = items[leaf]
        tree.add_leaves(parent[is_leaf], first[is_leaf], counts[is_leaf])
        tree.add_level(parent[~is_leaf])
        tell(1 - _to_do(counts[~is_leaf]) / whole)
        if is_leaf.any():
            items, right, boxes = items[~leaf], right[~leaf], Boxes(boxes.lower[~leaf], boxes.upper[~leaf])
            counts, first, cost = counts[~is_leaf], first[~is_leaf], cost[~is_leaf]
        if not len(counts):
            break
        _halve(boxes, counts, right, ~np.isfinite(cost) | (np.ceil(np.log2(counts / LEAF)) >= DEEPEST - level))
        place, on_right = _places(counts, right)
        items, boxes = _placed(items, place), Boxes(_placed(boxes.lower, place), _placed(boxes.upper, place))
        parent = np.arange(2 * len(counts)) + 2 * tree.levels[-2]
        first = np.stack([first, first + counts - on_right], 1).reshape(-1)
        counts = np.stack([counts - on_right, on_right], 1).reshape(-1)


def _to_do(counts: Ints) -> float:
    """Triangles times levels to come, about: each level halves nodes."""
    return float((counts * np.log2(counts)).sum())


def _leaves(boxes: Boxes, counts: Ints, cost: NDArray[np.float32]) -> Mask:
    """Which nodes stay whole: those of one triangle, and small ones that parting makes no cheaper. cost: of parting."""
    start = np.cumsum(counts) - counts
    area = half_area(np.minimum.reduceat(boxes.lower, start), np.maximum.reduceat(boxes.upper, start))
    return np.asarray((counts == 1) | ((counts <= LEAF) & (area * STEP + cost >= area * counts)))


def _places(counts: Ints, right: Mask) -> tuple[Ints, Ints]:
    """Where each triangle goes, so that in each node those of the left child come before those of the right one, in their old
    order; how many of each node go right."""
    node, start = np.repeat(np.arange(len(counts)), counts), np.cumsum(counts) - counts
    on_right = np.bincount(node, right, len(counts)).astype(np.int64)
    passed: Ints = np.cumsum(right) - right
    passed -= passed[start][node]  # triangles of the node before this one that go right
    middle = start + counts - on_right
    return np.where(right, middle[node] + passed, np.arange(len(right)) - passed), on_right


def _placed(values: NDArray[ScalarT], place: Ints) -> NDArray[ScalarT]:
    out = np.empty_like(values)
    out[place] = values
    return out


def _halve(boxes: Boxes, counts: Ints, right: Mask, which: Mask) -> None:
    """Let half of the triangles of each of these nodes go right, in place."""
    if which.any():
        rows = np.flatnonzero(np.repeat(which, counts))
        right[rows] = _halves(boxes.take(rows), counts[which])


def _halves(boxes: Boxes, counts: Ints) -> Mask:
    """The upper half of each node's triangles along the widest axis of its centres."""
    node, first = np.repeat(np.arange(len(counts)), counts), np.cumsum(counts) - counts
    centres = boxes.centres
    widest = (np.maximum.reduceat(centres, first) - np.minimum.reduceat(centres, first)).argmax(1)
    order = np.lexsort((centres[np.arange(len(node)), widest[node]], node))
    right = np.empty(len(node), bool)
    right[order] = np.arange(len(node)) - first[node] >= (counts // 2)[node]
    return right


def _packed(lower: F64, upper: F64, references: Ints, counts: Ints, margin: float) -> F32:
    """Boxes rounded outward, as the textures hold them. An empty child's is a point that no ray reaches."""
    nothing = (counts == 0) & (references < 0)
    nodes = np.empty((len(lower), 2, 2, 4), np.float32)
    nodes[:, :, 0, :3] = np.nextafter((lower - margin).astype(np.float32), np.float32(-np.inf))
    nodes[:, :, 1, :3] = np.nextafter((upper + margin).astype(np.float32), np.float32(np.inf))
    nodes[nothing, :, :3] = NOWHERE
    nodes[:, :, 0, 3], nodes[:, :, 1, 3] = references, counts
    return nodes.reshape(-1, 4, 4)


def _cost(lower: F64, upper: F64, counts: Ints) -> float:
    whole = float(half_area(lower[0].min(0), upper[0].max(0)))
    areas = half_area(lower, upper)
    return float(STEP + (areas * np.where(counts, counts, STEP))[np.isfinite(areas)].sum() / max(whole, 1e-300))
