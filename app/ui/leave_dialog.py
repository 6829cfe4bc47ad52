"""Leaving what is open, to quit or for another scene: at once where nothing is lost by it, else after a question."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.ui import widgets
from app.ui.files import save
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

BUTTON_EM = 8.0
TEXT_EM = 28.0


def leave_dialog(view: View, state: State) -> None:
    """Answer the wish to leave, once per frame: do what was wanted, or ask the user whether that is meant."""
    leaving = state.leaving
    if leaving is None:
        return
    if not imgui.is_popup_open(leaving.title):
        if not state.keeping.unsaved(view):
            state.leaving = None
            state.act(leaving.go)
            return
        imgui.open_popup(leaving.title)
    if not widgets.begin_modal(leaving.title):
        return
    em = imgui.get_font_size()
    imgui.dummy(imgui.ImVec2(TEXT_EM * em, 0))
    solved = widgets.duration(view.session.run.seconds)
    widgets.wrapped(
        f"{view.session.name}, solved for {solved}: what was done since it was opened or saved will be lost."
    )
    imgui.spacing()
    size = imgui.ImVec2(BUTTON_EM * em, 0)
    save_it = imgui.button("Save", size)
    imgui.same_line()
    go = imgui.button(leaving.word, size)
    imgui.same_line()
    stay = imgui.button("Cancel", size) or imgui.is_key_pressed(imgui.Key.escape, False)
    if save_it:
        state.after_saving = leaving.go
        save(view, state)
    elif go:
        state.act(leaving.go)
    if save_it or go or stay:
        state.leaving = None
        imgui.close_current_popup()
    imgui.end_popup()
