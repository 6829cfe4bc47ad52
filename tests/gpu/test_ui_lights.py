"""The Lights panel, and what stands over the view of a scene that nothing lights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from desks import VIEW, Desk, desk, session, where
from fake_session import FakeScene
from imgui_bundle import imgui

from app.scene.area_lamps import AreaLamp, Surfaces
from app.scene.lights import Light
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


def test_the_view_is_free_behind_the_offer(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    put_out(desk)
    before = desk.session.camera.eye.copy()
    desk.drag((VIEW[0], VIEW[1] + 200), (VIEW[0] + 60, VIEW[1] + 200))
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
    assert session.surfaces.lamps[0] == PANEL and state.lamp_place is not None
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


def test_handles_are_not_there_while_a_bake_runs(panel: Desk) -> None:
    session = panel.session
    session.fixed = "they are being baked"
    panel.frames(2)
    at = on_screen(session, panel.ui.state, np.array(PANEL.position))
    panel.drag((at.x, at.y), (at.x + 40, at.y))
    assert session.surfaces.lamps[0] == PANEL and panel.ui.state.lamp_place is None
