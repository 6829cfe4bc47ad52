"""Ctrl-C, and a request to end, that wait for a good moment."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM)
ONLY_LOOK = "view", "info", "doctor"  # commands that are not there to write something


def end_as_by_ctrl_c() -> None:
    """A request to end, as ``kill``, ``timeout`` and a system that shuts down make it, raises KeyboardInterrupt as Ctrl-C does;
    where it is ignored it stays so."""
    if signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, signal.default_int_handler)


def stopped(arguments: Sequence[str]) -> str:
    """What to say of a command that Ctrl-C has ended."""
    return f"glowtree: stopped{'' if not arguments or arguments[0] in ONLY_LOOK else ', nothing was written'}"


@contextlib.contextmanager
def held_back() -> Iterator[Callable[[], bool]]:
    """While inside, Ctrl-C, or SIGTERM where it means the same, is only noted, and whoever works asks whether it was, between
    two pieces of work; a second one interrupts at once. Where they mean something else already, or in another thread, it never
    was."""
    asked = False

    def note(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        if asked:
            raise KeyboardInterrupt
        asked = True

    mine = threading.current_thread() is threading.main_thread()
    held = [number for number in SIGNALS if mine and signal.getsignal(number) is signal.default_int_handler]
    for number in held:
        signal.signal(number, note)
    try:
        yield lambda: asked
    finally:
        for number in held:
            signal.signal(number, signal.default_int_handler)


__all__ = ["end_as_by_ctrl_c", "held_back", "stopped"]
