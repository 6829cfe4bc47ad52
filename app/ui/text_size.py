"""How large text and controls are, over what the screen asks for: by the View menu, and Ctrl with +, - and 0."""

from __future__ import annotations

from imgui_bundle import imgui

from app.ui.state import State

Key = imgui.Key
KEYS = (("Ctrl++, Ctrl+-, Ctrl+0", "larger and smaller text and controls, as the screen asks for"),)
STEPS = {1: (Key.equal, Key.keypad_add), -1: (Key.minus, Key.keypad_subtract)}
SIZES = (0.75, 0.9, 1.0, 1.1, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0)


def menu(state: State) -> None:
    """One item for each size, and the keys."""
    for size in SIZES:
        if imgui.menu_item(f"{size:.0%}", "Ctrl+0" if size == 1.0 else "", abs(state.text_size - size) < 1e-3)[0]:
            state.text_size = size
    imgui.separator()
    if imgui.menu_item("Larger", "Ctrl++", False)[0]:
        _step(state, 1)
    if imgui.menu_item("Smaller", "Ctrl+-", False)[0]:
        _step(state, -1)


def _step(state: State, steps: int) -> None:
    """So many sizes larger, or smaller."""
    nearest = min(range(len(SIZES)), key=lambda i: abs(SIZES[i] - state.text_size))
    state.text_size = SIZES[min(max(nearest + steps, 0), len(SIZES) - 1)]


def answer(state: State, *, control: bool) -> None:
    """Do what the keys pressed since the last frame ask for; + is where = is on some keyboards, with Shift on others."""
    for steps, keys in STEPS.items():
        if control and any(imgui.is_key_pressed(key, False) for key in keys):
            _step(state, steps)
    if control and any(imgui.is_key_pressed(key, False) for key in (Key._0, Key.keypad0)):
        state.text_size = 1.0


def legal(size: object) -> float:
    """A size that was kept, or the screen's own where it is none."""
    return float(size) if isinstance(size, (int, float)) and SIZES[0] <= size <= SIZES[-1] else 1.0


__all__ = ["KEYS", "SIZES", "answer", "legal", "menu"]
