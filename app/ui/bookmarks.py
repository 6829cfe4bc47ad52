"""Bookmarks of the camera: a digit with Ctrl sets one, the digit alone goes there; and the cameras of the scene's file."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.ui.navigation import look_through
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

DIGITS = range(1, 10)
KEYS = (
    ("Ctrl+1 to Ctrl+9", "bookmark where the camera is"),
    ("1 to 9", "go to that bookmark"),
)


def answer(view: View, state: State, *, control: bool) -> None:
    """Do what a digit that is pressed in this frame asks for. control: with Ctrl."""
    for digit in DIGITS:
        if any(imgui.is_key_pressed(key, False) for key in (imgui.Key[f"_{digit}"], imgui.Key[f"keypad{digit}"])):
            (bookmark if control else go)(view, state, digit)


def bookmark(view: View, state: State, digit: int) -> None:
    """Remember where the camera is."""
    view.bookmarks[digit] = view.camera.copy()
    state.notify(f"bookmark {digit}: the key {digit} comes back here")


def go(view: View, state: State, digit: int) -> None:
    """Stand where the camera was then."""
    if digit not in view.bookmarks:
        state.notify(f"no bookmark {digit} yet: Ctrl+{digit} sets it")
        return
    state.flight = None
    view.camera = view.bookmarks[digit].copy()


def menu(view: View, state: State) -> None:
    """Cameras of the file, bookmarks, and a new one."""
    for camera in view.session.scene.cameras:
        if imgui.menu_item(f"{camera.name}###camera {camera.name}", "", False)[0]:
            look_through(view, state, camera)
    imgui.separator()
    for digit in sorted(view.bookmarks):
        if imgui.menu_item(f"Bookmark {digit}", str(digit), False)[0]:
            go(view, state, digit)
    free = next((digit for digit in DIGITS if digit not in view.bookmarks), None)
    if free is not None and imgui.menu_item("Bookmark this view", f"Ctrl+{free}", False)[0]:
        state.act(partial(bookmark, view, state, free))


__all__ = ["KEYS", "answer", "menu"]
