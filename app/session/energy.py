"""The energy balance of a solve that goes on, measured anew now and then, and the work that edits took."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from app.solvers import EnergyBalance, Solver

BALANCE_SECONDS = 0.5  # between two measurements while solving, at least: each reads every texel
BALANCE_SHARE = 0.05  # of the time may go into them
SLOW_BALANCE, RARE_SECONDS = 0.03, 3.0  # one that takes longer than this is felt, and waits at least so long
UNFELT = 0.005  # s: one that takes no longer is measured while a hand is at the controls, too
EDIT_SECONDS = 0.2  # without another edit, until it is measured: a slider that is dragged edits every frame


class EnergyWatch:
    """The last energy balance that was measured, and when it is time for another.

    balance: set by ``begin`` and ``measure``.
    """

    def __init__(self) -> None:
        self.balance: EnergyBalance
        self._due = self._idle_after = self._cost = 0.0

    def begin(self, balance: EnergyBalance) -> None:
        """balance: with no light distributed yet."""
        self.balance = balance
        self._due, self._idle_after = time.perf_counter() + BALANCE_SECONDS, 0.0

    def begin_again(self) -> None:
        """All light is unshot again."""
        nothing = np.zeros(3)
        self.begin(replace(self.balance, absorbed=nothing, escaped=nothing, unshot=self.balance.emitted))

    def measure(self, solver: Solver[Any]) -> None:
        """Read every texel. Waits for the GPU."""
        start = time.perf_counter()
        self.balance = solver.energy()
        now = time.perf_counter()
        cost = self._cost = now - start
        self._due = now + max(BALANCE_SECONDS if cost < SLOW_BALANCE else RARE_SECONDS, cost / BALANCE_SHARE)

    def edited(self) -> None:
        """The balance is wrong from now on; the next is measured when no more edits follow."""
        self._due, self._idle_after = 0.0, time.perf_counter() + EDIT_SECONDS

    def may_measure(self, *, interactive: bool) -> bool:
        """Whether the last edit is a while ago, and it would not be felt by a hand at the controls. interactive: there is one."""
        felt = interactive and self._cost > UNFELT
        return not felt and time.perf_counter() >= self._idle_after

    @property
    def due(self) -> bool:
        """Whether it is time for another one while solving."""
        return time.perf_counter() >= self._due


class Effort:
    """Work that the solution took from nothing until converged, and since the materials were last edited: [Chen90] in numbers.

    fresh_work: None until converged from nothing with the options as they are; edited_at: work done when edited, or None;
    counted: what the solver had counted by then.
    """

    def __init__(self) -> None:
        self.begin()

    def begin(self) -> None:
        self.fresh_work: int | None = None
        self.edited_at: int | None = None
        self.counted: Mapping[str, int] = {}
        self._from_nothing = True

    def options_changed(self) -> None:
        """Work from now on cannot be compared with earlier work."""
        self.begin()
        self._from_nothing = False

    def edited(self, done: int, counts: Mapping[str, int], *, converged: bool) -> None:
        """converged: whether the light had; edits of light that still moves count as one."""
        if converged or self.edited_at is None:
            self.edited_at, self._from_nothing, self.counted = done, False, dict(counts)

    def converged(self, done: int) -> None:
        if self._from_nothing:
            self.fresh_work = done

    def edit_work(self, done: int) -> int | None:
        """Work since the edit, of so much; None if there was none."""
        return None if self.edited_at is None else done - self.edited_at

    def edit_counts(self, counts: Mapping[str, int]) -> Mapping[str, int]:
        """What was counted since the edit, of so much; nothing if there was none."""
        return {name: counts[name] - before for name, before in self.counted.items() if name in counts}
