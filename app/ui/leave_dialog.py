"""Quitting: at once where nothing is lost by it, else after a question."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.ui import widgets
from app.ui.files import save
from app.ui.state import Request, State

if TYPE_CHECKING:
    from app.session.view import View

TITLE = "Quit?"
BUTTON_EM = 7.0
TEXT_EM = 26.0


def quit_dialog(view: View, state: State) -> None:
    """Answer the wish to quit, once per frame: the host is asked to, or the user whether that is meant."""
    if state.ask_to_quit:
        state.ask_to_quit = False
        if not state.keeping.unsaved(view):
            state.requests.append(Request.QUIT)
            return
        imgui.open_popup(TITLE)
    if not widgets.begin_modal(TITLE):
        return
    em = imgui.get_font_size()
    imgui.dummy(imgui.ImVec2(TEXT_EM * em, 0))
    solved = widgets.duration(view.session.run.seconds)
    widgets.wrapped(
        f"{view.session.name}, solved for {solved}: what was done since it was opened or saved will be lost."
    )
    imgui.spacing()
    size = imgui.ImVec2(BUTTON_EM * em, 0)
    if imgui.button("Save", size):
        state.quit_when_saved = True
        save(view, state)
        imgui.close_current_popup()
    imgui.same_line()
    if imgui.button("Quit", size):
        state.requests.append(Request.QUIT)
        imgui.close_current_popup()
    imgui.same_line()
    if imgui.button("Cancel", size) or imgui.is_key_pressed(imgui.Key.escape, False):
        imgui.close_current_popup()
    imgui.end_popup()
