"""What lies on a surface hides it: pieces of faces that are no part of any texel."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from solver_scenes import grey, quads_scene

from app.atlas.parametrize import parametrize
from app.atlas.points import random_points
from app.atlas.texels import texel_surfaces, uniform_leaves
from app.scene.model import F64, Scene

CEILING = [(0, 3, 0), (2, 3, 0), (2, 3, 2), (0, 3, 2)]
FLOOR = [(0, 0, 0), (0, 0, 2), (2, 0, 2), (2, 0, 0)]
BOTTOM, TOP, SIDES = 0, 1, slice(2, 6)


def turned_box(low: float, high: float, angle: float = 0.4, size: float = 0.5) -> list[list[tuple[float, ...]]]:
    """Quads of a box so many metres wide, fronts out: bottom, top, sides."""
    around = angle + np.pi / 2 * np.arange(4)
    x, z = 1 + size * np.cos(around) / np.sqrt(2), 1 + size * np.sin(around) / np.sqrt(2)
    lower, upper = ([(x[k], y, z[k]) for k in range(4)] for y in (low, high))
    sides = [[lower[k], upper[k], upper[k - 3], lower[k - 3]] for k in range(4)]
    return [lower, upper[::-1], *sides]


def scene_of(*quads: list[tuple[float, ...]], double_sided: bool = False) -> Scene:
    return quads_scene([CEILING, *quads], [grey(0.5, 1.0, double_sided=double_sided)])


def seen_area(scene: Scene, y: float = 0.0, *, up: bool = True) -> tuple[float, NDArray[np.bool_], F64]:
    """Of texels in the plane y that face up or down; which of their texels something hides in part, and their positions."""
    charts = parametrize(scene, texels=3000)
    surfaces = texel_surfaces(scene, charts, uniform_leaves(charts))
    there = (surfaces.area > 0) & (np.abs(surfaces.position[..., 1] - y) < 1e-6)
    there &= np.abs(surfaces.normal[..., 1] - (1 if up else -1)) < 1e-3
    return float(surfaces.area[there].sum()), surfaces.cut[there], surfaces.position[there]


def under(position: F64, margin: float = 0.0, angle: float = 0.4) -> NDArray[np.bool_]:
    """Which positions lie under the box, so far from its edges."""
    x, z = position[:, 0] - 1, position[:, 2] - 1
    turn = angle + np.pi / 4
    u, v = np.cos(turn) * x + np.sin(turn) * z, -np.sin(turn) * x + np.cos(turn) * z
    return np.asarray(np.maximum(np.abs(u), np.abs(v)) < 0.25 - margin)


@pytest.mark.parametrize("bottom", [True, False])
@pytest.mark.parametrize("low", [0.0, 1e-4, -1e-7])
def test_a_floor_ends_at_the_foot_of_a_box(bottom: bool, low: float) -> None:
    """Exactly, whether the box has a bottom or not, and whether that lies a little above the floor or a rounding below."""
    box = turned_box(low, 0.5)
    area, cut, position = seen_area(scene_of(FLOOR, *(box if bottom else box[TOP:])))
    assert area == pytest.approx(4 - 0.25, rel=1e-6)
    assert cut.any() and not under(position, 1e-3).any()


def test_nothing_hides_where_nothing_lies() -> None:
    for quads in (
        [FLOOR],
        [FLOOR, *turned_box(0.1, 0.5)],  # it hovers
        [FLOOR, *turned_box(-0.2, 0.5)],  # it pierces
        [FLOOR, turned_box(0.0, 0.5)[BOTTOM]],  # a sheet that lies there face down: nothing says which side is open
        [
            FLOOR,
            *[quad[::-1] for quad in turned_box(0.0, 0.5)],
        ],  # a room that is seen from inside, on the floor of another
        [FLOOR, *turned_box(-0.5, 0.0)[BOTTOM:1], *turned_box(-0.5, 0.0)[SIDES]],  # open at the top: a well below
    ):
        area, cut, _ = seen_area(scene_of(*quads))
        assert area >= 4 - 1e-6 and not cut.any()


def test_boxes_hide_where_one_stands_on_another() -> None:
    lower, upper = turned_box(0.0, 0.5), turned_box(0.5, 0.8, size=0.4)
    scene = scene_of(FLOOR, *lower, *upper)
    assert seen_area(scene, 0.5)[0] == pytest.approx(0.25 - 0.16, rel=1e-6)
    assert seen_area(scene, 0.5, up=False)[0] == 0
    assert seen_area(scene)[0] == pytest.approx(4 - 0.25, rel=1e-6)


def test_two_that_lie_in_the_same_place_hide_it_once() -> None:
    box = turned_box(0.0, 0.5)
    area, _, position = seen_area(scene_of(FLOOR, *box, *turned_box(0.0, 0.4)))
    assert area == pytest.approx(4 - 0.25, rel=1e-6)
    assert ((position > -1e-9) & (position < 2 + 1e-9)).all()


def test_a_double_sided_box_keeps_its_own_sides() -> None:
    """The back of a face is no surface that its front lies on."""
    scene = scene_of(FLOOR, *turned_box(0.0, 0.5), double_sided=True)
    assert seen_area(scene)[0] == pytest.approx(4 - 0.25 + 0.25, rel=1e-6)  # and the inside of its bottom
    assert seen_area(scene, 0.5, up=False)[0] == pytest.approx(0.25, rel=1e-6)


def test_no_random_point_is_hidden() -> None:
    scene = scene_of(FLOOR, *turned_box(0.0, 0.5))
    points = random_points(scene, 4000, 1)
    position, normal = points.positions_normals(scene)
    floor = (np.abs(position[:, 1]) < 1e-9) & (normal[:, 1] > 0.5)
    assert 3000 < len(points) < 4000 and floor.sum() > 1000
    assert not under(position[floor]).any()
    assert len(random_points(scene_of(FLOOR), 4000, 1)) == 4000


def test_a_thin_slab_does_not_hide_itself() -> None:
    scene = scene_of(FLOOR, *turned_box(1.0, 1.0001))
    assert seen_area(scene, 1.0001)[0] == pytest.approx(0.25, rel=1e-6)
    assert seen_area(scene, 1.0, up=False)[0] == pytest.approx(0.25, rel=1e-6)
