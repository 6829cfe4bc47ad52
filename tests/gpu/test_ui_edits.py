"""Undo and redo in the interface: what a hand does at sliders and in the view, taken back by keys and menu."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from desks import VIEW, Desk, desk, session, where
from fake_session import FakeScene
from imgui_bundle import imgui

from app.scene.lights import Light
from app.scene.sky import Sky
from app.ui import widgets

__all__ = ["desk", "session", "where"]


def undo(desk: Desk) -> None:
    desk.key(imgui.Key.z, control=True)


def redo(desk: Desk) -> None:
    desk.ui.io.add_key_event(imgui.Key.mod_shift, True)
    desk.key(imgui.Key.z, control=True)
    desk.ui.io.add_key_event(imgui.Key.mod_shift, False)
    desk.frames()


def test_a_dragged_slider_is_one_step(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.frames()
    x, y = where["exposure"]
    desk.point(x, y)
    desk.press(0, True)
    for moved in (10, 20, 30):
        desk.point(x + moved, y)
    desk.press(0, False)
    exposure = desk.session.display.exposure
    assert exposure > 0 and desk.ui.state.edits.undoable == "exposure"
    undo(desk)
    assert desk.session.display.exposure == 0 and desk.ui.state.edits.redoable == "exposure"
    redo(desk)
    assert desk.session.display.exposure == exposure and desk.ui.state.edits.redoable is None


def test_esc_lets_go_of_a_slider(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.frames()
    x, y = where["exposure"]
    desk.point(x, y)
    desk.press(0, True)
    desk.point(x + 30, y)
    assert desk.session.display.exposure > 0
    desk.key(imgui.Key.escape)
    desk.point(x + 60, y)
    assert desk.session.display.exposure == 0, "nor does the hand that is still down move it"
    desk.press(0, False)
    assert desk.ui.state.edits.undoable is None


def test_a_drag_of_the_camera_is_one_step(desk: Desk) -> None:
    start = desk.session.camera.world_from_camera.copy()
    for end in ((700, 300), (600, 200)):
        desk.drag(VIEW, end)
    undo(desk)
    assert not np.allclose(desk.session.camera.world_from_camera, start)
    undo(desk)
    np.testing.assert_array_equal(desk.session.camera.world_from_camera, start)
    assert desk.ui.state.edits.undoable is None


def test_a_flight_to_the_whole_scene_is_one_step(desk: Desk) -> None:
    start = desk.session.camera.world_from_camera.copy()
    desk.key(imgui.Key.f)
    desk.frames(10, seconds=0.1)
    assert desk.ui.state.flight is None and not np.allclose(desk.session.camera.world_from_camera, start)
    undo(desk)
    np.testing.assert_array_equal(desk.session.camera.world_from_camera, start)
    assert desk.ui.state.edits.undoable is None


def test_edits_of_the_scene_are_named(desk: Desk) -> None:
    """And what one looks at is no edit."""
    session, state = desk.session, desk.ui.state
    red = session.materials[1]
    steps = (
        (lambda: session.set_material(1, dataclasses.replace(red, albedo=(0.1, 0.2, 0.3))), "albedo of red wall"),
        (lambda: session.set_lights((Light("bulb"),)), "lamp added"),
        (lambda: session.set_lights((Light("bulb", position=(1.0, 0.0, 0.0)),)), "position of bulb"),
        (lambda: session.set_sky(Sky("uniform")), "sky"),
        (lambda: session.set_sky(Sky("uniform", strength=2.0)), "strength of the sky"),
        (lambda: session.set_options(session.options.replace(level=1)), "level"),
    )
    session.scene.bounds = (np.zeros(3), np.ones(3))
    for edit, words in steps:
        edit()
        desk.frames()
        assert state.edits.undoable == words
    desk.key(imgui.Key.v)
    assert state.edits.undoable == "level"
    for _ in steps:
        undo(desk)
    assert session.materials[1] is red and session.scene.lights == () and session.scene.sky is None
    assert state.edits.undoable is None


def test_another_scene_has_another_history(desk: Desk) -> None:
    desk.session.set_options(desk.session.options.replace(level=1))
    desk.frames()
    assert desk.ui.state.edits.undoable == "level"
    desk.session.unedited = FakeScene(**vars(desk.session.unedited))
    desk.frames()
    assert desk.ui.state.edits.undoable is None


@pytest.mark.parametrize("drag", [False, True])
def test_the_menu_names_what_would_be_undone(desk: Desk, monkeypatch: pytest.MonkeyPatch, drag: bool) -> None:
    items: list[tuple[str, bool]] = []

    def note(label: str, key: str, chosen: bool, enabled: bool = True) -> tuple[bool, bool]:
        items.append((label.split("###")[0].strip(), enabled))
        return False, chosen

    if drag:
        desk.drag(VIEW, (700, 300))
    monkeypatch.setattr(imgui, "menu_item", note)
    monkeypatch.setattr(imgui, "begin_menu", lambda label, *_: label == "Edit")
    monkeypatch.setattr(imgui, "end_menu", lambda: None)
    desk.frames()
    assert items == [("Undo camera" if drag else "Undo", drag), ("Redo", False)]


# -- a right click ------------------------------------------------------------------------------------------------------


def test_a_right_click_puts_a_lamp_back_to_its_file_and_not_off(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    session = desk.session
    session.unedited = SimpleNamespace(**vars(session.scene))
    desk.front("Materials")
    desk.ui.state.material = 3
    lamp = session.materials[3]
    session.set_material(3, dataclasses.replace(lamp, emission=(1.0, 1.0, 1.0), albedo=(0.1, 0.1, 0.1)))
    desk.frames(2)
    real = widgets.put_back
    at: list[tuple[float, float]] = []

    def noted(value: object, default: object) -> object:
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        at.append(((low.x + high.x) / 2, (low.y + high.y) / 2))
        return real(value, default)

    with monkeypatch.context() as hand:
        hand.setattr(widgets, "put_back", noted)
        desk.frames(1)
    for place in at:
        desk.click(*place, button=1)
    assert (session.materials[3].emission, session.materials[3].albedo) == (lamp.emission, lamp.albedo)
    undo(desk)
    undo(desk)
    assert (session.materials[3].emission, session.materials[3].albedo) == ((1.0, 1.0, 1.0), (0.1, 0.1, 0.1))
