"""Which patches are in the local set: those nearest to the observer, and farther away, in a cascade, ever larger clusters."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from app.scene.model import F64
from app.solvers.local.patches import Patches

I64 = NDArray[np.int64]
STEPS = 8  # sizes of the cascade between one and twice as large
FARTHEST, NEAREST = (
    14,
    -3,
)  # octaves of edges of a patch, beyond which clusters take the place of patches: at most, at least
CUBE = 8  # edges of a patch, along the edge of a cube from all of which patches reach as far
ROOM = 0.94  # of the set, that is filled from the middle of a cube
GROWTH = 1.25  # times as far as clusters of one level, those of the next: with 2, few patches would be left near by
CORNER = 0.87  # edges of a cluster's cube, from its middle to its corner


class Selection:
    """Of one scene's patches, for sets of at most ``most`` of them."""

    def __init__(self, patches: Patches, most: int) -> None:
        self._patches, self._most = patches, most
        self._tree = cKDTree(patches.centre[: patches.count])
        self._step, self._cube = 0, np.full(3, np.nan)

    def nearest(self, observer: F64) -> I64:
        """The nearest patches, nearest first. observer (3,) [solver space]."""
        count = min(self._most, self._patches.count)
        return np.atleast_1d(self._tree.query(observer, k=count)[1]).astype(np.int64)

    def cascade(self, observer: F64) -> I64:
        """Patches near by, and beyond, up to the end of the world, clusters that are the larger the farther away, nearest first:
        patches reach as far as the set has room for. The same wherever the observer came from."""
        if self._patches.count <= self._most:
            return self.nearest(observer)
        step = self._step_around(observer)
        while step > NEAREST * STEPS and not self._fits(observer, step, self._most):
            step -= 1
        return self._cut(observer, step)[: self._most]

    def _step_around(self, observer: F64) -> int:
        """How far patches reach from the middle of the cube that the observer is in, with some room left: the same all over it,
        since each other reach would exchange a tenth of the set."""
        cube = np.floor(observer / (CUBE * self._patches.edge))
        if not np.array_equal(cube, self._cube):
            self._cube, middle, most = cube, (cube + 0.5) * CUBE * self._patches.edge, int(ROOM * self._most)
            while self._step < FARTHEST * STEPS and self._fits(middle, self._step + 1, most):
                self._step += 1
            while self._step > NEAREST * STEPS and not self._fits(middle, self._step, most):
                self._step -= 1
        return self._step

    def _fits(self, observer: F64, step: int, most: int) -> bool:
        return len(self._cut(observer, step)) <= most

    def _cut(self, observer: F64, step: int) -> I64:
        """Nodes, nearest first, of which no cluster of level n is nearer than 2^(step/STEPS) GROWTH^n edges of a patch."""
        patches, found = self._patches, []
        nodes, reach, count = patches.roots, patches.edge * 2.0 ** (step / STEPS), 0
        while len(nodes):
            edge = patches.edge * 2.0 ** patches.level[nodes]
            away = np.linalg.norm(patches.centre[nodes] - observer, axis=1) - CORNER * edge
            split = (patches.level[nodes] > 0) & (away < reach * GROWTH ** patches.level[nodes])
            found.append(nodes[~split])
            count += len(found[-1])
            if count > self._most:
                found[-1], nodes = nodes, nodes[:0]
                break
            first, last = patches.children[nodes[split]].T
            nodes = ranges(first, last)
        whole = np.concatenate([*found, nodes]) if len(nodes) else np.concatenate(found)
        return whole[np.argsort(distances(patches, whole, observer), kind="stable")]


def ranges(first: I64, last: I64) -> I64:
    """All numbers of the ranges from ``first`` (n,) to before ``last`` (n,)."""
    size = last - first
    return np.repeat(first - np.concatenate([[0], np.cumsum(size)[:-1]]), size) + np.arange(int(size.sum()))


def distances(patches: Patches, nodes: I64, observer: F64) -> F64:
    """(n,) from the observer to the middle of nodes [solver space]."""
    return np.asarray(np.linalg.norm(patches.centre[nodes] - observer, axis=1))


@dataclass(frozen=True)
class Swap:
    """Nodes that take the place of others, all at once: they cover the same surface, or one is nearer than the other."""

    leave: tuple[int, ...]
    enter: tuple[int, ...]


def swaps(
    patches: Patches, inside: I64, wanted: I64, free: int, observer: F64, can_enter: Callable[[I64], NDArray[np.bool_]]
) -> Iterator[Swap]:
    """How nodes ``inside`` become those ``wanted``, with no more than ``free`` more of them at any time: what enters, nearest
    first, each with all that it overlaps; where there is no room, first what leaves, farthest first. can_enter: which of nodes
    (n,) may enter yet; the others are left out, and nothing leaves for them."""
    enter, leave = np.setdiff1d(wanted, inside), np.setdiff1d(inside, wanted)
    nodes = np.concatenate([enter, leave])
    if not len(nodes):
        return
    entering = np.arange(len(nodes)) < len(enter)
    by_start = np.argsort(patches.start[nodes], kind="stable")
    reach = np.maximum.accumulate(patches.end[nodes[by_start]])
    begins = np.concatenate([[True], patches.start[nodes[by_start]][1:] >= reach[:-1]])
    group = np.empty(len(nodes), np.int64)
    group[by_start] = np.cumsum(begins) - 1
    away = np.full(int(group.max()) + 1, np.inf)
    np.minimum.at(away, group, distances(patches, nodes, observer))
    net = np.bincount(group, np.where(entering, 1, -1)).astype(np.int64)
    members = np.split(np.argsort(group, kind="stable"), np.cumsum(np.bincount(group))[:-1])

    def swap(g: int) -> Swap:
        mine = members[g]
        return Swap(tuple(nodes[mine[~entering[mine]]].tolist()), tuple(nodes[mine[entering[mine]]].tolist()))

    waits = np.zeros(len(away), bool)
    np.logical_or.at(waits, group[: len(enter)], ~can_enter(enter))
    enters = np.bincount(group[: len(enter)], minlength=len(away)) > 0
    growing = [g for g in np.argsort(away, kind="stable").tolist() if net[g] > 0 and not waits[g]]
    shrinking = [g for g in np.argsort(-away, kind="stable").tolist() if net[g] <= 0 and not waits[g]]
    while growing or shrinking:
        if growing and net[growing[0]] <= free:
            g = growing.pop(0)
        elif shrinking:
            g = shrinking.pop(0)
            if not (growing or enters[g]) and waits.any():
                continue  # its slot is for what may not enter yet
        else:
            return
        free -= int(net[g])
        yield swap(g)
