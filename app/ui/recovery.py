"""After a crash: an offer to go on with what was put aside, in the status bar and the File menu; whoever takes it is asked."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.session.keeping import Aside, drop
from app.ui import theme, widgets
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

TITLE = "Go on?"
BUTTON_EM = 7.0
TEXT_EM = 28.0
ICON = theme.ICONS.ICON_FA_CLOCK_ROTATE_LEFT


def offer(state: State) -> None:
    """A line of the status bar, as long as there is something that was put aside and neither taken up nor dropped."""
    if not state.asides:
        return
    aside = state.asides[0]
    imgui.text_colored(imgui.ImVec4(*theme.AMBER), f"{ICON}  {aside.name}: go on?")
    if imgui.is_item_hovered():
        imgui.set_mouse_cursor(imgui.MouseCursor_.hand)
    if imgui.is_item_clicked():
        state.recover = aside
    widgets.tooltip(f"Glowtree ended without being closed. What was open then is still there: {in_words(aside)}. Click")
    imgui.separator()


def menu(state: State) -> None:
    """All that crashes have left, in the File menu."""
    if not imgui.begin_menu(f"{ICON}  Left by a crash", bool(state.asides)):
        return
    for number, aside in enumerate(state.asides):
        if imgui.menu_item(f"{in_words(aside)}###aside {number}", "", False)[0]:
            state.recover = aside
    imgui.end_menu()


def recovery(view: View, state: State) -> None:
    """Ask, once per frame, what is to become of the one that was chosen."""
    aside = state.recover
    if aside is None:
        return
    imgui.open_popup(TITLE)
    if not widgets.begin_modal(TITLE):
        return
    em = imgui.get_font_size()
    imgui.dummy(imgui.ImVec2(TEXT_EM * em, 0))
    widgets.wrapped(f"Glowtree ended without being closed. What was open then is still there: {in_words(aside)}.")
    imgui.spacing()
    size = imgui.ImVec2(BUTTON_EM * em, 0)
    go_on = imgui.button("Go on", size)
    imgui.same_line()
    forget = imgui.button("Drop it", size)
    imgui.same_line()
    later = imgui.button("Later", size) or imgui.is_key_pressed(imgui.Key.escape, False)
    if go_on:
        state.leave_for(lambda: _go_on(view, state, aside))
    elif forget:
        state.asides.remove(aside)
        state.act(lambda: drop(aside))
    if go_on or forget or later:
        state.recover = None
        imgui.close_current_popup()
    imgui.end_popup()


def _go_on(view: View, state: State, aside: Aside) -> None:
    """Raises UserError; it is still offered then."""
    state.keeping.go_on(view, aside)
    state.asides.remove(aside)


def in_words(aside: Aside) -> str:
    """Its scene, how long it was solved for, and when it was put aside."""
    when = time.strftime("%x %H:%M", time.localtime(aside.when))
    return f"{aside.name}, solved for {widgets.duration(aside.seconds)}, of {when}"


__all__ = ["in_words", "menu", "offer", "recovery"]
