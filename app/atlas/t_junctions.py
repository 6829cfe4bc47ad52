"""Triangles divided where a corner of others lies on one of their edges: at such a T-junction pixels fall between both.

A rasteriser rounds corners to a part of a pixel: the straight edge of one triangle and that of its neighbours, which has a corner
more, leave pixels to what lies behind. Only where a surface ends is anything else behind: at an edge that an odd number of
triangles has, a rim, or at a corner on one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from app.atlas.sides import Edges, distinct_rows, runs
from app.scene.model import F64

ON_EDGE = 1e-6  # solver space: a corner no farther from an edge lies on it, to single precision
FEW = 32  # edges, or points, with which all of the others are compared
MOST = 4096  # divisions, beside one for each triangle, beyond which none is made: piles of sheets along one line

Ints = NDArray[np.int64]
Floats = NDArray[np.floating[Any]]


@dataclass(frozen=True, eq=False)
class Divided:
    """Triangles that take the place of others: parent (n,), not less than that of the row before; corners (n, 3): points; weights
    (n, 3, 3): of the parent's corners at each corner, None where no triangle was divided."""

    parent: Ints
    corners: Ints
    weights: F64 | None


def without_t_junctions(points: F64, corners: Ints) -> Divided:
    """points (p, 3), each place once; corners (m, 3) of the triangles."""
    count = len(corners)
    parent, weights = np.arange(count), np.tile(np.eye(3), (count, 1, 1))
    on_edges = _corners_on_edges(points, corners)
    if not 0 < len(on_edges[0]) <= count + MOST:
        return Divided(parent, corners, None)
    while len(on_edges[0]):
        row, corners, weights, on_edges = _divided_once(corners, weights, *on_edges)
        parent = np.append(parent, parent[row])
    order = np.argsort(parent, kind="stable")
    return Divided(parent[order], corners[order], weights[order])


def at_corners(values: Floats, weights: F64 | None) -> Floats:
    """(n, 3, c): values (n, 3, c) at corners of triangles, at those of parts of them."""
    return values if weights is None else np.asarray(np.einsum("nck,nkv->ncv", weights, values))


