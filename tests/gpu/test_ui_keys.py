"""Keys: each does what the help says, and none where it is typed into a field."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest
from desks import PICKED, VIEW, Desk, desk, session, where
from fake_session import FakeSession
from imgui_bundle import imgui

from app.gpu import Gpu
from app.ui.keys import ANY_POPUP, SHORTCUTS
from app.ui.state import Request

__all__ = ["desk", "session", "where"]


EFFECTS: dict[str, Callable[[Desk], bool]] = {
    "F1": lambda d: d.ui.state.show_help,
    "F2": lambda d: not d.ui.state.show_ui,
    "F5": lambda d: any("reloaded" in t.text for t in d.ui.state.toasts),
    "F12": lambda d: Request.SCREENSHOT in d.requests,
    "Space": lambda d: not d.session.running,
    ".": lambda d: ("work",) in d.session.calls and not d.session.running,
    "P": lambda d: d.ui.state.pace.is_fast(d.session.seconds),
    "R": lambda d: ("restart",) in d.session.calls,
    "F": lambda d: d.ui.state.flight is not None,
    "C": lambda d: d.session.display.show == "reference",
    "V": lambda d: d.session.display.show == "split",
    "X": lambda d: d.session.display.layer == "error",
    "Ctrl+P": lambda d: imgui.is_popup_open("", ANY_POPUP),
    "Ctrl+O": lambda d: imgui.is_popup_open("", ANY_POPUP),
    "Ctrl+Z": lambda d: d.session.display.exposure == 0,
    "Ctrl+Shift+Z": lambda d: d.session.display.exposure == 2,
    "Ctrl+S": lambda d: imgui.is_popup_open("", ANY_POPUP),
    "Ctrl+Shift+S": lambda d: imgui.is_popup_open("", ANY_POPUP),
    "Ctrl+Q": lambda d: Request.QUIT in d.requests,
    "Esc": lambda d: d.ui.state.picked is None,
}


def test_help_stays_within_a_small_window(gpu: Gpu, session: FakeSession) -> None:
    desk = Desk(gpu, session, (900, 500))
    desk.ui.state.show_help = True
    desk.frames(3)
    help_window = imgui.internal.find_window_by_name("##help")
    assert help_window.pos.x >= 0 and help_window.pos.x + help_window.size.x <= 900
    assert help_window.pos.y >= 0 and help_window.pos.y + help_window.size.y <= 500
    assert help_window.scroll_max.y > 0, "the rest is reached by the wheel"
    desk.release()


@pytest.mark.parametrize("shortcut", SHORTCUTS, ids=lambda s: s.label)
def test_every_key_does_what_the_help_says(desk: Desk, shortcut: Any) -> None:
    desk.session.compare()
    desk.ui.state.picked = PICKED
    desk.session.display = desk.session.display.replace(exposure=2.0)
    desk.frames()
    if shortcut.key == imgui.Key.z and shortcut.shift:
        desk.key(imgui.Key.z, control=True)
    if shortcut.shift:
        desk.ui.io.add_key_event(imgui.Key.mod_shift, True)
    assert not EFFECTS[shortcut.label](desk)
    desk.key(shortcut.key, control=shortcut.control)
    assert EFFECTS[shortcut.label](desk)


@pytest.mark.parametrize("shortcut", SHORTCUTS, ids=lambda s: s.label)
def test_keys_are_harmless_without_a_scene(gpu: Gpu, shortcut: Any) -> None:
    desk = Desk(gpu, FakeSession(opened=False))
    desk.key(shortcut.key, control=shortcut.control)
    desk.click(*VIEW)
    assert desk.session.calls == []
    desk.release()


def test_escape_closes_cancels_deselects_and_never_quits(desk: Desk) -> None:
    desk.session.picked = PICKED
    desk.click(*VIEW)
    assert desk.ui.state.picked is PICKED
    desk.key(imgui.Key.f1)
    cancelled: list[bool] = []
    desk.session.loading = SimpleNamespace(stage="unfolding", fraction=0.4, cancel=lambda: cancelled.append(True))
    desk.key(imgui.Key.escape)
    assert not desk.ui.state.show_help and not cancelled, "one thing at a time"
    desk.key(imgui.Key.escape)
    assert cancelled == [True] and desk.ui.state.picked is PICKED
    desk.session.loading = None
    desk.key(imgui.Key.o, control=True)
    desk.key(imgui.Key.escape)
    assert not imgui.is_popup_open("", ANY_POPUP) and desk.ui.state.picked is PICKED
    desk.key(imgui.Key.escape)
    assert desk.ui.state.picked is None
    desk.session.opened = False
    desk.key(imgui.Key.escape)
    assert desk.requests == [], "with nothing left it does nothing"


def test_with_ctrl_the_keys_of_flight_are_commands(desk: Desk) -> None:
    eye = desk.session.camera.eye.copy()
    desk.key(imgui.Key.q, control=True)
    assert (desk.session.camera.eye == eye).all()


def test_keys_typed_into_a_field_are_text(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.frames()
    desk.ask_to_type(*where["exposure"])
    assert desk.ui.io.want_text_input
    desk.key(imgui.Key.space)
    desk.ui.io.add_input_characters_utf8("3.5")
    desk.key(imgui.Key.enter)
    assert desk.session.running
    assert desk.session.display.exposure == 3.5


def test_a_key_of_flight_holds_the_view(desk: Desk) -> None:
    desk.ui.io.add_key_event(imgui.Key.w, True)
    desk.frames(2)
    assert desk.ui.held and desk.ui.moving
    desk.ui.io.add_key_event(imgui.Key.w, False)
    desk.frames(2)
    assert not desk.ui.held and not desk.ui.moving
