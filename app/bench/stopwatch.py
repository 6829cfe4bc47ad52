"""A clock that can be held, so that only solving is timed and not what looks at it."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator


class Stopwatch:
    """Seconds since it was made, less those while it was held."""

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock, self._start = clock, clock()
        self._held_at: float | None = None

    @property
    def seconds(self) -> float:
        return (self._clock() if self._held_at is None else self._held_at) - self._start

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """It stands while inside."""
        self._held_at = self._clock()
        try:
            yield
        finally:
            self._start += self._clock() - self._held_at
            self._held_at = None