def _corners_on_edges(points: F64, corners: Ints) -> tuple[Ints, Ints, Ints, F64]:
    """Which points lie on which edges: triangle, its edge from corner k to k + 1, point, share of the way there (q,) each."""
    start, end = corners.reshape(-1), np.roll(corners, -1, axis=1).reshape(-1)
    edges = Edges.of(corners.astype(np.int32))
    one, uses = edges.order[edges.first[:-1]], edges.uses
    low, high = np.minimum(start[one], end[one]), np.maximum(start[one], end[one])
    again = edges.edge.reshape(-1, 3)[_there_again(corners, edges)]  # both sides of a sheet are one
    rim = (uses - np.bincount(again.reshape(-1), minlength=len(uses))) % 2 == 1
    at_rim = np.unique(np.concatenate([low[rim], high[rim]]))
    used, rims, others = np.flatnonzero(np.bincount(start)), np.flatnonzero(rim), np.flatnonzero(~rim)
    found = [_on(points, low, high, rims, used), _on(points, low, high, others, at_rim)]
    on, node, share = (np.concatenate(column) for column in zip(*found, strict=True))
    # to each triangle that has the edge, whichever way
    which, nth = runs(edges.first[on], edges.first[on + 1])
    half = edges.order[nth]
    node, share = node[which], np.where(start[half] == low[on[which]], share[which], 1 - share[which])
    own = (corners[half // 3] == node[:, None]).any(1)  # a needle's tip
    return half[~own] // 3, half[~own] % 3, node[~own], share[~own]


def _there_again(corners: Ints, edges: Edges) -> Ints:
    """The triangles that have the same corners as one before."""
    across = np.roll(corners, 1, axis=1).reshape(-1)[edges.order]  # of each half-edge
    two = edges.first[:-1][edges.uses == 2]
    two = two[across[two] == across[two + 1]]
    many = np.flatnonzero(np.repeat(edges.uses > 2, edges.uses))
    maybe = np.unique(edges.order[np.concatenate([two, two + 1, many])] // 3)
    return np.delete(maybe, distinct_rows(*np.sort(corners[maybe], axis=1).T)[0])


def _on(points: F64, low: Ints, high: Ints, edges: Ints, asked: Ints) -> tuple[Ints, Ints, F64]:
    """Which of the points ``asked`` lie between the ends of which of the ``edges``, and at what share of the way."""
    if not len(edges) or not len(asked):
        return np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0)
    if min(len(edges), len(asked)) <= FEW:
        edges, asked = _in_boxes(points, low, high, edges, asked)
        if not len(edges) or not len(asked):
            return np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0)
    half = np.linalg.norm(points[high[edges]] - points[low[edges]], axis=1) / 2 + ON_EDGE
    far, _ = cKDTree(points[asked]).query(
        (points[low[edges]] + points[high[edges]]) / 2, distance_upper_bound=half.max() + ON_EDGE, workers=-1
    )
    edges = edges[far <= half]
    seen = np.argsort(np.ptp(points, axis=0))[1:]  # along the axis in which least lies above another
    lines = np.stack([points[low[edges]], points[high[edges]]], axis=1)
    tree = shapely.STRtree(shapely.linestrings(lines[..., seen]))
    node, edge = tree.query(shapely.points(points[asked][:, seen]), predicate="dwithin", distance=ON_EDGE)
    node, edge = asked[node], edges[edge]
    way, there = points[high[edge]] - points[low[edge]], points[node] - points[low[edge]]
    length = np.linalg.norm(way, axis=1)
    share = np.einsum("qk,qk->q", there, way) / np.maximum(length, ON_EDGE) ** 2
    off = np.linalg.norm(there - share[:, None] * way, axis=1)
    on = (off <= ON_EDGE) & (share * length > ON_EDGE) & ((1 - share) * length > ON_EDGE)
    return edge[on], node[on], share[on]


def _in_boxes(points: F64, low: Ints, high: Ints, edges: Ints, asked: Ints) -> tuple[Ints, Ints]:
    """The edges in whose boxes any of the points ``asked`` lies, or the points that lie in the box of any of the edges, whichever
    of both are more: compared with each of the few others."""
    along = np.ascontiguousarray(points.T)
    start, end, place = (along.take(of, axis=1) for of in (low[edges], high[edges], asked))
    least, most = np.minimum(start, end) - ON_EDGE, np.maximum(start, end) + ON_EDGE
    if len(edges) > len(asked):
        met = [_that_meet(least, most, point, point) for point in place.T]
        return edges[np.unique(np.concatenate(met))], asked
    met = [_that_meet(place, place, lower, upper) for lower, upper in zip(least.T, most.T, strict=True)]
    return edges, asked[np.unique(np.concatenate(met))]


def _that_meet(least: F64, most: F64, lower: F64, upper: F64) -> Ints:
    """Which of the boxes from least to most, (3, n) each, meet the one from lower to upper (3,)."""
    met = np.flatnonzero((least[0] <= upper[0]) & (most[0] >= lower[0]))
    for k in (1, 2):
        met = met[(least[k, met] <= upper[k]) & (most[k, met] >= lower[k])]
    return met


def _divided_once(
    corners: Ints, weights: F64, triangle: Ints, edge: Ints, node: Ints, share: F64
) -> tuple[Ints, Ints, F64, tuple[Ints, Ints, Ints, F64]]:
    """Each triangle that has points on edges in two, by a line from the middle one of these to the corner across. Those that were
    divided (d,), whose second halves come last; corners and weights; the points that remain on edges."""
    order = np.lexsort((share, edge, triangle))
    triangle, edge, node, share = triangle[order], edge[order], node[order], share[order]
    begin = np.flatnonzero(np.diff(triangle, prepend=-1))
    chosen = (begin + np.append(begin[1:], len(triangle))) // 2
    row, turn, at = triangle[chosen], (edge[chosen][:, None] + [0, 1, 2]) % 3, share[chosen]
    its = np.take_along_axis(corners[row], turn, 1)
    its_weights = np.take_along_axis(weights[row], turn[..., None], 1)
    place = (1 - at)[:, None] * its_weights[:, 0] + at[:, None] * its_weights[:, 1]
    count = len(corners)
    corners, weights = np.append(corners, its, 0), np.append(weights, its_weights, 0)
    corners[row], weights[row] = its, its_weights
    corners[row, 1], weights[row, 1] = node[chosen], place  # the node takes the place of the end, and of the start
    corners[count:, 0], weights[count:, 0] = node[chosen], place

    of = np.cumsum(np.diff(triangle, prepend=-1) > 0) - 1  # the number of each point's triangle among those divided
    left = np.ones(len(triangle), bool)
    left[chosen] = False
    side = (edge - edge[chosen][of]) % 3
    first = (side == 2) | (side == 0) & (share < at[of])
    on_it = side == 0  # the edge that is divided
    begins, length = np.where(first, 0.0, at[of]), np.where(first, at[of], 1 - at[of])
    along = np.where(on_it, (share - begins) / np.where(on_it, length, 1.0), share)
    remain = np.where(first, triangle, count + of)[left], side[left], node[left], along[left]
    return row, corners, weights, remain
