"""The light of a solution in the layout that a file brings along, its second texture coordinates, as lightmappers keep it.

The solution stays in charts of its own, which are made for it; each texel of the file's layout takes the light at the centroid of
the surface that it covers. A layout is kept where no two triangles share a place in it and all lies in [0, 1]; surfaces that
reflect nothing, as most lamps, need none. Where objects have a square each, as modelling programs make them, these squares are
scaled by the surface that they hold, and placed side by side.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import shapely
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.packing import MAX_SIDE, outlines, pack
from app.atlas.points import Points, barycentric
from app.atlas.seams import Seams
from app.atlas.sides import totals
from app.atlas.texels import texel_surfaces, uniform_leaves
from app.lightmap.at_points import light_at
from app.lightmap.seams import finished
from app.lightmap.surfaces import on_their_faces
from app.scene.model import F32, F64, Scene
from app.util.words import counted

OUTSIDE = 1e-4  # of the layout, that coordinates may leave [0, 1] by rounding
DARK = 1e-2  # of the mean irradiance: less is what a solution still owes, or leaks
LARGEST = MAX_SIDE / 2  # texels along the edge of a square as large as all
SHRUNK = 1e-3  # triangles are made smaller by this share before they are tried: neighbours have an edge in common
SHARED = 1e-2  # of the smaller of two triangles: less is no overlap but rounding


@dataclasses.dataclass(frozen=True, eq=False)
class Laid:
    """Light in a layout, as ``write_bake`` takes them: irradiance (H, W, 3) f32 [W/m²] over the atlas of the charts, or
    (H, W, 6), followed by its direct part, and whether each of its texels covers a surface. squares: of how many objects were
    placed side by side."""

    charts: Charts
    irradiance: F32
    covered: NDArray[np.bool_]
    squares: int = 1

    @property
    def image(self) -> F32:
        """The irradiance with filled gutters, and one light for both charts near seams."""
        return finished(self.irradiance, self.covered, self.charts)


def why_not_kept(scene: Scene, solved: Laid) -> str | None:
    """What speaks against the second texture coordinates of a scene as its layout; None if nothing does."""
    charts = solved.charts
    faces = _shown(scene, solved)
    if scene.uv1 is None:
        return "there is none"
    given = counted(len(faces), "triangle has", "triangles have")
    uv = scene.uv1[charts.face_triangle[faces]].astype(np.float64)
    area = areas(uv)
    twice = len(faces) - len(np.unique(charts.face_triangle[faces]))
    lost = int((area == 0.0).sum())
    outside = int(((uv < -OUTSIDE) | (uv > 1.0 + OUTSIDE)).any(axis=(1, 2)).sum())
    if twice:
        return f"{counted(twice, 'triangle is', 'triangles are')} lit on both sides, which have one place in it"
    if lost:
        return f"{lost} of {given} no area in it"
    if outside:
        return f"{outside} of {given} corners outside of 0 to 1"
    shared = overlaps(_apart(uv, _squares(scene, charts, faces, uv)), area)
    return f"{shared} of {given} places in common with others" if shared else None


def laid_out(scene: Scene, solved: Laid) -> Laid:
    """The light in the layout that ``why_not_kept`` says nothing against, of faces that reflect, with about as many texels."""
    assert scene.uv1 is not None
    charts = solved.charts
    faces = _shown(scene, solved)
    uv = np.clip(scene.uv1[charts.face_triangle[faces]].astype(np.float64), 0.0, 1.0)
    square = _squares(scene, charts, faces, uv)
    world = scene.normals_areas[1][charts.face_triangle[faces]]
    face_uv, size = _placed(uv, world, square, int(solved.covered.sum()), charts.tile)
    own = charts.with_faces(faces)
    hidden = _carried(own.hidden_uv, own.face_uv[own.hidden_face], face_uv[own.hidden_face])
    own = dataclasses.replace(own, size=size, face_uv=face_uv, hidden_uv=hidden, seams=Seams())
    leaves = uniform_leaves(own)
    surfaces = on_their_faces(scene, own, texel_surfaces(scene, own, leaves))
    there = surfaces.face >= 0
    face = surfaces.face[there]
    triangle = own.face_triangle[face]
    weights = np.clip(barycentric(surfaces.position[there], scene.corners[triangle]), 0.0, 1.0)
    points = Points(triangle, own.face_back[face], weights / weights.sum(axis=1, keepdims=True))
    image, known = np.zeros((*size[::-1], solved.irradiance.shape[2]), np.float32), np.zeros(size[::-1], bool)
    tile, row, column = np.nonzero(there)
    where = leaves.y[tile] * charts.tile + row, leaves.x[tile] * charts.tile + column
    image[where] = light_at(solved.image, charts, points)
    known[where] = True
    return Laid(own, image, known, int(square.max()) + 1)


def _carried(pieces: F64, old: F64, new: F64) -> F64:
    """Pieces (k, 3, 2) of triangles (k, 3, 2) where those are moved to."""
    flat = [np.pad(triangles, ((0, 0), (0, 0), (0, 1))) for triangles in (pieces, old)]
    weights = barycentric(flat[0].reshape(-1, 3), np.repeat(flat[1], 3, axis=0)).reshape(-1, 3, 3)
    return np.asarray(np.einsum("kpc,kcx->kpx", weights, new))


def _shown(scene: Scene, solved: Laid) -> NDArray[np.int64]:
    """The faces whose material reflects any light; where a triangle has two, not that to which none comes, as in a body."""
    charts = solved.charts
    reflects = np.array([max(m.albedo) > 0.0 for m in scene.materials])
    faces = np.flatnonzero(reflects[scene.material_ids[charts.face_triangle]])
    triangle, back = charts.face_triangle[faces], charts.face_back[faces]
    twice = (np.bincount(triangle, minlength=len(scene.triangles)) == 2)[triangle]
    if not twice.any():
        return faces
    middles = Points(triangle, back, np.full((len(faces), 3), 1 / 3))
    light = light_at(solved.image[..., :3], charts, middles).sum(axis=1)
    dark = twice & (light < DARK * light.mean())
    back_dark = np.zeros(len(scene.triangles), bool)
    back_dark[triangle[dark & back]] = True
    shown: NDArray[np.int64] = faces[~dark | (~back & back_dark[triangle])]
    return shown


def _squares(scene: Scene, charts: Charts, faces: NDArray[np.int64], uv: F64) -> NDArray[np.int64]:
    """The number (f,) of the square that each face lies in: 0 where all share one, else that of its object."""
    one = np.zeros(len(faces), np.int64)
    if not overlaps(uv, areas(uv)):
        return one
    return np.unique(scene.object_ids[charts.face_triangle[faces]], return_inverse=True)[1]


def _apart(uv: F64, square: NDArray[np.int64]) -> F64:
    """Squares beside each other, none of which touches the next."""
    return uv + np.array([2.0, 0.0]) * square[:, None, None]


def _placed(uv: F64, world: F64, square: NDArray[np.int64], texels: int, tile: int) -> tuple[F64, tuple[int, int]]:
    """The faces (f, 3, 2) [texels] in an atlas of whole tiles, and its size (W, H), that so many texels about cover. world (f,):
    their areas [m²]."""
    count = int(square.max()) + 1
    side = np.sqrt(texels * totals(square, world, count) / world.sum() / totals(square, areas(uv), count))
    side *= min(1.0, LARGEST / float(np.linalg.norm(side)))
    if count == 1:
        whole = max(round(float(side[0]) / tile), 1) * tile
        return whole * uv, (whole, whole)
    side = np.maximum(np.round(side), 1.0)
    halves = side[:, None, None, None] * np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]])
    origins, size = pack(outlines(halves.reshape(-1, 3, 2), np.repeat(np.arange(count), 2), count), tile)
    return side[square][:, None, None] * uv + origins[square][:, None], size


def areas(uv: F64) -> F64:
    """(f,) of triangles (f, 3, 2)."""
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    return np.asarray(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2)


def overlaps(uv: F64, area: F64) -> int:
    """How many triangles (f, 3, 2) share a place with another."""
    middle = uv.mean(axis=1, keepdims=True)
    smaller = shapely.polygons(middle + (1.0 - SHRUNK) * (uv - middle))
    one, other = shapely.STRtree(smaller).query(smaller, predicate="intersects")
    one, other = one[one < other], other[one < other]
    common = shapely.area(shapely.intersection(smaller[one], smaller[other]))
    shared = common > SHARED * np.minimum(area[one], area[other])
    return len(np.unique(np.concatenate([one[shared], other[shared]])))
