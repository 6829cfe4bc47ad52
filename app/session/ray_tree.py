"""The tree of boxes that rays walk, on its way: frames go on while a solver, or the error estimate, waits for it."""

from __future__ import annotations

from app.lightmap.tile_pool import TilePool
from app.util.background import BackgroundTask
from app.visibility.bvh import Bvh
from app.visibility.rays import tree_of

SORTING = "sorting triangles for rays"  # the stage


class RayTree(BackgroundTask[Bvh]):
    """The tree of a tile pool's triangles, see ``tree_of``: two of one pool build it once."""

    def __init__(self, pool: TilePool) -> None:
        super().__init__("rays in this scene", lambda tell: tree_of(pool, lambda share: tell(SORTING, share)))
