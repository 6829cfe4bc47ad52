"""Where to look from: a camera aimed at a point, and a camera for scenes that bring none."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from app.scene.model import F64, Camera, Scene

ROOM_YFOV = math.radians(60.0)
OBJECT_YFOV = math.radians(45.0)
OBJECT_DIRECTION = np.array([0.9, 0.6, 1.3])  # from the object to the eye: three quarters, from above
EYE_HEIGHTS = (0.5, 0.7, 0.3)  # of the bounding box, tried in turn for free standing room


def look_at(eye: ArrayLike, target: ArrayLike) -> F64:
    """(4, 4) rigid world_from_camera at ``eye`` that looks at ``target`` with +y up (-z up when looking along y)."""
    eye, target = np.asarray(eye, np.float64), np.asarray(target, np.float64)
    z = eye - target
    z = z / np.linalg.norm(z)
    up = np.array([0.0, 1.0, 0.0]) if abs(z[1]) < 1.0 - 1e-9 else np.array([0.0, 0.0, -1.0])
    x = np.cross(up, z)
    x = x / np.linalg.norm(x)
    matrix = np.eye(4)
    matrix[:3] = np.stack([x, np.cross(z, x), z, eye], axis=1)
    return matrix


def default_camera(scene: Scene) -> Camera:
    """A view of the whole scene.

    From the middle of the bounding box, half, 0.7 and 0.3 up, rays go out along ±x, ±y and ±z. If four of the six first
    hit the front of a triangle, the point is in a room: the camera looks along the longer free horizontal direction,
    from 5 % of it in front of the wall at one end, or from outside through that end where it is open. Otherwise the
    scene is an object and is seen from outside. Only the order of corners tells front from back, double-sided or not.
    """
    low, high = scene.bounds
    size = high - low
    for height in EYE_HEIGHTS:
        point = low + size * np.array([0.5, height, 0.5])
        hits = {(axis, sign): _first_hit(scene, point, axis, sign) for axis in range(3) for sign in (1, -1)}
        if sum(front for _, front in hits.values()) >= 4:
            return _inside(point, size, {key: distance for key, (distance, _) in hits.items()})
    radius = float(np.linalg.norm(size)) / 2
    centre = (low + high) / 2
    away = OBJECT_DIRECTION / np.linalg.norm(OBJECT_DIRECTION)
    return Camera("default", look_at(centre + away * radius / math.sin(OBJECT_YFOV / 2), centre), OBJECT_YFOV)


def _inside(point: F64, size: F64, free: dict[tuple[int, int], float]) -> Camera:
    def reach(axis: int) -> float:
        return sum(min(free[axis, sign], float(size[axis])) for sign in (1, -1))

    axis = 2 if reach(2) >= reach(0) else 0
    ahead = -1 if free[axis, 1] >= free[axis, -1] else 1
    backwards = free[axis, -ahead]
    eye, forward = point.copy(), np.zeros(3)
    forward[axis] = ahead
    if math.isfinite(backwards):
        eye[axis] -= ahead * (backwards - 0.05 * reach(axis))
    else:  # step out until the opening fills the view
        opening = float(np.delete(size, axis).max())
        eye[axis] -= ahead * (size[axis] + opening / math.tan(ROOM_YFOV / 2)) / 2
    return Camera("default", look_at(eye, eye + forward), ROOM_YFOV)


def _first_hit(scene: Scene, point: F64, axis: int, sign: int) -> tuple[float, bool]:
    """Distance along ±axis to the nearest triangle (infinite if none), and whether its front is seen."""
    others = [(axis + 1) % 3, (axis + 2) % 3]
    corners = scene.corners - point
    flat = corners[:, :, others]
    # Signed areas of the origin against each edge, seen along +axis: all of one sign if the ray passes through.
    areas = np.stack([_cross2(flat[:, (i + 1) % 3], flat[:, (i + 2) % 3]) for i in range(3)], axis=1)
    total = areas.sum(axis=1)
    inside = ((areas >= 0.0).all(axis=1) | (areas <= 0.0).all(axis=1)) & (total != 0.0)
    depth = sign * (areas[inside] * corners[inside][:, :, axis]).sum(axis=1) / total[inside]
    front = sign * total[inside] < 0.0
    ahead = depth > 0.0
    if not ahead.any():
        return math.inf, False
    nearest = int(np.argmin(depth[ahead]))
    return float(depth[ahead][nearest]), bool(front[ahead][nearest])


def _cross2(a: F64, b: F64) -> F64:
    cross: F64 = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return cross
