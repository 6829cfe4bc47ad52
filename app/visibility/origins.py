"""Origins are the places on the texels of a lightmap from which their rays start.

Where one flat surface fills a texel, rays start anywhere on it; else in the middle of the largest piece of surface in it, which,
unlike the middle of all, lies on the surface where that is curved.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.gpu import Gpu, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import upload
from app.lightmap.tile_pool import Array, Moves, TilePool, octahedral

WHOLE = 1e-3  # of a texel's square that may be missing where it counts as filled: rounding
NO_CHART = 0xFFFFFFFF  # where nothing is
FLAT = 1e-3  # edges of a texel, between the middle of its largest piece and the line on which that of all of it lies


class Origins:
    """Of the texels of one lightmap: ``textures`` as origin.glsl reads them. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap) -> None:
        self._gpu, self._lightmap = gpu, lightmap
        pool = lightmap.pool
        arrays = origin_tiles(pool, np.arange(pool.tiles))
        self._textures: dict[str, Texture] = {n: upload(gpu, pool.image_from_tiles(a)) for n, a in arrays.items()}

    @property
    def textures(self) -> dict[str, Texture]:
        """And those of the lightmap that go with them."""
        return self._textures | self._lightmap.textures("t_normal_ids", "t_facets", "t_leaves")

    @property
    def normals(self) -> Texture:
        """Normals, and charts."""
        return self._textures["t_origin_normal"]

    def write(self, slots: NDArray[np.int64]) -> None:
        """Other leaves are in these slots."""
        pool = self._lightmap.pool
        for name, tiles in origin_tiles(pool, slots).items():
            for slot, tile in zip(slots.tolist(), tiles, strict=True):
                viewport = (*pool.corner(slot), pool.tile, pool.tile)
                self._textures[name].write(np.ascontiguousarray(tile).tobytes(), viewport=viewport)

    def resized(self, moves: Moves) -> None:
        """The tile pool has got another number of slots."""
        for name, texture in self._textures.items():
            self._textures[name] = self._lightmap.moved(texture, moves)

    def release(self) -> None:
        self._gpu.release_all(*self._textures.values())


def origin_tiles(pool: TilePool, slots: NDArray[np.int64]) -> dict[str, Array]:
    """t_origin (n, t, t, 4) f32: point in the solver space, and 0 where nothing is, 1 for that point alone, 2 for its texel's
    square; t_origin_normal (n, t, t, 2) u32: octahedral normal of the face it lies on, and its chart, or NO_CHART."""
    charts, surfaces = pool.charts, pool.surfaces
    face = surfaces.face[slots]
    covered = face >= 0
    normals = pool.scene.normals_areas[0][charts.face_triangle] * np.where(charts.face_back, -1.0, 1.0)[:, None]
    facet = charts.face_facet[face]
    size = np.exp2(-pool.leaves.level[slots].astype(np.float64))[:, None, None]
    square = np.linalg.norm(np.cross(pool.dpdu, pool.dpdv), axis=1)[facet] * size**2
    area = surfaces.area[slots] / pool.space.scale**2
    middle = pool.space.local_from_world(surfaces.position[slots])
    leading = pool.space.local_from_world(surfaces.leading[slots])
    stray = np.abs(np.einsum("...k,...k->...", middle - leading, normals[face]))
    flat = stray <= FLAT * np.sqrt(np.maximum(square, 1e-300))
    filled = covered & flat & (np.abs(area - square) <= WHOLE * square) & ~surfaces.cut[slots] & _alike(face, facet)
    point = np.where((flat & filled)[..., None], middle, leading)
    kind = np.where(filled, 2.0, 1.0) * covered
    where = np.where(covered[..., None], point, 0.0)
    chart = np.where(covered, charts.face_chart[face], NO_CHART).astype(np.uint32)
    return {
        "t_origin": np.concatenate([where, kind[..., None]], -1).astype(np.float32),
        "t_origin_normal": np.stack([octahedral(normals[face]), chart], -1).astype(np.uint32),
    }


def _alike(face: NDArray[np.int32], facet: NDArray[np.int32]) -> NDArray[np.bool_]:
    """(n, t, t) whether the texels around are of the same facet: then so is all of the texel, whatever its largest piece."""
    out = np.ones(face.shape, bool)
    for axis in (1, 2):
        for step in (-1, 1):
            beside = np.roll(facet, step, axis)
            edge = [slice(None)] * 3
            edge[axis] = slice(0, 1) if step == 1 else slice(-1, None)
            same = (beside == facet) | (np.roll(face, step, axis) < 0)
            same[tuple(edge)] = True
            out &= same
    return out
