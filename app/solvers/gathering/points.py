"""Points between which light bounces: the texels of the lightmap, or where these come and go others that stay."""

from __future__ import annotations

from app.atlas.texels import uniform_leaves
from app.lightmap.lightmap import Lightmap
from app.lightmap.tile_pool import TilePool

MOST_POINTS = 100_000  # in quadtrees: as many as two cores trace rays from at interactive rates


def points_of(lightmap: Lightmap) -> TilePool:
    """Where leaves of quadtrees come and go: texels of one level, whatever the leaves."""
    pool, level = lightmap.pool, 0
    while level < lightmap.options.depth and pool.uniform_texels(level + 1) <= MOST_POINTS:
        level += 1
    return TilePool(pool.scene, pool.charts, uniform_leaves(pool.charts, level))


def level_of(points: Lightmap, lightmap: Lightmap) -> int:
    """The level of the points' texels, which goes with the leaves that there were when they were made; -1 where they are those of
    the lightmap."""
    return -1 if points is lightmap else int(points.pool.leaves.level.max())


__all__ = ["level_of", "points_of"]
