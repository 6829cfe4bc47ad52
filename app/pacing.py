"""How much of a solve fits into a frame: several shots of fast scenes, a part of one shot of slow ones."""

from __future__ import annotations

import time
from typing import Any

from app.gpu import Gpu
from app.solvers import Solver

LONG_FRAME = 0.07  # seconds from one advance to the next: a frame of 100 ms would be felt as a halt
MOST_BANDS = 16


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

    def advance(self, solver: Solver[Any], budget_ms: float, shots: int) -> int:
        """Make up to ``shots`` shots within ``budget_ms``; how many are whole."""
        start = time.perf_counter()
        if shots == 1 and self._pieces(start) > 1:
            return self._advance_some(solver, start, budget_ms)
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

    def _pieces(self, now: float) -> int:
        """Into how many bands a shot must be cut for frames to stay short: more after a long frame, fewer after a short one."""
        if self._start:
            frame = now - self._start
            if frame > LONG_FRAME:
                self._bands = min(2 * self._bands, MOST_BANDS)
            elif frame < 0.6 * LONG_FRAME:
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
