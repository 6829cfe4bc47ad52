"""Random points on the surfaces of a scene, and the irradiance that a lightmap has there.

The lightmap that is judged is the flat one that a bake writes, read bilinearly, as it is drawn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.collapse import collapse
from app.atlas.lightmap import Lightmap
from app.atlas.sides import lit_sides
from app.bake.gutter import fill_gutter
from app.reference.visibility import visible
from app.scene.model import F32, F64, Scene


@dataclass(frozen=True, eq=False)
class Points:
    """On surfaces: triangle (n,) and whether its back; weights (n, 3) of its corners."""

    triangle: NDArray[np.int32]
    back: NDArray[np.bool_]
    weights: F64

    def __len__(self) -> int:
        return len(self.triangle)

    def only(self, which: NDArray[np.bool_]) -> Points:
        return Points(self.triangle[which], self.back[which], self.weights[which])

    def positions_normals(self, scene: Scene) -> tuple[F64, F64]:
        """(n, 3) [m] and (n, 3)."""
        normal = scene.normals_areas[0][self.triangle] * np.where(self.back, -1.0, 1.0)[:, None]
        return np.einsum("nk,nkc->nc", self.weights, scene.corners[self.triangle]), normal


def random_points(scene: Scene, count: int, seed: int) -> Points:
    """Even in area on all sides that light can reach."""
    random = np.random.default_rng(seed)
    sides = lit_sides(scene)
    area = scene.normals_areas[1][sides.triangle]
    order = np.lexsort((sides.back, sides.triangle))
    side = random.choice(order, count, p=area[order] / area.sum())
    return Points(sides.triangle[side], sides.back[side], random.dirichlet((1, 1, 1), count))


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
    """(n, 3) [W/m²], bilinear."""
    image = fill_gutter(*collapse(lightmap.nodes, lightmap.irradiance()))
    return light_at(image, lightmap.charts, points)


def light_at(image: F32, charts: Charts, points: Points) -> F64:
    """(n, 3), bilinear, of an image (h, w, 3) of the charts' atlas, row 0 at v = 0, with filled gutters."""
    image = image.astype(np.float64)
    face = _faces(charts.face_triangle, charts.face_back, points)
    finer = image.shape[0] // charts.size[1]
    place = np.einsum("nk,nkc->nc", points.weights, charts.face_uv[face]) * finer - 0.5
    first = np.floor(place).astype(np.int64)
    (x, y), (s, t) = first.T, (place - first).T[..., None]
    columns, rows = (np.clip([i, i + 1], 0, size - 1) for i, size in ((x, image.shape[1]), (y, image.shape[0])))
    below, above = ((1 - s) * image[row, columns[0]] + s * image[row, columns[1]] for row in rows)
    return np.asarray((1 - t) * below + t * above)


def _faces(triangle: NDArray[np.int32], back: NDArray[np.bool_], points: Points) -> NDArray[np.int64]:
    """(n,) the charts' face that each point lies on."""
    keys, wanted = 2 * triangle.astype(np.int64) + back, 2 * points.triangle.astype(np.int64) + points.back
    order = np.argsort(keys)
    face = order[np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)]
    assert (keys[face] == wanted).all(), "a point on a side without texels"
    return np.asarray(face)
