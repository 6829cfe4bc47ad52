"""Irradiance at points of the surfaces is read from a lightmap as it is drawn.

What is read is the flat lightmap that a bake writes, bilinearly, as it is drawn.
"""

from __future__ import annotations

import numpy as np

from app.atlas.charts import Charts
from app.atlas.points import Points, SideIndex, bilinear
from app.lightmap.collapse import collapse
from app.lightmap.lightmap import Lightmap
from app.lightmap.seams import finished
from app.scene.model import F32, F64


def irradiance_of(lightmap: Lightmap, points: Points) -> F64:
    """(n, 3) [W/m²], bilinear, as a bake would hold it: with what is still to come."""
    lightmap.refresh_ambient(wait=True)
    image = finished(*collapse(lightmap.pool, lightmap.irradiance(ambient=True)), lightmap.charts)
    return light_at(image, lightmap.charts, points)


def light_at(image: F32, charts: Charts, points: Points) -> F64:
    """(n, 3), bilinear, of an image (h, w, 3) of the charts' atlas, row 0 at v = 0, with filled gutters."""
    image = image.astype(np.float64)
    face = SideIndex(charts.face_triangle, charts.face_back).of(points)
    finer = image.shape[0] // charts.size[1]
    place = np.einsum("nk,nkc->nc", points.weights, charts.face_uv[face]) * finer
    return bilinear(image, place)
