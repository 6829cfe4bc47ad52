"""The triangles of a scene as they are drawn: divided at T-junctions, corners shared, and where there are many, cut by place into
clusters.

Clusters that a view does not see are left out, and the others come from near to far, so that what is hidden costs no shading.
Where two faces lie in one plane, a depth test shows the one that was drawn first: triangles that overlap another one of their
plane come before all others, in the scene's order. So no picture depends on the order of clusters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts, corner_places
from app.atlas.sides import distinct_rows, least, middle, most, not_alone
from app.atlas.t_junctions import Divided, Floats, at_corners, without_t_junctions
from app.scene.model import F32, F64, I32, Scene

Array = NDArray[np.generic]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

CLUSTERED = 4096  # triangles from which on clusters pay
CLUSTER = 128  # triangles
MORTON_BITS = 10  # along each axis
SAME_PLANE = 1e-4  # of the normal and, in the solver space, of the distance: below that, planes are compared as one
TOUCHING = 1e-6  # solver space: what overlaps by no more only shares an edge, to single precision
COMPARED = 512  # neighbours in its plane with which a triangle is compared, at most
BLOCK = 1 << 12  # triangles that are compared at once
SPACE = 4.0  # more than the solver space is wide, 2

VERTEX = np.dtype([("in_position", "f4", 3), ("in_uv_front", "f4", 2), ("in_uv_back", "f4", 2), ("in_material", "u4")])
VERTEX_FORMAT = {"in_position": "3f", "in_uv_front": "2f", "in_uv_back": "2f", "in_material": "1u"}


@dataclass(frozen=True, eq=False)
class Clusters:
    """Runs of triangles.

    lower, upper (k, 3): corners of their boxes, solver space; first (k + 1,): the first triangle of each, and their
    number; fixed: that many are drawn before the others, in this order.
    """

    lower: F64
    upper: F64
    first: Ints
    fixed: int

    def seen(self, clip_from_local: F64) -> Ints:
        """Those that a view (4, 4) may see, in drawing order: the fixed ones, then the others from near to far."""
        x, y, _, w = clip_from_local
        # Neither near nor far plane: what lies beyond them is drawn at them, see render/frame.py
        sides = np.stack([w + x, w - x, w + y, w - y])
        middle, half = (self.lower + self.upper) / 2, (self.upper - self.lower) / 2
        inside = (middle @ sides[:, :3].T + sides[:, 3] + half @ np.abs(sides[:, :3].T) >= 0).all(1)
        eye = np.linalg.solve(np.stack([x, y, w])[:, :3], -np.array([x[3], y[3], w[3]]))
        away = np.linalg.norm(middle - eye, axis=1)
        away[: self.fixed] = -1.0
        order = np.argsort(away, kind="stable")
        return np.asarray(order[inside[order]])

    def triangles(self, order: Ints) -> Ints:
        """The triangles of these, one run after another."""
        count = self.first[order + 1] - self.first[order]
        end = np.cumsum(count)
        return np.asarray(np.arange(count.sum()) + np.repeat(self.first[order] - end + count, count))


@dataclass(frozen=True, eq=False)
class VisibleMesh:
    """vertices: (v,) VERTEX; corners: (n, 3) u32, its rows the triangles in drawing order; triangle: (n,) of the scene, of which
    each row is one or a part; weights (n, 3, 3): of that one's corners at each corner of the row, None where none was divided;
    clusters: None where there are few triangles."""

    vertices: Array
    corners: NDArray[np.uint32]
    triangle: Ints
    weights: F64 | None
    clusters: Clusters | None

    def rows_of(self, triangles: Ints) -> tuple[Ints, Ints]:
        """The rows of some triangles of the scene, in their order; and the place of the triangle of each among these."""
        order = np.argsort(self.triangle, kind="stable")
        begin, end = (np.searchsorted(self.triangle[order], triangles, side) for side in ("left", "right"))
        which = np.repeat(np.arange(len(triangles)), end - begin)
        nth = np.arange(len(which)) - np.repeat(np.cumsum(end - begin) - (end - begin), end - begin)
        return order[begin[which] + nth], which

    def at_corners(self, rows: Ints, values: Floats) -> Floats:
        """(k, 3, c) of values (triangles, 3, c) at corners of the scene's triangles, at those of rows (k,)."""
        return at_corners(values[self.triangle[rows]], None if self.weights is None else self.weights[rows])


