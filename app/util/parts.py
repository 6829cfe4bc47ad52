"""Long work as a generator that yields between its parts, so that a frame can make one of them."""

from __future__ import annotations

import inspect
from collections.abc import Generator
from typing import Any, TypeVar

ResultT = TypeVar("ResultT")


def run_to_end(parts: Generator[object, None, ResultT]) -> ResultT:
    """Do all parts of something; what it returns."""
    while True:
        try:
            next(parts)
        except StopIteration as end:
            return end.value  # type: ignore[no-any-return]  # StopIteration does not know it


def is_running(parts: Generator[object, None, object]) -> bool:
    """Whether a part is being done right now, and so asks: it cannot be ended then."""
    return inspect.getgeneratorstate(parts) == inspect.GEN_RUNNING


class UnderWay:
    """Work that has begun, of which parts may be left: one piece at a time."""

    def __init__(self) -> None:
        self._parts: Generator[Any, None, Any] | None = None

    def begin(self, parts: Generator[Any, None, ResultT]) -> Generator[Any, None, ResultT]:
        """These parts are what is under way now; what was must have ended."""
        self._parts = parts
        return parts

    def finish(self) -> None:
        """End what is under way, if anything; of its own parts this asks nothing."""
        if self._parts is not None and not is_running(self._parts):
            run_to_end(self._parts)
            self._parts = None

    def drop(self) -> None:
        """Leave undone what is left of it."""
        if self._parts is not None:
            self._parts.close()
            self._parts = None
