"""What lies on a surface hides it: pieces of faces that are no part of any texel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray
from solver_scenes import grey, quads_scene

from app.atlas import contacts
from app.atlas.cuts import cut_at_contacts
from app.atlas.parametrize import parametrize
from app.atlas.points import random_points
from app.atlas.texels import texel_count, texel_surfaces, uniform_leaves
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


def test_a_texel_is_looked_from_beside_what_stands_in_its_middle() -> None:
    """The centroid of what is left of it would lie within the box."""
    scene = scene_of(FLOOR, *turned_box(0.0, 0.5))
    charts = parametrize(scene, density=0.5)  # one texel
    surfaces = texel_surfaces(scene, charts, uniform_leaves(charts))
    floor = (surfaces.area > 0) & (np.abs(surfaces.position[..., 1]) < 1e-6) & (surfaces.normal[..., 1] > 0.9)
    assert floor.sum() == 1 and surfaces.area[floor] == pytest.approx(4 - 0.25)
    for place in surfaces.position[floor], surfaces.leading[floor]:
        assert not under(place).any() and np.abs(place[:, [0, 2]] - 1).max() < 0.5


def test_a_box_without_bottom_that_walls_pierce_hides_what_is_under_it() -> None:
    """Both are cut where they meet, and have the edges there in common: a door that stands a little in the wall beside it."""
    _, *door = turned_box(0.0, 1.0)
    wall = [[(x + 0.3, y, z) for x, y, z in quad] for quad in turned_box(0.5, 1.5)[SIDES]]
    scene = cut_at_contacts(scene_of(FLOOR, *door, *wall)).scene
    assert len(scene.triangles) > 2 * (1 + 1 + 5 + 4), "or nothing is pierced"
    assert seen_area(scene)[0] == pytest.approx(4 - 0.25, rel=1e-5)


@pytest.mark.parametrize("most_meet", [contacts.MOST_MEET, 10])
def test_of_many_boxes_in_one_plane_those_are_looked_at_that_meet(
    monkeypatch: pytest.MonkeyPatch, most_meet: int
) -> None:
    boxes = [
        [(x / 4 + 0.75 * i, y, z / 4 + 0.75 * k) for x, y, z in quad]
        for i in range(3)
        for k in range(3)
        for quad in turned_box(0.0, 0.5)
    ]
    scene = scene_of(FLOOR, *boxes)
    area, _, _ = seen_area(scene)
    assert area == pytest.approx(4 - 9 * 0.25 / 16, rel=1e-6)
    monkeypatch.setattr(contacts, "MOST_NEAR", 5)
    monkeypatch.setattr(contacts, "MOST_MEET", most_meet)
    if most_meet == 10:
        assert "dark feet" in parametrize(scene, texels=3000).warnings[0]
    else:
        assert seen_area(scene)[0] == pytest.approx(area, rel=1e-9)


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
    """The back of a face is no surface that its front lies on: one without a top shows the inside of its bottom; a closed one has
    none."""
    closed = turned_box(0.0, 0.5)
    quads = [quad for k, quad in enumerate(closed) if k != TOP]
    scene = scene_of(FLOOR, *quads, double_sided=True)
    assert seen_area(scene)[0] == pytest.approx(4 - 0.25 + 0.25, rel=1e-6)
    scene = scene_of(FLOOR, *closed, double_sided=True)
    assert seen_area(scene)[0] == pytest.approx(4 - 0.25, rel=1e-6)
    assert seen_area(scene, 0.5)[0] == pytest.approx(0.25, rel=1e-6)
    assert seen_area(scene, 0.5, up=False)[0] == 0


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


def upright(low: tuple[float, float], high: tuple[float, float], top: float = 0.5) -> list[list[tuple[float, ...]]]:
    """A box along the axes from corner to corner (x, z), without its bottom."""
    (x0, z0), (x1, z1) = low, high
    lower, upper = ([(x1, y, z0), (x1, y, z1), (x0, y, z1), (x0, y, z0)] for y in (0.0, top))
    return [upper[::-1], *([lower[k], upper[k], upper[k - 3], lower[k - 3]] for k in range(4))]


@pytest.mark.parametrize("nth", range(40))
def test_boxes_along_texels_edges_corners_and_the_diagonal_hide_what_they_stand_on(nth: int) -> None:
    """The first on a grid that the floor's own corners, edges and diagonal are on, too; others in part over it."""
    random = np.random.default_rng(nth)
    boxes, footprints = [], []
    for k in range(1 + nth % 3):
        (x0, x1), (z0, z1) = (np.sort(random.choice(9, 2, replace=False)) * (0.25 - 0.01 * k) for _ in "xz")
        footprints.append(shapely.box(x0, z0, x1, z1))
        boxes += upright((x0, z0), (x1, z1), 0.5 + 0.1 * k)
    covered = shapely.union_all(footprints)
    area, _, position = seen_area(scene_of(FLOOR, *boxes))
    assert area == pytest.approx(4 - covered.area, rel=1e-6, abs=1e-9)
    # but where a corner leaves a texel the shape of an L, or a gap divides it, whose middle is no part of it
    assert shapely.contains_xy(covered.buffer(-1e-6), position[:, 0], position[:, 2]).mean() < 0.01