@dataclass(frozen=True, eq=False)
class Drawn:
    """What is drawn of a scene's triangles, wherever their texels are: they, or parts of them, with corners at points (p, 3), in
    clusters where they are many, whose triangles are those of ``order`` one after another."""

    triangles: Divided
    points: F32
    order: Ints | None
    clusters: Clusters | None

    @staticmethod
    def of(local: F64, triangles: I32) -> Drawn:
        """local (positions, 3): solver space; triangles (m, 3) of these."""
        divided, places = _divided(local, triangles)
        count = len(divided.corners)
        if count < CLUSTERED:
            return Drawn(divided, places, None, None)
        points = places[divided.corners].astype(np.float64)
        fixed = _overlaps_in_plane(points)
        cluster = np.empty(count, np.int64)
        for mine, order in ((fixed, np.arange(fixed.sum())), (~fixed, _morton_order(middle(points[~fixed])))):
            cluster[np.flatnonzero(mine)[order]] = np.arange(len(order)) // CLUSTER
        order = np.lexsort((cluster, ~fixed))  # stable: within a cluster in the scene's order
        of, is_fixed = cluster[order], fixed[order]
        first = np.flatnonzero(np.r_[True, (of[1:] != of[:-1]) | (is_fixed[1:] != is_fixed[:-1])])
        clusters = Clusters(
            lower=np.minimum.reduceat(least(points)[order], first),
            upper=np.maximum.reduceat(most(points)[order], first),
            first=np.r_[first, count],
            fixed=int(is_fixed[first].sum()),
        )
        return Drawn(divided, places, order, clusters)


def visible_mesh(scene: Scene, charts: Charts, local: F64, drawn: Drawn | None = None) -> VisibleMesh:
    """local (positions, 3): of the scene, solver space; drawn: of these, if it is known."""
    drawn = drawn or Drawn.of(local, scene.triangles)
    divided, order, clusters = drawn.triangles, drawn.order, drawn.clusters
    vertices, corners = _shared_vertices(scene, charts, drawn.points, divided)
    parent, weights = divided.parent, divided.weights
    if order is not None:
        corners, parent, weights = corners[order], parent[order], None if weights is None else weights[order]
    return VisibleMesh(vertices, corners, parent, weights, clusters)


def coarse_mesh(scene: Scene, charts: Charts, local: F64) -> VisibleMesh:
    """The same for coarse texels, which are not there for long: in no clusters, and divided nowhere."""
    whole = Divided(np.arange(len(scene.triangles)), scene.triangles.astype(np.int64), None)
    vertices, corners = _shared_vertices(scene, charts, local.astype(np.float32), whole)
    return VisibleMesh(vertices, corners, whole.parent, None, None)


def _divided(local: F64, triangles: I32) -> tuple[Divided, F32]:
    """Triangles of places (n, 3) divided at T-junctions; where the points are that their corners are, as the GPU holds them."""
    rounded = local.astype(np.float32)
    example, number, _ = distinct_rows(*rounded.T)
    points = rounded[example]
    return without_t_junctions(points.astype(np.float64), number[triangles]), points


def _shared_vertices(scene: Scene, charts: Charts, points: F32, divided: Divided) -> tuple[Array, NDArray[np.uint32]]:
    """One vertex for all corners that are alike: position, atlas texel of front and back, -1 without a chart, material."""
    data = np.zeros((len(divided.parent), 3), VERTEX)
    data["in_position"] = points[divided.corners]
    places = at_corners(corner_places(charts, len(scene.triangles))[divided.parent], divided.weights)
    data["in_uv_front"], data["in_uv_back"] = places[..., :2], places[..., 2:]
    data["in_material"] = scene.material_ids[divided.parent, None]
    flat = data.reshape(-1)
    columns: list[NDArray[Any]] = [np.repeat(data["in_material"][:, 0], 3), divided.corners.reshape(-1)]
    for uv in ("in_uv_front", "in_uv_back"):
        pairs = np.ascontiguousarray(flat[uv]).view(np.int64).reshape(-1)
        if (pairs != pairs[0]).any():
            columns.append(np.unique(pairs, return_inverse=True)[1])
    example, number, _ = distinct_rows(*columns)
    return flat[example], number.reshape(-1, 3).astype(np.uint32)


