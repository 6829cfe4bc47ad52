"""The one loop that drives a solver: when it asks, what it gives back, and what counts as work."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import numpy as np

from app.solvers import Progress
from app.solvers.run import solve_until


class HalfInVain:
    """Of what is issued every second unit comes to nothing, and it is known a piece of work later."""

    def __init__(self) -> None:
        self.issued = self.arrived = self.done = 0
        self.asked: list[int] = []

    def work(self, amount: int) -> Generator[None, None, int]:
        yield
        self.asked.append(amount)
        self.arrived = self.done
        self.done += -(-amount // 2)
        self.issued += amount
        return amount

    def poll(self, *, wait: bool = False) -> Progress:
        if wait:
            self.issued = self.arrived = self.done
        return Progress(self.arrived, 1.0, np.zeros(3))


def test_it_asks_before_each_piece_of_work() -> None:
    solver: Any = HalfInVain()
    asked: list[int] = []

    def over(now: Progress) -> bool:
        asked.append(now.done)
        return len(asked) == 4

    assert solve_until(solver, 8, over).done == asked[-1] == 8
    assert asked == [0, 0, 4, 8] and solver.asked == [8, 8, 8]
    assert solve_until(solver, 8, lambda now: True).done == 8 and len(solver.asked) == 3, "nothing more"


def test_what_came_to_nothing_is_made_up_for() -> None:
    solver: Any = HalfInVain()
    assert solve_until(solver, 8, lambda now: False, most=20).done == 20 == solver.done
    assert max(solver.asked) == 8 and sum(solver.asked) > 20
