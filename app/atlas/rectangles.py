"""Facets that are whole rectangles: one axis-aligned chart each, no unwrap, no empty texels [Coombe03, 3.1].

The strips of a column or an arch are rectangles too, but unfold better together: those are left out.
The answer depends on the surface only: not on its diagonals, the order of its triangles, or where a modeller cut it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.sides import distinct_rows, least, most, numbered, totals
from app.scene.model import F64, I32

SAME = 1e-4  # relative: area against the bounding rectangle's; width against height of a square
TRIES = 8  # boundary edges to align with; one suffices unless long edges inside are cut on one side only
CREASE = np.radians(35.0)  # two facets at a smaller angle look like one curved surface: a column of 12 sides has 30°
CURVED = 2  # smooth neighbours of a strip that is part of a curved surface; a wall with one bend has 1
GENERIC = np.array([0.4286, 0.7347, 0.5258])  # to tell corners apart: any direction models do not use


@dataclass(frozen=True, eq=False)
class Rectangles:
    """facet (r,) i32; corner (r, 3) [m]; u, v (r, 3) unit axes, u × v the front normal; size (r, 2) [m], u first."""

    facet: I32
    corner: F64
    u: F64
    v: F64
    size: F64


def find_rectangles(points: F64, triangles: I32, materials: I32, facet: I32) -> Rectangles:
    """The facets whose area equals that of a rectangle around them, except the strips of a curved surface.

    points (n, 3) [m], triangles (m, 3), materials (m,), facet (m,) as from ``facets``. u runs along the longer
    side.
    """
    some = _of_whole_or_beside(triangles, facet)
    triangles, materials, given = triangles[some], materials[some], facet[some]
    facet = numbered(given).astype(np.int32)
    count = int(facet.max(initial=-1)) + 1
    corners = points[triangles]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = totals(facet, np.linalg.norm(cross, axis=1) / 2, count)
    normal = totals(facet, cross, count)
    normal /= np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)[:, None]
    edge_facet, edge_rank, edge_along = _ranked_boundary(points, triangles, facet)
    curved = _smooth_neighbours(triangles, materials, facet, normal) >= CURVED
    found, axes, lows, highs = np.zeros(count, bool), np.zeros((count, 3)), np.zeros((count, 2)), np.zeros((count, 2))
    for rank in range(TRIES):
        mine = (edge_rank == rank) & ~found[edge_facet]
        open_facets = edge_facet[mine]
        if not len(open_facets):
            break
        axes[open_facets] = edge_along[mine]
        low, high = _extents(corners, facet, normal, axes, open_facets)
        box = np.prod(high - low, axis=1)
        good = np.abs(box - area[open_facets]) < SAME * box
        found[open_facets[good]] = True
        lows[open_facets[good]], highs[open_facets[good]] = low[good], high[good]
    index = np.flatnonzero(found & ~curved)
    heights = totals(facet, np.einsum("mck,mk->mc", corners, normal[facet]).mean(axis=1), count)
    heights /= np.maximum(np.bincount(facet, minlength=count), 1)
    name = np.empty(count, np.int32)
    name[facet] = given
    return _oriented(name[index], normal[index], heights[index], axes[index], lows[index], highs[index])


def _of_whole_or_beside(triangles: I32, facet: I32) -> NDArray[np.int64]:
    """Triangles of facets with more than one, for a triangle is no rectangle; and those that share an edge with these."""
    whole = np.bincount(facet)[facet] > 1
    met = np.zeros(int(triangles.max(initial=-1)) + 1, np.int8)
    met[triangles[whole]] = 1
    return np.flatnonzero(whole | (met[triangles[:, 0]] + met[triangles[:, 1]] + met[triangles[:, 2]] >= 2))


def _ranked_boundary(
    points: F64, triangles: I32, facet: I32
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """Edges that occur once in their facet: the facet, the rank by length (0 = longest) and the unit direction."""
    a, b = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    owner, low, high = np.repeat(facet, 3), np.minimum(a, b), np.maximum(a, b)
    first, _, uses = distinct_rows(owner, low, high)
    once = first[(uses == 1) & (low[first] != high[first])]
    along = points[high[once]] - points[low[once]]
    length = np.linalg.norm(along, axis=1)
    order = np.lexsort((-length, owner[once]))
    owner = owner[once[order]].astype(np.int64)
    starts = np.searchsorted(owner, owner)
    return owner, np.arange(len(owner)) - starts, along[order] / length[order, None]


def _smooth_neighbours(triangles: I32, materials: I32, facet: I32, normal: F64) -> NDArray[np.int64]:
    """How many other facets of its material each facet continues into across an edge without a crease."""
    a, b = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    low, high, material = np.minimum(a, b), np.maximum(a, b), np.repeat(materials, 3)
    order = np.lexsort((high, low, material))
    i, j = order[:-1], order[1:]
    owner = np.repeat(facet, 3).astype(np.int64)
    meets = (material[i] == material[j]) & (a[i] == b[j]) & (b[i] == a[j]) & (owner[i] != owner[j])
    one, other = owner[i[meets]], owner[j[meets]]
    smooth = np.einsum("ek,ek->e", normal[one], normal[other]) > np.cos(CREASE)
    pairs = np.concatenate([np.stack([one, other])[:, smooth], np.stack([other, one])[:, smooth]], axis=1)
    return np.bincount(pairs[0, distinct_rows(*pairs)[0]], minlength=len(normal))


def _extents(
    corners: F64, facet: I32, normal: F64, axes: F64, wanted: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper bounds (len(wanted), 2) of the wanted facets along their axis and across it [m]."""
    slot = np.full(len(normal), -1)
    slot[wanted] = np.arange(len(wanted))
    mine = slot[facet] >= 0
    at, p = facet[mine], corners[mine]
    along = np.einsum("mck,mk->mc", p, axes[at])
    across = np.einsum("mck,mk->mc", p, np.cross(normal[at], axes[at]))
    low, high = np.full((len(wanted), 2), np.inf), np.full((len(wanted), 2), -np.inf)
    for k, s in enumerate((along, across)):
        np.minimum.at(low[:, k], slot[at], least(s))
        np.maximum.at(high[:, k], slot[at], most(s))
    return low, high


