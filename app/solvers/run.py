"""The loop that drives a solver until something ends the solve, where no window has to stay at its frame rate."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from app.solvers.base import Progress, Solver
from app.util.parts import run_to_end


def solve_until(
    solver: Solver[Any], batch: int | Callable[[], int], over: Callable[[Progress], bool], *, most: int | None = None
) -> Progress:
    """Work, ``batch`` at a time or what it says then, until ``over`` says so of the progress that has arrived; it is asked before
    each piece of work, the first too. most: work in all, in the family's unit; what was issued and came to nothing is made up
    for. Returns the progress that had arrived in the end: nothing waits for the GPU, unless ``most`` is reached."""
    while not over(now := solver.poll()):
        amount = batch if isinstance(batch, int) else batch()
        if most is not None:
            if solver.issued >= most:
                now = solver.poll(wait=True)
            amount = min(amount, most - solver.issued)
            if amount <= 0:
                break
        run_to_end(solver.work(amount))
    return now
