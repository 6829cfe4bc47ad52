"""The reference on every texel of a lightmap: what pictures of it, and of the error, are made from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.atlas.lightmap import Lightmap
from app.compare.light import ReferenceLight
from app.gpu import Gpu, Texture

TEXELS_PER_FRAME = 1 << 16  # that are looked up in one frame, where not all must be


class ReferenceTexels:
    """A texture like the lightmap's own, that follows its leaves. Whoever makes it releases it.

    texture: RGBA32F, H of the reference [W/m²]; 0 where it has not been looked up yet.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, light: ReferenceLight) -> None:
        self._gpu, self._lightmap, self._light = gpu, lightmap, light
        self._begin()

    def _begin(self) -> None:
        nodes = self._lightmap.nodes
        self.texture: Texture = self._gpu.texture(nodes.size, 4, "f4", bytes(16 * nodes.size[0] * nodes.size[1]))
        self._version, self._known = -1, np.full(nodes.tiles, -1)

    def follow(self, *, whole: bool) -> None:
        """Bring it up to date with the leaves; if not ``whole``, a part of it."""
        nodes = self._lightmap.nodes
        if self.texture.size != nodes.size:
            self.release()
            self._begin()
            whole = True
        if self._version == self._lightmap.version:
            return
        keys = np.where(nodes.used, nodes.leaves.keys, -1)
        stale = np.flatnonzero(nodes.used & (keys != self._known))
        now = stale if whole else stale[: TEXELS_PER_FRAME // nodes.tile**2]
        self._write(now)
        self._known[now] = keys[now]
        if len(now) == len(stale):
            self._version = self._lightmap.version

    def _write(self, slots: NDArray[np.int64]) -> None:
        nodes = self._lightmap.nodes
        tiles = self._light.on_tiles(nodes, slots)
        tiles = np.concatenate([tiles, np.ones((*tiles.shape[:-1], 1), np.float32)], axis=-1)
        if len(slots) == nodes.tiles:
            self.texture.write(nodes.image_from_tiles(tiles).tobytes())
            return
        for slot, tile in zip(slots.tolist(), tiles, strict=True):
            self.texture.write(tile.tobytes(), viewport=(*nodes.corner(slot), nodes.tile, nodes.tile))

    def release(self) -> None:
        self._gpu.release_all(self.texture)
