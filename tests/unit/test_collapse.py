"""Texture quadtrees collapse to one texture: linear light stays linear, even light even, to the last texel."""

from __future__ import annotations

import numpy as np
import pytest
from atlas_scenes import own_cache
from quadtrees import OTHER_TILES, SCENES, UNEVEN, grow, shuffle, tree_of

from app.atlas.charts import DEFAULT_TILE
from app.atlas.collapse import collapse
from app.atlas.node_set import NodeSet
from app.scene.model import F64

__all__ = ["own_cache"]


def texel_places(nodes: NodeSet) -> F64:
    """(slots, t, t, 2) middle of every texel in the atlas [texels of level 0]."""
    inside = np.stack(np.meshgrid(*2 * [np.arange(nodes.tile)]), -1) + 0.5
    corner = np.stack([nodes.leaves.x, nodes.leaves.y], -1)[:, None, None] * nodes.tile
    return (corner + inside) * np.exp2(-nodes.leaves.level.astype(float))[:, None, None, None]


def image_places(nodes: NodeSet, finest: int) -> F64:
    width, height = (side << finest for side in nodes.charts.size)
    return (np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1) + 0.5) / 2**finest


def in_charts(nodes: NodeSet, uv: F64, margin: float) -> np.ndarray:
    """Which places lie in a chart, so far from its border [texels of level 0]."""
    inside = np.zeros(uv.shape[:-1], bool)
    for x, y, w, h in nodes.charts.chart_rects:
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
    nodes = tree.nodes
    finest = int(nodes.leaves.level.max())
    assert finest > 1 and len(set(nodes.leaves.level[nodes.used])) > 2
    slope = np.array([[0.7, -0.2], [0.1, 0.4], [-0.3, 1.0]])
    image, covered = collapse(nodes, (texel_places(nodes) @ slope.T).astype(np.float32))
    uv = image_places(nodes, finest)
    assert covered.shape == uv.shape[:2]
    inner = in_charts(nodes, uv, 1.5)
    assert covered[inner].all() and inner.mean() > 0.3
    # single precision of values of some hundred
    np.testing.assert_allclose(image[inner], (uv @ slope.T)[inner], rtol=1e-5, atol=1e-4)


@pytest.mark.parametrize("name", SCENES)
def test_even_light_collapses_to_even_light_on_all_that_is_covered(name: str) -> None:
    """Uncovered texels hold rubbish, and none of it may get in."""
    tree = tree_of(name)
    shuffle(tree, np.random.default_rng(5), rounds=3)
    nodes = tree.nodes
    values = np.where((nodes.surfaces.face >= 0)[..., None], 0.375, 1e6).astype(np.float32)
    image, covered = collapse(nodes, values)
    finest = int(nodes.leaves.level.max())
    np.testing.assert_allclose(image[covered], 0.375, rtol=1e-6)
    if name not in UNEVEN:  # rectangles of whole texels: what is covered is what the charts say
        np.testing.assert_array_equal(covered, in_charts(nodes, image_places(nodes, finest), 0.0))


def test_one_level_collapses_to_itself() -> None:
    tree = tree_of("walls")
    grow(tree, np.flatnonzero(tree.nodes.used).tolist(), depth=1)
    nodes = tree.nodes
    assert set(nodes.leaves.level[nodes.used]) == {1}
    tile = nodes.tile
    values = np.random.default_rng(1).random((nodes.tiles, tile, tile, 3), np.float32)
    image, covered = collapse(nodes, values)
    rows, columns = (side // tile for side in image.shape[:2])
    tiled = image.reshape(rows, tile, columns, tile, 3).swapaxes(1, 2)
    mine = nodes.used
    seen = nodes.surfaces.face[mine] >= 0
    np.testing.assert_array_equal(tiled[nodes.leaves.y[mine], nodes.leaves.x[mine]][seen], values[mine][seen])
    assert covered.sum() == seen.sum()