@pytest.mark.parametrize("double_sided", [False, True])
def test_what_is_open_hides_no_floor_in_it(double_sided: bool) -> None:
    """Walls around a yard; a tray with a floor of its own, a little thicker than nothing; a house that is looked into."""
    yard = turned_box(0.0, 0.5)[SIDES]
    assert seen_area(scene_of(FLOOR, *yard, double_sided=double_sided))[0] == pytest.approx(4, rel=1e-6)
    outer, inner = upright((0.5, 0.5), (1.5, 1.5), 0.3), upright((0.501, 0.501), (1.499, 1.499), 0.3)
    rim = [[(a, 0.3, b), (c, 0.3, d), (e, 0.3, f), (g, 0.3, h)] for a, b, c, d, e, f, g, h in RIMS]
    bottom, floor = [[(x, y, z) for x, z in corners] for y, corners in ((0.0, OUTER), (0.001, INNER[::-1]))]
    inside = [[(x, max(y, 0.001), z) for x, y, z in quad[::-1]] for quad in inner[1:]]
    scene = scene_of(bottom, floor, *outer[1:], *inside, *rim, double_sided=double_sided)
    assert seen_area(scene, 0.001)[0] == pytest.approx(0.998**2, rel=1e-6)
    if double_sided:
        assert seen_area(scene_of(FLOOR, *turned_box(0.0, 0.5)[TOP:], double_sided=True))[0] == pytest.approx(
            4, rel=1e-6
        )


OUTER = [(1.5, 0.5), (1.5, 1.5), (0.5, 1.5), (0.5, 0.5)]
INNER = [(1.499, 0.501), (1.499, 1.499), (0.501, 1.499), (0.501, 0.501)]
RIMS = [(*OUTER[k], *INNER[k], *INNER[k - 3], *OUTER[k - 3]) for k in range(4)]


def test_as_many_texels_are_told_as_there_are() -> None:
    for quads in ([FLOOR], [FLOOR, *turned_box(0.0, 0.5)], [FLOOR, *upright((1.25, 0.0), (2.0, 0.75))]):
        charts = parametrize(scene_of(*quads), texels=3000)
        surfaces = texel_surfaces(scene_of(*quads), charts, uniform_leaves(charts))
        assert texel_count(charts) == np.count_nonzero(surfaces.face >= 0) == np.count_nonzero(surfaces.area > 0)


@pytest.mark.parametrize("opacity", [1.0, 0.5])
def test_what_is_not_opaque_hides_nothing(opacity: float) -> None:
    """A rug of a quarter of the floor."""
    rug = [(x / 2, 1e-3, z / 2) for x, _, z in FLOOR]
    paint = grey(0.5, 1.0)
    scene = quads_scene([CEILING, FLOOR, rug], [paint, replace(paint, opacity=opacity)], [0, 0, 1])
    area, _, _ = seen_area(scene, 0.0)
    assert area == pytest.approx(3.0 if opacity == 1.0 else 4.0)
