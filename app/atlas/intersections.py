"""Where triangles of different surfaces meet: segments in which they touch or pierce each other, and overlaps in one plane.

Lengths are over the scene's size. Triangles that are joined edge by edge are one surface, and not looked at but where more than
two share an edge: a ceiling may have its wall's corners, where that goes on above it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from app.atlas.sides import FLAT, FLAT_ANGLE, Edges, groups_of, least, most, numbered, rows_by, runs
from app.scene.model import F64
from app.util.background import Report

NEAR = 4 * FLAT  # what is no farther apart is in one place
# triangles of one edge, beyond which it is not looked at: pairs take 0.07 to 0.19 µs each, so that 100,000
# triangles take four seconds at worst
MOST_AROUND = 64
MOST_PAIRS = 1 << 24  # of triangles whose boxes meet, beyond which none is looked at: soups of loose triangles
DENSE = 256  # triangles of a surface, from which on it is looked at by itself
BLOCK = 1 << 16  # pairs of triangles that are looked at at once
SURFACES = 1 << 10  # whose boxes are looked at at once

I64 = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Contacts:
    """Where other triangles meet some: triangle (k,), ends (k, 2, 3); whether the other one reaches to its front, and to its
    back (k,)."""

    triangle: I64
    ends: F64
    front: Mask
    back: Mask

    def with_more(self, other: Contacts) -> Contacts:
        return Contacts(
            *(np.concatenate([getattr(c, f.name) for c in (self, other)]) for f in dataclasses.fields(self))
        )

    def only(self, which: Mask | I64) -> Contacts:
        return Contacts(self.triangle[which], self.ends[which], self.front[which], self.back[which])


def surfaces(edges: Edges) -> I64:
    """(m,) the number of the surface of each triangle: those that share an edge, two and no more, are of one."""
    two = edges.first[:-1][edges.uses == 2]
    pairs = np.stack([edges.order[two] // 3, edges.order[two + 1] // 3], axis=1)
    return groups_of(len(edges.edge) // 3, pairs)[1]


def standing_on_edges(corners: F64, edges: Edges) -> Contacts:
    """Where more than two triangles (m, 3, 3) share an edge: each of them met there by the others."""
    many = np.flatnonzero((edges.uses > 2) & (edges.uses <= MOST_AROUND))
    first, last = edges.first[many], edges.first[many + 1]
    edge, at = runs(first, last)
    half = edges.order[at]
    mine, at = runs(first[edge], last[edge])
    triangle, k = np.divmod(half, 3)
    own = corners[triangle]
    normal = np.cross(own[:, 1] - own[:, 0], own[:, 2] - own[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), np.finfo(float).tiny)[:, None]
    other, beside = np.divmod(edges.order[at], 3)
    height = np.einsum("pk,pk->p", corners[other, (beside + 2) % 3] - own[mine, 0], normal[mine])
    front, back = (np.bincount(mine, reaches, len(half)) > 0 for reaches in (height > FLAT, height < -FLAT))
    row = np.arange(len(half))
    found = Contacts(triangle, np.stack([own[row, k], own[row, (k + 1) % 3]], axis=1), front, back)
    return found.only(front | back)


def contacts(corners: F64, surface: I64, report: Report) -> tuple[Contacts, I64, bool]:
    """Where triangles (m, 3, 3) of different surfaces meet; pairs (k, 2) of them that overlap in one plane; whether there are too
    many to say. report(share) is called for each block, and may raise."""
    low, high = least(corners) - FLAT, most(corners) + FLAT
    some = _near_others(low, high, surface)
    corners = corners[some]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), np.finfo(float).tiny)[:, None]
    found = [Contacts(np.empty(0, np.int64), np.empty((0, 2, 3)), np.empty(0, bool), np.empty(0, bool))]
    overlaps = [np.empty((0, 2), np.int64)]
    pairs = 0
    for one, other in _pairs_that_meet(low[some], high[some], numbered(surface[some]), report):
        pairs += len(one)
        if pairs > MOST_PAIRS:
            return found[0], overlaps[0], True
        for first in range(0, len(one), BLOCK):
            report(0.5 + 0.5 * pairs / MOST_PAIRS)
            block = slice(first, first + BLOCK)
            meeting, overlapping = _meeting(corners, normals, one[block], other[block])
            found += meeting
            overlaps.append(overlapping)
    triangle, *rest = (np.concatenate([getattr(f, name.name) for f in found]) for name in dataclasses.fields(Contacts))
    return Contacts(some[triangle], *rest), some[np.concatenate(overlaps)], False


def _near_others(low: F64, high: F64, surface: I64) -> I64:
    """The triangles, of boxes low to high (m, 3), that may meet another surface: their boxes meet what its box shares with that
    of their own."""
    lows, highs = _around(low, high, surface)
    x, y, z = np.argsort(-np.ptp(np.concatenate([lows, highs]), axis=0))
    boxes = shapely.box(lows[:, x], lows[:, y], highs[:, x], highs[:, y])
    tree, pairs = shapely.STRtree(boxes), 0
    least_shared, most_shared = np.full(lows.shape, np.inf), np.full(lows.shape, -np.inf)
    for start in range(0, len(boxes), SURFACES):
        one, other = tree.query(boxes[start : start + SURFACES])
        one = one + start
        meets = (one != other) & (lows[one, z] <= highs[other, z]) & (highs[one, z] >= lows[other, z])
        one, other = one[meets], other[meets]
        pairs += len(one)
        if pairs > MOST_PAIRS:
            return np.arange(len(surface))
        np.minimum.at(least_shared, one, np.maximum(lows[one], lows[other]))
        np.maximum.at(most_shared, one, np.minimum(highs[one], highs[other]))
    meets = np.ones(len(surface), bool)
    for k in range(3):
        meets &= (low[:, k] <= most_shared[surface, k]) & (high[:, k] >= least_shared[surface, k])
    return np.flatnonzero(meets)


def _around(low: F64, high: F64, surface: I64) -> tuple[F64, F64]:
    """The boxes of surfaces, (s, 3) each, around those of their triangles."""
    order, first = rows_by(surface, int(surface.max(initial=-1)) + 1)
    return np.minimum.reduceat(low[order], first[:-1]), np.maximum.reduceat(high[order], first[:-1])


def _pairs_that_meet(low: F64, high: F64, surface: I64, report: Report) -> Iterator[tuple[I64, I64]]:
    """Pairs of triangles of different surfaces whose boxes meet, in blocks."""
    count = np.bincount(surface)
    if len(count) < 2:
        return
    lows, highs = _around(low, high, surface)
    x, y, z = np.argsort(-np.ptp(np.concatenate([low, high]), axis=0))
    boxes = shapely.box(low[:, x], low[:, y], high[:, x], high[:, y])
    whole = shapely.STRtree(shapely.box(lows[:, x], lows[:, y], highs[:, x], highs[:, y]))
    near, beside = [], []
    for start in range(0, len(low), BLOCK):
        report(0.5 * start / len(low))
        one, other = whole.query(boxes[start : start + BLOCK])
        one = one + start
        meets = (surface[one] != other) & (low[one, z] <= highs[other, z]) & (high[one, z] >= lows[other, z])
        near.append(one[meets])
        beside.append(other[meets])
    # a surface of many triangles is looked at by itself, or most pairs would be its own neighbours
    group = np.where(count > DENSE, np.arange(len(count)), -1)
    mine, theirs = np.concatenate(near), group[np.concatenate(beside)]
    at = np.argsort(theirs, kind="stable")
    for those in np.split(at, np.flatnonzero(np.diff(theirs[at])) + 1) if len(at) else ():
        asked, members = np.unique(mine[those]), np.flatnonzero(group[surface] == theirs[those[0]])
        tree = shapely.STRtree(boxes[members])
        for start in range(0, len(asked), BLOCK):
            one, other = tree.query(boxes[asked[start : start + BLOCK]])
            one, other = asked[one + start], members[other]
            meets = (one < other) & (surface[one] != surface[other])  # each is asked for the other
            meets &= (low[one, z] <= high[other, z]) & (high[one, z] >= low[other, z])
            yield one[meets], other[meets]


def _meeting(corners: F64, normals: F64, one: I64, other: I64) -> tuple[list[Contacts], I64]:
    """Where pairs of triangles meet in a segment: those of each first one, and of each other one; pairs (k, 2) that overlap."""
    heights = [
        _heights(corners, normals, a, b) for a, b in ((one, other), (other, one))
    ]  # of b's corners over a's plane
    along = np.cross(normals[one], normals[other])
    slope = np.linalg.norm(along, axis=1)
    flat = np.flatnonzero((slope <= FLAT_ANGLE) & ~heights[0].any(1) & ~heights[1].any(1))
    overlapping = np.stack([one[flat], other[flat]], axis=1)
    overlapping = overlapping[_overlap(corners[overlapping], normals[overlapping])]
    maybe = slope > FLAT_ANGLE
    for h in heights:
        maybe &= (h.min(1) <= 0) & (h.max(1) >= 0)
    one, other = one[maybe], other[maybe]
    over_one, over_other = (h[maybe] for h in heights)
    along = along[maybe] / slope[maybe, None]
    low, start, high, end = [], [], [], []
    for triangle, h in ((one, over_other), (other, over_one)):
        least, first, most, last = _span(corners[triangle], h, along)
        low.append(least)
        start.append(first)
        high.append(most)
        end.append(last)
    later, sooner = low[0] >= low[1], high[0] <= high[1]
    ends = np.stack([np.where(later[:, None], *start), np.where(sooner[:, None], *end)], axis=1)
    long = np.where(sooner, *high) - np.where(later, *low) > NEAR
    found = []
    for triangle, h in ((one, over_one), (other, over_other)):
        found.append(Contacts(triangle[long], ends[long], h.max(1)[long] > 0, h.min(1)[long] < 0))
    return found, overlapping


def _overlap(corners: F64, normals: F64) -> Mask:
    """(p,) whether pairs of triangles (p, 2, 3, 3) that lie in one plane overlap by more than NEAR: none of their edges has the
    other one beyond it. normals (p, 2, 3)."""
    out = np.cross(np.roll(corners, -1, axis=2) - corners, normals[:, :, None])
    out /= np.linalg.norm(out, axis=3, keepdims=True)
    off = (
        corners[:, ::-1, None] - corners[:, :, :, None]
    )  # (p, 2, 3, 3, 3): from the start of each edge to the other's corners
    beyond = np.einsum("ptek,ptevk->ptev", out, off).min(3)
    return np.asarray((beyond < -NEAR).all((1, 2)))


def _heights(corners: F64, normals: F64, a: I64, b: I64) -> F64:
    """(p, 3) of the corners of triangles b over the planes of triangles a; 0 where they lie in them."""
    h = np.einsum("pck,pk->pc", corners[b] - corners[a, :1], normals[a])
    return np.where(np.abs(h) <= FLAT, 0.0, h)


def _span(corners: F64, heights: F64, along: F64) -> tuple[F64, F64, F64, F64]:
    """How far triangles (p, 3, 3) reach along a line that their plane has with another one: least, and there; most, and there.
    heights (p, 3): over the other one."""
    following, h = np.roll(corners, -1, axis=1), np.roll(heights, -1, axis=1)
    crosses = heights * h < 0
    share = heights / np.where(crosses, heights - h, 1.0)
    places = np.concatenate([corners, corners + share[..., None] * (following - corners)], axis=1)
    there = np.concatenate([heights == 0, crosses], axis=1)
    t = np.einsum("pck,pk->pc", places, along)
    least, most = np.where(there, t, np.inf), np.where(there, t, -np.inf)
    row = np.arange(len(t))
    return least.min(1), places[row, least.argmin(1)], most.max(1), places[row, most.argmax(1)]
