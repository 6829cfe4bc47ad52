"""Random points on the surfaces of a scene: where irradiance is compared."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.atlas.contacts import hidden_points
from app.atlas.enclosed import sides_with_texels
from app.scene.model import F64, Scene


@dataclass(frozen=True, eq=False)
class Points:
    """On surfaces: triangle (n,) and whether its back; weights (n, 3) of its corners."""

    triangle: NDArray[np.int32]
    back: NDArray[np.bool_]
    weights: F64

    def __len__(self) -> int:
        return len(self.triangle)

    def only(self, which: NDArray[np.bool_] | NDArray[np.integer]) -> Points:
        """Those that are marked, or of these numbers."""
        return Points(self.triangle[which], self.back[which], self.weights[which])

    def positions_normals(self, scene: Scene) -> tuple[F64, F64]:
        """(n, 3) [m] and (n, 3)."""
        normal = scene.normals_areas[0][self.triangle] * np.where(self.back, -1.0, 1.0)[:, None]
        return np.einsum("nk,nkc->nc", self.weights, scene.corners[self.triangle]), normal


class SideIndex:
    """Finds points among sides: triangle (f,) and whether its back."""

    def __init__(self, triangle: NDArray[np.int32], back: NDArray[np.bool_]) -> None:
        keys = 2 * triangle.astype(np.int64) + back
        self._order = np.argsort(keys)
        self._keys = keys[self._order]

    def of(self, points: Points) -> NDArray[np.int64]:
        """(n,) which of the sides each point lies on."""
        found = self.find(points.triangle, points.back)
        assert (found >= 0).all(), "a point on a side without texels"
        return found

    def find(self, triangle: NDArray[np.integer], back: NDArray[np.bool_]) -> NDArray[np.int64]:
        """(n,) which of the sides are of these triangles (n,), and backs; -1 where there is none."""
        wanted = 2 * triangle.astype(np.int64) + back
        place = np.minimum(np.searchsorted(self._keys, wanted), len(self._keys) - 1)
        return np.where(self._keys[place] == wanted, self._order[place], -1)


def random_points(scene: Scene, count: int, seed: int) -> Points:
    """Even in area on all sides that light can reach, less those that something lies on: ``count`` at most."""
    random = np.random.default_rng(seed)
    sides = sides_with_texels(scene)
    area = scene.normals_areas[1][sides.triangle]
    order = np.lexsort((sides.back, sides.triangle))
    side = random.choice(order, count, p=area[order] / area.sum())
    points = Points(sides.triangle[side], sides.back[side], random.dirichlet((1, 1, 1), count))
    return points.only(~hidden_points(scene, points.triangle, points.back, points.weights))


def barycentric(position: F64, corners: F64) -> F64:
    """(n, 3) weights of corners (n, 3, 3) that make positions (n, 3), or the feet of those off the plane."""
    a, b, p = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], position - corners[:, 0]
    normal = np.cross(a, b)
    squared = np.einsum("nk,nk->n", normal, normal)
    second = np.einsum("nk,nk->n", np.cross(p, b), normal) / squared
    third = np.einsum("nk,nk->n", np.cross(a, p), normal) / squared
    return np.stack([1 - second - third, second, third], axis=1)


def bilinear(image: NDArray[Any], place: F64) -> F64:
    """An image (h, w, c) at places (n, 2) [its texels], whose middles lie at halves: (n, c), its edge texels beyond its edges."""
    low = np.floor(place - 0.5).astype(np.int64)
    (x, y), (s, t) = low.T, (place - 0.5 - low).T[..., None]
    columns, rows = (np.clip([i, i + 1], 0, size - 1) for i, size in ((x, image.shape[1]), (y, image.shape[0])))
    below, above = ((1 - s) * image[row, columns[0]] + s * image[row, columns[1]] for row in rows)
    return np.asarray((1 - t) * below + t * above)
