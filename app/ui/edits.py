"""Undo and redo in the window: the session's knobs and the interface's own, as one history."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.session.edits import Knob
from app.session.knobs import knobs_of, said
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View


def watch(view: View, state: State, seconds: float) -> None:
    """Note what was edited in this frame, ``seconds`` after the last."""
    if state.version is not view.session.unedited:  # other surfaces, which an edit has waited for
        state.version = view.session.unedited
        state.edits.arrived("surfaces", _knobs(view, state))
    state.edits.watch(_knobs(view, state), held=state.held or state.flight is not None, seconds=seconds)


def undo(view: View, state: State) -> None:
    """Take the last edit back."""
    state.flight = None
    state.act(lambda: state.edits.undo(_knobs(view, state)))


def redo(view: View, state: State) -> None:
    """Do the last edit that was undone again."""
    state.flight = None
    state.act(lambda: state.edits.redo(_knobs(view, state)))


def let_go(view: View, state: State) -> None:
    """Take the control out of the hand that holds it, and back to where it was before."""
    imgui.internal.clear_active_id()
    state.drag_button, state.light_held, state.split_held = -1, False, False
    state.area_held, state.held_lamp, state.scale = False, None, None
    state.act(lambda: state.edits.cancel(_knobs(view, state)))


def menu(view: View, state: State) -> None:
    """What can be undone and done again, by name."""
    for word, key, what, action in (
        ("Undo", "Ctrl+Z", state.edits.undoable, undo),
        ("Redo", "Ctrl+Shift+Z", state.edits.redoable, redo),
    ):
        if imgui.menu_item(f"{word} {what or ''}###{word}", key, False, what is not None)[0]:
            action(view, state)


def _knobs(view: View, state: State) -> tuple[Knob, ...]:
    def put_pace(pace: object) -> None:
        state.pace = pace  # type: ignore[assignment]

    return (*knobs_of(view), Knob("pace", lambda: state.pace, put_pace, said))


__all__ = ["let_go", "menu", "redo", "undo", "watch"]
