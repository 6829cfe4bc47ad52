"""Connected surfaces, and which of them are copies: one shape that differs only by where it is, how it is turned and its size.

What unfolds one of them unfolds the others: a chart is known by lengths on the surface alone. Copies list their triangles and
corners in one order, as nodes of glTF that share a mesh and instances do; so no two surfaces need be compared in more than one
way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.sides import SPREAD, distinct_rows, groups_of, middle, numbered, rows_by, totals
from app.scene.model import F64, I32

LEAST = 32  # triangles of a surface that is looked for: fewer cost no time to unfold
SAME = 1e-4  # of a shape's radius, that a corner of a copy may be off: charts have at most some thousand texels
ROUNDS = 8  # shapes told apart among surfaces that seem alike; what is left then is unfolded by itself
SAMPLED = 16  # corners of a surface that are compared first
BLOCK = 1 << 20  # corners compared at a time

I64 = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Surfaces:
    """surface (m,) i64: the number of the connected surface of each triangle; original (m,) i64: the triangle that each is a copy
    of, itself where there is none before it."""

    surface: I64
    original: I64


def find_surfaces(points: F64, triangles: I32, groups: I32) -> Surfaces:
    """Of triangles (m, 3) into welded points (n, 3); those of different groups (m,) are not connected."""
    vertices = _vertices(triangles, groups)
    surface = _connected(vertices)
    order, first = rows_by(surface, int(surface.max()) + 1)
    first, count = first[:-1], np.diff(first)
    original = np.arange(len(triangles))
    corners, named = points.take(triangles[order], axis=0), _names(vertices[order], first, count)
    centre, radius = _extents(corners, count)
    kind = distinct_rows(count, _digest(named, first), _sizes(corners, count, radius))[1]
    for mine in np.split(np.argsort(kind, kind="stable"), np.cumsum(np.bincount(kind))[:-1]):
        if len(mine) > 1 and count[mine[0]] >= LEAST:
            rows = first[mine][:, None] + np.arange(count[mine[0]])
            far = _distances(corners, rows, centre[mine], radius[mine])
            original[order[rows]] = order[rows[_same_shape(corners, named, rows, far)]]
    return Surfaces(surface, original)


def _vertices(triangles: I32, groups: I32) -> I64:
    """(m, 3) numbers of the corners, apart where groups meet."""
    corner = triangles.astype(np.int64)
    if (groups == groups[0]).all():
        return corner
    apart = corner + (int(corner.max()) + 1) * groups.astype(np.int64)[:, None]
    return numbered(apart)


def _connected(vertices: I64) -> I64:
    """(m,) a number for each set of triangles that corners connect, in the order of their first triangles."""
    joins = np.concatenate([vertices[:, :2], vertices[:, 1:]])
    label = groups_of(int(vertices.max()) + 1, joins)[1][vertices[:, 0]]
    first = np.full(int(label.max()) + 1, len(label))
    np.minimum.at(first, label, np.arange(len(label)))
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[label]


def _names(vertices: I64, first: I64, count: I64) -> I64:
    """(m, 3) each corner by the place in its surface, a run of triangles, at which its vertex is named first."""
    flat = vertices.reshape(-1)
    before = np.empty(int(flat.max()) + 1, np.int64)
    before[flat[::-1]] = np.arange(len(flat))[::-1]
    return before[vertices] - np.repeat(3 * first, count)[:, None]


def _digest(named: I64, first: I64) -> NDArray[np.uint64]:
    """(s,) equal for surfaces that name their corners alike."""
    place = np.arange(named.size) - np.repeat(3 * first, 3 * np.diff(np.append(first, len(named))))
    mixed = (named.reshape(-1) + 1).astype(np.uint64) * SPREAD * (2 * place + 1).astype(np.uint64)
    return np.asarray(np.add.reduceat(mixed ^ (mixed >> np.uint64(29)), 3 * first), np.uint64)


def _extents(corners: F64, count: I64) -> tuple[F64, F64]:
    """The middle of the corners (m, 3, 3) of each surface, runs of so many triangles (s,), and their mean distance from it."""
    surface = np.repeat(np.arange(len(count)), count)
    centre = totals(surface, middle(corners), len(count)) / count[:, None]
    off = corners - centre[surface][:, None]
    spread = totals(surface, np.einsum("mck,mck->m", off, off), len(count)) / count
    return centre, np.sqrt(np.maximum(spread / 3, np.finfo(float).tiny))


def _sizes(corners: F64, count: I64, radius: F64) -> I64:
    """(s,) the area of each surface over the square of its extent, roughly: surfaces that seem alike may differ there."""
    doubled = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    area = totals(np.repeat(np.arange(len(count)), count), doubled, len(count))
    return np.asarray(np.round(64 * np.log2(np.maximum(area / (3 * radius**2), np.finfo(float).tiny))), np.int64)


def _distances(corners: F64, rows: I64, centre: F64, radius: F64) -> F64:
    """(k, SAMPLED) of some corners of surfaces, of triangles rows (k, t), from their centre (k, 3), over their radius (k,)."""
    some = np.linspace(0, rows.shape[1] - 1, SAMPLED).astype(np.int64)
    return np.asarray(np.linalg.norm(corners[rows[:, some], 0] - centre[:, None], axis=2) / radius[:, None])


def _same_shape(corners: F64, named: I64, rows: I64, far: F64) -> I64:
    """(k,) for each of surfaces whose triangles are the rows (k, t), the first one that it is a copy of: itself, if none. far:
    see _distances."""
    same, waiting, one = np.arange(len(rows)), np.arange(1, len(rows)), 0
    step = max(1, BLOCK // (3 * rows.shape[1]))
    for _ in range(ROUNDS):
        shape = _centred(corners[rows[one : one + 1]])
        widest = np.abs(shape).max() / np.sqrt((shape**2).sum(2).mean())
        maybe = np.flatnonzero((np.abs(far[waiting] - far[one]) <= 4 * SAME * widest).all(1))  # no copy is farther off
        fits = np.zeros(len(waiting), bool)
        for start in range(0, len(maybe), step):
            block = maybe[start : start + step]
            mine = rows[waiting[block]]
            alike = (named[mine] == named[rows[one]]).all((1, 2))
            fits[block] = alike & _fits(_centred(corners[mine]), shape)
        same[waiting[fits]] = one
        waiting = waiting[~fits]
        if not len(waiting):
            break
        one, waiting = waiting[0], waiting[1:]
    return same


def _centred(corners: F64) -> F64:
    """Corners (k, t, 3, 3) of surfaces as points (k, 3 t, 3) about their middle."""
    points = corners.reshape(len(corners), -1, 3)
    return np.asarray(points - points.mean(axis=1, keepdims=True))


def _fits(copies: F64, shape: F64) -> NDArray[np.bool_]:
    """(k,) whether points (k, n, 3) about their centre are those of a shape (1, n, 3), turned and scaled [Kabsch76]."""
    radius = np.sqrt((copies**2).sum((1, 2)) / np.maximum((shape**2).sum(), np.finfo(float).tiny))
    u, _, v = np.linalg.svd(copies.transpose(0, 2, 1) @ shape[0])
    u[:, :, 2] *= np.sign(np.linalg.det(u @ v))[:, None]  # no mirror
    placed = radius[:, None, None] * (shape[0] @ (u @ v).transpose(0, 2, 1))
    off = np.abs(copies - placed).max((1, 2))
    return np.asarray(off <= SAME * radius * np.abs(shape).max())
