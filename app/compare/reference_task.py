"""The task that reads or solves a reference in a thread of its own: the window never waits for it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from app.atlas.points import random_points
from app.bake.read import read_bake
from app.compare.comparison import POINTS, POINTS_SEED, PreparedReference
from app.compare.reference_light import ReferenceLight, light_of_bake
from app.errors import UserError
from app.lightmap.tile_pool import TilePool
from app.scene.model import Scene
from app.util.background import BackgroundTask, Progress

TILES_AT_ONCE = 256  # looked up: bounds the memory that it takes
Work = Callable[[Progress], ReferenceLight]


def bake_light(path: Path, scene: Scene, tell: Progress) -> ReferenceLight:
    """Raises UserError where there is no bake, or one of another scene."""
    tell("reading", 0.0)
    bake = read_bake(path)
    tell("looking for its surfaces", 0.5)
    return light_of_bake(bake, scene)


def prepare_reference(light: ReferenceLight, pool: TilePool) -> PreparedReference:
    """Look up all that can be known of it in any thread: the leaves of a quadtree may change meanwhile. Raises UserError for a
    reference without light."""
    points = random_points(pool.scene, POINTS, POINTS_SEED)
    if not light.at(points).max() > 0:
        raise UserError(f"{light.name}: holds no light")
    tiles = None
    if not pool.adaptive:
        parts = np.array_split(np.arange(pool.tiles), -(-pool.tiles // TILES_AT_ONCE))
        tiles = np.concatenate([light.on_tiles(pool, part) for part in parts])
    return PreparedReference(light, points, pool, tiles)


class ReferenceTask(BackgroundTask[PreparedReference]):
    """A reference on its way, to be compared with the lightmap of ``pool``."""

    def __init__(self, pool: TilePool, work: Work) -> None:
        self.pool = pool
        super().__init__("the reference", lambda tell: prepare_reference(work(tell), pool))
