"""Which tiles come first: those near the observer, of which shadow rays are sent first and light is shown anew most often."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.direct_light.shadow_rays import DirectLight
from app.lightmap.lightmap import Lightmap
from app.lightmap.tile_pool import TilePool
from app.scene.model import F64

I64 = NDArray[np.int64]
AT_ONCE = 64  # that shadow rays are sent from, between two pictures
NEAR, IN_TURN = 128, 64  # whose light is shown anew in each picture, while the set changes


class Tiles:
    """Of a tile pool whose leaves stay. observer (3,) [solver space]: whoever moves it says where it is."""

    def __init__(self, pool: TilePool, observer: F64) -> None:
        self._pool, self.observer = pool, observer
        there = pool.surfaces.face >= 0
        at = np.where(there[..., None], pool.space.local_from_world(pool.surfaces.position), 0.0)
        count = there.sum((1, 2))[:, None]
        self._centre = np.where(count > 0, at.sum((1, 2)) / np.maximum(count, 1), np.inf)
        self.all: I64 = np.flatnonzero(count[:, 0] > 0)
        self._turn = 0

    @property
    def _away(self) -> F64:
        """(tiles,) from the observer to the middle of each, infinite of empty ones."""
        return np.asarray(np.linalg.norm(self._centre - self.observer, axis=1))

    def in_turn(self) -> I64:
        """Those that are near, and some of the others, each in turn; all where there are few."""
        tiles = self.all
        if len(tiles) <= NEAR + IN_TURN:
            return tiles
        order = np.argpartition(self._away[tiles], NEAR)
        rest = np.sort(tiles[order[NEAR:]])
        first, self._turn = self._turn % len(rest), self._turn + IN_TURN
        return np.concatenate([tiles[order[:NEAR]], np.roll(rest, -first)[:IN_TURN]])

    def dark_near(self, direct: DirectLight) -> bool:
        """Whether no shadow rays have been sent yet from some of those that are near."""
        tiles = self.all
        if not direct.sets or not len(tiles):
            return False
        nearest = tiles[np.argpartition(self._away[tiles], min(NEAR, len(tiles) - 1))[:NEAR]]
        return bool((direct.fewest[nearest] == 0).any())

    def next_to_shoot(self, direct: DirectLight, asked: int) -> I64:
        """From which shadow rays are sent next: of those with fewest, the nearest; none where all have had so many as asked."""
        counts = direct.fewest[self.all]
        left = self.all[(counts < asked) & (counts == counts.min(initial=asked))]
        return np.sort(left[np.argsort(self._away[left], kind="stable")[:AT_ONCE]])


def first_eye(lightmap: Lightmap) -> F64:
    """Where the scene's first camera is (3,) [m]: the observer, until somebody says where. The middle of a scene without any."""
    cameras = lightmap.scene.cameras
    if not cameras:
        return lightmap.space.centre
    return np.asarray(np.asarray(cameras[0].world_from_camera, np.float64)[:3, 3])
