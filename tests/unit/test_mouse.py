"""The mouse on its way to Dear ImGui: no press comes in the frame in which the pointer arrives, and none is lost or overtaken."""

from __future__ import annotations

from typing import Any

from app.viewer.mouse import Mouse


class Heard:
    """Events as Dear ImGui would hear of them."""

    def __init__(self) -> None:
        self.events: list[tuple[Any, ...]] = []
        self.add_mouse_pos_event = lambda x, y: self.events.append(("at", x, y))
        self.add_mouse_button_event = lambda button, down: self.events.append(("down" if down else "up", button))
        self.add_mouse_wheel_event = lambda x, y: self.events.append(("wheel", x, y))

    def take(self) -> list[tuple[Any, ...]]:
        events, self.events = self.events, []
        return [event for i, event in enumerate(events) if event not in events[:i] or event[0] != "at"]


def test_a_press_waits_until_the_pointer_is_there() -> None:
    heard = Heard()
    mouse = Mouse(lambda: heard)  # type: ignore[arg-type,return-value]
    mouse.move(5, 5)
    mouse.button(5, 5, 0, True)
    mouse.button(5, 5, 0, False)
    mouse.move(30, 5)
    mouse.scroll(0, 1)
    assert heard.take() == [("at", 5, 5)]
    assert mouse.frame()
    assert heard.take() == [("at", 5, 5), ("down", 0), ("up", 0), ("at", 30, 5), ("wheel", 0, 1)]
    assert not mouse.frame()


def test_a_pointer_at_rest_presses_at_once() -> None:
    heard = Heard()
    mouse = Mouse(lambda: heard)  # type: ignore[arg-type,return-value]
    mouse.move(5, 5)
    mouse.frame()
    heard.take()
    mouse.button(5, 5, 1, True)
    assert heard.take() == [("at", 5, 5), ("down", 1)]


def test_two_clicks_on_the_way_take_a_frame_each() -> None:
    heard = Heard()
    mouse = Mouse(lambda: heard)  # type: ignore[arg-type,return-value]
    for x in (5, 50):
        mouse.button(x, 0, 0, True)
        mouse.button(x, 0, 0, False)
    frames = [heard.take()]
    while mouse.frame():
        frames.append(heard.take())
    assert [("down", 0) in frame for frame in frames] == [False, True, True]
    assert frames[1][-1] == ("at", 50, 0)
