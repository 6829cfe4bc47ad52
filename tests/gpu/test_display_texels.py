"""Display texels and pages follow the leaves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from forests import DEPTH, SCENES, SMOOTH, Forest, forest, tables
from solver_scenes import table_room

from app.gpu import Gpu
from app.render import resolve
from app.render.ages import LeafAges
from app.render.options import DisplayOptions
from app.render.resolve import BORDER, DisplayTexels

__all__ = ["forest"]


@pytest.mark.parametrize("interpolation", SMOOTH)
@pytest.mark.parametrize("name", SCENES)
def test_display_texels_follow_the_leaves(
    gpu: Gpu, forest: Callable[..., Forest], rng: np.random.Generator, name: str, interpolation: str
) -> None:
    """A frame that brings only those of changed leaves up to date shows what one does that begins anew."""
    trees = forest(SCENES[name](), texels=6000)
    trees.lightmap.resize(trees.tree.resize(3000))
    options = DisplayOptions(layer="irradiance", tone_map="clamp", interpolation=interpolation)
    known = DisplayTexels(gpu, trees.lightmap, LeafAges(trees.pool), BORDER[interpolation])
    depths = set()
    for change in ("none", "grow", "grow", "both", "shrink", "grow", "shrink", "shrink", "shrink", "shrink"):
        if change in ("grow", "both"):
            trees.grow(0.3, rng)
        if change in ("shrink", "both") and trees.tree.merges(np.flatnonzero(trees.pool.used)):
            trees.shrink()
        depths.add(trees.pool.depth)
        trees.write_noise(np.random.default_rng(len(depths)))
        known.resolve("irradiance", options, scale=None, whole=change == "none")
        for _ in range(-(-known.size[1] * known.size[0] // resolve.TEXELS_PER_FRAME)):
            known.resolve("irradiance", options, scale=None, whole=False)
        fresh = DisplayTexels(gpu, trees.lightmap, LeafAges(trees.pool), BORDER[interpolation])
        fresh.resolve("irradiance", options, scale=None, whole=True)
        for what, expected in tables(fresh).items():
            np.testing.assert_array_equal(tables(known)[what], expected, err_msg=f"{what} after {change}")
        fresh.release()
    assert known.fits(BORDER[interpolation]), "or it would have begun anew"
    known.release()
    assert len(depths) > 1, "the page table has been both coarser and finer"


def test_pages_follow_the_finest_leaf(forest: Callable[..., Forest]) -> None:
    """The table of a tree that has grown and shrunk is that of one made at once, and no finer than it must be."""
    trees = forest(table_room(), texels=12000)
    first = trees.pool.depth
    for _ in range(DEPTH):
        trees.grow()
    assert trees.pool.depth == DEPTH == trees.pool.leaves.level.max() > first
    height, width = trees.pool.slot_tables["t_pages"].shape[:2]
    assert (width, height) == tuple(side << DEPTH for side in np.array(trees.pool.charts.size) // trees.pool.tile)
    while trees.tree.merges(np.flatnonzero(trees.pool.used)):
        trees.shrink()
    assert trees.pool.depth <= trees.pool.leaves.level.max() + 1 < DEPTH
    pages = trees.lightmap.texture("t_pages")
    held = np.frombuffer(pages.read(), np.uint32).reshape(pages.height, pages.width, 1)
    np.testing.assert_array_equal(held, trees.pool.slot_tables["t_pages"])
    for slot in np.flatnonzero(trees.pool.used):
        k = 1 << (trees.pool.depth - trees.pool.leaves.level[slot])
        x, y = trees.pool.leaves.x[slot] * k, trees.pool.leaves.y[slot] * k
        assert (held[y : y + k, x : x + k] == slot + 1).all()
    assert len(np.unique(held)) == trees.pool.used.sum() + (held == 0).any()
