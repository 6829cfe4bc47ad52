"""When each leaf was split off: freshly split ones are shown for a moment, see app/shaders/render/shine.glsl."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import NDArray

from app.atlas.node_set import NodeSet
from app.scene.model import F32

NEVER, LATER = -1e6, 1e6  # s


class LeafAges:
    """Follows the leaves of one node set, by the pages that they cover: slots are used again, places are not."""

    def __init__(self, nodes: NodeSet) -> None:
        self._start = time.perf_counter()
        self._levels = _levels(nodes)
        self._born = np.full(self._levels.shape, NEVER, np.float32)

    @property
    def now(self) -> float:
        """s, in the time of ``born``."""
        return time.perf_counter() - self._start

    def born(self, nodes: NodeSet) -> F32:
        """(H, W) f32, for each page: when its leaf was first seen in place of a coarser one [s], else NEVER."""
        levels = _levels(nodes)
        self._born[(levels > self._levels) & (self._levels >= 0)] = self.now
        self._born[levels < self._levels] = NEVER
        self._levels = levels
        return self._born


def _levels(nodes: NodeSet) -> NDArray[np.int8]:
    """(H, W) the level of each page's leaf; -1 where there is none."""
    pages = nodes.slot_tables["t_pages"][..., 0].astype(np.int64)
    return np.where(pages > 0, nodes.leaves.level[pages - 1], -1).astype(np.int8)
