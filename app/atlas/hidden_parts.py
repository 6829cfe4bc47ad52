"""What of faces something lies on, in each cell of a grid, taken away from what they show there."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.fragments import Fragments
from app.scene.model import F64

LEAST_SEEN = 1e-3  # of a texel, that is not hidden: less is no place to look from
CELLS = 1 << 40  # more than there are in a grid

I64 = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class HiddenParts:
    """key (n,), of face and cell, in ascending order; share of the cell's area that is hidden, and that times its centroid."""

    key: I64
    share: F64
    u: F64
    v: F64

    @property
    def cell(self) -> I64:
        """(n,) cells in which something is hidden."""
        return self.key % CELLS

    def take_from(self, part: Fragments, face: I64, cell: I64) -> tuple[NDArray[np.bool_], F64, F64, F64]:
        """Which fragments are left of those of faces in cells, and of these share and centroid u, v."""
        share, u, v = part.share, part.share * part.u, part.share * part.v
        if len(self.key):
            key = face * CELLS + cell
            place = np.minimum(np.searchsorted(self.key, key), len(self.key) - 1)
            here = self.key[place] == key
            share, u, v = (
                whole - np.where(here, own[place], 0.0)
                for whole, own in ((share, self.share), (u, self.u), (v, self.v))
            )
        kept = share > LEAST_SEEN * part.share
        share = share[kept]
        return kept, share, u[kept] / share, v[kept] / share


def hidden_parts(pieces: Iterable[tuple[I64, I64, Fragments]]) -> HiddenParts:
    """Of the face and the cell of each fragment of a piece that is hidden."""
    keys, sums = [np.empty(0, np.int64)], [np.empty((0, 3))]
    for face, cell, part in pieces:
        keys.append(face * CELLS + cell)
        sums.append(part.share[:, None] * np.column_stack([np.ones(len(part.u)), part.u, part.v]))
    key, which = np.unique(np.concatenate(keys), return_inverse=True)
    share, u, v = (
        np.bincount(which.reshape(-1), column, len(key)).astype(np.float64) for column in np.concatenate(sums).T
    )
    return HiddenParts(key, share, u, v)
