"""Keys reach Dear ImGui as they were pressed, also where a chord and what is typed after it lie in one frame."""

from __future__ import annotations

from imgui_bundle import imgui

from app.viewer.keyboard import Keyboard

CTRL, A, ONE = 1, 2, 3
KEYS = {CTRL: imgui.Key.left_ctrl, A: imgui.Key.a, ONE: imgui.Key._1}


class Told:
    """What Dear ImGui was told in a frame."""

    def __init__(self) -> None:
        self.events: list[object] = []

    def add_key_event(self, key: imgui.Key, down: bool) -> None:
        self.events.append((key, down))

    def add_input_characters_utf8(self, text: str) -> None:
        self.events.append(text)

    def frame(self) -> list[object]:
        events, self.events = self.events, []
        return events


def test_what_is_typed_after_a_chord_is_none() -> None:
    told = Told()
    keyboard = Keyboard(KEYS, lambda: told)  # type: ignore[arg-type, return-value]
    for key, down in ((CTRL, True), (A, True), (A, False), (CTRL, False), (ONE, True)):
        keyboard.key(key, down)
    keyboard.text("1")
    keyboard.key(ONE, False)
    ctrl = [(imgui.Key.mod_ctrl, True), (imgui.Key.left_ctrl, True)]
    assert told.frame() == [*ctrl, (imgui.Key.a, True), (imgui.Key.a, False)]
    keyboard.frame()
    up = [(imgui.Key.mod_ctrl, False), (imgui.Key.left_ctrl, False)]
    assert told.frame() == [*up, (imgui.Key._1, True), "1", (imgui.Key._1, False)]
    keyboard.frame()
    assert told.frame() == []


def test_two_chords_in_one_frame_are_two() -> None:
    told = Told()
    keyboard = Keyboard(KEYS, lambda: told)  # type: ignore[arg-type, return-value]
    for _ in range(2):
        for key, down in ((CTRL, True), (A, True), (A, False), (CTRL, False)):
            keyboard.key(key, down)
    frames = []
    for _ in range(3):
        frames.append([event for event in told.frame() if isinstance(event, tuple) and event[0] is imgui.Key.mod_ctrl])
        keyboard.frame()
    assert frames == [
        [(imgui.Key.mod_ctrl, True)],
        [(imgui.Key.mod_ctrl, False), (imgui.Key.mod_ctrl, True)],
        [(imgui.Key.mod_ctrl, False)],
    ]


def test_a_window_that_loses_the_keyboard_holds_nothing() -> None:
    told = Told()
    keyboard = Keyboard(KEYS, lambda: told)  # type: ignore[arg-type, return-value]
    keyboard.key(CTRL, True)
    keyboard.key(CTRL, False)
    keyboard.text("1")
    told.frame()
    keyboard.forget()
    keyboard.frame()
    keyboard.key(99, True)
    assert told.frame() == []
