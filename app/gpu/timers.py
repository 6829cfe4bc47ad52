"""Milliseconds per pass from GL timer queries, read a few frames late so that nothing waits for the GPU."""

from __future__ import annotations

import contextlib
from collections import defaultdict, deque
from collections.abc import Iterator
from contextlib import AbstractContextManager

import moderngl

LAG = 3  # queries in flight per pass before the oldest is read
EVERY = (
    7  # draws of a pass, after the first LAG, of which one is timed: a software rasteriser ends all it draws at a query
)
NOT_TIMED = contextlib.nullcontext()


class Timers:
    """Totals per pass label, of some of its draws. Off by default: a query costs little, but not nothing."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self._ctx = ctx
        self._pending: dict[str, deque[moderngl.Query]] = defaultdict(deque)
        self._free: list[moderngl.Query] = []
        self._open = False
        self._met: dict[str, int] = defaultdict(int)  # draws, timed or not
        self.enabled = False
        self.total_ms: dict[str, float] = defaultdict(float)
        self.calls: dict[str, int] = defaultdict(int)

    def measure(self, label: str) -> AbstractContextManager[None]:
        """Time what is drawn inside. GL allows one timer at a time: an inner one is counted with the outer."""
        return self._timed(label) if self.enabled and not self._open and self._due(label) else NOT_TIMED

    @contextlib.contextmanager
    def _timed(self, label: str) -> Iterator[None]:
        query = self._free.pop() if self._free else self._ctx.query(time=True)
        self._open = True
        try:
            with query:
                yield
        finally:
            self._open = False
        pending = self._pending[label]
        pending.append(query)
        if len(pending) > LAG:
            self._collect(label, pending.popleft())

    def _due(self, label: str) -> bool:
        self._met[label] += 1
        return self._met[label] <= LAG or self._met[label] % EVERY == 0

    def flush(self) -> None:
        """Read every query in flight (waits for the GPU)."""
        for label, pending in self._pending.items():
            while pending:
                self._collect(label, pending.popleft())

    def reset(self) -> None:
        self.flush()
        self._met.clear()
        self.total_ms.clear()
        self.calls.clear()

    def mean_ms(self) -> dict[str, float]:
        """Mean milliseconds per call, by label, in order of first use."""
        return {label: self.total_ms[label] / self.calls[label] for label in self.total_ms}

    def release(self) -> None:
        self.flush()
        self._free.clear()

    def _collect(self, label: str, query: moderngl.Query) -> None:
        self.total_ms[label] += query.elapsed * 1e-6
        self.calls[label] += 1
        self._free.append(query)
