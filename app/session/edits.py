"""The history of edits: what was changed by hand, as plain values before and after, so that it can be undone and done again.

Nobody tells it of an edit. Once per frame it looks at all knobs, and what has another value since the last look is an edit; while
a control is held, all of its changes are one step.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

MOST_STEPS = 1000


@dataclass(frozen=True)
class Knob:
    """One thing that can be edited.

    get, put: its value, which is never changed in place; put may raise UserError. say: in words what two values differ in, for
    "undo ...". pause: changes that follow each other sooner than this are one step [s], for what no hand holds, as the wheel.
    waits: whether a new value takes a while to come and can be stopped: the step is taken back then.
    """

    name: str
    get: Callable[[], Any]
    put: Callable[[Any], None]
    say: Callable[[Any, Any], str]
    pause: float = 0.0
    waits: bool = False


@dataclass
class Step:
    """Values of the knobs that were changed together, by name. there: whether what it takes a while to come has come."""

    before: dict[str, Any] = field(default_factory=dict)
    after: dict[str, Any] = field(default_factory=dict)
    words: str = ""
    there: bool = False


class EditHistory:
    """Steps that were made, and steps that were undone, of one scene."""

    def __init__(self) -> None:
        self._past: list[Step] = []
        self._future: list[Step] = []
        self._known: dict[str, Any] | None = None  # values at the last look
        self._open: Step | None = None  # what the hand is at
        self._gripped = False  # whether it held a control, and did not only turn the wheel
        self._since = 0.0  # s, the last change

    def watch(self, knobs: Sequence[Knob], *, held: bool, seconds: float) -> None:
        """Note what is another since the last look, ``seconds`` ago. held: whether a hand is at a control."""
        now = {knob.name: knob.get() for knob in knobs}
        known, self._known = self._known, now
        self._since += seconds
        self._gripped = held or (self._gripped and self._open is not None)
        if known is None:
            return
        changed = [knob for knob in knobs if knob.name in known and now[knob.name] != known[knob.name]]
        if changed:
            self._note(changed, known, now)
        if self._open is not None and not held and (self._gripped or self._since >= self._pause(knobs)):
            self._close(knobs)

    def _note(self, changed: Sequence[Knob], known: Mapping[str, Any], now: Mapping[str, Any]) -> None:
        self._future.clear()
        self._since = 0.0
        if self._open is not None and self._open.before.keys() != {knob.name for knob in changed}:
            self._open = None  # two hands, or the wheel and a hand
        if self._open is None:
            self._open = Step()
            self._past.append(self._open)
            del self._past[:-MOST_STEPS]
        for knob in changed:
            self._open.before.setdefault(knob.name, known[knob.name])
            self._open.after[knob.name] = now[knob.name]
        self._open.words = _words(changed, self._open)

    def _pause(self, knobs: Sequence[Knob]) -> float:
        assert self._open is not None
        return max(knob.pause for knob in knobs if knob.name in self._open.before)

    def _close(self, knobs: Sequence[Knob]) -> None:
        step, self._open = self._open, None
        assert step is not None
        waits = all(knob.waits for knob in knobs if knob.name in step.before)
        last = self._past[-2] if len(self._past) > 1 else None
        if step.before == step.after:
            self._past.pop()
        elif waits and last is not None and not last.there and (last.before, last.after) == (step.after, step.before):
            del self._past[-2:]

    def arrived(self, name: str, knobs: Sequence[Knob]) -> None:
        """What the last step of knob ``name`` waited for is there: what has changed since the last look came with it."""
        now = {knob.name: knob.get() for knob in knobs}
        known, self._known = self._known, now
        step = next((step for step in reversed(self._past) if name in step.after), None)
        if known is None or step is None:
            return
        step.there = True
        for key in now.keys() & known.keys():
            if now[key] != known[key]:
                step.before.setdefault(key, known[key])
                step.after[key] = now[key]

    # -- back and forth ------------------------------------------------------------------------------------------------

    @property
    def undoable(self) -> str | None:
        """The words for what ``undo`` takes back; None where that is nothing."""
        return self._past[-1].words if self._past else None

    @property
    def redoable(self) -> str | None:
        """The words for what ``redo`` does again; None where that is nothing."""
        return self._future[-1].words if self._future else None

    def undo(self, knobs: Sequence[Knob]) -> None:
        """Take the last step back. Raises UserError."""
        if self._past:
            self._go(knobs, self._past[-1].before)
            self._future.append(self._past.pop())

    def redo(self, knobs: Sequence[Knob]) -> None:
        """Do the last step that was undone again. Raises UserError."""
        if self._future:
            self._go(knobs, self._future[-1].after)
            self._past.append(self._future.pop())

    def cancel(self, knobs: Sequence[Knob]) -> None:
        """Take back what the hand that holds a control has done since it took hold. Raises UserError."""
        if self._open is not None:
            self._go(knobs, self._open.before)
            self._past.pop()

    @property
    def held(self) -> bool:
        """Whether a hand has changed something and still holds it."""
        return self._open is not None

    def _go(self, knobs: Sequence[Knob], values: Mapping[str, Any]) -> None:
        try:
            for knob in knobs:
                if knob.name in values:
                    knob.put(values[knob.name])
        finally:
            self._known = {knob.name: knob.get() for knob in knobs}
            self._open = None


def _words(changed: Sequence[Knob], step: Step) -> str:
    said = (knob.say(step.before[knob.name], step.after[knob.name]) for knob in changed)
    return ", ".join(dict.fromkeys(said))


__all__ = ["EditHistory", "Knob"]
