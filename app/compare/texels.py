"""The reference on every texel of a lightmap: what pictures of it, and of the error, are made from."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.atlas.lightmap import Lightmap
from app.atlas.node_set import Moves
from app.compare.light import ReferenceLight
from app.gpu import Gpu, Texture
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
        nodes = self._lightmap.nodes
        self.texture: Texture = self._gpu.texture(nodes.size, 4, "f4", bytes(16 * nodes.size[0] * nodes.size[1]))
        self._version, self._known = -1, np.full(nodes.tiles, -1)

    def follow(self, *, whole: bool) -> None:
        """Bring it up to date with the leaves; if not ``whole``, a part of it."""
        nodes = self._lightmap.nodes
        if len(self._known) != nodes.tiles:
            self._resize()
        if self._version == self._lightmap.version:
            return
        keys = self._keys
        stale = np.flatnonzero(nodes.used & (keys != self._known))
        now = stale if whole else stale[: TEXELS_PER_FRAME // nodes.tile**2]
        self._write(now, self._light.on_tiles(nodes, now))
        self._known[now] = keys[now]
        if len(now) == len(stale):
            self._version = self._lightmap.version

    @property
    def _keys(self) -> NDArray[np.int64]:
        """The leaf in each slot; -1 where there is none."""
        nodes = self._lightmap.nodes
        return np.where(nodes.used, nodes.leaves.keys, -1)

    def _resize(self) -> None:
        """The node set has got another number of slots: leaves that are known take their texels along, wherever they are now."""
        tiles = self._lightmap.nodes.tiles
        leaves, now, before = np.intersect1d(self._keys, self._known, return_indices=True)
        there = leaves >= 0
        moves = Moves(tiles, min(len(self._known), tiles), before[there], now[there])
        self.texture, self._known = self._lightmap.moved(self.texture, moves), moves.array(self._known, -1)

    def _write(self, slots: NDArray[np.int64], tiles: F32) -> None:
        nodes = self._lightmap.nodes
        tiles = np.concatenate([tiles, np.ones((*tiles.shape[:-1], 1), np.float32)], axis=-1)
        if len(slots) == nodes.tiles:
            self.texture.write(nodes.image_from_tiles(tiles).tobytes())
            return
        for slot, tile in zip(slots.tolist(), tiles, strict=True):
            self.texture.write(tile.tobytes(), viewport=(*nodes.corner(slot), nodes.tile, nodes.tile))

    def release(self) -> None:
        self._gpu.release_all(self.texture)
