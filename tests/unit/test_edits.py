"""The history of edits, over knobs that are plain attributes."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from app.errors import UserError
from app.session.edits import MOST_STEPS, EditHistory, Knob


class Hand:
    """Turns knobs and is watched, frame by frame."""

    def __init__(self) -> None:
        self.at = SimpleNamespace(level=1, colour="red", eye=0.0, texels=100)
        self.history = EditHistory()
        names = {"level": {}, "colour": {}, "eye": {"pause": 0.5}, "texels": {"waits": True}}
        self.knobs = [self._knob(name, **more) for name, more in names.items()]
        self.frame()

    def _knob(self, name: str, **more: object) -> Knob:
        return Knob(
            name,
            lambda: getattr(self.at, name),
            lambda value: setattr(self.at, name, value),
            lambda before, after: f"{name} {before} to {after}",
            **more,
        )

    def frame(self, *, held: bool = False, seconds: float = 0.02, **values: object) -> None:
        vars(self.at).update(values)
        self.history.watch(self.knobs, held=held, seconds=seconds)

    def undo(self) -> None:
        self.history.undo(self.knobs)
        self.frame()

    def redo(self) -> None:
        self.history.redo(self.knobs)
        self.frame()


def test_each_edit_is_undone_and_done_again() -> None:
    hand = Hand()
    assert hand.history.undoable is None and hand.history.redoable is None
    hand.undo()
    hand.redo()
    hand.frame(level=2)
    hand.frame(colour="blue")
    assert hand.history.undoable == "colour red to blue"
    hand.undo()
    assert (hand.at.colour, hand.at.level) == ("red", 2)
    assert (hand.history.undoable, hand.history.redoable) == ("level 1 to 2", "colour red to blue")
    hand.undo()
    assert hand.at.level == 1 and hand.history.undoable is None
    hand.redo()
    hand.redo()
    assert (hand.at.colour, hand.at.level) == ("blue", 2) and hand.history.redoable is None


def test_an_edit_after_an_undo_forgets_what_was_undone() -> None:
    hand = Hand()
    hand.frame(level=2)
    hand.undo()
    hand.frame(level=3)
    assert hand.history.redoable is None
    hand.undo()
    assert hand.at.level == 1


def test_a_drag_is_one_step() -> None:
    hand = Hand()
    for level in range(2, 9):
        hand.frame(held=True, level=level)
        hand.frame(held=True)
    hand.frame()
    assert hand.history.undoable == "level 1 to 8"
    hand.frame(held=True, level=9)  # another one, at once
    hand.frame()
    hand.undo()
    assert hand.at.level == 8
    hand.undo()
    assert hand.at.level == 1


def test_a_drag_back_to_its_start_is_no_step() -> None:
    hand = Hand()
    hand.frame(held=True, level=2)
    hand.frame(held=True, level=1)
    hand.frame()
    assert hand.history.undoable is None


def test_two_controls_are_two_steps_however_fast() -> None:
    hand = Hand()
    hand.frame(held=True, level=2)
    hand.frame(held=True, colour="blue")
    hand.frame()
    hand.undo()
    assert (hand.at.level, hand.at.colour) == (2, "red")


def test_what_one_action_changes_is_one_step() -> None:
    hand = Hand()
    hand.frame(level=2, colour="blue")
    assert hand.history.undoable == "level 1 to 2, colour red to blue"
    hand.undo()
    assert (hand.at.level, hand.at.colour) == (1, "red")


def test_notches_of_a_wheel_are_one_step_until_it_pauses() -> None:
    hand = Hand()
    for eye in (1.0, 2.0, 3.0):
        hand.frame(eye=eye, seconds=0.2)
    hand.frame(seconds=0.6)
    hand.frame(eye=4.0)
    hand.undo()
    assert hand.at.eye == 3.0
    hand.undo()
    assert hand.at.eye == 0.0


def test_two_drags_of_what_a_wheel_moves_are_two_steps() -> None:
    hand = Hand()
    for eye in (1.0, 2.0):
        hand.frame(held=True, eye=eye)
        hand.frame()
    hand.undo()
    assert hand.at.eye == 1.0


def test_esc_takes_back_what_is_held() -> None:
    hand = Hand()
    hand.frame(level=2)
    hand.frame(held=True, level=5)
    assert hand.history.held
    hand.history.cancel(hand.knobs)
    hand.frame()
    assert hand.at.level == 2 and hand.history.undoable == "level 1 to 2" and not hand.history.held
    hand.history.cancel(hand.knobs)
    assert hand.at.level == 2, "nothing is held"


def test_what_was_waited_for_and_stopped_is_no_step() -> None:
    hand = Hand()
    hand.frame(level=2)
    hand.frame(texels=200)
    hand.frame()
    hand.frame(texels=100)  # stopped by the user
    hand.frame()
    assert hand.history.undoable == "level 1 to 2"
    hand.frame(level=3)
    hand.frame()
    hand.frame(level=2)
    hand.frame()
    assert hand.history.undoable == "level 3 to 2", "a knob that was turned back is an edit"


def test_what_cannot_be_undone_is_said_and_kept() -> None:
    hand = Hand()

    def refuse(value: object) -> None:
        raise UserError("not now")

    hand.frame(level=2)
    knob = hand.knobs[0]
    hand.knobs[0] = Knob(knob.name, knob.get, refuse, knob.say)
    with pytest.raises(UserError, match="not now"):
        hand.undo()
    hand.frame()
    hand.knobs[0] = knob
    assert hand.history.undoable == "level 1 to 2" and hand.history.redoable is None
    hand.undo()
    assert hand.at.level == 1


def test_the_oldest_steps_are_forgotten() -> None:
    hand = Hand()
    for level in range(MOST_STEPS + 10):
        hand.frame(level=level)
    for _ in range(MOST_STEPS + 10):
        hand.undo()
    assert hand.at.level == 9 and hand.history.undoable is None
