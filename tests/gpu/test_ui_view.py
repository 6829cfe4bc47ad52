"""The interface around the 3-D view: what mouse and keys move, what a click picks, the atlas."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from desks import PICKED, VIEW, Desk, desk, session, where
from fake_session import FakeScene, FakeSession
from imgui_bundle import imgui

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.ui.panels import atlas

__all__ = ["desk", "session", "where"]


def test_another_scene_of_the_same_name_is_another_scene(desk: Desk) -> None:
    state, session = desk.ui.state, desk.session

    def select() -> None:
        state.picked, state.material, state.atlas = PICKED, 2, AtlasOptions(texels=77)
        state.emission_colours[3] = (1.0, 0.0, 0.0)
        desk.frames()

    select()
    assert state.picked is PICKED and state.material == 2, "nothing is forgotten by itself"
    session.lightmap = SimpleNamespace(space=session.lightmap.space)  # the same scene, cut anew
    desk.frames()
    assert state.picked is None and state.atlas in (None, session.atlas)
    assert state.material == 2 and state.emission_colours
    select()
    session.unedited, session.lightmap = FakeScene(**vars(session.scene)), SimpleNamespace(space=session.lightmap.space)
    desk.frames()
    assert state.picked is None and state.material == 0
    assert 3 not in state.emission_colours


def test_the_draft_of_a_cut_stays_until_it_is_done(gpu: Gpu, where: dict[str, tuple[float, float]]) -> None:
    desk, draft = Desk(gpu, FakeSession(), (1920, 1080)), AtlasOptions(texels=777)
    desk.ui.state.atlas = draft
    desk.session.loading = SimpleNamespace(stage="unfolding", fraction=0.4, cancel=lambda: None)
    desk.frames()
    desk.click(*where["anew"])
    assert ("cut_anew",) not in desk.session.calls, "a scene is on its way"
    desk.session.loading = None
    desk.frames()
    desk.click(*where["anew"])
    assert ("cut_anew",) in desk.session.calls and desk.ui.state.atlas == draft
    desk.release()


def test_a_click_picks_and_a_drag_does_not(desk: Desk) -> None:
    desk.session.picked = PICKED
    desk.session.running = False
    left, top, _, _ = desk.ui.state.view_px
    desk.click(*VIEW)
    assert desk.session.calls == [("pick", VIEW[0] - int(left), VIEW[1] - int(top))]
    assert desk.ui.state.picked is PICKED
    desk.drag(VIEW, (VIEW[0] + 60, VIEW[1]))
    assert len(desk.session.calls) == 1


MOVES = {
    "orbit": lambda d: d.drag(VIEW, (VIEW[0] + 60, VIEW[1] + 20)),
    "pan right": lambda d: d.drag(VIEW, (VIEW[0] + 60, VIEW[1] + 20), button=1),
    "pan middle": lambda d: d.drag(VIEW, (VIEW[0] + 60, VIEW[1] + 20), button=2),
    "wheel": lambda d: (d.point(*VIEW), d.ui.io.add_mouse_wheel_event(0, 1), d.frames()),
    "fly": lambda d: d.key(imgui.Key.w),
}


@pytest.mark.parametrize("move", MOVES)
def test_mouse_and_keys_move_the_eye(desk: Desk, move: str) -> None:
    before = desk.session.camera.copy()
    MOVES[move](desk)
    after = desk.session.camera
    assert not np.allclose(after.eye, before.eye)
    if move == "orbit":
        np.testing.assert_allclose(after.target, before.target, atol=1e-12)
    if move == "wheel":
        assert after.distance < before.distance
    if move.startswith("pan"):
        right = before.world_from_camera[:3, 0]
        assert (after.eye - before.eye) @ right < 0  # what is seen follows the mouse
        np.testing.assert_array_equal(after.world_from_camera[:3, :3], before.world_from_camera[:3, :3])


def test_the_mouse_over_a_panel_moves_nothing(desk: Desk) -> None:
    before = desk.session.camera.copy()
    desk.drag((150, 200), (250, 260), button=2)
    desk.ui.io.add_mouse_wheel_event(0, 1)
    desk.frames(2)
    np.testing.assert_array_equal(desk.session.camera.world_from_camera, before.world_from_camera)


@pytest.mark.parametrize("seconds", [1 / 240, 1 / 60, 1 / 7])
def test_movement_depends_on_time_not_on_frames(gpu: Gpu, seconds: float) -> None:
    desk = Desk(gpu, FakeSession(), (320, 240))
    desk.key(imgui.Key.f)
    desk.frames(math.ceil(0.4 / seconds), seconds)
    goal = desk.session.camera.copy()
    goal.focus(np.zeros(3), 1.0)
    np.testing.assert_allclose(desk.session.camera.eye, goal.eye, atol=1e-12)
    start = desk.session.camera.eye.copy()
    desk.ui.io.add_key_event(imgui.Key.d, True)
    desk.frames(round(1 / seconds), seconds)
    moved = np.linalg.norm(desk.session.camera.eye - start)
    desk.release()
    assert moved == pytest.approx(0.4, rel=0.01)  # radii per second; a frame more or less at 7 per second is not lost


def test_what_is_picked_is_read_again_while_shooting(desk: Desk) -> None:
    """The point, whatever its pixel shows after the eye has moved or the panels are hidden."""
    desk.session.picked = PICKED
    desk.click(*VIEW)
    desk.session.picked = None
    for move in (lambda: None, lambda: desk.session.camera.orbit(0.1, 0.0), lambda: desk.key(imgui.Key.f2)):
        move()
        before = desk.session.calls.count(("read_again",))
        desk.frames(20, seconds=0.05)
        assert 2 <= desk.session.calls.count(("read_again",)) - before <= 4  # four times a second
        assert desk.ui.state.picked is PICKED
    desk.session.running = False
    before = len(desk.session.calls)
    desk.frames(20, seconds=0.05)
    assert len(desk.session.calls) == before


def test_the_atlas_is_drawn_only_where_it_is_seen(desk: Desk) -> None:
    insets = desk.session.insets
    desk.frames(3, seconds=1.0)
    (width, height), turned = insets[-1]
    assert not turned and 150 < width <= 512 and width / height == pytest.approx(160 / 96, rel=0.02)
    insets.clear()
    desk.ui.state.hidden_panels.add("Inspect")
    desk.frames(3, seconds=1.0)
    assert insets == []


@pytest.mark.parametrize("size", [(160, 96), (96, 160)], ids=str)
def test_pointing_at_the_atlas_tells_of_the_leaf(
    desk: Desk, gpu: Gpu, monkeypatch: pytest.MonkeyPatch, size: tuple[int, int]
) -> None:
    asked: list[tuple[float, float]] = []
    places: list[atlas.Place] = []

    def leaf(lightmap: object, uv: tuple[float, float]) -> SimpleNamespace:
        asked.append(uv)
        return SimpleNamespace(level=2, rect=(64.0, 32.0, 68.0, 36.0), texels=256, texel=0.01)

    place = atlas._place
    monkeypatch.setattr(atlas, "leaf_at", leaf)
    monkeypatch.setattr(atlas, "_place", lambda *args: places.append(place(*args)) or places[-1])
    desk.session.image = gpu.texture((64, 28), 4, "f1", bytes(64 * 28 * 4))
    desk.session.charts.size = size
    desk.point(5, 5)
    desk.frames(40)
    assert places[-1].turned == (size[0] < size[1]), "the longer edge lies along the longer one of what room there is"
    before, asked[:] = desk.image(), []
    assert len({(p.left, p.top, p.scale) for p in places[-10:]}) == 1, "it stays where it is"
    at = places[-1].screen_from_atlas(65.0, 33.0)
    desk.point(at.x, at.y)
    desk.frames(2)
    assert asked[-1] == pytest.approx((65.0, 33.0), abs=1 / places[-1].scale)  # Dear ImGui cuts to whole pixels
    corner = places[-1].screen_from_atlas(64.0, 32.0)
    assert (desk.image()[int(corner.y) - 1, int(corner.x) + 2] > 120).all(), "framed"
    assert (desk.image() != before).any(-1).sum() > 2000, "a tooltip"
