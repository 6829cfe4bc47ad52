"""The Lights panel, and what stands over the view of a scene that nothing lights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from desks import VIEW, Desk, desk, session, where
from fake_session import FakeScene, FakeSession
from imgui_bundle import imgui, implot

from app.gpu import Gpu
from app.scene.area_lamps import AreaLamp, Surfaces
from app.scene.lights import Light
from app.scene.sky import Sky, Sun
from app.solvers import SOLVERS
from app.ui import area_edits, slider, widgets
from app.ui.new_lamps import KINDS
from app.ui.on_screen import on_screen

__all__ = ["desk", "session", "where"]

LABELS = [kind.label for kind in KINDS]


def put_out(desk: Desk) -> None:
    scene = desk.session.scene
    scene.materials = tuple(replace(material, emission=(0.0, 0.0, 0.0)) for material in scene.materials)
    desk.frames(3)


def test_a_dark_scene_offers_lamps_in_the_view(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.frames()
    assert not set(LABELS) & where.keys(), "there is light"
    put_out(desk)
    left, top, width, height = desk.ui.state.view_px
    for label in LABELS:
        x, y = where[label]
        assert left < x < left + width and top < y < top + height, label
    desk.session.picked = None
    desk.click(*where["Sky"])
    assert desk.session.scene.sky.kind == "clear"
    where.clear()
    desk.frames(2)
    assert not set(LABELS) & where.keys(), "what was asked for is there"
    assert not any("--" in toast.text for toast in desk.ui.state.toasts)


def test_lamps_are_added_in_the_panel_too(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.front("Lights")
    desk.click(*where["Sun"])
    (sun,) = desk.session.scene.lights
    assert sun.from_afar and sun.emits and desk.ui.state.light == 0
    desk.click(*where["Point"])
    assert [light.kind for light in desk.session.scene.lights] == ["directional", "point"] and desk.ui.state.light == 1
    desk.click(*where["Ceiling"])
    assert desk.session.calls[-1][0] == "change_surfaces"


def test_a_light_is_duplicated_and_removed(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    lamps = desk.session.scene = desk.session.unedited = FakeScene(**vars(desk.session.scene))
    lamps.materials = tuple(replace(material, emission=(0.0, 0.0, 0.0)) for material in lamps.materials)
    lamps.lights = (Light("a", intensity=(3.0, 2.0, 1.0)), Light("b", "spot"))
    desk.front("Lights")
    desk.click(*where["Duplicate"])
    assert [light.name for light in lamps.lights] == ["a", "b", "point 1"]
    assert lamps.lights[2].intensity == (3.0, 2.0, 1.0) and lamps.lights[2].position != lamps.lights[0].position
    desk.ui.state.light = 1
    desk.frames(2)
    desk.click(*where["Remove"])
    assert [light.name for light in lamps.lights] == ["a", "point 1"]


def test_lamps_with_area_are_duplicated_and_removed(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.front("Lights")
    for button in ("Duplicate", "Remove"):
        desk.session.calls.clear()
        desk.click(*where[button])
        assert [call[0] for call in desk.session.calls] == ["change_surfaces"], button


def test_the_view_is_free_above_the_offer(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    put_out(desk)
    before = desk.session.camera.eye.copy()
    desk.drag(VIEW, (VIEW[0] + 60, VIEW[1]))
    assert (desk.session.camera.eye != before).any()
    desk.key(imgui.Key.f2)
    where.clear()
    desk.frames(2)
    assert not set(LABELS) & where.keys(), "a picture alone"


PANEL = AreaLamp("panel", (0.0, 0.0, -2.0), (1.0, 1.0, 1.0), (0.4, 0.4))


@pytest.fixture
def panel(desk: Desk) -> Desk:
    """An added lamp before the eye."""
    session = desk.session
    session.surfaces = Surfaces((PANEL,))
    lamp = replace(session.materials[0], name="panel", emission=PANEL.emission)
    session.unedited = FakeScene(**vars(session.unedited) | {"materials": (*session.materials, lamp)})
    session.scene.materials = session.unedited.materials
    number = len(session.materials) - 1
    for scene in (session.scene, session.unedited):
        scene.material_ids = np.append(scene.material_ids, number)
        scene.corners = np.zeros((number + 1, 3, 3))
        scene.normals_areas = np.zeros((number + 1, 3)), np.ones(number + 1)
    return desk


def test_an_added_lamp_is_moved_by_its_handle(panel: Desk) -> None:
    """And its surfaces are cut once, when it is let go."""
    state, session = panel.ui.state, panel.session
    panel.frames(2)
    at = on_screen(session, state, np.array(PANEL.position))
    assert at is not None
    eye = session.camera.world_from_camera.copy()
    panel.point(at.x, at.y)
    panel.press(0, True)
    panel.point(at.x + 20, at.y)
    panel.point(at.x + 40, at.y)
    assert session.surfaces.lamps[0] == PANEL and state.held_lamp is not None
    assert state.area_lamp == len(session.materials) - 1, "it is selected"
    panel.press(0, False)
    panel.frames(2)
    (x, y, z) = session.surfaces.lamps[0].position
    assert x > 0.05 and abs(y) < 1e-6 and z == pytest.approx(-2.0)
    assert [call[0] for call in session.calls].count("change_surfaces") == 1
    assert (session.camera.world_from_camera == eye).all() and state.edits.undoable == "position of panel"
    panel.key(imgui.Key.z, control=True)
    assert session.surfaces.lamps[0] == PANEL


def test_an_added_lamp_is_moved_in_the_panel(panel: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    state = panel.ui.state
    panel.front("Lights")
    state.area_lamp = len(panel.session.materials) - 1
    moved = {"##Position [m]": [1.0, 2.0, 3.0]}
    with monkeypatch.context() as hand:
        hand.setattr(imgui, "drag_float3", lambda label, now, *_: (label in moved, moved.get(label, now)))
        panel.frames(1)
    panel.frames(2)
    assert panel.session.surfaces.lamps[0].position == (1.0, 2.0, 3.0)


def test_a_lamp_that_is_held_stays_behind_with_its_scene(panel: Desk) -> None:
    """Its number is that of a material in that scene: none of another one is moved once it is let go."""
    state, session = panel.ui.state, panel.session
    panel.frames(2)
    at = on_screen(session, state, np.array(PANEL.position))
    panel.point(at.x, at.y)
    panel.press(0, True)
    panel.point(at.x + 20, at.y)
    assert state.held_lamp is not None
    session.read = session.unedited = FakeScene(**vars(session.unedited))
    session.surfaces = Surfaces()
    panel.frames(1)
    assert state.held_lamp is None and not state.area_held
    panel.press(0, False)
    panel.frames(2)
    assert "change_surfaces" not in [call[0] for call in session.calls]


def test_handles_are_not_there_while_a_bake_runs(panel: Desk) -> None:
    session = panel.session
    session.fixed = "they are being baked"
    panel.frames(2)
    at = on_screen(session, panel.ui.state, np.array(PANEL.position))
    panel.drag((at.x, at.y), (at.x + 40, at.y))
    assert session.surfaces.lamps[0] == PANEL and panel.ui.state.held_lamp is None


def test_an_added_lamp_has_a_size_and_is_turned(panel: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """And nothing is cut while a hand still moves a slider."""
    state, session = panel.ui.state, panel.session
    panel.front("Lights")
    state.area_lamp = len(session.materials) - 1
    edited = {"##Width": 0.8, "##Turned": 30.0}
    with monkeypatch.context() as hand:
        hand.setattr(slider, "slide", lambda label, now, *_: edited.get(label, now))
        hand.setattr(imgui, "drag_float3", lambda label, now, *_: (label == "##Direction", [0.0, -2.0, 0.0]))
        hand.setattr(imgui, "is_any_item_active", lambda: True)
        panel.frames(3)
        assert session.surfaces.lamps == (PANEL,), "it is held"
    panel.frames(2)
    (lamp,) = session.surfaces.lamps
    assert lamp.size == (0.8, 0.4) and lamp.direction == (0.0, -1.0, 0.0) and lamp.turn == pytest.approx(30.0)
    assert [call[0] for call in session.calls].count("change_surfaces") == 1


def test_a_lamp_of_the_scene_is_moved_unless_it_is_part_of_a_larger_piece(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[str] = []
    monkeypatch.setattr(widgets, "tooltip", told.append)
    session, state = desk.session, desk.ui.state
    desk.front("Lights")
    assert any(area_edits.JOINED in text for text in told), "all corners of a fake scene are in one place"
    session.read = FakeScene(**vars(session.read))
    session.read.corners = np.arange(len(session.read.material_ids) * 9.0).reshape(-1, 3, 3)
    desk.frames(2)
    moved = {"##Position [m]": [1.0, 2.0, 3.0]}
    with monkeypatch.context() as hand:
        hand.setattr(imgui, "drag_float3", lambda label, now, *_: (label in moved, moved.get(label, now)))
        desk.frames(1)
    desk.frames(2)
    (there,) = session.surfaces.moved
    assert there.key == ("lamp", 0) and state.edits.undoable == "lamp moved"
    np.testing.assert_allclose(there.shift, np.array([1.0, 2.0, 3.0]) - session.read.corners[3].mean(0))
    desk.key(imgui.Key.z, control=True)
    assert session.surfaces == Surfaces()


def test_lamps_of_the_scene_have_handles_while_the_lights_panel_is_there(desk: Desk) -> None:
    session, state = desk.session, desk.ui.state
    session.read = session.unedited = FakeScene(**vars(session.read))
    session.read.corners = np.arange(len(session.read.material_ids) * 9.0).reshape(-1, 3, 3)
    session.read.corners[3] = (0.0, 0.0, -2.0)
    at = on_screen(session, state, np.array((0.0, 0.0, -2.0)))
    desk.front("Scene")
    desk.point(at.x, at.y)
    desk.press(0, True)
    assert state.held_lamp is None
    desk.press(0, False)
    desk.front("Lights")
    desk.drag((at.x, at.y), (at.x + 40, at.y))
    desk.frames(2)
    assert len(session.surfaces.moved) == 1 and session.surfaces.moved[0].shift[0] > 0.05


def test_a_dark_scene_has_neither_converged_nor_a_plot(
    desk: Desk, where: dict[str, tuple[float, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It says what is missing, with a button that leads to lamps."""
    bars: list[float] = []
    plots: list[str] = []
    small: dict[str, tuple[float, float]] = {}
    bar, plot, button = imgui.progress_bar, implot.begin_plot, imgui.small_button

    def noting(label: str) -> bool:
        result = button(label)
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        small[label.split("###")[0]] = ((low.x + high.x) / 2, (low.y + high.y) / 2)
        return bool(result)

    monkeypatch.setattr(imgui, "progress_bar", lambda share, *more: (bars.append(share), bar(share, *more)))
    monkeypatch.setattr(implot, "begin_plot", lambda name, *more: (plots.append(name), plot(name, *more))[1])
    monkeypatch.setattr(imgui, "small_button", noting)
    put_out(desk)
    for kept in (bars, plots):
        kept.clear()
    where.clear()
    desk.frames(2)
    assert set(bars) == {0.0} and plots == [] and "Converged" not in where and "light" in where
    desk.click(*small["Add a lamp"])
    where.clear()
    desk.frames(2)
    assert desk.ui.state.lights_shown


