"""Long work as a generator that yields between its parts, so that a frame can make one of them."""

from __future__ import annotations

import inspect
from collections.abc import Generator
from typing import TypeVar

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
