"""A texture with the reference's light on every texel of a lightmap: what pictures of it, and of the error, are made from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.compare.reference_light import ReferenceLight
from app.gpu import Gpu, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.tile_pool import Moves
from app.scene.model import F32

TEXELS_PER_FRAME = 1 << 14  # that are looked up in one frame, where not all must be


class ReferenceTexels:
    """A texture like the lightmap's own, that follows its leaves. Whoever makes it releases it.

    texture: RGBA32F, H of the reference [W/m²]; 0 where it has not been looked up yet.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, light: ReferenceLight, tiles: F32 | None = None) -> None:
        """tiles: of all slots, where they have been looked up before, see ``ReferenceLight.on_tiles``."""
        self._gpu, self._lightmap, self._light = gpu, lightmap, light
        self._begin()
        if tiles is not None:
            self._write(np.arange(len(tiles)), tiles)
            self._version = lightmap.version

    def _begin(self) -> None:
        pool = self._lightmap.pool
        self.texture: Texture = self._gpu.texture(pool.size, 4, "f4", bytes(16 * pool.size[0] * pool.size[1]))
        self._version, self._known = -1, np.full(pool.tiles, -1)

    def follow(self, *, whole: bool) -> None:
        """Bring it up to date with the leaves; if not ``whole``, a part of it."""
        pool = self._lightmap.pool
        if len(self._known) != pool.tiles:
            self._resize()
        if self._version == self._lightmap.version:
            return
        keys = self._keys
        stale = np.flatnonzero(pool.used & (keys != self._known))
        now = stale if whole else stale[: TEXELS_PER_FRAME // pool.tile**2]
        self._write(now, self._light.on_tiles(pool, now))
        self._known[now] = keys[now]
        if len(now) == len(stale):
            self._version = self._lightmap.version

    @property
    def _keys(self) -> NDArray[np.int64]:
        """The leaf in each slot; -1 where there is none."""
        pool = self._lightmap.pool
        return np.where(pool.used, pool.leaves.keys, -1)

    def _resize(self) -> None:
        """The tile pool has got another number of slots: leaves that are known take their texels along, wherever they are now."""
        tiles = self._lightmap.pool.tiles
        leaves, now, before = np.intersect1d(self._keys, self._known, return_indices=True)
        there = leaves >= 0
        moves = Moves(tiles, min(len(self._known), tiles), before[there], now[there])
        self.texture, self._known = self._lightmap.moved(self.texture, moves), moves.array(self._known, -1)

    def _write(self, slots: NDArray[np.int64], tiles: F32) -> None:
        pool = self._lightmap.pool
        tiles = np.concatenate([tiles, np.ones((*tiles.shape[:-1], 1), np.float32)], axis=-1)
        if len(slots) == pool.tiles:
            self.texture.write(pool.image_from_tiles(tiles).tobytes())
            return
        for slot, tile in zip(slots.tolist(), tiles, strict=True):
            self.texture.write(tile.tobytes(), viewport=(*pool.corner(slot), pool.tile, pool.tile))

    def release(self) -> None:
        self._gpu.release_all(self.texture)
