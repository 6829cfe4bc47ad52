"""Large surfaces that are seen whole from one side are one chart; what hides or turns away a part of itself is not."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from atlas_scenes import TURN, moved, own_cache, scene_of, split_grid
from numpy.typing import NDArray

import app.atlas.large_surfaces as large_surfaces
from app.atlas.parametrize import parametrize
from app.atlas.sides import weld
from app.scene import shapes
from app.scene.model import F64, I32, Material, Scene

__all__ = ["own_cache"]


@pytest.fixture(autouse=True)
def few_are_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(large_surfaces, "LARGE", 256)
    monkeypatch.setattr(large_surfaces, "PIECE", 1024)


def _sheet(
    place: Callable[[F64, F64], list[F64]],
    across: int = 24,
    up: int = 24,
    omit: NDArray[np.bool_] | None = None,
    turn: F64 = TURN,
) -> Scene:
    """A grid of u, v in 0..1 at other places, turned; omit (across, up): squares that are left out."""
    flat = split_grid(shapes.quad((0, 0, 0), (1, 0, 0), (0, 0, 1)), across, up)
    triangles = flat.triangles if omit is None else flat.triangles[~np.repeat(omit.reshape(-1), 2)]
    points = np.stack(place(flat.positions[:, 0], flat.positions[:, 2]), axis=1)
    return moved(scene_of([shapes.Mesh(points, triangles, flat.uv)]), turn)


def _seen(scene: Scene) -> tuple[I32, F64]:
    points, corners = weld(scene)
    return large_surfaces.seen_whole(points, corners, np.zeros(len(corners), np.int64), lambda share: None)


def _hills(u: F64, v: F64) -> list[F64]:
    return [4 * u, 0.3 * np.sin(9 * u) * np.cos(7 * v), 4 * v]


def test_terrain_is_one_chart_without_seams() -> None:
    scene = _sheet(_hills)
    charts = parametrize(scene, density=8.0)
    assert charts.method == "1 pieces seen whole from one side"
    assert charts.chart_count == 1 and not len(charts.seams)
    a, b = charts.face_uv[:, 1] - charts.face_uv[:, 0], charts.face_uv[:, 2] - charts.face_uv[:, 0]
    covered = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2 / 8.0**2
    area = scene.normals_areas[1][charts.face_triangle]
    assert np.isclose(covered.sum(), area.sum())
    # the steepest slopes rise by 0.3·9/4: 1.2 m² of them are seen as one, and the whole chart is made larger
    assert np.abs(np.log(covered / area)).max() < np.log(1.2)
    width, height = charts.chart_rects[0, 2:]
    assert width * height < 1.2 * covered.sum() * 8.0**2  # it lies straight in its rectangle


def test_holes_are_borders_too() -> None:
    omit = np.zeros((24, 24), bool)
    omit[5:9, 7:12] = True
    chart, uv = _seen(_sheet(_hills, omit=omit))
    assert (chart == 0).all() and np.isfinite(uv).all()


def test_what_lies_twice_in_one_place_is_not_seen_whole() -> None:
    """A spiral ramp faces up everywhere; after one turn it hides itself."""

    def ramp(turns: float) -> Scene:
        def place(u: F64, v: F64) -> list[F64]:
            angle, radius = 2 * np.pi * turns * u, 1 + v
            return [radius * np.sin(angle), 0.5 * turns * u, radius * np.cos(angle)]

        return _sheet(place, across=60, up=4)

    assert (_seen(ramp(0.9))[0] == 0).all()
    assert (_seen(ramp(1.2))[0] < 0).all()
    assert (_seen(ramp(2.0))[0] < 0).all()  # its borders lie on each other


def test_what_turns_away_is_not_seen_whole_but_its_halves_may_be() -> None:
    def bent(u: F64, v: F64) -> list[F64]:
        angle = 3.6 * (u - 0.5)
        return [np.sin(angle), np.cos(angle), v]

    assert (_seen(_sheet(bent))[0] < 0).all()  # of fewer triangles than PIECE
    chart, _ = _seen(_sheet(bent, 48, 24, turn=np.eye(4)))  # each half is bent by 103 degrees
    assert set(chart) == {0, 1} and (np.bincount(chart) == 1152).all()


def test_a_closed_surface_is_not_seen_whole() -> None:
    assert (_seen(scene_of([shapes.icosphere(0.5, 3)]))[0] < 0).all()


def test_a_narrow_ring_is_several_charts() -> None:
    """The rectangle around a road around a lake is nearly empty."""

    def ring(width: float) -> Scene:
        def place(u: F64, v: F64) -> list[F64]:
            angle, radius = 2 * np.pi * u, 1 + width * v
            return [radius * np.sin(angle), 0 * u, radius * np.cos(angle)]

        return _sheet(place, across=400, up=2)

    assert set(_seen(ring(2.0))[0]) == {0}
    chart, uv = _seen(ring(0.1))
    assert (chart >= 0).all() and 4 <= chart.max() + 1 <= 16
    boxes = [np.ptp(uv[chart == k].reshape(-1, 2), axis=0).prod() for k in range(chart.max() + 1)]
    assert sum(boxes) < 1.1**2 * np.pi  # of 4.8 m²; each arc's box may be three times as large as it


def test_mirrored_surfaces_are_seen_from_their_front(monkeypatch: pytest.MonkeyPatch) -> None:
    """And those of two materials are a chart each."""
    sheet = _sheet(_hills)
    scene = dataclasses.replace(
        sheet,
        triangles=sheet.triangles[:, ::-1].copy(),
        material_ids=(np.arange(len(sheet.triangles)) % 48 < 24).astype(np.int32),
        materials=(Material("one", double_sided=True), Material("other", double_sided=True)),
    )
    charts = parametrize(scene, density=8.0)
    assert charts.method == "2 pieces seen whole from one side" and charts.chart_count == 4  # from the back, too
    a, b = charts.face_uv[:, 1] - charts.face_uv[:, 0], charts.face_uv[:, 2] - charts.face_uv[:, 0]
    turned = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    assert ((turned < 0) == charts.face_back).all()