def test_the_sun_is_moved_and_the_sky_is_another(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(gpu, FakeSession(), (1920, 1400))
    desk.front("Lights")
    before = desk.session.scene.sky = Sky("clear", (1.0, 0.5, 0.2), 2.0, sun=Sun(100, 20))
    moved = {"##Sun azimuth": 230.0, "##sky strength": 3.0}
    with monkeypatch.context() as hand:
        hand.setattr(slider, "slide", lambda label, value, *_: moved.get(label, value))
        desk.frames(1)
    (sky,) = [call[1] for call in desk.session.calls if call[0] == "set_sky"]
    assert (sky.sun, sky.strength, sky.colour) == (Sun(230, 20), 3.0, before.colour)
    for index, kind in enumerate(("none", "uniform", "clear")):
        desk.session.read = FakeScene(**vars(desk.session.scene) | {"sky": before})
        chosen = {"##kind": index}
        monkeypatch.setattr(imgui, "combo", lambda label, now, *_, c=chosen: (label in c, c.get(label, now)))
        desk.frames(1)
        now = desk.session.scene.sky
        assert (now is None) if kind == "none" else now.kind == kind
    desk.release()


def test_editing_a_light_tells_the_session(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    lights = (Light("a", intensity=(4.0, 2.0, 1.0)), Light("b", "spot"))
    told: list[tuple[Light, ...]] = []
    desk.session.scene.lights = lights
    desk.session.set_lights = told.append  # type: ignore[attr-defined]
    desk.front("Lights")
    assert not told
    monkeypatch.setattr(slider, "slide", lambda label, value, *_: 2 * value if label == "##strength" else value)
    desk.frames(1)
    assert told[-1] == (replace(lights[0], intensity=(8.0, 4.0, 2.0)), lights[1])  # colour kept, strength doubled


def test_a_light_is_dragged_by_its_handle(desk: Desk) -> None:
    """In the plane that faces the eye, and the view stays."""
    light = Light("a", position=tuple((desk.session.camera.eye + desk.session.camera.forward).tolist()))
    desk.session.scene.lights = (light,)

    def follow(lights: tuple[Light, ...]) -> None:
        desk.session.scene.lights = lights

    desk.session.set_lights = follow  # type: ignore[attr-defined]
    eye = desk.session.camera.world_from_camera.copy()
    left, top, width, height = desk.ui.state.view_px
    x, y = left + width / 2, top + height / 2
    desk.drag((x, y), (x + 100, y))
    moved = np.subtract(desk.session.scene.lights[0].position, light.position)
    assert moved == pytest.approx([2 * np.tan(desk.session.camera.yfov / 2) * 100 / height, 0, 0], rel=0.05)
    assert (desk.session.camera.world_from_camera == eye).all()


@pytest.mark.parametrize("solver", list(SOLVERS))
def test_lamps_flicker_where_the_solver_can_follow(desk: Desk, monkeypatch: pytest.MonkeyPatch, solver: str) -> None:
    desk.session.family = replace(desk.session.family, relights=SOLVERS[solver].relights)
    desk.front("Lights")
    monkeypatch.setattr(imgui, "checkbox", lambda label, on: (label == "##flicker", True))
    desk.frames(1)
    assert (("set_flicker", True) in desk.session.calls) == (solver in ("gathering", "local"))
