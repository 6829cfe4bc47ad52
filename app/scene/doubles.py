"""Triangles in the very place of others: both would be lit and reflect, and make light."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.scene.model import F64, Material
from app.util.words import counted

# Odd multipliers that spread the bits of coordinates [Knuth, multiplicative hashing by the golden ratio].
HASH = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)
# Of a triangle's corners, 9 a + 3 b + c: it winds the other way.
ODD_ORDERS = 0 * 9 + 2 * 3 + 1, 1 * 9 + 0 * 3 + 2, 2 * 9 + 1 * 3 + 0
BOTH = 2  # in place of a front
SAME, TWICE = " (same corners and material)", ": light would be counted twice there"
WINS = ": what emits stays before what has two sides, and that before what is listed first"

Array = NDArray[Any]
Bools = NDArray[np.bool_]
I64 = NDArray[np.int64]


def doubles(
    positions: F64, triangles: Array, material_ids: I64, materials: Sequence[Material], given: Bools, notes: list[str]
) -> Bools:
    """(m,) which of the ``given`` triangles are to be left out, since others lie in the same place.

    Of one material, those that have the corners and, unless it is double-sided, the front of one before them. Of several opaque
    ones, one that emits light from two sides is left alone. Else one for each front that emits; then one with two sides, unless
    both fronts emit: its other side is the wall of the room behind; and only where there is none, one for each front left. Of
    those that are alike in this the first is kept.
    """
    alike = _with_equal_corners(positions, triangles)
    alike = alike[given[alike]]
    again = np.zeros(len(triangles), bool)
    place, turned = _places(positions[triangles[alike]])
    material = material_ids[alike]
    emits, two_sided, opaque = np.array([(m.emits, m.double_sided, m.opaque) for m in materials], bool)[material].T
    front = np.where(two_sided, BOTH, turned)
    again[alike] = ~_firsts(place, np.where(two_sided, 0, turned), material)
    listed = int(again.sum())
    order = np.argsort(~emits, kind="stable")
    order = order[(opaque & ~again[alike])[order]]
    place, front, emits = place[order], front[order], emits[order]
    hidden = ~_firsts(place, front)
    there, lit = np.zeros((2, int(place.max(initial=0)) + 1, 3), bool)
    there[place, front] = True
    lit[place[emits], front[emits]] = True
    hidden |= lit[place, BOTH] & ~(emits & (front == BOTH))
    hidden |= lit[place, :BOTH].all(axis=1) & ~emits
    hidden |= there[place, BOTH] & ~emits & (front != BOTH)
    again[alike[order[hidden]]] = True
    if listed:
        verb, were = ("repeats", "was") if listed == 1 else ("repeat", "were")
        notes.append(f"{counted(listed, 'triangle', 'triangles')} {verb} others{SAME} and {were} left out{TWICE}")
    if others := int(again.sum()) - listed:
        verb = "was" if others == 1 else "were"
        what = "in the place of one of another material"
        notes.append(f"{counted(others, 'triangle', 'triangles')} {what} {verb} dropped{WINS}")
    return again


def _firsts(*columns: Array) -> Bools:
    """(n,) which rows have none that is alike before them."""
    first = np.zeros(len(columns[0]), bool)
    if len(first):
        first[np.unique(np.column_stack(columns), axis=0, return_index=True)[1]] = True
    return first


def _with_equal_corners(positions: F64, triangles: Array) -> I64:
    """Triangles that share their three corners with another one; few others, that only seem to."""
    bits = np.ascontiguousarray(positions + 0.0).view(np.uint64)  # -0 is 0
    x, y, z = ((bits ^ (bits >> np.uint64(32))) * HASH).T  # signs reach all bits, or mirrored triangles would be alike
    vertex = ((x + y + z) ^ ((x + y + z) >> np.uint64(29))) * HASH[0]
    whole = vertex[triangles[:, 0]] + vertex[triangles[:, 1]] + vertex[triangles[:, 2]]
    ranked = np.sort(whole)
    twice = ranked[1:][ranked[1:] == ranked[:-1]]
    return np.flatnonzero(np.isin(whole, twice)) if len(twice) else twice.astype(np.int64)


def _places(corners: F64) -> tuple[I64, Bools]:
    """The number of the place of triangles (n, 3, 3), one for all with the same corners, and whether they wind the other way."""
    order = np.lexsort((corners[..., 2], corners[..., 1], corners[..., 0]), axis=1)
    rows = np.take_along_axis(corners, order[..., None], axis=1).reshape(-1, 9)
    turned = np.isin((order * [9, 3, 1]).sum(axis=1), ODD_ORDERS)
    place = np.unique(rows, axis=0, return_inverse=True)[1] if len(rows) else np.empty(0, np.int64)
    return place.reshape(-1), turned
