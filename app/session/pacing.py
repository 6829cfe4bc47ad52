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
INTERACTIVE_BUDGET = 4.0  # ms of such a frame, that solving gets also where all else takes too long already
PART_STAYS = 0.9  # share of the longest part of late, and
REST_STAYS = 0.8  # of what else a frame takes, that goes into the next guess
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
        self._unit = self._so_far = 0.0  # ms that the last unit of work took, and the one under way so far
        self._part = self._solved = self._rest = (
            0.0  # ms: the longest part of late; of the last frame, solving; all else
        )
        self._batch = self._bands = 1
        self._parts: Generator[None, None, int] | None = None  # of one unit of work, over several frames

    def pause(self) -> None:
        """No lap runs until the next advance."""
        self._last = self._start = 0.0

    def advance(self, solver: Solver[Any], budget_ms: float, amount: int, *, interactive: bool = False) -> int:
        """Do up to ``amount`` of work within ``budget_ms``, or a part of one unit; how much is whole. interactive: a hand is at
        the controls, which frames keep up with."""
        start = time.perf_counter()
        self._look_back(start)
        pieces = self._pieces(start, INTERACTIVE_FRAME if interactive else LONG_FRAME) > 1
        budget = min(budget_ms, self._left) if interactive else budget_ms
        if (interactive and (pieces or self._unit > budget)) or (pieces and amount == 1):
            made = self._advance_some(solver, start, budget)
        else:
            made = self._advance_whole(solver, start, budget_ms, amount)
        self._solved = (time.perf_counter() - start) * 1e3
        return made

    def _look_back(self, now: float) -> None:
        """Learn from the last frame what one takes beside solving."""
        if self._start:
            rest = (now - self._start) * 1e3 - self._solved
            self._rest = REST_STAYS * self._rest + (1 - REST_STAYS) * rest if self._rest else rest

    @property
    def _left(self) -> float:
        """ms after which no further part starts, so that an interactive frame ends in time."""
        return max(INTERACTIVE_FRAME * 1e3 - self._rest - self._part, INTERACTIVE_BUDGET)

    def _advance_whole(self, solver: Solver[Any], start: float, budget_ms: float, amount: int) -> int:
        """Whole units of work, what was begun as well."""
        made, self._parts = 0, None
        while made < amount:
            more = run_to_end(solver.work(min(amount - made, self._batch)))
            made += more
            if not more and solver.poll().converged:
                break  # nothing is left to do but what an edit asked for
            if made < amount:
                self._gpu.ctx.finish()
                spent = (time.perf_counter() - start) * 1e3
                self._batch = max(1, int((budget_ms - spent) / (spent / max(made, 1))))
                if spent >= budget_ms:
                    break
        self._unit = (time.perf_counter() - start) * 1e3 / max(made, 1)
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
        """Parts of work, as many as the budget allows, with no more than one unit begun."""
        begun, made, anew = start, 0, False
        while (begun - start) * 1e3 < budget_ms:
            if self._parts is None:
                if anew:
                    break
                self._parts, self._so_far, anew = solver.work(1, self._bands), 0.0, True
            if next(self._parts, OVER) is OVER:
                self._parts = None
            self._gpu.ctx.finish()
            now = time.perf_counter()
            part, begun = (now - begun) * 1e3, now
            self._part, self._so_far = max(PART_STAYS * self._part, part), self._so_far + part
            if self._parts is None:
                self._unit, made = self._so_far, made + 1
        return made
