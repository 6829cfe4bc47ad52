"""The keys: one table, which the dispatcher and the help overlay both walk."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.ui import bookmarks, text_size
from app.ui.edits import let_go, redo, undo
from app.ui.files import save, save_as
from app.ui.navigation import focus
from app.ui.panels.compare import show, shown
from app.ui.panels.solver import toggle
from app.ui.state import Pace, Request, State

if TYPE_CHECKING:
    from app.session.view import View

Key = imgui.Key
ANY_POPUP = int(imgui.PopupFlags_.any_popup_id | imgui.PopupFlags_.any_popup_level)


@dataclass(frozen=True)
class Shortcut:
    """A key (with Ctrl or ⌘ where ``control``, and Shift where ``shift``) and what it does."""

    label: str
    help: str
    key: imgui.Key
    action: Callable[[View, State], None]
    control: bool = False
    shift: bool = False
    while_typing: bool = False
    needs_scene: bool = False


def _help(view: View, state: State) -> None:
    state.show_help = not state.show_help


def _ui(view: View, state: State) -> None:
    state.show_ui = not state.show_ui


def _reload(view: View, state: State) -> None:
    state.requests.append(Request.RELOAD_SHADERS)


def _screenshot(view: View, state: State) -> None:
    state.requests.append(Request.SCREENSHOT)


def _save_picture(view: View, state: State) -> None:
    state.ask_for_picture = True


def _pause(view: View, state: State) -> None:
    toggle(view)


def _one_step(view: View, state: State) -> None:
    view.session.run.running = False
    state.act(view.session.work)


def flip_pace(view: View, state: State) -> None:
    """Watch, or be fast: whichever it is not now."""
    state.pace = Pace("watch" if state.pace.is_fast(view.session.run.seconds) else "fast")


def _restart(view: View, state: State) -> None:
    state.act(view.session.restart)


def _flip(view: View, state: State) -> None:
    show(view, state, "solution" if shown(view) == "reference" else "reference")


def _split(view: View, state: State) -> None:
    show(view, state, "solution" if shown(view) == "split" else "split")


def _error(view: View, state: State) -> None:
    show(view, state, view.display.show if shown(view) == "error" else "error")


def _open(view: View, state: State) -> None:
    state.ask_for_file = True


def _quit(view: View, state: State) -> None:
    state.quit()


def _escape(view: View, state: State) -> None:
    """Take back what a hand holds, else close what is open above the view, else stop what is on its way, else drop what is
    picked. It never quits."""
    if state.held and state.edits.held:
        let_go(view, state)
    elif state.show_help:
        state.show_help = False
    elif view.session.on_its_way is not None:
        view.session.on_its_way.cancel()
    elif state.flight is not None:
        state.flight = None
    else:
        state.picked = None


SHORTCUTS = (
    Shortcut("F1", "help on and off", Key.f1, _help, while_typing=True),
    Shortcut("F2", "user interface on and off", Key.f2, _ui, while_typing=True),
    Shortcut("F5", "reload shaders; a broken one keeps the last good program", Key.f5, _reload, while_typing=True),
    Shortcut("F12", "screenshot into the current folder", Key.f12, _screenshot, while_typing=True),
    Shortcut("Space", "run or pause", Key.space, _pause, needs_scene=True),
    Shortcut(".", "one step: a shot, or what else the solver counts", Key.period, _one_step, needs_scene=True),
    Shortcut("P", "pace: watch one step after the other, or fast", Key.p, flip_pace, needs_scene=True),
    Shortcut("R", "restart", Key.r, _restart, needs_scene=True),
    Shortcut("F", "look at the picked point, or at the whole scene", Key.f, focus, needs_scene=True),
    Shortcut("C", "flip between solution and reference", Key.c, _flip, needs_scene=True),
    Shortcut("V", "split view: solution and reference", Key.v, _split, needs_scene=True),
    Shortcut("X", "error heat map on and off", Key.x, _error, needs_scene=True),
    Shortcut("Ctrl+O", "open a scene or session", Key.o, _open, control=True),
    Shortcut("Ctrl+S", "save the session", Key.s, save, control=True, needs_scene=True),
    Shortcut("Ctrl+Shift+S", "save it to another file", Key.s, save_as, control=True, shift=True, needs_scene=True),
    Shortcut("Ctrl+P", "save a picture of the view alone", Key.p, _save_picture, control=True, needs_scene=True),
    Shortcut("Ctrl+Z", "undo the last edit, or move of the camera", Key.z, undo, control=True, needs_scene=True),
    Shortcut("Ctrl+Shift+Z", "redo what was undone", Key.z, redo, control=True, shift=True, needs_scene=True),
    Shortcut(
        "Ctrl+Q", "quit; asks where edits or a long solve would be lost", Key.q, _quit, control=True, while_typing=True
    ),
    Shortcut("Esc", "let go, close what is open, stop loading, drop what is picked", Key.escape, _escape),
)

POINTER = (
    ("Click", "inspect the texel; beside all surfaces: drop it"),
    ("Left drag", "orbit, or move the line of a split view"),
    ("Right or middle drag", "pan"),
    ("Wheel", "nearer and farther"),
    ("W A S D Q E", "fly; Shift is faster, Alt slower"),
    ("Drag a number", "change it; with Shift a tenth as far"),
    ("Double click, Ctrl+click", "type a number"),
    ("Drop a file", "open it: a scene, a session, an .exr as a reference"),
)


def dispatch(view: View, state: State) -> None:
    """Do what the keys pressed since the last frame ask for."""
    io = imgui.get_io()
    if imgui.is_popup_open("", ANY_POPUP):
        modal = imgui.internal.get_top_most_popup_modal() is not None  # answers Esc itself
        if not modal and imgui.is_key_pressed(Key.escape, False):
            imgui.internal.close_popup_to_level(0, True)
        return
    text_size.answer(state, control=io.key_ctrl or io.key_super)
    if view.session.opened and not io.want_text_input:
        bookmarks.answer(view, state, control=io.key_ctrl or io.key_super)
    for shortcut in SHORTCUTS:
        held = io.key_ctrl or io.key_super
        ready = (view.session.opened or not shortcut.needs_scene) and (not io.want_text_input or shortcut.while_typing)
        ready = ready and held == shortcut.control and (not held or io.key_shift == shortcut.shift)
        if ready and imgui.is_key_pressed(shortcut.key, False):
            shortcut.action(view, state)
