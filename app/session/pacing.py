"""How much of a solve fits into a frame: several pieces of work in fast scenes, a part of one in slow ones, less while a hand is
at the controls."""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import Any

from app.gpu import Gpu
from app.solvers import Solver
from app.util.parts import run_to_end

LONG_FRAME = 0.07  # seconds from one advance to the next: a frame of 100 ms would be felt as a halt
INTERACTIVE_FRAME = 1 / 30  # s, while a hand is at the controls: what it does is seen at once
INTERACTIVE_BUDGET = 4.0  # ms of such a frame, after which no further part of a piece of work starts
MOST_BANDS = 16
OVER = object()  # no part is left
SLOW_FRAME, FAST_FRAME = 0.08, 0.05  # s for solving and drawing, beyond which they take turns, and below which not


class Turns:
    """Which frames solve and which draw the view: every one both, or in turns where both together take long."""

    def __init__(self) -> None:
        self._alternate, self._solve, self._last = False, True, 0.0

    def next(self, seconds: float) -> tuple[bool, bool]:
        """Whether the next frame solves, and whether it draws the view. seconds: that the last frame took."""
        both = seconds + (self._last if self._alternate else 0.0)
        self._last = seconds
        if self._alternate != (both > (FAST_FRAME if self._alternate else SLOW_FRAME)):
            self._alternate = not self._alternate
        self._solve = not (self._alternate and self._solve)
        return self._solve, not (self._alternate and self._solve)


class Pacer:
    """What lets a solver work once per frame, as much as the frame has time for."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self.begin()

    def begin(self) -> None:
        """Forget how fast the last solve was."""
        self._last = self._start = 0.0
        self._batch = self._bands = 1
        self._parts: Generator[None, None, int] | None = None  # of one unit of work, over several frames

    def pause(self) -> None:
        """No lap runs until the next advance."""
        self._last = self._start = 0.0

    def advance(self, solver: Solver[Any], budget_ms: float, amount: int, *, interactive: bool = False) -> int:
        """Do up to ``amount`` of work within ``budget_ms``, or a part of one unit; how much is whole. interactive: a hand is at
        the controls, which frames keep up with."""
        start = time.perf_counter()
        if self._pieces(start, INTERACTIVE_FRAME if interactive else LONG_FRAME) > 1 and (interactive or amount == 1):
            return self._advance_some(solver, start, min(budget_ms, INTERACTIVE_BUDGET) if interactive else budget_ms)
        made, self._parts = 0, None
        while made < amount:
            made += run_to_end(solver.work(min(amount - made, self._batch)))
            if made < amount:
                self._gpu.ctx.finish()
                spent = (time.perf_counter() - start) * 1e3
                self._batch = max(1, int((budget_ms - spent) / (spent / max(made, 1))))
                if spent >= budget_ms:
                    break
        return made

    def lap(self) -> float:
        """Seconds since the last lap, 0 after a pause."""
        now = time.perf_counter()
        seconds = now - self._last if self._last else 0.0
        self._last = now
        return seconds

    def _pieces(self, now: float, longest: float) -> int:
        """Into how many bands a unit of work must be cut for frames to stay short: more after a long frame, fewer after a short
        one."""
        if self._start:
            frame = now - self._start
            if frame > longest:
                self._bands = min(2 * self._bands, MOST_BANDS)
            elif frame < 0.6 * longest:
                self._bands = max(self._bands // 2, 1)
        self._start = now
        return self._bands

    def _advance_some(self, solver: Solver[Any], start: float, budget_ms: float) -> int:
        """Parts of one unit of work, as many as the budget allows."""
        while (time.perf_counter() - start) * 1e3 < budget_ms:
            self._parts = self._parts or solver.work(1, self._bands)
            if next(self._parts, OVER) is OVER:
                self._parts = None
            self._gpu.ctx.finish()
            if self._parts is None:
                return 1
        return 0
