"""Charts in the atlas: none overlap, gaps hold, little is wasted."""

from __future__ import annotations

import time

import numpy as np
import pytest

from app.atlas import packing
from app.atlas.charts import ALIGN, DEFAULT_TILE, GAP, TILES
from app.atlas.layout import measured
from app.atlas.packing import outlines, pack
from app.atlas.sides import Edges, Sides
from app.errors import UserError
from app.scene.model import F64

rng = np.random.default_rng(7)


def _rectangles(sizes: np.ndarray) -> tuple[F64, np.ndarray]:
    """Two triangles for each (w, h)."""
    unit = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], float)
    return (unit[None] * sizes[:, None, None]).reshape(-1, 3, 2), np.repeat(np.arange(len(sizes)), 2)


def _triangles(count: int, largest: float) -> tuple[F64, np.ndarray]:
    uv = rng.uniform(0, largest, (count, 3, 2)) * rng.uniform(0.01, 1, (count, 1, 1))
    return uv - uv.min(axis=1, keepdims=True), np.arange(count)


def _covered(uv: F64, size: tuple[int, int]) -> np.ndarray:
    """Texels near any of a few thousand points of the triangles, (H, W) bool: independent of the code under test."""
    weights = rng.dirichlet((1, 1, 1), 3000)
    edges = np.linspace(0, 1, 500)[:, None]
    rims = [edges * np.eye(3)[a] + (1 - edges) * np.eye(3)[b] for a, b in ((0, 1), (1, 2), (2, 0))]
    points = np.einsum("pk,fkc->fpc", np.concatenate([weights, *rims]), uv).reshape(-1, 2)
    texel = np.minimum(np.floor(points), np.array(size) - 1).astype(int)
    # points on a texel's edge, but for rounding, tell nothing
    inside = (np.abs(points - texel - 0.5) < 0.5 - 1e-9).all(axis=1)
    covered = np.zeros((size[1], size[0]), bool)
    covered[texel[inside, 1], texel[inside, 0]] = True
    return covered


CASES = {
    "rectangles": _rectangles(ALIGN * rng.integers(1, 20, (80, 2)).astype(float)),
    "odd rectangles": _rectangles(rng.integers(1, 30, (80, 2)).astype(float)),
    "triangles": _triangles(80, 90.0),
    "tiny": _triangles(80, 3.0),
    "long": _rectangles(np.array([[300.0, 1.0], [299.0, 2.0], [2.0, 298.0], [5.0, 5.0], [1.0, 1.0]])),
}


@pytest.mark.parametrize(
    ("name", "tile"), [*((name, DEFAULT_TILE) for name in CASES), *(("triangles", t) for t in TILES)]
)
def test_gaps_hold(name: str, tile: int) -> None:
    uv, chart = CASES[name]
    origins, size = pack(outlines(uv, chart, chart.max() + 1), tile)
    assert size[0] % tile == size[1] % tile == 0
    assert (origins % ALIGN == 0).all()
    placed = uv + origins[chart][:, None]
    assert placed.min() >= 0 and (placed <= size).all()
    owner = np.full((size[1] + 2 * GAP, size[0] + 2 * GAP), -1)
    for c in range(chart.max() + 1):
        rows, columns = np.nonzero(_covered(placed[chart == c], size))
        for dx in range(-GAP, GAP + 1):
            for dy in range(-GAP, GAP + 1):
                near = owner[rows + GAP + dy, columns + GAP + dx]
                assert ((near == -1) | (near == c)).all(), (name, c)
        owner[rows + GAP, columns + GAP] = c


@pytest.mark.parametrize(("name", "least"), [("rectangles", 0.88), ("triangles", 0.6)])
def test_little_is_wasted(name: str, least: float) -> None:
    # least: what a skyline reaches on few charts; triangles hollow each other's boxes out
    uv, chart = CASES[name]
    shapes = outlines(uv, chart, chart.max() + 1)
    _, size = pack(shapes, DEFAULT_TILE)
    assert ((shapes.top - shapes.bottom).sum() * ALIGN) / (size[0] * size[1]) > least
    assert 0.4 <= size[0] / size[1] <= 2.5


def test_many_charts_pack_in_time_and_fill_holes() -> None:
    sizes = np.concatenate([rng.integers(20, 150, (60, 2)), rng.integers(1, 15, (8000, 2))]).astype(float)
    uv, chart = _rectangles(sizes)
    start = time.process_time()
    shapes = outlines(uv, chart, len(sizes))
    _, size = pack(shapes, DEFAULT_TILE)
    assert time.process_time() - start < 2.0  # 0.3 s measured on an idle core
    assert ((shapes.top - shapes.bottom).sum() * ALIGN) / (size[0] * size[1]) > 0.9


def test_too_long_a_chart_is_refused() -> None:
    uv, chart = _rectangles(np.array([[packing.MAX_SIDE + 4.0, 4.0]]))
    with pytest.raises(UserError, match=r"16400 x 16 texels: the limit is 16384"):
        pack(outlines(uv, chart, 1), DEFAULT_TILE)


@pytest.mark.parametrize(("lit_backs", "inner"), [([], 1), ([0, 1], 1), ([1], 0)])
def test_edges_inside_of_a_chart_are_left_out(lit_backs: list[int], inner: int) -> None:
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    uv = np.array([[0, 0], [9, 0], [9, 7], [0, 7.0]])[triangles]
    lit = Sides(np.array([0, 1, *lit_backs], np.int32), np.arange(2 + len(lit_backs)) >= 2, 0)
    chart, none = np.zeros(2, np.int32), np.empty((0, 2))
    slow, fast = (measured(chart, uv, none, lit, edges) for edges in (None, Edges.of(triangles)))
    assert slow.rim.all() and np.count_nonzero(~fast.rim) == 2 * inner  # from both of its sides
    assert slow.border == fast.border == 16
