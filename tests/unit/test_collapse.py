"""Texture quadtrees collapse to one texture: linear light stays linear, even light even, to the last texel."""

from __future__ import annotations

import numpy as np
import pytest
from atlas_scenes import own_cache
from quadtrees import OTHER_TILES, SCENES, UNEVEN, grow, shuffle, tree_of

from app.atlas.charts import DEFAULT_TILE
from app.lightmap.collapse import collapse
from app.lightmap.tile_pool import TilePool
from app.scene.model import F64

__all__ = ["own_cache"]


def texel_places(pool: TilePool) -> F64:
    """(slots, t, t, 2) middle of every texel in the atlas [texels of level 0]."""
    inside = np.stack(np.meshgrid(*2 * [np.arange(pool.tile)]), -1) + 0.5
    corner = np.stack([pool.leaves.x, pool.leaves.y], -1)[:, None, None] * pool.tile
    return (corner + inside) * np.exp2(-pool.leaves.level.astype(float))[:, None, None, None]


def image_places(pool: TilePool, finest: int) -> F64:
    width, height = (side << finest for side in pool.charts.size)
    return (np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1) + 0.5) / 2**finest


def in_charts(pool: TilePool, uv: F64, margin: float) -> np.ndarray:
    """Which places lie in a chart, so far from its border [texels of level 0]."""
    inside = np.zeros(uv.shape[:-1], bool)
    for x, y, w, h in pool.charts.chart_rects:
        low, high = np.array([x, y]) + margin, np.array([x + w, y + h]) - margin
        inside |= ((uv > low) & (uv < high)).all(-1)
    return inside


@pytest.mark.parametrize(
    ("seed", "tile"), [*((seed, DEFAULT_TILE) for seed in range(3)), *((0, t) for t in OTHER_TILES)]
)
def test_linear_light_collapses_to_linear_light(seed: int, tile: int) -> None:
    """Means of linear light and its interpolation are linear: no step where levels change. From 1.5 texels of the coarsest level
    on from where a chart ends, where nothing is there to interpolate with."""
    tree = tree_of("walls", density=0.625 * tile, tile=tile)
    shuffle(tree, np.random.default_rng(seed), rounds=3)
    pool = tree.pool
    finest = int(pool.leaves.level.max())
    assert finest > 1 and len(set(pool.leaves.level[pool.used])) > 2
    slope = np.array([[0.7, -0.2], [0.1, 0.4], [-0.3, 1.0]])
    image, covered = collapse(pool, (texel_places(pool) @ slope.T).astype(np.float32))
    uv = image_places(pool, finest)
    assert covered.shape == uv.shape[:2]
    inner = in_charts(pool, uv, 1.5)
    assert covered[inner].all() and inner.mean() > 0.3
    # single precision of values of some hundred
    np.testing.assert_allclose(image[inner], (uv @ slope.T)[inner], rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize("name", SCENES)
def test_even_light_collapses_to_even_light_on_all_that_is_covered(name: str) -> None:
    """Uncovered texels hold rubbish, and none of it may get in."""
    tree = tree_of(name)
    shuffle(tree, np.random.default_rng(5), rounds=3)
    pool = tree.pool
    values = np.where((pool.surfaces.face >= 0)[..., None], 0.375, 1e6).astype(np.float32)
    image, covered = collapse(pool, values)
    finest = int(pool.leaves.level.max())
    np.testing.assert_allclose(image[covered], 0.375, rtol=1e-6)
    if name not in UNEVEN:  # rectangles of whole texels: what is covered is what the charts say
        np.testing.assert_array_equal(covered, in_charts(pool, image_places(pool, finest), 0.0))


def test_one_level_collapses_to_itself() -> None:
    tree = tree_of("walls")
    grow(tree, np.flatnonzero(tree.pool.used).tolist(), depth=1)
    pool = tree.pool
    assert set(pool.leaves.level[pool.used]) == {1}
    tile = pool.tile
    values = np.random.default_rng(1).random((pool.tiles, tile, tile, 3), np.float32)
    image, covered = collapse(pool, values)
    rows, columns = (side // tile for side in image.shape[:2])
    tiled = image.reshape(rows, tile, columns, tile, 3).swapaxes(1, 2)
    mine = pool.used
    seen = pool.surfaces.face[mine] >= 0
    np.testing.assert_array_equal(tiled[pool.leaves.y[mine], pool.leaves.x[mine]][seen], values[mine][seen])
    assert covered.sum() == seen.sum()
