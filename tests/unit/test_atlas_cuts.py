"""Triangles are cut where other surfaces touch or pierce them, and charts end there."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from solver_scenes import grey, quads_scene, room

from app.atlas import cuts, flat_pieces, intersections
from app.atlas.charts import Charts
from app.atlas.cuts import cut_at_contacts
from app.atlas.parametrize import parametrize
from app.atlas.triangle_cuts import ENDS, JUMPS
from app.scene.model import F64, Scene
from app.scene.validate import Part, validate

WALL = [(1.0, 0, 0), (1.0, 1, 0), (1.0, 1, 1), (1.0, 0, 1)]


def box(low: tuple[float, ...], high: tuple[float, ...]) -> F64:
    """Six quads, fronts out."""
    return room(np.subtract(high, low))[:, ::-1] + low


def scene_of(*quads: object, double_sided: bool = False) -> Scene:
    """In a room 2 × 1 × 1, fronts inward."""
    return quads_scene([*room((2.0, 1.0, 1.0)), *quads], [grey(0.5, double_sided=double_sided)])


def charts_of(scene: Scene) -> tuple[Scene, Charts]:
    cut = cut_at_contacts(scene)
    return cut.scene, parametrize(cut.scene, texels=3000, ends=cut.ends)


def spans(scene: Scene, charts: Charts, axis: int) -> NDArray[np.float64]:
    """(charts, 2): from where to where each reaches along an axis."""
    at = scene.corners[charts.face_triangle, :, axis]
    return np.array(
        [(at[charts.face_chart == k].min(), at[charts.face_chart == k].max()) for k in range(charts.chart_count)]
    )


def on_one_side(spans: NDArray[np.float64], place: float) -> bool:
    return bool(((spans[:, 1] <= place + 1e-5) | (spans[:, 0] >= place - 1e-5)).all())


def test_where_nothing_meets_nothing_is_cut() -> None:
    """A box that stands on the floor hides what is under it, and one that touches a wall touches its rim."""
    for quads in ([], box((0.5, 0, 0.3), (0.8, 0.4, 0.6)), [[(x, y, z) for y, x, z in WALL[::-1]]]):
        scene = scene_of(*quads)
        cut = cut_at_contacts(scene)
        assert cut.scene is scene and cut.ends is None


@pytest.mark.parametrize("turn", [0.0, 0.3], ids=["along the axes", "askew"])
def test_a_sheet_wall_parts_charts_at_its_foot_and_top(turn: float) -> None:
    wall = [(x + turn * (z - 0.5), y, z) for x, y, z in WALL]
    scene = scene_of(wall, double_sided=True)
    cut, charts = charts_of(scene)
    assert charts.chart_count == 4 * 2 + 2 + 2  # floor, ceiling, long walls; short walls; both sides of this one
    assert cut.normals_areas[1].sum() == pytest.approx(scene.normals_areas[1].sum(), rel=1e-9)
    beside = cut.corners[charts.face_triangle] @ [1.0, 0.0, -turn] - 1.0 + 0.5 * turn
    for chart in range(charts.chart_count):
        mine = beside[charts.face_chart == chart]
        assert mine.max() < 1e-5 or mine.min() > -1e-5


def test_charts_end_at_edges_that_are_there_where_a_third_surface_has_them_too() -> None:
    """Rooms of quads that share a wall: floor, ceiling and long walls go on behind it, in the same plane."""
    left = room()
    right = np.add(left, (1.0, 0.0, 0.0))
    scene = quads_scene([*np.delete(left, 3, 0), *np.delete(right, 2, 0), WALL], [grey(0.5, double_sided=True)])
    _, charts = charts_of(scene)
    assert on_one_side(spans(scene, charts, 0), 1.0)
    assert parametrize(scene).chart_count < charts.chart_count


def test_charts_end_where_a_sheet_shares_the_corners_of_the_floor_that_it_stands_on() -> None:
    """Floor and sheet are one surface: the floor goes on beside it, and a wall joins both."""
    floor = [[(x, 0, z), (x, 0, z + 0.5), (x + 1, 0, z + 0.5), (x + 1, 0, z)] for x in (0, 1) for z in (0, 0.5)]
    sheet = [(1, 0, 0), (1, 0.5, 0), (1, 0.5, 0.5), (1, 0, 0.5)]
    roof = [(0, 1, 0), (2, 1, 0), (2, 1, 1), (0, 1, 1)]
    wall = [(0, 0, 0), (1, 0, 0), (1, 0.5, 0), (0, 0.5, 0)]
    scene = quads_scene([*floor, sheet, wall, roof], [grey(0.5, double_sided=True)])
    cut, charts = charts_of(scene)
    on_floor = charts.face_chart[(cut.corners[charts.face_triangle, :, 1] == 0).all(1)]
    assert on_one_side(spans(cut, charts, 0)[np.unique(on_floor)], 1.0)
    assert parametrize(scene).chart_count < charts.chart_count


def test_a_beam_parts_a_wall_whose_diagonals_meet_its_edges_near_a_corner(monkeypatch: pytest.MonkeyPatch) -> None:
    """A contact shorter than what is told apart is none; the others around the beam are joined all the same."""
    monkeypatch.setattr(flat_pieces, "MOST_ENDS", 0)
    scene = scene_of(*box((0.5, 0.4, -1e-4), (0.52, 0.42, 0.5)))
    cut = cut_at_contacts(scene)
    assert cut.ends is not None and cut.scene.warnings == scene.warnings
    start = cut.scene.corners[(cut.ends == JUMPS).any(1)]
    assert {0.5, 0.52} <= set(start[(np.abs(start[..., 2]) < 1e-9)][:, 0].round(5).tolist())


def test_what_pierces_is_cut_and_cuts() -> None:
    """A box through the floor: its sides end there, and the floor has a hole in it, which is a chart by itself."""
    scene = scene_of(*box((0.5, -0.2, 0.3), (0.8, 0.4, 0.6)))
    cut, charts = charts_of(scene)
    assert on_one_side(spans(cut, charts, 1), 0.0)
    assert charts.chart_count == 6 + 1 + 1 + 2 * 4  # the room's, the hole, the top, the sides
    x, y = (spans(cut, charts, k) for k in (0, 1))
    floor = (np.abs(y) < 1e-6).all(1)
    assert sorted(map(tuple, x[floor].round(6).tolist())) == [(0.0, 2.0), (0.5, 0.8)]


def test_curved_surfaces_are_cut_and_stay_closed() -> None:
    """A ball through the floor, off its vertices."""
    ball = trimesh.creation.uv_sphere(0.3, count=[16, 16])
    floor = scene_of()
    parts = [
        Part(floor.positions, floor.triangles),
        Part(np.add(ball.vertices, (0.813, 0.0271, 0.44)), ball.faces, material_ids=1),
    ]
    scene = validate("ball", "ball", parts, ["ball"], [grey(0.5), grey(0.5)])
    cut, charts = charts_of(scene)
    assert on_one_side(spans(cut, charts, 1), 0.0)
    assert cut.normals_areas[1].sum() == pytest.approx(scene.normals_areas[1].sum(), rel=1e-9)
    of_ball = cut.triangles[cut.material_ids == 1]
    assert len(of_ball) > len(ball.faces) and trimesh.Trimesh(cut.positions, of_ball).is_watertight


def test_a_foot_that_ends_in_the_middle_is_drawn_on() -> None:
    """Light goes on there, while charts end."""
    screen = [(1.0, 0, 0.3), (1.0, 0.5, 0.3), (1.0, 0.5, 0.6), (1.0, 0, 0.6)]
    cut = cut_at_contacts(scene_of(screen))
    assert cut.ends is not None
    start = cut.scene.corners
    middle = (start + np.roll(start, -1, axis=1)) / 2
    for kind, inside in ((JUMPS, True), (ENDS, False)):
        at = middle[cut.ends == kind]
        assert len(at) and (np.abs(at[:, :2] - [1, 0]) < 1e-5).all()
        assert (((at[:, 2] > 0.3) & (at[:, 2] < 0.6)) == inside).all()
    assert on_one_side(spans(*charts_of(scene_of(screen)), 0)[:2], 1.0)


def test_a_thin_door_parts_the_floor_along_its_middle() -> None:
    """Which it hides: a texel wider than the door would have both of its sides."""
    door = box((0.99, 0.0, 0.3), (1.01, 0.8, 0.8))
    scene = scene_of(*door)
    cut, charts = charts_of(scene)
    assert cut.normals_areas[1].sum() == pytest.approx(scene.normals_areas[1].sum(), rel=1e-9)
    floor = (cut.corners[charts.face_triangle, :, 1] < 1e-9).all(1) & (charts.face_chart >= 0)
    beside = cut.corners[charts.face_triangle, :, 0]
    for chart in np.unique(charts.face_chart[floor]):
        mine = beside[(charts.face_chart == chart) & floor]
        assert mine.max() <= 1.0 + 1e-5 or mine.min() >= 1.0 - 1e-5


def test_a_hollow_wall_parts_the_floor_that_goes_on_around_its_end() -> None:
    """The floor between its sheets is a chart of its own: one of both rooms would have the other one's texels across a gap."""
    sheets = [[(x, 0.0, 0.0), (x, 0.5, 0.0), (x, 0.5, 0.6), (x, 0.0, 0.6)] for x in (0.98, 1.02)]
    end = [(0.98, 0.0, 0.6), (0.98, 0.5, 0.6), (1.02, 0.5, 0.6), (1.02, 0.0, 0.6)]
    cut, charts = charts_of(scene_of(sheets[0][::-1], sheets[1], end))
    floor = charts.face_chart[(cut.corners[charts.face_triangle, :, 1] < 1e-9).all(1)]
    assert on_one_side(spans(cut, charts, 0)[np.unique(floor)], 1.0)


