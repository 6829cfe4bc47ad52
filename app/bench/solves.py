"""Solves against the clock: the solver's programs compiled first, then solved from the start."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

from app.gpu import Gpu
from app.solvers import Progress, Solver
from app.solvers.run import solve_until
from app.util.parts import run_to_end


@dataclass
class TimedSolve:
    """A solve from the start. done: work in the solver's unit; curve: (work done, what remained after it)."""

    done: int = 0
    seconds: float = 0.0
    remaining: float = 1.0
    converged: bool = False
    curve: list[tuple[int, float]] = field(default_factory=list)

    @property
    def seconds_each(self) -> float:
        """Of a unit of work."""
        return self.seconds / max(self.done, 1)


def warm_up(gpu: Gpu, solver: Solver[Any], batch: int) -> None:
    """Draw once with each program, for drivers compile it then: each pass, and a batch with what is not part of every one."""
    for _ in solver.warm_up():
        pass
    solver.reset()
    run_to_end(solver.work(batch))
    solver.poll(wait=True)
    solver.reset()
    gpu.ctx.finish()


def timed_solve(gpu: Gpu, solver: Solver[Any], batch: int, seconds: float) -> TimedSolve:
    """Solve from the start until converged, or for so many seconds."""
    warm_up(gpu, solver, batch)
    solve, start = TimedSolve(curve=[(0, 1.0)]), time.perf_counter()

    def over(now: Progress) -> bool:
        if now.done > solve.done:  # what remains was measured before the last work that is done
            solve.curve += [(solve.done, now.remaining)] if solve.done else []
            solve.done = now.done
        solve.converged = now.converged
        return now.converged or time.perf_counter() - start >= seconds

    solve_until(solver, batch, over)
    gpu.ctx.finish()
    solve.seconds = time.perf_counter() - start
    end = solver.settle()
    solve.done, solve.remaining = end.done, end.remaining
    if end.done > solve.curve[-1][0]:
        solve.curve.append((end.done, end.remaining))
    return solve
