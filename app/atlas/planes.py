"""Flat pieces of triangles with their planes: which may lie on each other, and which end bodies.

Most of many triangles are parts of curved surfaces, in whose planes lies nothing else: all that takes long is asked for the few
others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.sides import FLAT, FLAT_ANGLE, SPREAD, Edges, groups_of, least, middle, most, rows_by, runs, scene_size
from app.scene.model import F64, I32, Scene

MOST_CORNERS = 256  # of a loop that a cap closes: its triangles all meet in one corner
BLOCK = 1 << 14  # facets whose neighbours are looked at at once
CELL = 8  # times FLAT_ANGLE: width of the cells of normals in which planes are told apart
HEIGHT_BITS = 24  # of a key, for the distance of a plane from the origin
# three axes at right angles, of which no model has edges or planes along the last
GENERIC = np.linalg.qr(np.array([[0.5319, 0.3, 0.1], [0.7023, 0.1, 0.4], [0.4733, 0.8, 0.2]]))[0][:, ::-1]

I64 = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Members:
    """The rows that bear each of some labels: of label k, ``order`` from ``first[k]`` up to ``first[k + 1]``."""

    order: I64
    first: I64

    @staticmethod
    def of(label: I64 | I32) -> Members:
        """label (n,): from 0, none missing."""
        return Members(*rows_by(label, int(label.max(initial=-1)) + 1))

    def __getitem__(self, label: int) -> I64:
        return self.order[self.first[label] : self.first[label + 1]]

    def only(self, labels: I64) -> Members:
        """Those of some labels (k,), which are then the labels 0 to k - 1."""
        owner, at = runs(self.first[labels], self.first[labels + 1])
        return Members(self.order[at], np.append(0, np.cumsum(np.bincount(owner, minlength=len(labels)))))


@dataclass(frozen=True, eq=False)
class Facets:
    """Some flat pieces of triangles, those of the scene first. number (n,): of each among all; corners (m, 3, 3) of all
    triangles; members: triangles of each facet; normal, point (n, 3): their planes; least, most (n, 3): boxes around them; depth
    (n,): see ``Planes.depths``; scene: how many are the scene's."""

    number: I64
    corners: F64
    members: Members
    normal: F64
    point: F64
    least: F64
    most: F64
    depth: F64
    scene: int


@dataclass(frozen=True, eq=False)
class Planes:
    """All flat pieces of triangles, those of the scene first. corners (m, 3, 3), edges, facet (m,): of the triangles; members:
    triangles of each facet, the largest first; normal, point (n, 3): its plane; scene: how many are the scene's; flat: distance
    from a plane that still counts as on it."""

    corners: F64
    edges: Edges
    facet: I64
    members: Members
    normal: F64
    point: F64
    scene: int
    flat: float

    @staticmethod
    def of_scene(scene: Scene, points: F64, triangles: I32, facet: I32, edges: Edges) -> Planes:
        """points (n, 3), triangles (m, 3): welded; facet (m,), edges of them."""
        return Planes.of(points - points.min(0), triangles, facet, scene.sides, FLAT * scene_size(scene), edges)

    @staticmethod
    def of(points: F64, triangles: I32, facet: I32, double_sided: Mask, flat: float, edges: Edges) -> Planes:
        """points (n, 3), triangles (m, 3), facet (m,), whether their material has two sides (m,)."""
        count = int(facet.max(initial=-1)) + 1
        caps, cap = _caps(points, triangles, facet, double_sided, flat, edges)
        owner = facet.astype(np.int64)
        if len(caps):
            triangles, owner = np.concatenate([triangles, caps]), np.append(owner, count + cap.astype(np.int64))
            edges = Edges.of(triangles)
        corners = points[triangles]
        normals, area = _normals_areas(corners)
        members = Members.of(owner)
        many = np.flatnonzero(np.diff(members.first)[owner[members.order]] > 1)
        rows = np.sort(members.order[many])
        members.order[many] = rows[np.lexsort((-area[rows], owner[rows]))]
        largest = members.order[members.first[:-1]]
        return Planes(corners, edges, owner, members, normals[largest], corners[largest, 0], count, flat)

    def only(self, some: I64) -> Facets:
        """Those of some numbers (k,), in order."""
        members = self.members.only(some)
        corners = self.corners[members.order]
        return Facets(
            some,
            self.corners,
            members,
            self.normal[some],
            self.point[some],
            np.minimum.reduceat(least(corners), members.first[:-1]) if len(some) else np.empty((0, 3)),
            np.maximum.reduceat(most(corners), members.first[:-1]) if len(some) else np.empty((0, 3)),
            self.depths(some),
            int(np.count_nonzero(some < self.scene)),
        )

    def near(self, within: float, own: I64 | None = None) -> I64:
        """The facets in whose planes, either way round and no more than ``within`` before or behind, another one may be, one of
        ``own`` (k,) if they are given; few others, that only seem to be."""
        seen = self.normal @ GENERIC
        turned = np.where(seen[:, 2] < 0, -1.0, 1.0)[:, None]
        place = turned * seen[:, :2] / FLAT_ANGLE / CELL
        height = turned[:, 0] * np.einsum("nk,nk->n", self.normal, self.point) / within
        height = np.floor(height / (1 + 1e-6)).astype(np.int64)
        height -= height.min(initial=0)
        # in each cell that the plane may share with another one; those seen edgewise may be turned either way
        reach = (1 + 1e-6) / CELL / 2
        lower, upper = np.floor(place - reach).astype(np.int64), np.floor(place + reach).astype(np.int64)
        keys, facets = [], []
        for corner in np.ndindex(2, 2):
            cell = np.where(corner, upper, lower)
            mine = np.flatnonzero((np.array(corner) <= upper - lower).all(1))
            mixed = (cell[mine].astype(np.uint64) * np.cumprod(np.full(2, SPREAD))).sum(1)
            mixed = (mixed ^ (mixed >> np.uint64(29))) * SPREAD >> np.uint64(HEIGHT_BITS + 1) << np.uint64(HEIGHT_BITS)
            keys.append(mixed.astype(np.int64) + height[mine])
            facets.append(mine)
        key, facet = np.concatenate(keys), np.concatenate(facets)
        order = np.argsort(key)
        key, facet = key[order], facet[order]
        asked = np.ones(len(self.normal), bool)
        if own is not None:
            asked = np.zeros(len(self.normal), bool)
            asked[own] = True
        before = np.maximum.accumulate(np.where(asked[facet], key, -2))
        after = np.minimum.accumulate(np.where(asked[facet], key, np.iinfo(np.int64).max)[::-1])[::-1]
        found = np.abs(seen[:, 2]) <= 2 * FLAT_ANGLE
        found[facet[1:][key[1:] - before[:-1] <= 1]] = True
        found[facet[:-1][after[1:] - key[:-1] <= 1]] = True
        return np.flatnonzero(found)

    def depths(self, some: I64) -> F64:
        """(k,) how far a body reaches behind each of some facets (k,) that ends one, next to it: triangles that meet it in an
        edge are all behind and face away. 0 where it ends none."""
        deep, wrong = np.zeros(len(some)), np.zeros(len(some), bool)
        for first in range(0, len(some), BLOCK):
            members = self.members.only(some[first : first + BLOCK])
            triangle = np.repeat(np.arange(len(members.order)), 3)
            edge = self.edges.edge[(3 * members.order[:, None] + np.arange(3)).reshape(-1)]
            half, at = runs(self.edges.first[edge], self.edges.first[edge + 1])
            mine, other = triangle[half], self.edges.order[at] // 3
            apart = self.facet[members.order[mine]] != self.facet[other]
            mine, other = mine[apart], other[apart]
            one, owner = (
                members.order[mine],
                first + np.repeat(np.arange(len(members.first) - 1), np.diff(members.first))[mine],
            )
            up, theirs = _normals_areas(self.corners[one])[0], _normals_areas(self.corners[other])[0]
            heights = np.einsum("pck,pk->pc", self.corners[other] - self.corners[one, :1], up)
            away = np.einsum("pk,pk->p", middle(self.corners[other]) - middle(self.corners[one]), theirs) > 0
            aside = np.abs(heights).max(1) > self.flat
            wrong[owner[(heights.max(1) > self.flat) | (aside & ~away)]] = True
            np.maximum.at(deep, owner, -heights.min(1))
        deep[wrong] = 0.0
        return deep


