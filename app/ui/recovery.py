"""After a crash: an offer to go on with what was put aside."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.session.keeping import Aside, drop
from app.ui import widgets
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

TITLE = "Go on?"
BUTTON_EM = 7.0
TEXT_EM = 28.0


def recovery(view: View, state: State) -> None:
    """Ask, once per frame, as long as there is something that was put aside and neither taken up nor dropped."""
    if not state.asides:
        return
    imgui.open_popup(TITLE)
    if not widgets.begin_modal(TITLE):
        return
    em, aside = imgui.get_font_size(), state.asides[0]
    imgui.dummy(imgui.ImVec2(TEXT_EM * em, 0))
    widgets.wrapped(f"Glowtree ended without being closed. What was open then is still there: {in_words(aside)}.")
    imgui.spacing()
    size = imgui.ImVec2(BUTTON_EM * em, 0)
    if imgui.button("Go on", size):
        state.act(lambda: state.keeping.go_on(view, aside))
        _answered(state)
    imgui.same_line()
    if imgui.button("Drop it", size):
        state.act(lambda: drop(aside))
        _answered(state)
    imgui.same_line()
    if imgui.button("Later", size) or imgui.is_key_pressed(imgui.Key.escape, False):
        aside.lock.release()
        _answered(state)
    imgui.end_popup()


def _answered(state: State) -> None:
    del state.asides[0]
    imgui.close_current_popup()


def in_words(aside: Aside) -> str:
    """Its scene, how long it was solved for, and when it was put aside."""
    when = time.strftime("%x %H:%M", time.localtime(aside.when))
    return f"{aside.name}, solved for {widgets.duration(aside.seconds)}, of {when}"


__all__ = ["in_words", "recovery"]
