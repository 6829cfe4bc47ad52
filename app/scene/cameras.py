"""Where to look from: a camera aimed at a point, and a camera for scenes that bring none."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from app.scene.model import F64, Camera, Scene
from app.scene.rooms import AxisRays, Free, find_room

ROOM_YFOV = math.radians(60.0)
OBJECT_YFOV = math.radians(45.0)
OBJECT_DIRECTION = np.array([0.9, 0.6, 1.3])  # from the object to the eye: three quarters, from above


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

    From the middle of the room that ``find_room`` finds, the camera looks along the longer free horizontal direction, from 5 % of
    it in front of the wall at one end, or from outside through that end where it is open. Where there is no room, the scene is
    an object and is seen from outside.
    """
    low, high = scene.bounds
    size = high - low
    room = find_room(scene, AxisRays(scene))
    if room is not None:
        return _inside(room, size)
    radius = float(np.linalg.norm(size)) / 2
    centre = (low + high) / 2
    away = OBJECT_DIRECTION / np.linalg.norm(OBJECT_DIRECTION)
    return Camera("default", look_at(centre + away * radius / math.sin(OBJECT_YFOV / 2), centre), OBJECT_YFOV)


def _inside(room: Free, size: F64) -> Camera:
    reach = np.minimum(room.distance, size[:, None]).sum(1)
    axis = 2 if reach[2] >= reach[0] else 0
    before, after = room.distance[axis]
    ahead = -1 if after >= before else 1
    backwards = float(after if ahead < 0 else before)
    eye, forward = room.point.copy(), np.zeros(3)
    forward[axis] = ahead
    if math.isfinite(backwards):
        eye[axis] -= ahead * (backwards - 0.05 * reach[axis])
    else:  # step out until the opening fills the view
        opening = float(np.delete(size, axis).max())
        eye[axis] -= ahead * (size[axis] + opening / math.tan(ROOM_YFOV / 2)) / 2
    return Camera("default", look_at(eye, eye + forward), ROOM_YFOV)
