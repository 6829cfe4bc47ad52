"""Leaves of one level, cut into texels a block at a time: what faces show in each texel, less what something lies on, is summed.

Area and centroid go to the world by a face's affine map. The sums of a block stay in a processor's cache.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.contacts import inside_triangles
from app.atlas.fragments import Cutter, Fragments, Windows
from app.atlas.hidden_parts import HiddenParts, hidden_parts
from app.atlas.texel_middles import FLAT, MISSING, along, beside_the_surface
from app.atlas.unit_square import SLIVER
from app.scene.model import F64, I32

PLACES = 8  # along the edge of a texel: where else to look from, when something lies on its middle

I64 = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Faces:
    """Of each face: uv (f, 3, 2) in the atlas [texels of level 0]; its first corner, ∂p/∂u and ∂p/∂v [m per texel of level 0],
    and towards, its normal, (f, 3) each; per_texel (f,), its area [m²] for each texel² in the atlas."""

    uv: F64
    corner: F64
    dpdu: F64
    dpdv: F64
    towards: F64
    per_texel: F64

    def places(self, face: I64, du: F64, dv: F64) -> F64:
        """(3, n) [m] of what lies du, dv (n,) [texels of level 0] from the first corners of faces (n,)."""
        corner, dpdu, dpdv = (np.ascontiguousarray(of[face].T) for of in (self.corner, self.dpdu, self.dpdv))
        return np.asarray(corner + du * dpdu + dv * dpdv)


@dataclass(frozen=True, eq=False)
class BlockTexels:
    """Of the m texels of leaves (n,): area, face, cut (m,), leading (3, m), see TexelSurfaces; moment (3, m): centroid times
    area; normal (3, m): the sum of those of faces times area; best (m,): area of the largest share; middle (2, m): centroid in
    the atlas [texels], of those that are cut. fragments: how many were summed."""

    leaf: I64
    area: F64
    face: I32
    cut: Mask
    leading: F64
    moment: F64
    normal: F64
    best: F64
    middle: F64
    fragments: int

    @property
    def position(self) -> F64:
        """(3, m)"""
        return self.moment / np.where(self.area > 0, self.area, 1.0)


class LeafBlocks:
    """windows: pairs of a face and a leaf that it meets; over: of a piece (k, 3, 2) of a face piece_face (k,) that is hidden and
    a leaf. size: of a texel, in texels of level 0. blocks: pairs of ``windows``, by leaf, that are cut together."""

    def __init__(
        self, faces: Faces, windows: Windows, pieces: F64, piece_face: I64, over: Windows, size: float
    ) -> None:
        self._faces, self._size, self._uv = faces, size, faces.uv / size
        self._pieces, self._piece_face = pieces / size, piece_face
        self._windows, self._over = windows.by_leaf(), over.by_leaf()
        self._cutter, self._over_cutter = Cutter(self._uv, self._windows), Cutter(self._pieces, self._over)
        self.blocks = self._cutter.blocks(self._windows.leaf)

    def texels(self, pairs: slice) -> BlockTexels:
        """Those of a block."""
        leaf, number = np.unique(self._windows.leaf[pairs], return_inverse=True)
        windows = dataclasses.replace(self._windows.only(pairs), leaf=number)
        over, part = self._lying_on(leaf)
        piece, hidden_slot = over.face[part.pair], over.slot(part)
        hidden = hidden_parts([(self._piece_face[piece], hidden_slot, part)])
        found = self._summed(leaf, windows, self._cutter.of(pairs), hidden)
        if len(piece):
            self._look_beside(found, windows, piece, hidden_slot)
        self._stay_on_surface(found, windows)
        return found

    def _lying_on(self, leaf: I64) -> tuple[Windows, Fragments]:
        """Pairs of what is hidden and these leaves (n,), by their place among them, and its fragments."""
        first, last = np.searchsorted(self._over.leaf, [leaf[0], leaf[-1] + 1]).tolist()
        over = self._over.only(slice(first, last))
        part = self._over_cutter.of(slice(first, last))
        place = np.minimum(np.searchsorted(leaf, over.leaf), len(leaf) - 1)
        mine = (leaf[place] == over.leaf)[part.pair]
        return dataclasses.replace(over, leaf=place), part if mine.all() else part.only(mine)

    def _summed(self, leaf: I64, windows: Windows, part: Fragments, hidden: HiddenParts) -> BlockTexels:
        face, slot, pair = windows.face[part.pair], windows.slot(part), part.pair
        kept, share, u, v = hidden.take_from(part, face, slot)
        if not kept.all():
            face, slot, pair = face[kept], slot[kept], pair[kept]
        texels = len(leaf) * windows.tile**2
        own, size = windows.face, self._size
        covered = share * self._faces.per_texel[own][pair] * size**2
        du, dv = ((at - self._uv[own, 0, k][pair]) * size for k, at in enumerate((u, v)))

        def summed(values: F64) -> F64:
            return np.asarray(np.bincount(slot, values, texels), np.float64)

        best, which = np.zeros(texels), np.full(texels, -1, np.int32)
        np.maximum.at(best, slot, covered)
        largest = np.flatnonzero(covered >= best[slot])
        which[slot[largest]] = face[largest]
        moment, normal, leading = np.zeros((3, 3, texels))
        for k in range(3):
            corner, dpdu, dpdv, towards = (
                of[own, k][pair] for of in (self._faces.corner, self._faces.dpdu, self._faces.dpdv, self._faces.towards)
            )
            place = corner + du * dpdu + dv * dpdv
            moment[k], normal[k] = summed(covered * place), summed(covered * towards)
            leading[k, slot[largest]] = place[largest]
        cut, middle = np.zeros(texels, bool), np.zeros((2, texels))
        cut[hidden.cell] = True
        area = summed(covered)
        if cut.any():
            here = np.flatnonzero(cut[slot])
            for k, at in enumerate((u, v)):
                middle[k] = np.bincount(slot[here], (covered * at)[here], texels)
            middle /= np.where(area > 0, area, 1.0)
        return BlockTexels(leaf, area, which, cut, leading, moment, normal, best, middle, len(pair))

    def _look_beside(self, found: BlockTexels, windows: Windows, piece: I64, slot: I64) -> None:
        """Move texels on whose middle something lies to the nearest place on them beside it. piece, slot: that overlap."""
        pieces, uv, middle = self._pieces, self._uv, found.middle.T
        on_it = (found.face[slot] >= 0) & inside_triangles(pieces[piece], middle[slot][:, None])[:, 0]
        slots = np.unique(slot[on_it])
        if not len(slots):
            return
        leaf, place = np.divmod(slots, windows.tile**2)
        first = np.searchsorted(windows.leaf, leaf)
        corner = np.column_stack(
            [windows.left[first] + place % windows.tile, windows.bottom[first] + place // windows.tile]
        )
        steps = (np.arange(PLACES) + 0.5) / PLACES
        places = corner[:, None] + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
        free = inside_triangles(uv[found.face[slots]], places)
        mine = np.isin(slot, slots)
        nth = np.searchsorted(slots, slot[mine])
        np.logical_and.at(free, nth, ~inside_triangles(pieces[piece[mine]], places[nth]))
        far = np.where(free, ((places - middle[slots][:, None]) ** 2).sum(-1), np.inf)
        some = np.flatnonzero(free.any(axis=1))
        slots, at = slots[some], places[some, far.argmin(axis=1)[some]]
        face = found.face[slots].astype(np.int64)
        found.leading[:, slots] = self._faces.places(face, *((at - uv[face, 0]).T * self._size))
        found.moment[:, slots] = found.area[slots] * found.leading[:, slots]

    def _stay_on_surface(self, found: BlockTexels, windows: Windows) -> None:
        """Move flat texels whose centroid lies beside the surface that they cover to that of their largest share."""
        slot = np.flatnonzero(found.best < (1 - SLIVER) * found.area)
        face, area, faces = found.face[slot].astype(np.int64), found.area[slot], self._faces
        partly = area < (1 - MISSING) * faces.per_texel[face] * self._size**2
        partly &= np.linalg.norm(found.normal[:, slot], axis=0) > (1 - FLAT) * area
        slot, face, area = slot[partly], face[partly], area[partly]
        off = (found.moment[:, slot] / area).T - faces.corner[face]
        tangents = np.stack([faces.dpdu[face], faces.dpdv[face]])
        at = self._uv[face, 0] + np.stack(along(tangents, off), axis=1) / self._size
        beside = beside_the_surface(at, face, self._uv, slot // windows.tile**2, windows.face, windows.leaf)
        slot = slot[beside]
        found.moment[:, slot] = found.area[slot] * found.leading[:, slot]
