"""Where there is room in a scene: what rays along the axes meet first, from points in it, and the largest room that they find.

A point is in a room if rays along ±x, ±y and ±z meet fronts of surfaces, in a closed one all six, in an open one at least four.
Only the order of corners tells front from back, double-sided or not: the inside of a wall or of a table is no room.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.scene.model import F64, Scene

HEIGHTS = (0.5, 0.7, 0.3)  # of the bounding box, tried in turn in its middle: furniture may stand there
GRID = (5, 3, 5)  # points of the bounding box that are tried else
LEAST = 0.02  # of the bounding box, that the free distances around a point must span: less is a vase, or the inside of a slab
OPEN = 4  # fronts of six around a point in an open room


@dataclass(frozen=True, eq=False)
class Free:
    """What is free around a point. distance (3, 2): along -x and +x, -y …, infinite where nothing is met [m]; front (3, 2):
    whether the front of a surface is met."""

    point: F64
    distance: F64
    front: NDArray[np.bool_]

    @property
    def span(self) -> F64:
        """(3,) between the ends along each axis."""
        return np.asarray(self.distance.sum(1))

    @property
    def middle(self) -> F64:
        """(3,) of the ends, along an axis that has two."""
        ends = np.where(np.isfinite(self.distance).all(1, keepdims=True), self.distance, 0.0)
        return np.asarray(self.point + (ends[:, 1] - ends[:, 0]) / 2)


class AxisRays:
    """Rays along the axes against the triangles of one scene. What a line meets is kept: points in a grid share lines."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        a, b, c = scene.corners.transpose(1, 2, 0)
        self._lower, self._upper = (f(f(a, b), c) for f in (np.minimum, np.maximum))  # (3, m) boxes of triangles
        self._met: dict[tuple[int, float, float], tuple[F64, NDArray[np.bool_]]] = {}

    def free(self, point: F64) -> Free:
        """Around a point (3,)."""
        distance, front = np.full((3, 2), np.inf), np.zeros((3, 2), bool)
        for axis in range(3):
            place, faces_on = self._along(axis, point)
            after = int(np.searchsorted(place, point[axis], "right"))
            before = int(np.searchsorted(place, point[axis], "left")) - 1
            if after < len(place):
                distance[axis, 1] = place[after] - point[axis]
                front[axis, 1] = not faces_on[after]
            if before >= 0:
                distance[axis, 0] = point[axis] - place[before]
                front[axis, 0] = faces_on[before]
        return Free(point, distance, front)

    def _along(self, axis: int, point: F64) -> tuple[F64, NDArray[np.bool_]]:
        """Where the line through a point meets triangles, in order, and whether they face along the axis."""
        across = [(axis + 1) % 3, (axis + 2) % 3]
        u, v = (float(point[k]) for k in across)
        if (axis, u, v) not in self._met:
            near: slice | NDArray[np.int64] = slice(None)
            for k, place in zip(across, (u, v), strict=True):
                meets = np.flatnonzero((self._lower[k][near] <= place) & (self._upper[k][near] >= place))
                near = meets if isinstance(near, slice) else near[meets]
            corners = self._scene.corners[near]
            flat = corners[:, :, across] - (u, v)
            # Signed areas of the line against each edge, seen along the axis: all of one sign if it passes through
            areas = np.stack([_cross2(flat[:, (i + 1) % 3], flat[:, (i + 2) % 3]) for i in range(3)], axis=1)
            total = areas.sum(axis=1)
            hit = ((areas >= 0.0).all(axis=1) | (areas <= 0.0).all(axis=1)) & (total != 0.0)
            place = (areas[hit] * corners[hit][:, :, axis]).sum(axis=1) / total[hit]
            order = np.argsort(place, kind="stable")
            self._met[axis, u, v] = place[order], total[hit][order] > 0
        return self._met[axis, u, v]


def find_room(scene: Scene, rays: AxisRays) -> Free | None:
    """What is free around a point in the middle of a room: the middle of the bounding box, if that is in one; else where walls
    are farthest in a closed one, halfway up; None where there is none."""
    low, high = scene.bounds
    size = high - low
    middles = (rays.free(low + size * (0.5, height, 0.5)) for height in HEIGHTS)
    return next((free for free in middles if free.front.sum() >= OPEN), None) or _roomiest(rays, low, size)


def _roomiest(rays: AxisRays, low: F64, size: F64) -> Free | None:
    """Of the points of a grid, the one farthest from the walls of the closed room that it is in."""
    points = [rays.free(low + size * (np.array(index) + 0.5) / GRID) for index in np.ndindex(*GRID)]
    inside = [free for free in points if free.front.all() and np.prod(free.span) >= LEAST * np.prod(size)]
    if not inside:
        return None
    best = max(inside, key=lambda free: float(np.prod(free.distance)))
    return rays.free(np.array([best.point[0], best.middle[1], best.point[2]]))


def _cross2(a: F64, b: F64) -> F64:
    cross: F64 = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return cross
