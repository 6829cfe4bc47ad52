"""What lies on a surface and hides it: a box on a floor, one box on another.

Under it no light comes and nobody looks, but texels that it hides in part would be as dark as their hidden share, and spread
that around the foot of what stands there. So such pieces of surface are no part of any texel.

A facet c hides a side f where it lies a little before the plane of f: a lamp under a ceiling, a rug. Where it lies in that
plane, c, or what would close a body without a bottom, must face against f and bound a body that rises in front of f: all
triangles that meet c in a corner lie behind c, and face away from it. A wall without thickness between two rooms has theirs in
front of it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.spatial import cKDTree

from app.atlas.sides import FLAT, FLAT_ANGLE, facets, scene_size, weld
from app.scene.model import F64, I32, Scene

GAP = 0.05  # of a texel: what is no farther from a surface lies on it
LEAST = 1e-9  # of a face, that a piece is: less is rounding
MOST_NEAR = 4096  # pieces in one plane, of those that are not one: their pairs would take too long
SHARED = 1e-3  # of a piece, that another may hide too


def hidden_pieces(
    scene: Scene,
    points: F64,
    triangles: I32,
    facet: I32,
    face_triangle: I32,
    face_back: NDArray[np.bool_],
    face_uv: F64,
    density: float,
) -> tuple[F64, NDArray[np.int64]]:
    """Pieces of faces that something lies on: their corners (k, 3, 2) in the atlas [texels], and the face of each (k,).

    points (n, 3), triangles (m, 3): welded; facet (m,) of them; face_triangle (f,), face_back (f,), face_uv (f, 3, 2): sides in
    the atlas; density [texels/m]."""
    size = scene_size(scene)
    within, points = max(GAP / density, FLAT * size), points - points.min(0)
    caps, cap = _caps(points, triangles, FLAT * size)
    count = int(facet.max(initial=-1)) + 1
    triangles, facet = np.concatenate([triangles, caps]), np.append(facet, count + cap)
    corners = points[triangles]
    normals = np.concatenate([scene.normals_areas[0], _normals(points[caps])])
    flats = _Flats.of(corners, facet)
    ends = np.flatnonzero(
        _thickness(corners, triangles, facet, normals, FLAT * size) > 2 * within
    )  # else of one thin body
    sheets = np.arange(count)
    lids, body = np.concatenate([ends, sheets, sheets]), np.arange(len(ends) + 2 * count) < len(ends)
    normal, point = normals[flats.largest], corners[flats.largest, 0]
    down = np.concatenate([-normal[ends], normal[sheets], -normal[sheets]])
    sides, side = np.unique(2 * facet[face_triangle].astype(np.int64) + face_back, return_inverse=True)
    own, up = sides // 2, normal[sides // 2] * np.where(sides % 2 == 1, -1.0, 1.0)[:, None]
    # planes as points (normal, height): angles in units of what is flat, distances in units of the gap
    units = np.array([FLAT_ANGLE, FLAT_ANGLE, FLAT_ANGLE, within])
    tree = cKDTree(np.column_stack([down, np.einsum("lk,lk->l", down, point[lids])]) / units)
    planes = np.column_stack([up, np.einsum("sk,sk->s", up, point[own])]) / units
    few = np.flatnonzero(tree.query_ball_point(planes, 1.0, return_length=True) <= MOST_NEAR)
    faces_of = np.split(np.argsort(side.reshape(-1), kind="stable"), np.cumsum(np.bincount(side.reshape(-1)))[:-1])
    pieces: list[F64] = []
    owners: list[int] = []
    for one, near in zip(few.tolist(), tree.query_ball_point(planes[few], 1.0), strict=True):
        mine, lid = own[one], lids[near]
        above = (point[lid] - point[mine]) @ up[one] > FLAT * size
        lid = np.unique(lid[(body[near] | above) & (lid != mine)])
        lid = lid[
            ((flats.least[lid] <= flats.most[mine] + within) & (flats.most[lid] >= flats.least[mine] - within)).all(1)
        ]
        others = np.concatenate([np.empty(0, np.int64), *(flats.members[k] for k in lid)])
        for face in faces_of[one].tolist() if len(others) else []:
            hidden = _hidden_of(corners[face_triangle[face]], corners[others], face_uv[face], within)
            pieces += hidden
            owners += [face] * len(hidden)
    return np.array(pieces).reshape(-1, 3, 2), np.array(owners, np.int64)


@dataclass(frozen=True, eq=False)
class _Flats:
    """Flat pieces of triangles: members of each, the largest of them (n,), and the box around them, least and most (n, 3)."""

    members: list[NDArray[np.int64]]
    largest: NDArray[np.int64]
    least: F64
    most: F64

    @staticmethod
    def of(corners: F64, facet: I32) -> _Flats:
        """corners (m, 3, 3), facet (m,): every number from 0 occurs."""
        edges = corners[:, 1:] - corners[:, :1]
        area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
        order = np.lexsort((-area, facet))
        members = np.split(order, np.flatnonzero(np.diff(facet[order])) + 1)
        first = np.flatnonzero(np.diff(facet[order], prepend=-1))
        least = np.minimum.reduceat(corners[order].min(1), first)
        return _Flats(members, order[first], least, np.maximum.reduceat(corners[order].max(1), first))


def _hidden_of(corners: F64, others: F64, uv: F64, within: float) -> list[F64]:
    """What triangles (n, 3, 3) [m] hide of a face, corners (3, 3) [m] at uv (3, 2): triangles (3, 2)."""
    near = (others.min(1) <= corners.max(0) + within).all(1) & (others.max(1) >= corners.min(0) - within).all(1)
    hidden: list[F64] = []
    for polygon in _on_face(corners, others[near], uv):
        piece = _clip(polygon, uv)
        if len(piece) > 2 and _area(piece) > LEAST * _area(list(uv)) and not _overlaps(piece, hidden):
            hidden += [np.array((piece[0], piece[k], piece[k + 1])) for k in range(1, len(piece) - 1)]
    return hidden


def _overlaps(polygon: list[F64], others: list[F64]) -> bool:
    """Whether a convex polygon shares more than an edge with any of some triangles: what lies on that is hidden already."""
    if not others:
        return False
    corners = np.array(others)
    meets = ((corners.min(1) < np.max(polygon, axis=0)) & (corners.max(1) > np.min(polygon, axis=0))).all(1)
    return any(_area(_clip(np.array(polygon), triangle)) > SHARED * _area(polygon) for triangle in corners[meets])


def _area(polygon: list[F64]) -> float:
    """Of a convex one."""
    x, y = np.array(polygon).reshape(-1, 2).T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)


def hidden_points(scene: Scene, triangle: I32, back: NDArray[np.bool_], weights: F64) -> NDArray[np.bool_]:
    """(n,) whether something lies on points of sides: triangle and whether its back (n,), weights (n, 3) of its corners."""
    points, corners = weld(scene)
    sides, side = np.unique(2 * triangle.astype(np.int64) + back, return_inverse=True)
    own = np.tile(np.eye(3)[:, 1:], (len(sides), 1, 1))  # of each side, the weights of its second and third corner
    facet = facets(points, corners, scene.material_ids, scene_size(scene))
    at = (sides // 2).astype(np.int32), sides % 2 == 1, own
    pieces, owner = hidden_pieces(scene, points, corners, facet, *at, math.inf)
    hidden = np.zeros(len(triangle), bool)
    for piece, one in zip(pieces, owner.tolist(), strict=True):
        mine = np.flatnonzero(side.reshape(-1) == one)
        from_corners = weights[mine, None, 1:] - piece
        edge = np.roll(piece, -1, axis=0) - piece
        turns = edge[:, 0] * from_corners[..., 1] - edge[:, 1] * from_corners[..., 0]
        hidden[mine] |= (turns >= 0).all(1) | (turns <= 0).all(1)
    return hidden


def _thickness(corners: F64, triangles: I32, facet: I32, normals: F64, flat: float) -> F64:
    """(facets,) how far a body reaches behind each facet that ends one, next to it: triangles that meet it in a corner are all
    behind and face away. 0 where it ends none."""
    count = len(triangles)
    has = coo_array((np.ones(3 * count, bool), (np.repeat(np.arange(count), 3), triangles.reshape(-1)))).tocsr()
    one, other = (has @ has.T).nonzero()
    heights = np.einsum("pck,pk->pc", corners[other] - corners[one, :1], normals[one])
    centre = corners.mean(1)
    away = np.einsum("pk,pk->p", centre[other] - centre[one], normals[other]) > 0
    aside = np.abs(heights).max(1) > flat
    wrong = (heights.max(1) > flat) | (aside & ~away)
    deep = np.zeros(int(facet.max(initial=-1)) + 1)
    np.maximum.at(deep, facet[one], -heights.min(1))
    deep[facet[one[wrong]]] = 0.0
    return deep


def _caps(points: F64, triangles: I32, flat: float) -> tuple[I32, I32]:
    """(c, 3) triangles that would close bodies which have no bottom, each a fan in a loop of open edges, flat and convex; the
    number of each loop (c,)."""
    start, end = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    used = np.sort(np.stack([start, end], 1), axis=1)
    _, which, uses = np.unique(used, axis=0, return_inverse=True, return_counts=True)
    alone = uses[which.reshape(-1)] == 1
    follows = dict(zip(end[alone].tolist(), start[alone].tolist(), strict=True))  # a cap turns the other way round
    if len(follows) < np.count_nonzero(alone):  # loops that meet in a corner are no loops
        corner, times = np.unique(end[alone], return_counts=True)
        for one in corner[times > 1].tolist():
            del follows[one]
    caps = []
    while follows:
        first, after = follows.popitem()
        loop = [first]
        while after != first and after in follows:
            loop.append(after)
            after = follows.pop(after)
        fan = np.array([(loop[0], loop[k], loop[k + 1]) for k in range(1, len(loop) - 1)], np.int32).reshape(-1, 3)
        if after == first and len(fan) and _flat_and_convex(points[loop], flat):
            caps.append(fan)
    loops = np.repeat(np.arange(len(caps)), [len(fan) for fan in caps]).astype(np.int32)
    return np.concatenate([np.empty((0, 3), np.int32), *caps]), loops


def _flat_and_convex(loop: F64, flat: float) -> bool:
    """Of a polygon (n, 3)."""
    edge = np.roll(loop, -1, axis=0) - loop
    turns = np.cross(edge, np.roll(edge, -1, axis=0))
    normal = turns.sum(0) / max(float(np.linalg.norm(turns.sum(0))), np.finfo(float).tiny)
    return bool((np.abs((loop - loop[0]) @ normal) <= flat).all() and (turns @ normal >= -flat * flat).all())


def _normals(corners: F64) -> F64:
    """(n, 3) of triangles (n, 3, 3)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny))