def test_a_board_a_little_before_a_wall_parts_it() -> None:
    """Where it ends above the floor, the wall below it is in the dark: its texels may not be those of the wall above."""
    board = box((2e-4, 0.05, 0.1), (0.02, 0.06, 0.9))
    scene = scene_of(
        *board, [(0, 0.5, 0), (1, 0.5, 0), (1, 0.5, 1), (0, 0.5, 1)][::-1], *box((-0.1, 0.7, 0.7), (1, 0.8, 0.8))
    )
    cut, charts = charts_of(scene)
    wall = charts.face_chart[(np.abs(cut.corners[charts.face_triangle, :, 0]) < 1e-9).all(1)]
    y = spans(cut, charts, 1)[np.unique(wall)]
    assert on_one_side(y, 0.055) and y.min() == 0


def test_grass_does_not_shred_a_floor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(flat_pieces, "MOST_ENDS", 5)
    blades = [[(x, 0, 0.3), (x, 0.2, 0.3), (x, 0.2, 0.4), (x, 0, 0.4)] for x in (0.5, 1.0, 1.5)]
    cut = cut_at_contacts(scene_of(*blades))
    assert cut.ends is None and "6 thin things" in cut.scene.warnings[0]


def test_a_cut_is_cut_once() -> None:
    once = cut_at_contacts(scene_of(*box((0.5, -0.2, 0.3), (0.8, 0.4, 0.6)), WALL, double_sided=True))
    again = cut_at_contacts(once.scene)
    assert again.ends is not None and once.ends is not None
    assert len(again.scene.triangles) == len(once.scene.triangles)
    first, second = (parametrize(cut.scene, texels=3000, ends=cut.ends) for cut in (once, again))
    assert first.chart_count == second.chart_count


