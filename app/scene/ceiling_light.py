"""A light for scenes that bring none: a square under the ceiling of the room that the camera looks at."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from app.scene.area_lamps import AreaLamp, Surfaces, with_surfaces
from app.scene.model import Scene
from app.scene.rooms import OPEN, AxisRays, Free, find_room

LIGHT_SHARE = 0.25  # its edges, of the room's
LIGHT_GAP = 0.01  # below the ceiling, of the room's height
ABOVE = 0.25  # over what is no room, of the scene's largest extent
THINNEST = 0.01  # of the scene's largest extent: it is lit as if no extent were less
MEAN_IRRADIANCE = 1.0  # W/m² that it alone would give the whole ground plan
CLEAR = 0.9  # of what is free beside its middle, that it may take
LOOKS = 5  # along each edge, for what hangs from the ceiling or stands in its way
HALVINGS = 6  # of its edges, at most, until nothing does


def with_ceiling_light(scene: Scene) -> Scene:
    """The scene with a ``ceiling_light``."""
    return with_surfaces(scene, Surfaces((ceiling_light(scene, "ceiling light"),)))


def ceiling_light(scene: Scene, name: str) -> AreaLamp:
    """A one-sided, downward rectangle of light under the ceiling of a room: the one that the first camera stands in, else the one
    that ``find_room`` finds.

    Its edges are a quarter of the room's, or less where something is in the way; it hangs 1 % of the room's height below whatever
    is lowest over it, in an open room the top of the scene, and its radiance L follows from πL·A_light = E·A_ground with
    E = 1 W/m²: what falls on a floor of the room's size is then about as much as in the Cornell box, whatever the unit. What is
    no room and has no ceiling is lit from a quarter of its size above it.
    """
    (x, y, z), u, v, ground = _square(scene)
    radiance = float(MEAN_IRRADIANCE * ground / (math.pi * 4 * u * v))
    middle = float(x), float(y), float(z)
    return AreaLamp(name, middle, (radiance, radiance, radiance), (2 * float(u), 2 * float(v)))


class _Square(NamedTuple):
    """Its middle and half of its edges along x and z [m]; the area of the ground plan [m²]."""

    middle: tuple[float, float, float]
    u: float
    v: float
    ground: float


def _square(scene: Scene) -> _Square:
    low, high = scene.bounds
    thinnest = THINNEST * float((high - low).max())
    rays = AxisRays(scene)
    room = _room(scene, rays) or rays.free((low + high) / 2)
    enclosed, roofed = room.front.sum() >= OPEN, room.front[1, 1]
    ends = (
        np.clip(room.point[:, None] + room.distance * [-1, 1], low[:, None], high[:, None])
        if enclosed
        else np.stack([low, high], 1)
    )
    width, _, depth = np.maximum(ends[:, 1] - ends[:, 0], thinnest)
    u, v = LIGHT_SHARE * width / 2, LIGHT_SHARE * depth / 2
    x, y, z = room.point
    if not enclosed and not roofed:
        return _Square((x, float(high[1]) + ABOVE * float((high - low).max()), z), u, v, width * depth)
    looks = [(a, b) for a in np.linspace(-1, 1, LOOKS) for b in np.linspace(-1, 1, LOOKS)]
    floor = float(ends[1, 0])
    for _ in range(HALVINGS):
        over = [rays.free(np.array([x + a * u, room.point[1], z + b * v])) for a, b in looks]
        top = min(float(high[1]), *(float(free.point[1] + free.distance[1, 1]) for free in over))
        y = top - LIGHT_GAP * (top - floor)
        across = [rays.free(np.array([x + a * u, y, z])).distance[2].min() * CLEAR >= v for a, _ in looks]
        along = [rays.free(np.array([x, y, z + b * v])).distance[0].min() * CLEAR >= u for _, b in looks]
        if all(across) and all(along):
            break
        u, v = u / 2, v / 2
    return _Square((x, y, z), u, v, width * depth)


def _room(scene: Scene, rays: AxisRays) -> Free | None:
    """What is free around the middle of the room that shall be lit."""
    room = find_room(scene, rays)
    if scene.cameras:
        eye = rays.free(np.asarray(scene.cameras[0].world_from_camera, np.float64)[:3, 3])
        room = eye if eye.front.all() else room
    if room is None:
        return None
    middle = rays.free(np.array([room.middle[0], room.point[1], room.middle[2]]))
    return middle if middle.front.sum() >= OPEN else room
