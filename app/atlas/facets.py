"""How triangles join into flat facets.

Facets are found on welded vertices: triangles that share an edge, a material and a plane belong together, whichever file order or
diagonal they came with.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.atlas.sides import (
    FLAT,
    FLAT_ANGLE,
    SPREAD,
    WELD,
    Edges,
    distinct_rows,
    groups_of,
    middle,
    not_alone,
    numbered,
    totals,
)
from app.scene.model import F64, I32

NEAR_PLANES = 2e-4  # apart: more than planes are whose normals and lines are the same when rounded to 10 FLAT


def facets(points: F64, triangles: I32, materials: I32, size: float, edges: Edges | None = None) -> I32:
    """Number the connected flat pieces of one material.

    points (n, 3) [m], triangles (m, 3) into them (welded), materials (m,), size: the scene's diagonal [m]; edges of the
    triangles, if they are known.
    Returns (m,) i32. A piece that bends little by little, edge after edge, falls back to its single triangles.
    """
    corners = (points[triangles] - points.mean(axis=0)) / size
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(normals, axis=1)
    normals /= np.maximum(doubled, np.finfo(float).tiny)[:, None]
    pairs, left = _flat_edges(corners, triangles, materials, normals, edges or Edges.of(triangles))
    joins = np.concatenate([pairs, _t_junctions(corners, normals, materials, left)])
    count, label = groups_of(len(triangles), joins)
    some = np.flatnonzero(np.bincount(label)[label] > 1)
    bent = some[_bent(corners[some], normals[some] * doubled[some, None], numbered(label[some]))]
    label[bent] = count + np.arange(len(bent))
    return numbered(label).astype(np.int32)


def _bent(corners: F64, normals: F64, label: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(m,) whether pieces, of triangles (m, 3, 3) with such labels, stray from their planes. normals (m, 3): times area."""
    count = int(label.max(initial=-1)) + 1
    mean = totals(label, normals, count)
    mean /= np.maximum(np.linalg.norm(mean, axis=1), np.finfo(float).tiny)[:, None]
    centre = totals(label, middle(corners), count) / np.bincount(label, minlength=count)[:, None]
    stray = np.abs(np.einsum("mck,mk->mc", corners - centre[label][:, None], mean[label])).max(axis=1)
    bent = np.zeros(count, bool)
    bent[label[stray > 4 * FLAT]] = True  # an honest plane strays by FLAT from its neighbour, a few from the mean
    return np.asarray(bent[label])


