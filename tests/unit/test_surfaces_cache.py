"""Texels that are kept: the same again, and cut anew where anything differs that they follow from; cutting can be stopped."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from atlas_scenes import box_room, own_cache, scene_of

from app.atlas.charts import Charts
from app.atlas.parametrize import parametrize
from app.atlas.texels import TexelSurfaces, texel_surfaces, uniform_leaves
from app.lightmap import surfaces
from app.lightmap.surfaces import on_their_faces, surfaces_of
from app.scene import shapes
from app.scene.model import Material, Scene
from app.util.background import CancelledError

__all__ = ["own_cache"]


def _refuse(*_: object) -> TexelSurfaces:
    raise AssertionError("cuts them")


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch) -> Scene:
    """A room with a drum, that folds texels, and a box that hides a part of the floor."""
    monkeypatch.setattr(surfaces, "FEWEST", 0)
    return scene_of(
        [box_room(), shapes.cylinder(0.41, 1.07, 14).moved(1, 0, 1), shapes.box((0.4, 0.5, 0.6)).moved(-1, -1.25, 0)],
        [Material("a")],
    )


@pytest.fixture
def charts(scene: Scene) -> Charts:
    return parametrize(scene, texels=3000)


def test_what_is_kept_is_the_same_again(scene: Scene, charts: Charts, monkeypatch: pytest.MonkeyPatch) -> None:
    leaves = uniform_leaves(charts)
    made = on_their_faces(scene, charts, texel_surfaces(scene, charts, leaves))
    assert made.cut.any() and (made.position != made.leading).any()
    first = surfaces_of(scene, charts, leaves)
    monkeypatch.setattr(surfaces, "texel_surfaces", _refuse)
    again = surfaces_of(scene, charts, leaves)
    for field in dataclasses.fields(TexelSurfaces):
        for other in (first, again):
            one, two = getattr(made, field.name), getattr(other, field.name)
            assert one.dtype == two.dtype and np.array_equal(one, two), field.name


def test_other_leaves_and_other_charts_are_cut_anew(
    scene: Scene, charts: Charts, monkeypatch: pytest.MonkeyPatch
) -> None:
    leaves = uniform_leaves(charts)
    surfaces_of(scene, charts, leaves)
    monkeypatch.setattr(surfaces, "texel_surfaces", _refuse)
    for other, some in (
        (charts, leaves.only(np.arange(1, len(leaves)))),
        (dataclasses.replace(charts, face_uv=charts.face_uv + 1e-9), leaves),
    ):
        with pytest.raises(AssertionError, match="cuts them"):
            surfaces_of(scene, other, some)


def test_cutting_says_how_far_it_is_and_can_be_stopped(scene: Scene, charts: Charts) -> None:
    shares: list[float] = []
    texel_surfaces(scene, charts, uniform_leaves(charts), shares.append)
    assert shares == sorted(shares) and 0 < shares[-1] <= 1

    def stop(share: float) -> None:
        raise CancelledError

    with pytest.raises(CancelledError):
        texel_surfaces(scene, charts, uniform_leaves(charts), stop)