def test_what_triangles_carry_is_cut_along() -> None:
    scene = scene_of(WALL, double_sided=True)
    uv = (scene.corners[..., [0, 2]] * 0.25).astype(np.float32)
    normals = np.broadcast_to(scene.normals_areas[0][:, None], scene.corners.shape).astype(np.float32)
    scene = dataclasses.replace(scene, uv0=uv, normals=normals)
    cut = cut_at_contacts(scene).scene
    assert cut.uv0 is not None and cut.normals is not None
    np.testing.assert_allclose(cut.uv0, cut.corners[..., [0, 2]] * 0.25, atol=1e-5)
    np.testing.assert_allclose(
        cut.normals, np.broadcast_to(cut.normals_areas[0][:, None], cut.corners.shape), atol=1e-5
    )


def test_too_many_to_look_at_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(intersections, "MOST_PAIRS", 3)
    cut = cut_at_contacts(scene_of(WALL))
    assert cut.ends is None and "too many" in cut.scene.warnings[0]


def test_of_too_many_that_meet_the_largest_are_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    """The floor, of what four sunken boxes pierce."""
    boxes = [box((x, -0.1, 0.3), (x + 0.2, 0.3, 0.6)) for x in (0.1, 0.5, 0.9, 1.3)]
    scene = scene_of(*np.concatenate(boxes))
    assert cut_at_contacts(scene).scene.warnings == scene.warnings
    monkeypatch.setattr(cuts, "MOST_PIECES", 1)
    cut = cut_at_contacts(scene)
    note = "16 small surfaces are not cut where others meet them, only the 1 largest are: light and shadow"
    assert any(note in warning for warning in cut.scene.warnings)
    assert cut.ends is not None
    jumps = cut.scene.object_ids[(cut.ends == JUMPS).any(1)]
    assert set(jumps.tolist()) == {0}  # the room's first wall
