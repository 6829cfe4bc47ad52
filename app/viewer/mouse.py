"""The mouse as Dear ImGui hears of it: where it presses, it has been in the frame before."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from imgui_bundle import imgui


class Mouse:
    """Passes events on. A press that comes in one frame with the way to it waits for the next: tabs, among others, answer only a
    pointer that they have seen before, and where frames are long a hand moves and clicks within one.

    io: where events go, of the interface whose window it is.
    """

    def __init__(self, io: Callable[[], imgui.IO]) -> None:
        self._io = io
        self._at: tuple[float, float] | None = None
        self._moved = False  # since the last frame
        self._waiting: list[tuple[Callable[..., None], tuple[Any, ...]]] = []

    def move(self, x: float, y: float) -> None:
        """It is at (x, y) [display units], from the top left of the window."""
        if not self._waits(self.move, x, y):
            self._io().add_mouse_pos_event(x, y)
            self._moved = self._moved or (x, y) != self._at
            self._at = x, y

    def button(self, x: float, y: float, button: int, down: bool) -> None:
        """A button went down or up there."""
        if not self._waits(self.button, x, y, button, down):
            self.move(x, y)
            if down and self._moved:
                self._waiting.append((self.button, (x, y, button, down)))
            else:
                self._io().add_mouse_button_event(button, down)

    def scroll(self, x: float, y: float) -> None:
        """The wheel turned by so many notches."""
        if not self._waits(self.scroll, x, y):
            self._io().add_mouse_wheel_event(x, y)

    def frame(self) -> bool:
        """A frame was built; whether something has waited for that."""
        waiting, self._waiting, self._moved = self._waiting, [], False
        for event, values in waiting:
            event(*values)
        return bool(waiting)

    def _waits(self, event: Callable[..., None], *values: Any) -> bool:
        """Whether it has to wait for others that do."""
        if self._waiting:
            self._waiting.append((event, values))
        return bool(self._waiting)


__all__ = ["Mouse"]
