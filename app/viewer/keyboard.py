"""The keyboard as Dear ImGui wants it: which key is which, modifiers, and chords that last less than a frame.

A modifier's release waits for the frame in which the key beside it went down, and what is typed later waits with it: in
a slow window the 1 that is typed after Ctrl+A would be Ctrl+1.
"""

from __future__ import annotations

import string
from collections.abc import Callable, Mapping

from imgui_bundle import imgui

MODIFIERS = {
    imgui.Key.mod_ctrl: (imgui.Key.left_ctrl, imgui.Key.right_ctrl),
    imgui.Key.mod_shift: (imgui.Key.left_shift, imgui.Key.right_shift),
    imgui.Key.mod_alt: (imgui.Key.left_alt, imgui.Key.right_alt),
    imgui.Key.mod_super: (imgui.Key.left_super, imgui.Key.right_super),
}
# pyglet's name of a key, and Dear ImGui's
NAMED_KEYS = """
    RETURN:enter ESCAPE:escape BACKSPACE:backspace TAB:tab SPACE:space DELETE:delete INSERT:insert HOME:home END:end
    PAGEUP:page_up PAGEDOWN:page_down LEFT:left_arrow RIGHT:right_arrow UP:up_arrow DOWN:down_arrow
    MENU:menu PAUSE:pause
    LCTRL:left_ctrl RCTRL:right_ctrl LSHIFT:left_shift RSHIFT:right_shift LALT:left_alt RALT:right_alt
    LCOMMAND:left_super RCOMMAND:right_super LWINDOWS:left_super RWINDOWS:right_super
    PERIOD:period COMMA:comma MINUS:minus EQUAL:equal SLASH:slash BACKSLASH:backslash SEMICOLON:semicolon
    APOSTROPHE:apostrophe GRAVE:grave_accent BRACKETLEFT:left_bracket BRACKETRIGHT:right_bracket
    CAPSLOCK:caps_lock NUMLOCK:num_lock SCROLLLOCK:scroll_lock PRINT:print_screen
    NUM_ENTER:keypad_enter NUM_ADD:keypad_add NUM_SUBTRACT:keypad_subtract NUM_MULTIPLY:keypad_multiply
    NUM_DIVIDE:keypad_divide NUM_DECIMAL:keypad_decimal NUM_EQUAL:keypad_equal
"""
KEY_NAMES = {
    **dict(pair.split(":") for pair in NAMED_KEYS.split()),
    **{f"NUM_{i}": f"keypad{i}" for i in range(10)},
    **{f"_{i}": f"_{i}" for i in range(10)},
    **{f"F{i}": f"f{i}" for i in range(1, 13)},
    **{letter: letter.lower() for letter in string.ascii_uppercase},
}


class Keyboard:
    """Passes keys and text on. keys: what the window calls them, and Dear ImGui; io: of the context that they are for."""

    def __init__(self, keys: Mapping[int, imgui.Key], io: Callable[[], imgui.IO]) -> None:
        self._keys, self._io = keys, io
        self._held: set[imgui.Key] = set()
        self._later: list[tuple[imgui.Key, bool] | str] = []  # from a modifier's release on

    def key(self, key: int, down: bool) -> None:
        """A key of the window went down or up."""
        known = self._keys.get(key)
        if known is not None:
            self._pass_on_or_keep((known, down))

    def text(self, text: str) -> None:
        """Text was typed."""
        self._pass_on_or_keep(text)

    def frame(self) -> None:
        """A frame has seen all that was passed on: pass on what waits, up to the release of another modifier."""
        later, self._later = self._later, []
        for nth, event in enumerate(later):
            if nth == 0:
                self._pass_on(event)
            else:
                self._pass_on_or_keep(event)

    def forget(self) -> None:
        """Nothing is held: the window has lost the keyboard."""
        self._held.clear()
        self._later.clear()

    def _pass_on_or_keep(self, event: tuple[imgui.Key, bool] | str) -> None:
        if self._later or _lets_go(event):
            self._later.append(event)
        else:
            self._pass_on(event)

    def _pass_on(self, event: tuple[imgui.Key, bool] | str) -> None:
        if isinstance(event, str):
            self._io().add_input_characters_utf8(event)
            return
        known, down = event
        (self._held.add if down else self._held.discard)(known)
        for modifier, keys in MODIFIERS.items():
            if known in keys:
                self._io().add_key_event(modifier, any(k in self._held for k in keys))
        self._io().add_key_event(known, down)


def _lets_go(event: tuple[imgui.Key, bool] | str) -> bool:
    """Whether it is the release of a modifier."""
    return not isinstance(event, str) and not event[1] and any(event[0] in keys for keys in MODIFIERS.values())


def pyglet_keys() -> dict[int, imgui.Key]:
    """pyglet's key constants and what Dear ImGui calls them; needs a display, as everything of pyglet.window does."""
    from pyglet.window import key

    return {getattr(key, name): imgui.Key[ours] for name, ours in KEY_NAMES.items() if hasattr(key, name)}
