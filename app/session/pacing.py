"""How much of a solve fits into a frame: one unit of work to watch, or fast as much as there is time for; a part of one in slow
scenes; less while a hand is at the controls."""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import Any

from app.gpu import Gpu
from app.solvers import Solver
from app.util.parts import run_to_end

LONG_FRAME = 0.07  # seconds from one advance to the next: a frame of 100 ms would be felt as a halt
INTERACTIVE_FRAME = 1 / 30  # s, while a hand is at the controls: what it does is seen at once
WATCH_BUDGET = 20.0  # ms of a frame after which no further part of one unit of work starts
LEAST_BUDGET = 4.0  # ms of a frame that solving gets also where all else takes too long already
# ms: where drawing takes a quarter of a frame or less, a fast one is as long as that, within these bounds: 60 to 15 pictures a
# second
SHORTEST_FAST, LONGEST_FAST, DRAWING = 1e3 / 60, 1e3 / 15, 1 / 4
EVEN_FAST = 100.0  # ms that a fast frame may take so that solving gets as long as drawing
WHOLE = 1 / 2  # of the budget: batches that take no longer are made whole
MOST = 1 << 30  # of work at once: a solver's own batch is less
PART_STAYS = 0.9  # share of the longest part of late, and
REST_STAYS = 0.8  # of what else a frame takes, that goes into the next guess
MOST_BANDS = 16
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
    """What lets a solver work once per frame: one unit of work to watch, or fast, as much as the frame has time for."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self.begin()

    def begin(self) -> None:
        """Forget how fast the last solve was."""
        self._last = self._start = self._end = 0.0
        self._rest = 0.0  # ms: what a frame takes beside solving
        self._part = 0.0  # ms: the longest part of late
        self._unit = self._so_far = 0.0  # ms that the last piece of work took, and the one under way so far
        self._bands = 1
        self._parts: Generator[None, None, int] | None = None  # of one piece of work, over several frames

    def pause(self) -> None:
        """No lap runs until the next advance."""
        self._last = self._start = self._end = 0.0

    @property
    def between(self) -> bool:
        """Whether no piece of work is under way: what needs whole ones does not wait for the rest of one."""
        return self._parts is None

    def advance(self, solver: Solver[Any], *, fast: bool, interactive: bool = False, to_end: bool = False) -> int:
        """Do one unit of work, or a part of it; if ``fast``, as much as fits. How much is whole. interactive: a hand is at the
        controls, which frames keep up with, fast or not. to_end: somebody waits until no piece is under way: begin none after one
        that ends."""
        start = time.perf_counter()
        bands = self._pieces(start, INTERACTIVE_FRAME if interactive else LONG_FRAME)
        if interactive:
            whole = bands == 1 and 0 < self._unit <= self._left
            made = self._whole(solver, start) if whole else self._some(solver, start, self._left, 1, to_end)
        elif not fast:
            whole = bands == 1 and self._unit > 0  # it is not known yet how long the first one takes
            made = self._whole(solver, start) if whole else self._some(solver, start, WATCH_BUDGET, 1, to_end)
        else:
            budget = self._fast_budget
            whole = bands == 1 and 0 < self._unit <= WHOLE * budget
            amount = MOST if self._unit else 1  # first one unit: light is there before much is tried for more
            made = (
                self._whole(solver, start, budget, MOST) if whole else self._some(solver, start, budget, amount, to_end)
            )
        self._end = time.perf_counter()
        return made

    def drawn(self) -> None:
        """The frame that solved is drawn: learn what one takes beside solving. Waits for the GPU, but not for the screen."""
        if self._end:
            self._gpu.ctx.finish()
            rest = (time.perf_counter() - self._end) * 1e3
            self._rest = REST_STAYS * self._rest + (1 - REST_STAYS) * rest if self._rest else rest
            self._end = 0.0

    @property
    def _left(self) -> float:
        """ms after which no further part starts, so that an interactive frame ends in time."""
        return max(INTERACTIVE_FRAME * 1e3 - self._rest - self._part, LEAST_BUDGET)

    @property
    def _fast_budget(self) -> float:
        """ms that a fast frame solves: three quarters of it where that leaves 15 pictures a second; as long as drawing takes
        where that leaves 10."""
        frame = min(max(self._rest / DRAWING, SHORTEST_FAST), LONGEST_FAST)
        return max(frame - self._rest, min(self._rest, EVEN_FAST - self._rest), LEAST_BUDGET)

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

    def _whole(self, solver: Solver[Any], start: float, budget_ms: float = 0.0, amount: int = 1) -> int:
        """Whole pieces of work, what was begun as well: one unit, or of more at once as many as the budget allows."""
        made, spent, self._parts = 0, 0.0, None
        while True:
            more = run_to_end(solver.work(amount))
            if amount > 1:
                self._gpu.ctx.finish()
            before, spent = spent, (time.perf_counter() - start) * 1e3
            self._unit, made = spent - before, made + more
            if amount == 1 or spent + self._unit > budget_ms or solver.poll().converged:
                return made

    def _some(self, solver: Solver[Any], start: float, budget_ms: float, amount: int, to_end: bool) -> int:
        """Parts of work, as many as the budget allows: of pieces of so much at once, and where that is one unit, of no more than
        one that is begun here; with ``to_end`` none after one that ends."""
        begun, made, anew, ended = start, 0, False, False
        while (begun - start) * 1e3 < budget_ms:
            if self._parts is None:
                if anew if amount == 1 else ended and solver.poll().converged:
                    break
                self._parts, self._so_far, anew = solver.work(amount, self._bands), 0.0, True
            more = self._next_part()
            self._gpu.ctx.finish()
            now = time.perf_counter()
            part, begun = (now - begun) * 1e3, now
            self._part, self._so_far = max(PART_STAYS * self._part, part), self._so_far + part
            if more is not None:
                self._unit, made, ended = self._so_far, made + more, True
                if to_end:
                    break
        return made

    def _next_part(self) -> int | None:
        """Do one; after the last of a piece of work, how much that was."""
        assert self._parts is not None
        try:
            next(self._parts)
        except StopIteration as last:
            self._parts = None
            return int(last.value or 0)  # nothing where another has ended it
        return None
