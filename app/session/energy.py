"""What a running solve is known to have done: its energy book, made anew now and then, and the shots that edits took."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from app.solvers import EnergyBalance, Solver

BOOKS_SECONDS = 0.5  # between two looks at the energy book while shooting, at least: it reads every texel
BOOKS_SHARE = 0.05  # of the time may go into it
SLOW_BOOKS, RARE_SECONDS = 0.03, 3.0  # a look that takes longer than this is felt, and waits at least so long
EDIT_SECONDS = 0.2  # without another edit, until the book is made: a slider that is dragged edits every frame


class Books:
    """The last energy book, and when it is time for another.

    book: set by ``begin`` and ``make``.
    """

    def __init__(self) -> None:
        self.book: EnergyBalance
        self._due = self._quiet_after = 0.0

    def begin(self, book: EnergyBalance) -> None:
        """book: with nothing shot."""
        self.book = book
        self._due, self._quiet_after = time.perf_counter() + BOOKS_SECONDS, 0.0

    def begin_again(self) -> None:
        """All light is unshot again."""
        nothing = np.zeros(3)
        self.begin(replace(self.book, absorbed=nothing, escaped=nothing, unshot=self.book.emitted))

    def make(self, solver: Solver[Any]) -> None:
        """Read every texel. Waits for the GPU."""
        start = time.perf_counter()
        self.book = solver.books()
        now = time.perf_counter()
        cost = now - start
        self._due = now + max(BOOKS_SECONDS if cost < SLOW_BOOKS else RARE_SECONDS, cost / BOOKS_SHARE)

    def edited(self) -> None:
        """The book is wrong from now on; the next is made when no more edits follow."""
        self._due, self._quiet_after = 0.0, time.perf_counter() + EDIT_SECONDS

    @property
    def quiet(self) -> bool:
        """Whether the last edit is a while ago."""
        return time.perf_counter() >= self._quiet_after

    @property
    def due(self) -> bool:
        """Whether it is time for another book while shooting."""
        return self.quiet and time.perf_counter() >= self._due


class Effort:
    """Shots that the solution took from nothing until converged, and since the materials were last edited: [Chen90] at work.

    fresh_shots: None until converged from nothing with the knobs as they are; edited_at: shots made when edited, or None.
    """

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        self.fresh_shots: int | None = None
        self.edited_at: int | None = None
        self._from_nothing = True

    def turned(self) -> None:
        """Other knobs: shots from now on cannot be compared with earlier ones."""
        self.begin()
        self._from_nothing = False

    def edited(self, shots: int, *, rested: bool) -> None:
        """rested: whether the light had converged; edits of light that still moves count as one."""
        if rested or self.edited_at is None:
            self.edited_at, self._from_nothing = shots, False

    def converged(self, shots: int) -> None:
        if self._from_nothing:
            self.fresh_shots = shots

    def edit_shots(self, shots: int) -> int | None:
        """Shots since the edit, of so many; None if there was none."""
        return None if self.edited_at is None else shots - self.edited_at
