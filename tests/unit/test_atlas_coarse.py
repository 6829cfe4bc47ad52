"""Charts that are there at once: every lit side is in one, to about its size, and no two share a texel."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from atlas_scenes import TURN, box_room, face_areas, moved, scene_of

from app.atlas import coarse
from app.atlas.charts import Charts
from app.atlas.coarse import coarse_charts
from app.atlas.enclosed import sides_with_texels
from app.atlas.texels import texel_surfaces, uniform_leaves
from app.scene import shapes
from app.scene.model import Material, Scene
from app.util.background import unheard

SCENES = {
    "box": lambda: scene_of([box_room()]),
    "ball": lambda: moved(scene_of([box_room(), shapes.icosphere(0.8, 4)]), TURN),
    "two sides": lambda: scene_of(
        [box_room(), shapes.icosphere(0.8, 3)], [Material("a"), Material("b", double_sided=True)]
    ),
}


def charts_of(scene: Scene, texels: int = 4000) -> Charts:
    charts = coarse_charts(scene, 16, texels, unheard)
    assert charts is not None
    return charts


@pytest.mark.parametrize("name", SCENES)
def test_all_lit_surface_has_texels_of_its_own(name: str) -> None:
    scene = SCENES[name]()
    charts = charts_of(scene)
    lit = sides_with_texels(scene)
    assert np.array_equal(charts.face_triangle, lit.triangle) and np.array_equal(charts.face_back, lit.back)
    surfaces = texel_surfaces(scene, charts, uniform_leaves(charts))
    assert surfaces.area.sum() == pytest.approx(face_areas(scene, charts).sum())
    assert 2000 < np.count_nonzero(surfaces.face >= 0) < 8000
    a, b = charts.face_uv[:, 1] - charts.face_uv[:, 0], charts.face_uv[:, 2] - charts.face_uv[:, 0]
    turn = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    assert (np.where(charts.face_back, -turn, turn) > 0).all()  # seen from the front; a back in a mirror
    shortened = np.abs(turn) / 2 / (charts.density**2 * face_areas(scene, charts))
    assert shortened.min() > 1 / np.sqrt(3) - 1e-6 and shortened.max() < 1 + 1e-6
    for k, (x, y, width, height) in enumerate(charts.chart_rects.tolist()):
        assert 0 <= x and 0 <= y and x + width <= charts.size[0] and y + height <= charts.size[1]
        inside = charts.face_uv[charts.face_chart == k].reshape(-1, 2) - (x, y)
        assert inside.min() > -1e-9 and (inside < (width + 1e-9, height + 1e-9)).all()


def test_materials_have_the_density_they_ask_for() -> None:
    def texels(scale: float) -> float:
        materials = [Material("a"), Material("b", lightmap_scale=scale)]
        charts = charts_of(scene_of([box_room(), shapes.icosphere(0.8, 3)], materials))
        a, b = charts.face_uv[:, 1] - charts.face_uv[:, 0], charts.face_uv[:, 2] - charts.face_uv[:, 0]
        of_ball = charts.face_triangle >= len(box_room().triangles)
        return float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])[of_ball].sum() / 2 / charts.density**2)

    assert texels(3.0) == pytest.approx(9 * texels(1.0))


def test_a_soup_of_loose_triangles_has_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(coarse, "MOST_PIECES", 5)
    assert coarse_charts(scene_of([box_room()]), 16, 1000, unheard) is None


def test_specks_go_with_the_pieces_beside_them() -> None:
    """Where the pieces of a rough ball meet, single triangles turn to another axis than those around."""
    scene = scene_of([shapes.icosphere(0.8, 4)])
    rough = 1 + 0.01 * np.random.default_rng(1).standard_normal(len(scene.positions))
    charts = charts_of(dataclasses.replace(scene, positions=scene.positions * rough[:, None]))
    sizes = np.bincount(charts.face_chart)
    assert len(sizes) < 60 and np.sort(sizes)[-6:].sum() > 0.95 * len(scene.triangles)  # else 304