def _morton_order(centres: F64) -> Ints:
    """(n, 3) points along a Z-curve through their cube."""
    if not len(centres):
        return np.zeros(0, np.int64)
    lower, extent = centres.min(0), float(np.ptp(centres, axis=0).max())
    cells = ((centres - lower) / max(extent, 1e-300) * (2**MORTON_BITS - 1)).astype(np.int64)
    code = np.zeros(len(centres), np.int64)
    for bit in range(MORTON_BITS):
        for axis in range(3):
            code |= (cells[:, axis] >> bit & 1) << (3 * bit + axis)
    return np.asarray(np.argsort(code, kind="stable"))


def _overlaps_in_plane(points: F64) -> Mask:
    """Whether a triangle (points (n, 3, 3)) overlaps another one of its plane, or has more neighbours than are compared."""
    found, row = np.zeros(len(points), bool), np.arange(len(points))
    normal = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    steep = (np.abs(normal) > 0.5).argmax(1)  # an axis that the plane is not parallel to: a unit vector has such
    normal *= np.sign(normal[row, steep])[:, None]  # either winding
    plane = np.concatenate([normal, (normal * middle(points)).sum(1, keepdims=True)], 1)
    across = (steep[:, None] + [1, 2]) % 3
    flat = np.take_along_axis(points, across[:, None], 2)  # (n, 3, 2), seen along that axis
    (u0, v0), (u1, v1) = (least(flat) + TOUCHING).T, (most(flat) - TOUCHING).T
    for shift in (0.0, 0.5):  # or rounding would part equal planes
        rounded = np.floor(plane / SAME_PLANE + shift).astype(np.int64)
        mine = not_alone(rounded)  # few on curved surfaces
        of = distinct_rows(*rounded[mine].T)[1]
        count, sorted_by_u = len(mine), np.lexsort((u0[mine], of))
        order = mine[sorted_by_u]
        along = SPACE * of[sorted_by_u]  # each plane has its own stretch of numbers
        beyond = np.searchsorted(along + u0[order], along + u1[order])
        ahead = np.maximum(beyond - np.arange(count) - 1, 0)
        found[order[ahead > COMPARED]] = True
        ahead = np.minimum(ahead, COMPARED)
        ends = np.cumsum(ahead)
        for first in range(0, count, BLOCK):
            some = np.arange(first, min(first + BLOCK, count))
            nth = np.repeat(some, ahead[some])
            start = ends[some] - ahead[some]
            a, b = order[nth], order[nth + 1 + np.arange(len(nth)) - np.repeat(start - start[0], ahead[some])]
            boxes = (v0[a] < v1[b]) & (v0[b] < v1[a])
            a, b = a[boxes], b[boxes]
            hit = ~_apart(flat[a], flat[b])
            found[a[hit]] = found[b[hit]] = True
    return found


def _apart(a: F64, b: F64) -> Mask:
    """Whether pairs of triangles (m, 3, 2) have an edge, of either, with one on this side and the other on that."""
    apart = np.zeros(len(a), bool)
    for one, other in ((a, b), (b, a)):
        edge = np.roll(one, -1, 1) - one
        across = np.stack([-edge[..., 1], edge[..., 0]], -1)
        across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-300)
        mine, others = (np.einsum("mei,mki->mek", across, triangle) for triangle in (one, other))
        apart |= (others.min(-1) > mine.max(-1) - TOUCHING).any(1) | (others.max(-1) < mine.min(-1) + TOUCHING).any(1)
    return apart
