"""The light of a solution in the layout that a file brings along, its second texture coordinates, as lightmappers keep it.

The solution stays in charts of its own, which are made for it; each texel of the file's layout takes the light at the centroid of
the surface that it covers. A layout is kept where no two triangles share a place in it and all lies in [0, 1]; surfaces that
reflect nothing, as most lamps, need none.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import shapely
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.packing import MAX_SIDE
from app.atlas.points import Points, barycentric
from app.atlas.texels import texel_surfaces, uniform_leaves
from app.lightmap.at_points import light_at
from app.lightmap.gutter import fill_gutter
from app.lightmap.tiles import on_their_faces
from app.scene.model import F32, F64, Scene
from app.scene.validate import counted

OUTSIDE = 1e-4  # of the layout, that coordinates may leave [0, 1] by rounding
SHRUNK = 1e-3  # triangles are made smaller by this share before they are tried: neighbours have an edge in common
SHARED = 1e-2  # of the smaller of two triangles: less is no overlap but rounding


@dataclasses.dataclass(frozen=True, eq=False)
class Laid:
    """Light in a layout, as ``write_bake`` takes them: irradiance (H, W, 3) f32 [W/m²] over the atlas of the charts, and whether
    each of its texels covers a surface."""

    charts: Charts
    irradiance: F32
    covered: NDArray[np.bool_]


def why_not_kept(scene: Scene, charts: Charts) -> str | None:
    """What speaks against the second texture coordinates of a scene as its layout; None if nothing does."""
    faces = _reflecting(scene, charts)
    if scene.uv1 is None:
        return "there is none"
    given = counted(len(faces), "triangle has", "triangles have")
    uv = scene.uv1[charts.face_triangle[faces]].astype(np.float64)
    area = _areas(uv)
    twice = len(faces) - len(np.unique(charts.face_triangle[faces]))
    lost = int((area == 0.0).sum())
    outside = int(((uv < -OUTSIDE) | (uv > 1.0 + OUTSIDE)).any(axis=(1, 2)).sum())
    if twice:
        return f"{counted(twice, 'triangle is', 'triangles are')} lit on both sides, which have one place in it"
    if lost:
        return f"{lost} of {given} no area in it"
    if outside:
        return f"{outside} of {given} corners outside of 0 to 1"
    shared = _overlaps(uv, area)
    return f"{shared} of {given} places in common with others" if shared else None


def laid_out(scene: Scene, solved: Laid) -> Laid:
    """The light in the layout that ``why_not_kept`` says nothing against, of faces that reflect, with about as many texels."""
    assert scene.uv1 is not None
    charts = solved.charts
    faces = _reflecting(scene, charts)
    uv = np.clip(scene.uv1[charts.face_triangle[faces]].astype(np.float64), 0.0, 1.0)
    side = math.sqrt(int(solved.covered.sum()) / float(_areas(uv).sum()))
    side = min(max(round(side / charts.tile), 1) * charts.tile, MAX_SIDE)
    own = dataclasses.replace(
        charts.with_faces(faces),
        size=(side, side),
        face_uv=side * uv,
        hidden_uv=np.empty((0, 3, 2)),
        hidden_face=np.empty(0, np.int64),
    )
    leaves = uniform_leaves(own)
    surfaces = on_their_faces(scene, own, texel_surfaces(scene, own, leaves))
    there = surfaces.face >= 0
    face = surfaces.face[there]
    triangle = own.face_triangle[face]
    weights = np.clip(barycentric(surfaces.position[there], scene.corners[triangle]), 0.0, 1.0)
    points = Points(triangle, own.face_back[face], weights / weights.sum(axis=1, keepdims=True))
    image, known = np.zeros((side, side, 3), np.float32), np.zeros((side, side), bool)
    tile, row, column = np.nonzero(there)
    where = leaves.y[tile] * charts.tile + row, leaves.x[tile] * charts.tile + column
    image[where] = light_at(fill_gutter(solved.irradiance, solved.covered), charts, points)
    known[where] = True
    return Laid(own, image, known)


def _reflecting(scene: Scene, charts: Charts) -> NDArray[np.int64]:
    """The faces whose material reflects any light."""
    reflects = np.array([max(m.albedo) > 0.0 for m in scene.materials])
    return np.flatnonzero(reflects[scene.material_ids[charts.face_triangle]])


def _areas(uv: F64) -> F64:
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return np.asarray(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2)


def _overlaps(uv: F64, area: F64) -> int:
    """How many triangles (f, 3, 2) share a place with another."""
    middle = uv.mean(axis=1, keepdims=True)
    smaller = shapely.polygons(middle + (1.0 - SHRUNK) * (uv - middle))
    one, other = shapely.STRtree(smaller).query(smaller, predicate="intersects")
    one, other = one[one < other], other[one < other]
    common = shapely.area(shapely.intersection(smaller[one], smaller[other]))
    shared = common > SHARED * np.minimum(area[one], area[other])
    return len(np.unique(np.concatenate([one[shared], other[shared]])))