def _oriented(facet: I32, normal: F64, height: F64, axis: F64, low: F64, high: F64) -> Rectangles:
    """Choose origin and axes from the four corners, the same for every way the rectangle may have been given."""
    side = np.cross(normal, axis)
    # re-orthogonalise: the edge lies in the plane only as well as the vertices do
    axis = np.cross(side, normal)
    base = height[:, None] * normal
    s = np.stack([low[:, 0], high[:, 0], high[:, 0], low[:, 0]], axis=1)
    t = np.stack([low[:, 1], low[:, 1], high[:, 1], high[:, 1]], axis=1)
    corners = base[:, None] + s[..., None] * axis[:, None] + t[..., None] * side[:, None]  # counter-clockwise
    size = high - low
    lengths = np.stack([size[:, 0], size[:, 1], size[:, 0], size[:, 1]], axis=1)  # of the edge that leaves each corner
    allowed = lengths >= (1 - SAME) * lengths.max(axis=1, keepdims=True)
    score = np.where(allowed, corners @ GENERIC, np.inf)
    first = np.argmin(score, axis=1)
    rows = np.arange(len(facet))
    corner = corners[rows, first]
    to_u = corners[rows, (first + 1) % 4] - corner
    to_v = corners[rows, (first + 3) % 4] - corner
    w, h = np.linalg.norm(to_u, axis=1), np.linalg.norm(to_v, axis=1)
    return Rectangles(facet, corner, to_u / w[:, None], to_v / h[:, None], np.stack([w, h], axis=1))
