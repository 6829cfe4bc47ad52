"""The insides of closed bodies, which no light reaches and nobody sees: a box of a file whose materials all have two sides.

A body is what its edges join. It is closed if each edge has two triangles, which run along it in opposite directions. A room is
a closed body, too: a body whose bounding box holds anything else, a lamp, another body or a camera, keeps its inside.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from app.atlas.sides import FLAT, Edges, Sides, groups_of, least, lit_sides, most, scene_size, totals, weld
from app.scene.model import F64, I32, Scene

Mask = NDArray[np.bool_]


def sides_with_texels(scene: Scene) -> Sides:
    """The sides of a scene that light can reach: those that have texels."""
    lit = lit_sides(scene)
    return without_enclosed(lit, scene, *weld(scene)) if _may_enclose(scene) else lit


def without_enclosed(lit: Sides, scene: Scene, points: F64, corners: I32) -> Sides:
    """The lit sides that are not within such a body; all of them where there are lamps without area, or a sky. points (n, 3) [m],
    corners (m, 3) of the triangles: welded."""
    if not _may_enclose(scene):
        return lit
    within = _enclosed(scene, points, corners)[lit.triangle, lit.back.astype(np.int64)]
    if within.all():
        return lit
    return Sides(lit.triangle[~within], lit.back[~within], lit.dark + int(np.count_nonzero(within)))


def cameras_inside(scene: Scene) -> F64:
    """(k, 3) [m] places of the cameras that may be within a body: those in the scene's bounding box; none where no inside is left
    out. On these the sides with texels depend."""
    if not _may_enclose(scene):
        return np.empty((0, 3))
    eyes = np.array([camera.world_from_camera[:3, 3] for camera in scene.cameras]).reshape(-1, 3)
    low, high = scene.positions.min(0), scene.positions.max(0)
    return np.unique(eyes[((eyes > low) & (eyes < high)).all(1)], axis=0)


def _may_enclose(scene: Scene) -> bool:
    return not scene.open_to_lights and bool(scene.sides.any())


def _enclosed(scene: Scene, points: F64, corners: I32) -> Mask:
    """(m, 2) fronts and backs of triangles that are the inside of such a body."""
    start, end = corners.reshape(-1), np.roll(corners, -1, axis=1).reshape(-1)
    edges = Edges.of(corners)
    edge, uses = edges.edge, edges.uses
    pairs = np.stack(edges.pairs(), axis=1) // 3
    count, body = groups_of(len(corners), pairs)
    way = np.bincount(edge, np.where(start < end, 1.0, -1.0))
    holds = np.array([m.opaque and m.double_sided for m in scene.materials])[scene.material_ids]
    holds &= ((uses[edge] == 2) & (way[edge] == 0)).reshape(-1, 3).all(1)
    triangles = points[corners]
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low, body, least(triangles))
    np.maximum.at(high, body, most(triangles))
    closed = np.bincount(body, ~holds, count) == 0
    closed[closed] = _alone(scene, triangles, body, np.flatnonzero(closed), low, high)
    # what a body holds, by the tetrahedra from its middle to its triangles; below 0 where its fronts are inside
    off = triangles - ((low + high) / 2)[body][:, None]
    volume = totals(body, np.einsum("mk,mk->m", off[:, 0], np.cross(off[:, 1], off[:, 2])), count)
    out = np.zeros((len(corners), 2), bool)
    out[:, 0] = (closed & (volume < 0))[body]
    out[:, 1] = (closed & (volume > 0))[body]
    return out


def _alone(
    scene: Scene, triangles: F64, body: NDArray[np.int64], asked: NDArray[np.int64], low: F64, high: F64
) -> Mask:
    """Whether nothing else reaches into the boxes low to high (bodies, 3) of the bodies asked for, and no camera is there."""
    near = FLAT * scene_size(scene)
    x, y = np.argsort(-np.ptp(triangles.reshape(-1, 3), axis=0))[:2]
    lower, upper = low[asked] + near, high[asked] - near
    tree = shapely.STRtree(shapely.box(lower[:, x], lower[:, y], upper[:, x], upper[:, y]))
    # triangles of bodies whose boxes meet those of others
    other, mine = tree.query(shapely.box(low[:, x], low[:, y], high[:, x], high[:, y]))
    meets = (other != asked[mine]) & (low[other] < upper[mine]).all(1) & (high[other] > lower[mine]).all(1)
    may = np.zeros(len(low), bool)
    may[other[meets]] = True
    some = np.flatnonzero(may[body])
    eyes = cameras_inside(scene)
    first = np.concatenate([least(triangles[some]), eyes])
    last = np.concatenate([most(triangles[some]), eyes])
    owner = np.concatenate([body[some], np.full(len(eyes), -1)])
    one, other = tree.query(shapely.box(first[:, x], first[:, y], last[:, x], last[:, y]))
    meets = (owner[one] != asked[other]) & (first[one] < upper[other]).all(1) & (last[one] > lower[other]).all(1)
    alone = np.asarray((upper > lower).all(1))
    alone[other[meets]] = False
    return alone
