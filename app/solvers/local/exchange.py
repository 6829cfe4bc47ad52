"""Nodes enter and leave the local set as the observer moves: nearest first, whole swaps, each once its rows are there."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator

import numpy as np
from numpy.typing import NDArray

from app.scene.model import F64
from app.solvers.local.form_factors import LocalSet
from app.solvers.local.matrix import LocalMatrix
from app.solvers.local.members import Members
from app.solvers.local.patches import Patches
from app.solvers.local.rows import Rows
from app.solvers.local.selection import Selection, Swap, swaps

I64 = NDArray[np.int64]
FILLING = 64  # nodes that enter at once while the set is filled
ROWS = 256  # made at once before that, and
ROWS_WHILE_WALKING = 48  # while it goes on


class Exchange:
    """What of one world's nodes is in the set, and what is to be.

    wanted: nodes that the set is to have, nearest first. first: whether it is filled for the first time, or anew.
    """

    def __init__(self, patches: Patches, rows: Rows, held: LocalSet, members: Members, matrix: LocalMatrix) -> None:
        self._patches, self._rows, self._held, self._members, self._matrix = patches, rows, held, members, matrix
        self._selection = Selection(patches, held.most)
        self.wanted, self.first = np.empty(0, np.int64), True

    def look(self, observer: F64, outside: str) -> None:
        """Which nodes are wanted from here, ``outside`` of OUTSIDE. observer (3,) [solver space]."""
        self._observer = observer
        choose = self._selection.cascade if outside == "cascade" else self._selection.nearest
        before, self.wanted = self.wanted, choose(observer)
        if not np.array_equal(before, self.wanted):
            self._members.look_again()

    @property
    def to_come(self) -> int:
        """How many of the nodes that are wanted are not in the set yet."""
        return int((self._held.slot[self.wanted] < 0).sum())

    @property
    def needed(self) -> I64:
        """Nodes whose rows must stay."""
        return np.concatenate([self._held.nodes, self.wanted])

    def make_rows(self) -> Iterator[None]:
        """Some of the rows that nodes need which are to enter, nearest first."""
        missing = self.wanted[~self._rows.has(self.wanted)]
        if len(missing):
            yield from self._rows.make(missing[: ROWS if self.first else ROWS_WHILE_WALKING], self.needed)

    def plan(self) -> list[Swap]:
        """The next nodes that enter and leave, whole swaps whose rows are there, or that enter anew."""
        have_rows = bool(self._rows.has(self.wanted).all())
        if self.first and not have_rows:
            return []
        held = self._held
        plan = list(swaps(self._patches, held.nodes, self.wanted, held.free, self._observer, self._rows.has))
        if not plan and have_rows:
            plan = [Swap((node,), (node,)) for node in self._members.stale()]
        return plan

    def swap(self, plan: list[Swap], at_once: int, stop: Callable[[], bool]) -> Generator[None, None, int]:
        """Carry out as much of the plan as a piece of work may: up to so many nodes, FILLING at first; less once ``stop``
        says so. Returns how many have entered."""
        diagonals = dict[int, float]()
        if self.first:  # rows of a part of the set must not sum to more than those of all of it
            at_once = FILLING
            diagonals = dict(zip(self.wanted.tolist(), self._held.diagonals(self.wanted).tolist(), strict=True))
        entered: list[int] = []
        for swap in plan:
            full = len(entered) + len(swap.enter) > at_once or not self._matrix.has_room(swap.leave, swap.enter)
            if entered and (full or stop()):
                break
            yield
            entered += self._members.swap(swap, diagonals)
        self._members.entered[entered] = self._members.pieces
        self.first = self.first and self.to_come > 0
        return len(entered)
