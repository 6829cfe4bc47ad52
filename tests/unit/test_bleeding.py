"""How far charts bleed into each other where a lightmap is read bilinearly, at full size and in its mip levels: each chart has a
light of its own, and it is counted how often a look-up on the surfaces is off by a tenth."""

from __future__ import annotations

import numpy as np
import pytest

from app.atlas.charts import GAP
from app.atlas.charts_cache import charts_of
from app.atlas.options import AtlasOptions
from app.atlas.points import Points, SideIndex, bilinear, random_points
from app.atlas.texels import texel_surfaces, uniform_leaves
from app.bake.arrange import arranged
from app.lightmap.at_points import light_at
from app.lightmap.gutter import fill_gutter
from app.scene.load import load_scene

POINTS = 20_000
OFF = 0.1


def off_by_level(name: str, texels: int, levels: int, padding: int = GAP) -> list[float]:
    """The share of look-ups that are off, of each level, with charts so many texels apart."""
    scene, charts = charts_of(load_scene(name), AtlasOptions(texels=texels))
    leaves = uniform_leaves(charts)
    surfaces = texel_surfaces(scene, charts, leaves)
    tile, row, column = np.nonzero(surfaces.face >= 0)
    where = leaves.y[tile] * charts.tile + row, leaves.x[tile] * charts.tile + column
    light = np.random.default_rng(1).uniform(1, 2, charts.chart_count)
    image, known = np.zeros((*charts.size[::-1], 3), np.float32), np.zeros(charts.size[::-1], bool)
    image[where] = light[charts.face_chart[surfaces.face[tile, row, column]]][:, None]
    known[where] = True
    image = fill_gutter(image, known)
    if padding > GAP:
        placed = arranged(scene, charts, image, padding, None)
        charts, image = placed.charts, placed.light
    points = random_points(scene, POINTS, 3)
    face = SideIndex(charts.face_triangle, charts.face_back).find(points.triangle, points.back)
    place = np.einsum("nk,nkc->nc", points.weights, charts.face_uv[face])[face >= 0]
    right = light[charts.face_chart[face[face >= 0]]]
    shares = []
    for level in range(levels):
        seen = bilinear(image, place / 2**level)[:, 0]
        shares.append(float((np.abs(seen / right - 1) > OFF).mean()))
        height, width = image.shape[:2]
        image = image.reshape(height // 2, 2, width // 2, 2, 3).mean((1, 3))
    return shares


# Measured: 0, 0, 1.5 and 0, 0, 1.0 and 0, 1.1, 10.5 per cent at levels 0, 1, 2: with many charts much lies near a border.
@pytest.mark.parametrize(
    ("scene", "texels", "most"),
    [
        ("cornell-box", 4000, (0.0, 0.002, 0.03)),
        ("textured-room", 4000, (0.0, 0.002, 0.02)),
        ("museum", 20000, (0.0, 0.02, 0.15)),
    ],
)
def test_charts_bleed_in_mip_levels_and_not_at_full_size(scene, texels, most):
    shares = off_by_level(scene, texels, len(most))
    assert all(share <= bound for share, bound in zip(shares, most, strict=True)), shares
    assert shares[2] > 0.005  # the words of gutter.py would be wrong


@pytest.mark.parametrize(("padding", "levels"), [(6, 2), (14, 3)])
def test_padding_keeps_charts_apart_in_mip_levels(padding, levels):
    """But for corners, where another chart is nearer than the own one, across the diagonal."""
    assert max(off_by_level("museum", 20000, levels, padding)) < 1e-3


@pytest.mark.parametrize("finer", [1, 2])
def test_padding_moves_light_and_does_not_change_it(finer):
    scene, charts = charts_of(load_scene("textured-room"), AtlasOptions(texels=2000))
    leaves = uniform_leaves(charts, finer - 1)
    tile, row, column = np.nonzero(texel_surfaces(scene, charts, leaves).face >= 0)
    known = np.zeros([finer * side for side in charts.size[::-1]], bool)
    known[leaves.y[tile] * charts.tile + row, leaves.x[tile] * charts.tile + column] = True
    light = fill_gutter(np.random.default_rng(2).uniform(1, 2, (*known.shape, 3)).astype(np.float32), known)
    points = random_points(scene, POINTS, 3)
    there = SideIndex(charts.face_triangle, charts.face_back).find(points.triangle, points.back) >= 0
    points = Points(points.triangle[there], points.back[there], points.weights[there])
    placed = arranged(scene, charts, light, 8, None)
    np.testing.assert_allclose(
        light_at(placed.light, placed.charts, points), light_at(light, charts, points), rtol=1e-5
    )
