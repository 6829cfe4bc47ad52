"""The sides of a scene's triangles that light can reach; and what all work on triangles begins with: corners that coincide made
one, edges, and rows that are alike.

Radiosity travels in straight lines, so a side receives light only from what lies strictly in front of its plane. The
farthest that anything reaches in a direction is a vertex of the scene's convex hull: if every hull vertex lies on or
behind the plane of a side, that side is *dark* and needs no texels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, QhullError, cKDTree

from app.scene.model import F64, I32, Scene

# Relative to the scene's diagonal. Vertices in float32 are good to 6e-8 of their coordinate.
WELD = 1e-7  # vertices closer than this are one
FLAT = 1e-6  # distance from a plane that still counts as on it
# Radians between two normals of one plane: what FLAT allows over a triangle a thousandth of the scene high.
FLAT_ANGLE = 1e-3
BLOCK = 1 << 22  # numbers in a temporary array
COUNTED = 4  # times as many kinds of numbers as there are numbers, at most, are sorted by counting
FEW = 4096  # rows, from which on that is faster
# Odd multiplier that spreads bits [Knuth, multiplicative hashing by the golden ratio].
SPREAD = np.uint64(0x9E3779B97F4A7C15)


@dataclass(frozen=True, eq=False)
class Sides:
    """The lit sides: triangle (f,) i32, back (f,) bool; fronts first, each in triangle order. dark: sides left out."""

    triangle: I32
    back: NDArray[np.bool_]
    dark: int


def least(corners: F64) -> F64:
    """The least of three, of triangles (n, 3, k) the lower corners (n, k) of their boxes; many times faster than min(1)."""
    return np.minimum(np.minimum(corners[:, 0], corners[:, 1]), corners[:, 2])


def most(corners: F64) -> F64:
    """The most of three, as ``least``."""
    return np.maximum(np.maximum(corners[:, 0], corners[:, 1]), corners[:, 2])


def middle(corners: F64) -> F64:
    """The mean of three, of triangles (n, 3, k) their centroids (n, k)."""
    return np.asarray((corners[:, 0] + corners[:, 1] + corners[:, 2]) / 3)


def scene_size(scene: Scene) -> float:
    """Diagonal of the box around the scene [m]."""
    low, high = scene.bounds
    return float(np.linalg.norm(high - low))


def lit_sides(scene: Scene) -> Sides:
    """Every front, and every back of a double-sided material, that has something in front of it.

    All where there is a sky, or a lamp without area, which may hang or shine from outside; and where no side has (a lone sheet,
    a convex body seen from outside): there is then no light to save texels for, but still a surface to show.
    """
    size = scene_size(scene)
    low, high = scene.bounds
    corners = (scene.corners - (low + high) / 2) / size
    normals, _ = scene.normals_areas
    offsets = np.einsum("mk,mk->m", normals, corners[:, 0])
    hull = _hull_points((scene.positions[scene.used] - (low + high) / 2) / size)
    fronts = _reaches(hull, normals, offsets)
    two_sided = scene.sides
    backs = two_sided.copy()
    backs[two_sided] = _reaches(hull, -normals[two_sided], -offsets[two_sided])
    if scene.open_to_lights or (not fronts.any() and not backs.any()):
        fronts, backs = np.ones_like(fronts), two_sided
    triangle = np.concatenate([np.flatnonzero(fronts), np.flatnonzero(backs)]).astype(np.int32)
    back = np.arange(len(triangle)) >= np.count_nonzero(fronts)
    return Sides(triangle, back, len(normals) + int(np.count_nonzero(two_sided)) - len(triangle))


def _reaches(hull: F64, normals: F64, offsets: F64) -> NDArray[np.bool_]:
    """Whether any of the points (h, 3) is in front of each plane, normals (m, 3) and offsets (m,)."""
    found, left = np.zeros(len(normals), bool), np.arange(len(normals))
    for extreme in (*hull.argmin(axis=0), *hull.argmax(axis=0)):  # most planes have one of these in front
        found[left] = normals[left] @ hull[extreme] - offsets[left] > FLAT
        left = left[~found[left]]
    step = max(1, BLOCK // len(hull))
    for start in range(0, len(left), step):
        part = left[start : start + step]
        found[part] = (normals[part] @ hull.T).max(axis=1) - offsets[part] > FLAT
    return found


def _hull_points(points: F64) -> F64:
    """The corners of the convex hull of points (n, 3), which may all lie in one plane."""
    try:
        vertices = ConvexHull(points).vertices
    except QhullError:
        _, _, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
        try:
            vertices = ConvexHull(points @ axes[:2].T).vertices
        except QhullError:
            return points
    return np.asarray(points[vertices])


def rows_by(label: NDArray[np.integer], count: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The rows that bear each of some labels: of label k, ``order`` from ``first[k]`` up to ``first[k + 1]``, in the order in
    which they are given.

    label (n,) in [0, count). By counting, as sparse matrices are transposed: many times faster than np.argsort.
    """
    order, first = _counted(label, count)
    return order.astype(np.int64), first.astype(np.int64)


