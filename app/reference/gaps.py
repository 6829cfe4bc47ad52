"""Random points that lie in narrow gaps, where a reference itself goes wrong: what is right above each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.atlas.points import Points
from app.reference.line_of_sight import visible
from app.scene.model import Scene


def open_above(scene: Scene, points: Points, reach: float) -> NDArray[np.bool_]:
    """(n,) whether nothing lies above the points nearer than ``reach`` [m]: they are not in a gap, nor under what they touch."""
    position, normal = points.positions_normals(scene)
    end = position + reach * normal
    low, high = np.minimum(position, end), np.maximum(position, end)
    least, most = scene.corners.min(axis=1), scene.corners.max(axis=1)
    free = np.ones(len(points), bool)
    for i in range(len(points)):
        near = ((least <= high[i]) & (most >= low[i])).all(axis=1)
        if near.any():
            free[i] = visible(position[i : i + 1], end[i : i + 1], scene.corners[near])[0]
    return free
