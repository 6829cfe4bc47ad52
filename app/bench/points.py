"""What lies above random points of a scene, and the irradiance that a lightmap has there.

The lightmap that is judged is the flat one that a bake writes, read bilinearly, as it is drawn.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.collapse import collapse
from app.atlas.lightmap import Lightmap
from app.atlas.points import Points, SideIndex, bilinear
from app.bake.gutter import fill_gutter
from app.reference.visibility import visible
from app.scene.model import F32, F64, Scene


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


def irradiance_of(lightmap: Lightmap, points: Points) -> F64:
    """(n, 3) [W/m²], bilinear, as a bake would hold it: with what is still to come."""
    image = fill_gutter(*collapse(lightmap.nodes, lightmap.irradiance(ambient=True)))
    return light_at(image, lightmap.charts, points)


def light_at(image: F32, charts: Charts, points: Points) -> F64:
    """(n, 3), bilinear, of an image (h, w, 3) of the charts' atlas, row 0 at v = 0, with filled gutters."""
    image = image.astype(np.float64)
    face = SideIndex(charts.face_triangle, charts.face_back).of(points)
    finer = image.shape[0] // charts.size[1]
    place = np.einsum("nk,nkc->nc", points.weights, charts.face_uv[face]) * finer
    return bilinear(image, place)