def _normals_areas(corners: F64) -> tuple[F64, F64]:
    """Of triangles (n, 3, 3): their unit normals (n, 3), and twice their areas (n,)."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(normals, axis=1)
    return normals / np.maximum(doubled, np.finfo(float).tiny)[:, None], doubled


def _caps(points: F64, triangles: I32, facet: I32, double_sided: Mask, flat: float, edges: Edges) -> tuple[I32, I32]:
    """(c, 3) triangles that would close bodies which lack a bottom and nothing else, each a fan in a loop of open edges, flat and
    convex; the number of each loop (c,). What has two sides may be looked into."""
    alone = edges.uses[edges.edge] == 1
    if not alone.any():
        return np.empty((0, 3), np.int32), np.empty(0, np.int32)
    body = np.repeat(_bodies(facet, edges), 3)  # of each half-edge
    open_edges, two = np.bincount(body, alone), np.bincount(body, np.repeat(double_sided, 3)) > 0
    alone &= (open_edges[body] <= MOST_CORNERS) & ~two[body]
    start, end = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    at, to = (zip(body[alone].tolist(), ends[alone].tolist(), strict=True) for ends in (end, start))
    follows = dict(zip(at, to, strict=True))  # a cap turns the other way round
    caps = []
    while follows:
        first, after = follows.popitem()
        loop = [first]
        while after != first and after in follows:
            loop.append(after)
            after = follows.pop(after)
        corners = [corner for _, corner in loop]
        whole = after == first and len(loop) == open_edges[first[0]] > 2
        if whole and _flat_and_convex(points[corners], flat):
            caps.append(np.array([(corners[0], *corners[k : k + 2]) for k in range(1, len(loop) - 1)], np.int32))
    loops = np.repeat(np.arange(len(caps)), [len(fan) for fan in caps]).astype(np.int32)
    return np.concatenate([np.empty((0, 3), np.int32), *caps]), loops


def _bodies(facet: I32, edges: Edges) -> I64:
    """(m,) the number of the body of each triangle: what shares an edge, two and no more, or a facet. Where bodies pierce each
    other both are cut, and have that edge in common."""
    two, crowded = edges.first[:-1][edges.uses == 2], np.flatnonzero(edges.uses[edges.edge] > 2) // 3
    _, first, which = np.unique(facet[crowded], return_index=True, return_inverse=True)
    pairs = np.stack([edges.order[two] // 3, edges.order[two + 1] // 3], axis=1)
    return groups_of(len(facet), np.concatenate([pairs, np.stack([crowded, crowded[first][which]], axis=1)]))[1]


def _flat_and_convex(loop: F64, flat: float) -> bool:
    """Of a polygon (n, 3)."""
    edge = np.roll(loop, -1, axis=0) - loop
    turns = np.cross(edge, np.roll(edge, -1, axis=0))
    normal = turns.sum(0) / max(float(np.linalg.norm(turns.sum(0))), np.finfo(float).tiny)
    return bool((np.abs((loop - loop[0]) @ normal) <= flat).all() and (turns @ normal >= -flat * flat).all())
