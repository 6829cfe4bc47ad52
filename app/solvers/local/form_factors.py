"""Form factors between the nodes of the local set, from the rays of both of them.

The rays of node i that hit j, and those of j that hit i, are two estimates of one number, A_i F_ij = A_j F_ji [Cohen93, 3.5].
Of N rays each, with variances in proportion to A_i and A_j, they are best combined into

    A_i F_ij = A_i A_j (n_ij + n_ji) / (N (A_i + A_j))

so that reciprocity holds exactly. What a row then has too much or too little of, beside the share of its own rays that hit the
set, is put on its diagonal: light that a node would send to itself. Rows sum to 1 less what escapes, and no light is made.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from app.scene.model import F64
from app.solvers.local.patches import Patches
from app.solvers.local.rows import LOST, Rows
from app.solvers.local.selection import ranges

I64 = NDArray[np.int64]


class LocalSet:
    """The nodes in the slots of the matrix, and their form factors, on the CPU.

    most: slots. node (most,) i64: in each slot, -1 where it is free. area (most,): of nodes, in mean areas of a patch.
    diagonal (most,): F_ii. row_sum (most,): Σ_j F_ij over the set. received (most,): 1 less the share of rays that were lost.
    """

    def __init__(self, patches: Patches, rows: Rows, most: int) -> None:
        self._patches, self._rows, self.most = patches, rows, most
        self.unit = patches.edge**2  # solver space, of the areas below
        self.clear()

    def clear(self) -> None:
        """No node is in it."""
        most, rays = self.most, self._rows.rays
        self.node = np.full(most, -1, np.int64)
        self.slot = np.full(len(self._patches), -1, np.int32)  # of each node
        self.slot_at = np.full(len(self._patches.order), -1, np.int32)  # of each texel in order
        self.area, self.diagonal, self.row_sum, self.received = (np.zeros(most) for _ in range(4))
        self._hits = np.full((most, rays), LOST, np.int32)

    @property
    def nodes(self) -> I64:
        """Those in the set."""
        return self.node[self.node >= 0]

    @property
    def free(self) -> int:
        return int((self.node < 0).sum())

    def first_free(self) -> int:
        return int(np.flatnonzero(self.node < 0)[0])

    def leave(self, node: int) -> int:
        """Take a node out; the slot that it was in."""
        slot = int(self.slot[node])
        start, end = self._patches.start[node], self._patches.end[node]
        self.row_sum -= self.kernel(slot) * self.area[slot]
        self.node[slot] = self.slot[node] = -1
        self.slot_at[start:end] = -1
        self.area[slot] = self.diagonal[slot] = self.row_sum[slot] = self.received[slot] = 0.0
        self._hits[slot] = LOST
        return slot

    def enter(self, node: int, slot: int, diagonal: float | None = None) -> F64:
        """Put a node into a free slot. diagonal: its F_ii, where other nodes are known that will enter, too. Returns (most,)
        √(A_i A_j) F_ij / A_j of it with each slot, its own as well: symmetric, and never more than 1."""
        start, end = self._patches.start[node], self._patches.end[node]
        hits = self._rows.of(np.array([node]))[0]
        self.node[slot], self.slot[node], self.slot_at[start:end] = node, slot, slot
        self.area[slot] = self._patches.area[node] / self.unit
        self._hits[slot] = hits
        self.received[slot] = np.mean(hits < LOST)
        self.diagonal[slot] = 0.0
        kernel = self.kernel(slot)
        found = self.slot_at[hits[hits < LOST]]
        self.diagonal[slot] = np.sum(found >= 0) / len(hits) - kernel @ self.area if diagonal is None else diagonal
        kernel[slot] = self.diagonal[slot] / self.area[slot]
        self.row_sum += kernel * self.area[slot]
        self.row_sum[slot] = kernel @ self.area
        return np.asarray(kernel * np.sqrt(self.area[slot] * self.area))

    def kernel(self, slot: int) -> F64:
        """(most,) F_ij / A_j of a slot's node with each other, and with itself what is on the diagonal, in 1 / unit."""
        node = int(self.node[slot])
        start, end = self._patches.start[node], self._patches.end[node]
        hits = self._hits[slot]
        found = self.slot_at[hits[hits < LOST]]
        to = np.bincount(found[found >= 0], minlength=self.most)
        back = ((self._hits >= start) & (self._hits < end)).sum(1)
        kernel = (to + back) / (self._rows.rays * (self.area[slot] + self.area))
        kernel[self.node < 0] = 0.0
        kernel[slot] = self.diagonal[slot] / self.area[slot]
        return np.asarray(kernel)

    def lost(self) -> Iterator[tuple[I64, NDArray[np.bool_]]]:
        """Of each of ``nodes``, (N,) where each of its rays starts, a place in the order of texels, and whether it is lost."""
        for node in self.nodes:
            one = np.array([node])
            yield self._rows.starts(one)[0], self._rows.of(one)[0] == LOST

    @property
    def outside(self) -> F64:
        """(most,) share of what each node sees that is outside of the set."""
        return np.where(self.node >= 0, self.received - self.row_sum, 0.0)

    def drift(self) -> F64:
        """(most,) by how much each F_ii is not what it would be if its node entered now: others have come and gone since."""
        out = np.zeros(self.most)
        there = self.node >= 0
        out[there] = self.diagonals(self.node[there]) - self.diagonal[there]
        return out

    def diagonals(self, nodes: I64) -> F64:
        """(n,) F_ii of each of these nodes, in a set of all of them."""
        factors, hit = self.among(nodes)
        return np.asarray(hit - factors.sum(1))

    def matrix(self) -> csr_array[np.float64]:
        """F (n, n) of ``nodes``, as the matrix on the GPU has it."""
        factors, _ = self.among(self.nodes)
        diagonal = self.diagonal[self.node >= 0]
        return csr_array(factors + coo_array((diagonal, (np.arange(len(diagonal)),) * 2), shape=factors.shape))

    def among(self, nodes: I64) -> tuple[csr_array[np.float64], F64]:
        """F (n, n) among these nodes without its diagonal, and the share of each one's rays that hit one of them."""
        patches, rays, hits = self._patches, self._rows.rays, self._rows.of(nodes)
        place = np.full(len(patches.order) + 1, -1, np.int64)  # in ``nodes``, of each texel in order
        size = patches.end[nodes] - patches.start[nodes]
        place[ranges(patches.start[nodes], patches.end[nodes])] = np.repeat(np.arange(len(nodes)), size)
        found = place[np.minimum(hits, len(place) - 1)]
        row, _ = np.nonzero(found >= 0)
        column, area = found[found >= 0], patches.area[nodes] / self.unit
        other, shape = row != column, (len(nodes), len(nodes))
        counts = csr_array(coo_array((np.ones(int(other.sum())), (row[other], column[other])), shape=shape))
        both = coo_array(counts + counts.T)
        i, j = both.coords
        factors = both.data * area[j] / (rays * (area[i] + area[j]))
        return csr_array(coo_array((factors, (i, j)), shape=shape)), np.bincount(row, minlength=len(nodes)) / rays
