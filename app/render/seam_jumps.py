"""How far light jumps at seams, on the texels beside them: what is left once it fades from one chart to the other."""

from __future__ import annotations

import time

import numpy as np

from app.gpu import Gpu, Texture
from app.lightmap.collapse import collapse
from app.lightmap.lightmap import Lightmap
from app.lightmap.seams import finished, places_and_jumps
from app.lightmap.tile_pool import TilePool
from app.scene.model import F32, F64

SECONDS = 0.5  # between two looks at light that moves: each reads it back


class SeamJumps:
    """A texture of one lightmap's size, R32F: the largest jump along a seam beside each texel, over its mean. Whoever makes it
    releases it."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._texture: Texture | None = None
        self._due = 0.0
        self._of: Lightmap | None = None

    def of(self, lightmap: Lightmap, *, whole: bool) -> Texture:
        """The texture, brought up to date, or if not ``whole`` now and then. Waits for the GPU then."""
        fits = self._texture is not None and self._of is lightmap and self._texture.size == lightmap.size
        if self._texture is None or not fits:
            self.release()
            self._texture, self._of, self._due = self._gpu.texture(lightmap.size, 1, "f4"), lightmap, 0.0
        if whole or time.monotonic() >= self._due:
            self._texture.write(_texels_of(lightmap).tobytes())
            self._due = time.monotonic() + SECONDS
        return self._texture

    def release(self) -> None:
        if self._texture is not None:
            self._gpu.release_all(self._texture)
        self._texture = self._of = None


def _texels_of(lightmap: Lightmap) -> F32:
    """(h, w) of the tile pool."""
    pool, charts = lightmap.pool, lightmap.charts
    image = finished(*collapse(pool, lightmap.irradiance(ambient=True)), charts)
    place, jump = places_and_jumps(image, charts)
    out = np.zeros(lightmap.size[::-1], np.float32)
    column, row = _pool_texels(pool, place)
    np.maximum.at(out, (row, column), jump)
    return out


def _pool_texels(pool: TilePool, place: F64) -> tuple[np.ndarray, np.ndarray]:
    """Column and row in the tile pool of places (n, 2) of the atlas [texels of level 0] that leaves cover."""
    pages = pool.slot_tables["t_pages"][..., 0]
    page = np.floor(place * pool.pages_per_texel).astype(np.int64)
    slot = pages[page[:, 1], page[:, 0]].astype(np.int64) - 1
    corner = np.stack([pool.leaves.x[slot], pool.leaves.y[slot]], axis=1) * pool.tile
    inside = np.floor(place * 2.0 ** pool.leaves.level[slot][:, None]).astype(np.int64) - corner
    column, row = (pool.corners(slot) + inside).T
    return column, row
