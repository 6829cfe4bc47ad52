"""Where leaves of different level meet: no edge shows."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from forests import SMOOTH, Forest, forest, places
from numpy.typing import NDArray
from solver_scenes import grey, quads_scene, room

from app.atlas.charts import TILES
from app.gpu import Gpu
from app.lightmap.quadtree import MAX_DEPTH
from app.render import edge_texels, resolve
from app.render.ages import LeafAges
from app.render.edges import unequal_edges
from app.render.options import DisplayOptions
from app.render.resolve import BORDER, DisplayTexels
from app.scene.model import F64

__all__ = ["forest"]


def weights(interpolation: str, t: F64) -> F64:
    """Of the texels -1, 0, 1 and 2 at t (2,) between 0 and 1: (4, 2)."""
    if interpolation == "bilinear":
        return np.array([t * 0, 1 - t, t, t * 0])
    s = 1 - t
    return np.array([s**3, 3 * t**3 - 6 * t**2 + 4, 3 * s**3 - 6 * s**2 + 4, t**3]) / 6


def sampled(display: NDArray[np.float64], pool: object, interpolation: str, slot: int, uv: F64) -> float:
    """What is interpolated at a place of the atlas [texels of level 0] in one leaf's display texels."""
    leaves, columns, tile = pool.leaves, pool.columns, pool.tile  # type: ignore[attr-defined]
    border = BORDER[interpolation]
    inside = uv * 2.0 ** leaves.level[slot] - np.array([leaves.x[slot], leaves.y[slot]]) * tile
    at = np.array([slot % columns, slot // columns]) * (tile + 2 * border) + border + inside - 0.5
    base = np.floor(at).astype(int)
    w = weights(interpolation, at - base)
    rows, columns = (np.clip(base[axis] + np.arange(-1, 3), 0, display.shape[1 - axis] - 1) for axis in (1, 0))
    return float(w[:, 1] @ display[np.ix_(rows, columns)] @ w[:, 0])


def edge_points(pool: object) -> list[tuple[int, int, F64]]:
    """A third of the places where two leaves of different level meet, four along the edge of a leaf of MAX_DEPTH."""
    pages = pool.slot_tables["t_pages"][..., 0].astype(np.int64) - 1  # type: ignore[attr-defined]
    level, cell = pool.leaves.level, 1 / pool.pages_per_texel  # type: ignore[attr-defined]
    found, count = [], 4 << (MAX_DEPTH - pool.depth)  # type: ignore[attr-defined]
    for step, along in (((0, 1), (0, 1)), ((1, 0), (1, 0))):
        a, b = pages[: len(pages) - step[0], : pages.shape[1] - step[1]], pages[step[0] :, step[1] :]
        met = (a >= 0) & (b >= 0) & (level[a] != level[b])
        for y, x in np.argwhere(met):
            for t in (np.arange(count) + 0.5) / count:
                uv = np.array([x + along[1] + t * (1 - along[1]), y + along[0] + t * (1 - along[0])]) * cell
                found.append((int(a[y, x]), int(b[y, x]), uv))
    return found[::3]  # each of the four in turn


def shown(gpu: Gpu, trees: Forest, interpolation: str, light: F64) -> NDArray[np.float64]:
    """The display texels, 0 to 1, of light that they show as it is: sRGB undone."""
    linear = np.where(light <= 0.04045, light / 12.92, ((np.maximum(light, 0.04045) + 0.055) / 1.055) ** 2.4)
    trees.write({"t_irradiance": np.repeat(linear[..., None], 3, -1) * np.pi / trees.lightmap.unit})
    display = DisplayTexels(gpu, trees.lightmap, LeafAges(trees.pool), BORDER[interpolation])
    options = DisplayOptions(layer="irradiance", tone_map="clamp", interpolation=interpolation)
    textures = display.resolve("irradiance", options, scale=None, whole=True)
    texture = textures["t_display"]
    raw = np.frombuffer(texture.read(), np.uint8).reshape(texture.height, texture.width, 4)[..., 0] / 255
    display.release()
    return raw


ROUNDING = 1 / 255  # half a step of 8 bits on either side


@pytest.fixture(params=TILES)
def uneven(forest: Callable[..., Forest], rng: np.random.Generator, request: pytest.FixtureRequest) -> Forest:
    """One square of 64 texels, with leaves of three levels."""
    trees = forest(quads_scene([room((4.0, 4.0, 4.0))[0]], [grey(0.5, 1.0)]), texels=64 * 64, tile=request.param)
    for _ in range(2):
        trees.grow(0.3, rng)
    return trees


@pytest.mark.parametrize("interpolation", SMOOTH)
def test_linear_light_stays_linear_where_levels_meet(gpu: Gpu, uneven: Forest, interpolation: str) -> None:
    """On both sides of every edge, and there is no step."""
    pool = uneven.pool
    slope, middle = np.array([0.006, 0.005]), pool.charts.chart_rects[0][:2] + 32
    raw = shown(gpu, uneven, interpolation, 0.5 + (places(uneven) - middle) @ slope)
    tested = 0
    for a, b, uv in edge_points(pool):
        if (np.abs(uv - middle) < 30).all():
            exact = 0.5 + (uv - middle) @ slope
            both = np.array([sampled(raw, pool, interpolation, slot, uv) for slot in (a, b)])
            assert np.abs(both - exact).max() < ROUNDING, (uv, both, exact)
            assert np.ptp(both) < ROUNDING
            tested += 1
    assert tested > 100


@pytest.mark.parametrize("interpolation", SMOOTH)
def test_curved_light_has_no_step_where_levels_meet(gpu: Gpu, uneven: Forest, interpolation: str) -> None:
    """Waves of 8 texels of level 0. What is left is how a row of fine texels follows a coarser one along the edge: where that
    bends, it is off by 1/8 of the second difference, by 5/32 at the end of a leaf, and by a quarter more since sRGB bends too.
    Across the edge nothing is left."""
    pool = uneven.pool
    middle = pool.charts.chart_rects[0][:2] + 32
    second_difference = 0.25 * (2 * np.sin(np.pi / 8)) ** 2
    for direction in ((1.0, 0.0), (0.6, 0.8)):
        wave = np.sin(places(uneven) @ np.array(direction) * 2 * np.pi / 8)
        raw = shown(gpu, uneven, interpolation, 0.5 + 0.25 * wave)
        steps = [
            abs(sampled(raw, pool, interpolation, a, uv) - sampled(raw, pool, interpolation, b, uv))
            for a, b, uv in edge_points(pool)
            if (np.abs(uv - middle) < 30).all()
        ]
        assert max(steps) < 1.25 * 5 / 32 * second_difference + 2 * ROUNDING, (direction, np.array(steps).max() * 255)
        # the ends are half of the edge of a small leaf
        assert np.mean(steps) < (1.0 if pool.tile == 8 else 0.6) * ROUNDING


def test_edges_that_one_texture_cannot_hold(
    gpu: Gpu, forest: Callable[..., Forest], rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Many small leaves have more of them than a texture has rows: their border texels are made in several."""
    trees = forest(quads_scene([room((4.0, 4.0, 4.0))[0]], [grey(0.5, 1.0)]), texels=160 * 160, tile=8)
    trees.grow(0.3, rng)
    light = 0.5 + 0.25 * np.sin(places(trees).sum(-1))
    whole = shown(gpu, trees, "bicubic", light)
    longest = max(whole.shape)  # as short as the display texels allow
    monkeypatch.setattr(resolve, "TABLE_WIDTH", longest)
    monkeypatch.setattr(edge_texels, "IN_A_ROW", 1)
    monkeypatch.setattr(gpu, "limits", dataclasses.replace(gpu.limits, max_texture=longest))
    found = unequal_edges(trees.pool, BORDER["bicubic"], np.flatnonzero(trees.pool.used))
    assert max(len(some) for some in found.values()) > longest
    np.testing.assert_array_equal(shown(gpu, trees, "bicubic", light), whole)
