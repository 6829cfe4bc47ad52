"""The pace of pairs: how many are done at once, so that no draw takes long, and what all of them will take.

A bounce is quadratic in texels. It is drawn in parts that are measured one by one: a part waits for the GPU, for minutes of
queued work could neither be stopped nor foreseen.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from app.gpu import Gpu

PART = 0.02  # seconds that a part is to take: a frame holds it besides drawing
FIRST = 1 << 16  # pairs, before anything is known
KNOWN = 0.5  # seconds measured, from which more is foreseen
GROWTH = 2  # at most, from part to part


class Pace:
    """pairs: that the next part is to do; seconds: that a part is to take."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self.seconds = PART
        self.forget()

    def forget(self) -> None:
        """Pairs may cost more or less from now on."""
        self.pairs = FIRST
        self._pairs, self._spent, self._warm = 0, 0.0, False

    @contextmanager
    def timed(self, pairs: int) -> Iterator[None]:
        """Measure a part of so many pairs."""
        start = time.perf_counter()
        yield
        self._gpu.ctx.finish()
        spent = max(time.perf_counter() - start, 1e-6)
        if not self._warm:  # the driver has compiled
            self._warm = True
            return
        self._pairs, self._spent = self._pairs + pairs, self._spent + spent
        self.pairs = max(int(min(pairs * self.seconds / spent, GROWTH * self.pairs)), 1)

    def foreseen(self, pairs: int) -> float | None:
        """Seconds that so many pairs will take; None as long as too few were measured."""
        return pairs * self._spent / self._pairs if self._pairs and self._spent >= KNOWN else None
