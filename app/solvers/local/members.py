"""Members are the nodes of the local set: on the CPU with their form factors, on the GPU in the matrix."""

from __future__ import annotations

import numpy as np

from app.scene.model import F64
from app.solvers.local.form_factors import LocalSet
from app.solvers.local.matrix import LocalMatrix
from app.solvers.local.selection import Swap

DRIFT = 1e-3  # of a diagonal, beyond which its node enters anew
OTHER = 1e-6  # of an albedo, beyond which it is another


class Members:
    """A set and a matrix that hold the same nodes.

    albedo (nodes, 3): of each patch and cluster, with which nodes enter from now on. pieces: of work, so far; entered (slots,):
    the one in which what is in each slot entered.
    """

    def __init__(self, held: LocalSet, matrix: LocalMatrix, albedo: F64) -> None:
        self.held, self.matrix, self.albedo, self.pieces = held, matrix, albedo, 0
        self.clear()

    def clear(self) -> None:
        """None."""
        most = self.held.most
        self.held.clear()
        self.matrix.clear()
        self._inside = np.zeros((most, 3))  # ρ with which the node in each slot has entered
        self._since = np.full(most, -1)  # the count at which what is in each slot entered
        self._left: dict[int, int] = {}  # and each node left
        self._count = 0
        self.entered = np.zeros(most, np.int64)
        self._stale: list[int] | None = None  # None: not looked for

    @property
    def left(self) -> int:
        """How many different nodes have left since there were none."""
        return len(self._left)

    @property
    def mean_albedo(self) -> float:
        """Of the colour that is reflected most, over the area of the set."""
        held = self.held
        reflected = (held.area[:, None] * self._albedo_of_slots).sum(0)
        return float((reflected / max(held.area.sum(), 1e-300)).max())

    @property
    def _albedo_of_slots(self) -> F64:
        """(slots, 3), 0 where they are free."""
        return np.where(self.held.node[:, None] >= 0, self.albedo[self.held.node], 0.0)

    # -- nodes that enter anew -----------------------------------------------------------------------------------------

    @property
    def settled(self) -> bool:
        """Whether none must enter anew, as far as was looked for."""
        return self._stale == []

    @property
    def waiting(self) -> int:
        """How many must enter anew, as far as was looked for."""
        return len(self._stale or ())

    def look_again(self) -> None:
        """Other nodes are wanted, or albedos are others: some may have to enter anew."""
        self._stale = None

    def stale(self) -> list[int]:
        """Nodes that must enter anew: whose albedo is another, or whose diagonal has drifted; looked for once nothing moves."""
        if self._stale is None:
            held = self.held
            drifted = np.abs(held.drift()) > DRIFT
            other = self.matrix.coloured and (np.abs(self._albedo_of_slots - self._inside) > OTHER).any(1)
            self._stale = [int(node) for node in held.node[(drifted | other) & (held.node >= 0)]]
        return self._stale

    # -- nodes that come and go ----------------------------------------------------------------------------------------

    def swap(self, swap: Swap, diagonals: dict[int, float]) -> list[int]:
        """Carry it out. diagonals: F_ii of nodes, as in ``LocalSet.enter``. Returns the slots that nodes have entered."""
        for node in swap.leave:
            self.leave(node)
        slots = [self.enter(node, diagonals.get(node)) for node in swap.enter]
        if self._stale is not None and swap.leave == swap.enter:
            self._stale.remove(swap.enter[0])
        else:
            self._stale = None
        return slots

    def leave(self, node: int) -> None:
        """Take a node out."""
        slot = self.held.leave(node)
        self.matrix.leave(slot, self._inside[slot])
        self._left[node] = self._count

    def enter(self, node: int, diagonal: float | None = None) -> int:
        """The slot that a node has entered. diagonal: see ``LocalSet.enter``."""
        held, slot = self.held, self.held.first_free()
        kernel = held.enter(node, slot, diagonal)
        self._inside[slot] = self.albedo[node]
        self._count += 1
        there = held.node >= 0
        known = there & (self._since <= self._left.get(node, -1))
        self.matrix.enter(slot, kernel, self._inside[slot], self._inside * there[:, None], known)
        self._since[slot] = self._count
        return slot
