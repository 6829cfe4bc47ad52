"""How much of a solve fits into a frame: several shots of fast scenes, a part of one shot of slow ones, less while a hand is at
the controls."""

from __future__ import annotations

import time
from typing import Any

from app.gpu import Gpu
from app.solvers import Solver

LONG_FRAME = 0.07  # seconds from one advance to the next: a frame of 100 ms would be felt as a halt
BRISK_FRAME = 1 / 30  # s, while a hand is at the controls: what it does is seen at once
BRISK_BUDGET = 4.0  # ms of such a frame, after which no further part of a shot starts
MOST_BANDS = 16
SLOW_FRAME, FAST_FRAME = 0.08, 0.05  # s for shooting and drawing, beyond which they take turns, and below which not


class Turns:
    """Which frames shoot and which draw the view: every one both, or in turns where both together take long."""

    def __init__(self) -> None:
        self._alternate, self._shoot, self._last = False, True, 0.0

    def next(self, seconds: float) -> tuple[bool, bool]:
        """Whether the next frame shoots, and whether it draws the view. seconds: that the last frame took."""
        both = seconds + (self._last if self._alternate else 0.0)
        self._last = seconds
        if self._alternate != (both > (FAST_FRAME if self._alternate else SLOW_FRAME)):
            self._alternate = not self._alternate
        self._shoot = not (self._alternate and self._shoot)
        return self._shoot, not (self._alternate and self._shoot)


class Pacer:
    """Steps a solver once per frame."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self.begin()

    def begin(self) -> None:
        """Forget how fast the last solve was."""
        self._last = self._start = 0.0
        self._batch = self._bands = 1

    def pause(self) -> None:
        """No lap runs until the next advance."""
        self._last = self._start = 0.0

    def advance(self, solver: Solver[Any], budget_ms: float, shots: int, *, brisk: bool = False) -> int:
        """Make up to ``shots`` shots within ``budget_ms``, or a part of one; how many are whole. brisk: rather keep up with a
        hand."""
        start = time.perf_counter()
        if self._pieces(start, BRISK_FRAME if brisk else LONG_FRAME) > 1 and (brisk or shots == 1):
            return self._advance_some(solver, start, min(budget_ms, BRISK_BUDGET) if brisk else budget_ms)
        made = 0
        while made < shots:
            made += solver.step(min(shots - made, self._batch))
            if made < shots:
                self._gpu.ctx.finish()
                spent = (time.perf_counter() - start) * 1e3
                self._batch = max(1, int((budget_ms - spent) / (spent / made)))
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
        """Into how many bands a shot must be cut for frames to stay short: more after a long frame, fewer after a short one."""
        if self._start:
            frame = now - self._start
            if frame > longest:
                self._bands = min(2 * self._bands, MOST_BANDS)
            elif frame < 0.6 * longest:
                self._bands = max(self._bands // 2, 1)
        self._start = now
        return self._bands

    def _advance_some(self, solver: Solver[Any], start: float, budget_ms: float) -> int:
        """Parts of one shot, as many as the budget allows."""
        whole = False
        while not whole and (time.perf_counter() - start) * 1e3 < budget_ms:
            whole = solver.step_part(self._bands)
            self._gpu.ctx.finish()
        return int(whole)