def _on_face(corners: F64, others: F64, uv: F64) -> F64:
    """Where triangles (n, 3, 3) lie in the atlas, by the map of a face, corners (3, 3) at uv (3, 2): (n, 3, 2)."""
    local_from_world = np.linalg.pinv((corners[1:] - corners[0]).T)
    return np.asarray(uv[0] + (others - corners[0]) @ local_from_world.T @ (uv[1:] - uv[0]))


def _clip(polygon: F64, triangle: F64) -> list[F64]:
    """A convex polygon (n, 2) inside a triangle (3, 2): its corners, none where they do not meet. [Sutherland74]"""
    (ux, uy), (vx, vy) = triangle[1] - triangle[0], triangle[2] - triangle[0]
    turn = np.sign(ux * vy - uy * vx)
    inside = list(polygon)
    for k in range(3):
        a, edge = triangle[k], triangle[(k + 1) % 3] - triangle[k]
        distance = [turn * (edge[0] * (p[1] - a[1]) - edge[1] * (p[0] - a[0])) for p in inside]
        kept: list[F64] = []
        for i, p in enumerate(inside):
            q, dp, dq = inside[i - 1], distance[i], distance[i - 1]
            if (dp < 0) != (dq < 0):
                kept.append(q + (p - q) * (dq / (dq - dp)))
            if dp >= 0:
                kept.append(p)
        inside = kept
    return inside