def _counted(label: NDArray[np.integer], count: int) -> tuple[NDArray[np.integer], NDArray[np.integer]]:
    """As rows_by, in numbers as small as they fit in."""
    rows = np.arange(len(label) + 1, dtype=np.int32 if len(label) < np.iinfo(np.int32).max else np.int64)
    by_label = csr_array((np.ones(len(label), bool), label, rows), shape=(len(label), count)).tocsc()
    return by_label.indices, by_label.indptr


def numbered(label: NDArray[np.integer]) -> NDArray[np.int64]:
    """(…) the labels (…), which are not negative, numbered from 0 with none missing, in their order."""
    span = int(label.max(initial=-1)) + 1
    if span > COUNTED * len(label):
        return np.asarray(np.unique(label, return_inverse=True)[1].reshape(label.shape), np.int64)
    used = np.zeros(span, bool)
    used[label] = True
    return np.asarray((np.cumsum(used) - 1)[label], np.int64)


def kinds(label: NDArray[np.integer]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The labels (…), which are not negative, that there are, and the number (…) of each among these, as np.unique has them."""
    number = numbered(label)
    found = np.empty(int(number.max(initial=-1)) + 1, np.int64)
    found[number.reshape(-1)] = label.reshape(-1)
    return found, number


def not_alone(rows: NDArray[np.int64]) -> NDArray[np.int64]:
    """The rows (n, k) that have an equal one; few others, that only seem to have."""
    mixed = (rows.astype(np.uint64) * np.cumprod(np.full(rows.shape[1], SPREAD))).sum(axis=1)
    mixed ^= mixed >> np.uint64(29)
    order = np.argsort(mixed)
    same = mixed[order[1:]] == mixed[order[:-1]]
    alone = np.ones(len(rows), bool)
    alone[order[1:][same]] = alone[order[:-1][same]] = False
    return np.flatnonzero(~alone)


def runs(first: NDArray[np.int64], last: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The whole numbers from each first one up to each last one, less that, one run after the other: of which run, and they."""
    count = last - first
    owner = np.repeat(np.arange(len(count)), count)
    return owner, np.arange(len(owner)) + np.repeat(first - (np.cumsum(count) - count), count)


def distinct_rows(*columns: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """One row of each kind, in sorted order: its index (d,), the kind of each row (n,), rows of each kind (d,).

    columns (n,) each; many times faster than np.unique(axis=0).
    """
    order, fresh = _in_order(columns)
    kind = np.empty(len(order), np.int64)
    kind[order] = np.cumsum(fresh) - 1
    return order[fresh], kind, np.diff(np.append(np.flatnonzero(fresh), len(order)))


def _in_order(columns: tuple[NDArray[Any], ...]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Rows in sorted order, those that are alike as they are given, and whether each differs from the one before it (n,)."""
    count = len(columns[0])
    columns, spans = _packed(columns)
    if spans:
        counted = _counted(columns[-1], spans[-1])[0]
        for column, span in zip(columns[-2::-1], spans[-2::-1], strict=True):
            counted = counted[_counted(column[counted], span)[0]]
        order = counted.astype(np.int64)
    else:
        order = np.lexsort(columns[::-1])
    fresh = np.zeros(count, bool)
    fresh[:1] = True
    for column in columns:
        in_order = column[order]
        fresh[1:] |= in_order[1:] != in_order[:-1]
    return order, fresh


def _packed(columns: tuple[NDArray[Any], ...]) -> tuple[tuple[NDArray[Any], ...], list[int]]:
    """Columns in few of the same order; of whole numbers from 0, how many each may hold, if they are sorted fast by counting."""
    count = len(columns[0])
    if not count or any(column.dtype.kind not in "biu" for column in columns):
        return columns, []
    least = [int(column.min()) for column in columns]
    spans = [int(column.max()) - low + 1 for column, low in zip(columns, least, strict=True)]
    counted = count >= FEW and max(spans) <= COUNTED * count
    most = COUNTED * count if counted else (1 << 63) - 1
    if max(map(abs, least)) >= 1 << 62 or (not counted and math.prod(spans) > most):
        return columns, []
    keys: list[NDArray[Any]] = []
    sizes: list[int] = []
    for column, low, span in zip(columns, least, spans, strict=True):
        key = column - low if counted and column.dtype == np.int32 else column.astype(np.int64) - low
        key = key.astype(np.int32) if most < np.iinfo(np.int32).max else key
        if keys and sizes[-1] * span <= most:
            keys[-1] = keys[-1] * span + key
            sizes[-1] *= span
        else:
            keys.append(key)
            sizes.append(span)
    return tuple(keys), sizes if counted else []


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of triangles. Half-edge 3 m + k runs from corner k to k + 1 of triangle m. edge (3 m,): the number of its edge,
    by the lower and then by the higher of its corners; order (3 m,): the half-edges of one edge after those of another, of edge e
    from first[e] up to first[e + 1]."""

    edge: NDArray[np.int64]
    order: NDArray[np.int64]
    first: NDArray[np.int64]

    @staticmethod
    def of(triangles: I32) -> Edges:
        start, end = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
        order, fresh = _in_order((np.minimum(start, end), np.maximum(start, end)))
        edge = np.empty(len(order), np.int64)
        edge[order] = np.cumsum(fresh) - 1
        return Edges(edge, order, np.append(np.flatnonzero(fresh), len(order)))

    @property
    def uses(self) -> NDArray[np.int64]:
        """(edges,) how many half-edges each has."""
        return np.diff(self.first)

    def pairs(self, shift: int = 1) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Half-edges of one edge so far apart in ``order``, the earlier ones and the later ones."""
        in_order = self.edge[self.order]
        at = np.flatnonzero(in_order[shift:] == in_order[:-shift])
        return self.order[at], self.order[at + shift]


def totals(label: NDArray[np.integer], values: F64, count: int) -> F64:
    """Sums of values (n,) or (n, k) over each label in [0, count): (count,) or (count, k)."""
    if values.ndim == 1:
        return np.bincount(label, values, count).astype(np.float64)
    return np.stack([np.bincount(label, column, count) for column in values.T], axis=1).astype(np.float64)


@dataclass(frozen=True, eq=False)
class Welded:
    """A scene's triangles with corners that coincide made one: points (n, 3) [m], corners (m, 3) into them, and their edges."""

    points: F64
    corners: I32
    edges: Edges

    @staticmethod
    def of(scene: Scene) -> Welded:
        points, corners = weld(scene)
        return Welded(points, corners, Edges.of(corners))


def weld(scene: Scene) -> tuple[F64, I32]:
    """Join vertices that coincide: points (n, 3) [m] and the corner indices (m, 3) of the triangles into them."""
    used = scene.used
    vertices = scene.positions[used]
    order = _by_place(vertices)
    places = vertices[order]
    fresh = np.append(True, (places[1:] != places[:-1]).any(1))
    kind = np.empty(len(order), np.int64)
    kind[order] = np.cumsum(fresh) - 1
    points = places[fresh]
    count, label = groups_of(len(points), _pairs_within(points, WELD * scene_size(scene)))
    first = np.zeros(count, np.int64)
    first[label[::-1]] = np.arange(len(points))[::-1]
    return points[first], label[kind[np.cumsum(used)[scene.triangles] - 1]].astype(np.int32)


def _by_place(points: F64) -> NDArray[np.int64]:
    """(n,) points (n, 3) in the order of x, then y, then z, those that coincide as they are given."""
    order = np.argsort(points[:, 0])
    x = points[order, 0]
    same = x[1:] == x[:-1]
    tied = np.flatnonzero(np.append(same, False) | np.append(False, same))
    rows = np.sort(order[tied])
    order[tied] = rows[np.lexsort(points[rows].T[::-1])]
    return order


def _pairs_within(points: F64, reach: float) -> NDArray[np.int64]:
    """Pairs (p, 2) of points (n, 3), which are in the order of x, that are no farther apart. Most are alone along an axis."""
    some = np.arange(len(points))
    run = np.zeros(len(points), np.int64)
    for axis in range(3):
        if axis:
            order = np.lexsort((points[some, axis], run))
            some, run = some[order], run[order]
        near = (np.diff(points[some, axis]) <= reach * (1 + 1e-9)) & (run[1:] == run[:-1])
        run = np.cumsum(np.append(True, ~near)[: len(some)])
        kept = np.append(near, False)[: len(some)] | np.append(False, near)[: len(some)]
        some, run = some[kept], run[kept]
    pairs = cKDTree(points[some]).query_pairs(reach, output_type="ndarray") if len(some) else np.empty((0, 2), np.int64)
    return np.asarray(some[pairs], np.int64)


def groups_of(count: int, pairs: NDArray[np.int64]) -> tuple[int, NDArray[np.int64]]:
    """How many groups so many things form that pairs (p, 2) join, and the number of that of each (count,)."""
    graph = coo_array((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    number, label = connected_components(graph, directed=False)
    return int(number), label.astype(np.int64)
