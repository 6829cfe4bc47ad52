"""What lies on a surface and hides it: a box on a floor, one box on another.

Under it no light comes and nobody looks, but texels that it hides in part would be as dark as their hidden share, and spread
that around the foot of what stands there. So such pieces of surface are no part of any texel.

A triangle c, or one that would close a body without a bottom, hides a side f where it lies in the plane of f, faces against it,
and bounds a body that rises in front of f: all surfaces that meet c in a corner lie behind c, and face away from it. A wall
without thickness between two rooms has theirs in front of it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.spatial import cKDTree

from app.atlas.sides import FLAT, FLAT_ANGLE, facets, scene_size, weld
from app.scene.model import F64, I32, Scene

GAP = 0.05  # of a texel: what is no farther from a surface lies on it
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
    caps = _caps(points, triangles, FLAT * size)
    triangles, facet = np.concatenate([triangles, caps]), np.append(facet, np.full(len(caps), -1, np.int32))
    corners = points[triangles]
    normals = np.concatenate([scene.normals_areas[0], _normals(points[caps])])
    lids = np.flatnonzero(_thickness(corners, triangles, normals, FLAT * size) > 2 * within)  # else of one thin body
    if not len(lids):
        return np.empty((0, 3, 2)), np.empty(0, np.int64)
    towards = normals[face_triangle] * np.where(face_back, -1.0, 1.0)[:, None]
    height = np.einsum("fk,fk->f", towards, corners[face_triangle, 0])
    # planes as points (normal, height): angles in units of what is flat, distances in units of the gap
    units = np.array([FLAT_ANGLE, FLAT_ANGLE, FLAT_ANGLE, within])
    planes = np.column_stack([-normals, -np.einsum("mk,mk->m", normals, corners[:, 0])])[lids]
    near = cKDTree(planes / units).query_ball_point(np.column_stack([towards, height]) / units, 1.0)
    least, most = corners.min(1) - within, corners.max(1) + within
    pieces, owners = [], []
    for face in np.flatnonzero([len(some) > 0 for some in near]).tolist():
        f, lid = face_triangle[face], lids[near[face]]
        lid = lid[(facet[lid] != facet[f]) & (least[lid] <= most[f]).all(1) & (most[lid] >= least[f]).all(1)]
        mine: list[F64] = []
        for polygon in _on_face(corners[f], corners[lid], face_uv[face]):
            piece = _clip(polygon, face_uv[face])
            if len(piece) > 2 and not _overlaps(piece, mine):
                mine += [np.array((piece[0], piece[k], piece[k + 1])) for k in range(1, len(piece) - 1)]
        pieces += mine
        owners += [face] * len(mine)
    return np.array(pieces).reshape(-1, 3, 2), np.array(owners, np.int64)


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


def _thickness(corners: F64, triangles: I32, normals: F64, flat: float) -> F64:
    """(m,) how far a body reaches behind each triangle that ends one, next to it: triangles that meet it in a corner are all
    behind and face away. 0 where it ends none."""
    count = len(triangles)
    has = coo_array((np.ones(3 * count, bool), (np.repeat(np.arange(count), 3), triangles.reshape(-1)))).tocsr()
    one, other = (has @ has.T).nonzero()
    heights = np.einsum("pck,pk->pc", corners[other] - corners[one, :1], normals[one])
    centre = corners.mean(1)
    away = np.einsum("pk,pk->p", centre[other] - centre[one], normals[other]) > 0
    aside = np.abs(heights).max(1) > flat
    wrong = (heights.max(1) > flat) | (aside & ~away)
    deep = np.zeros(count)
    np.maximum.at(deep, one, -heights.min(1))
    return np.where(np.bincount(one, wrong, count) == 0, deep, 0.0)


def _caps(points: F64, triangles: I32, flat: float) -> I32:
    """(c, 3) triangles that would close bodies which have no bottom: each a fan in a loop of open edges, flat and convex."""
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
    return np.concatenate([np.empty((0, 3), np.int32), *caps])


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