def _flat_edges(
    corners: F64, triangles: I32, materials: I32, normals: F64, edges: Edges
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs (p, 2) of triangles that continue each other across a whole edge, and the half-edges (h,) left without one.

    One with two possible partners (sheets that coincide) gets none, and is not listed as left either.
    """
    start, end = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    firsts, seconds = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for shift in range(1, int(edges.uses.max(initial=1))):
        i, j = edges.pairs(shift)
        fits = (materials[i // 3] == materials[j // 3]) & (start[i] == end[j]) & (start[i] != end[i])
        i, j = i[fits], j[fits]
        flat = _coplanar(corners, normals, i, j)
        firsts.append(i[flat])
        seconds.append(j[flat])
    i, j = np.concatenate(firsts), np.concatenate(seconds)
    partners = np.bincount(np.concatenate([i, j]), minlength=3 * len(triangles))
    clear = (partners[i] == 1) & (partners[j] == 1)
    return np.stack([i[clear] // 3, j[clear] // 3], axis=1), np.flatnonzero((partners == 0) & (start != end))


def _coplanar(corners: F64, normals: F64, i: NDArray[np.int64], j: NDArray[np.int64]) -> NDArray[np.int64]:
    """Which triangles of half-edges i and j lie in one plane and face the same way."""
    turn = np.linalg.norm(normals[i // 3] - normals[j // 3], axis=1)
    some = np.flatnonzero(turn < FLAT_ANGLE)
    i, j = i[some], j[some]
    ti, tj = i // 3, j // 3
    far_i, far_j = corners[ti, (i % 3 + 2) % 3], corners[tj, (j % 3 + 2) % 3]
    off_i = np.einsum("ek,ek->e", far_j - corners[ti, i % 3], normals[ti])
    off_j = np.einsum("ek,ek->e", far_i - corners[tj, j % 3], normals[tj])
    return np.asarray(some[np.maximum(np.abs(off_i), np.abs(off_j)) < FLAT])


def _in_near_planes(corners: F64, normals: F64, half: NDArray[np.int64]) -> NDArray[np.int64]:
    """The half-edges (h,) of triangles whose plane may be that of another one: their normals are the same when rounded, and they
    are about as far from the origin."""
    owns = np.zeros(len(corners), bool)
    owns[half // 3] = True
    some = np.flatnonzero(owns)
    rounded = np.round(normals[some] / (10 * FLAT)).astype(np.int64).astype(np.uint64)
    mixed = (rounded * np.cumprod(np.full(3, SPREAD))).sum(axis=1)
    mixed = (mixed ^ (mixed >> np.uint64(29))) * SPREAD
    far = np.einsum("mk,mk->m", corners[some, 0], normals[some])
    key = (mixed >> np.uint64(16) << np.uint64(16)) + ((far + 2) / NEAR_PLANES).astype(np.uint64)
    order = np.argsort(key)
    near = np.diff(key[order]) <= 1
    owns[some[order]] = np.append(near, False)[: len(some)] | np.append(False, near)[: len(some)]
    return half[owns[half // 3]]


def _t_junctions(corners: F64, normals: F64, materials: I32, half: NDArray[np.int64]) -> NDArray[np.int64]:
    """Pairs of triangles whose edges overlap in part: one long edge against several short ones.

    Half-edges of one plane and line are found by rounding both; along each line, runs of overlapping intervals join.
    A line on which two edges of the same direction overlap belongs to sheets that coincide, and is left alone.
    """
    half = _in_near_planes(corners, normals, half)
    t = half // 3
    p, q = corners[t, half % 3], corners[t, (half + 1) % 3]
    along = q - p
    length = np.linalg.norm(along, axis=1)
    along /= length[:, None]
    generic = np.array([0.5319, 0.7023, 0.4733])  # any direction that no edge of a model is at right angles to
    forward = along @ generic > 0
    along[~forward] *= -1
    foot = p - np.einsum("ek,ek->e", p, along)[:, None] * along
    key = np.round(np.concatenate([foot, along, normals[t]], axis=1) / (10 * FLAT)).astype(np.int64)
    shared = not_alone(key)
    t, forward = t[shared], forward[shared]
    p, q, along, length = p[shared], q[shared], along[shared], length[shared]
    line = distinct_rows(*key[shared].T, materials[t])[1]
    low = np.einsum("ek,ek->e", np.where(forward[:, None], p, q), along)
    order = np.lexsort((low, line))
    line, low, high, forward = line[order], low[order], (low + length)[order], forward[order]
    # shift every line into its own range of numbers, so that one running maximum serves them all
    shift = 4.0 * line
    reach = np.maximum.accumulate(high + shift)
    overlaps = np.flatnonzero((line[1:] == line[:-1]) & (low[1:] + shift[1:] < reach[:-1] - WELD))
    doubled = np.zeros(line.max(initial=0) + 1, bool)
    for way in (True, False):
        mine = np.flatnonzero(forward == way)
        reach = np.maximum.accumulate((high + shift)[mine])
        clash = (line[mine][1:] == line[mine][:-1]) & ((low + shift)[mine][1:] < reach[:-1] - WELD)
        doubled[line[mine][1:][clash]] = True
    overlaps = overlaps[~doubled[line[overlaps]]]
    return np.stack([t[order[overlaps]], t[order[overlaps + 1]]], axis=1)
