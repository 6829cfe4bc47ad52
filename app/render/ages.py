"""When each leaf was split off: freshly split ones are shown for a moment, see app/shaders/render/shine.glsl."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from app.atlas.texels import Leaves
from app.lightmap.tile_pool import TilePool
from app.scene.model import F32

NEVER, LATER = -1e6, 1e6  # s


class LeafAges:
    """Follows the leaves of one tile pool, by the places that they cover: slots are used again, places are not."""

    def __init__(self, pool: TilePool) -> None:
        self._start = time.perf_counter()
        self._keys = pool.leaves.keys
        self._born = np.full(len(self._keys), NEVER, np.float32)

    @property
    def now(self) -> float:
        """s, in the time of ``born``."""
        return time.perf_counter() - self._start

    def born(self, pool: TilePool) -> F32:
        """(slots,) f32: when each leaf was first seen in place of a coarser one [s], else NEVER."""
        keys, order = pool.leaves.keys, np.argsort(self._keys)
        at = order[np.minimum(np.searchsorted(self._keys[order], keys), len(order) - 1)]
        born = np.where((keys >= 0) & (self._keys[at] == keys), self._born[at], np.float32(NEVER))
        fresh = np.flatnonzero((keys >= 0) & (self._keys[at] != keys))
        born[fresh[self._was_coarser(pool.leaves.only(fresh))]] = self.now
        self._keys, self._born = keys, born
        return born

    def _was_coarser(self, leaves: Leaves) -> NDArray[np.bool_]:
        """Whether each of these lies in a leaf that was there before."""
        found = np.zeros(len(leaves), bool)
        for k in range(1, int(leaves.level.max(initial=0)) + 1):
            found |= np.isin(Leaves(leaves.level - k, leaves.x >> k, leaves.y >> k).keys, self._keys)
        return found
