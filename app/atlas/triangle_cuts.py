"""Triangles are cut along what parts flat pieces of the scene, and so are neighbours of these, so that no gap opens.

A piece is cut in its plane, with all nodes on a grid of FLAT: noding is robust then. Lengths are over the scene's size.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from app.atlas.flat_pieces import Piece, axes_of, keys_of, merged, noded
from app.atlas.intersections import NEAR
from app.atlas.sides import FLAT, distinct_rows
from app.scene.model import F64, I32
from app.scene.validate import has_area
from app.util.background import Report

GOES_ON, ENDS, JUMPS = 0, 1, 2  # at an edge: nothing; a chart; a chart, since something stands there and light may jump

I64 = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class CutTriangles:
    """Triangles that take the place of others: parent (t,), nodes (t, 3), weights (t, 3, 3) of the parent's corners at each, ends
    (t, 3) as in Cut; new (n, 3): where nodes beyond the points of the scene are."""

    parent: I64
    nodes: I64
    weights: F64
    ends: NDArray[np.uint8]
    new: F64

    def only(self, which: Mask) -> CutTriangles:
        return CutTriangles(self.parent[which], self.nodes[which], self.weights[which], self.ends[which], self.new)


class _Nodes:
    """Points of the mesh that is made: welded ones (n, 3) first, then new ones; ``on_edge``: those on edges of the mesh that was,
    from the lower to the higher of its two points, by how far along [-]."""

    def __init__(self, places: F64) -> None:
        self.places = places
        self.new: list[F64] = []
        self.on_edge: dict[tuple[int, int], dict[float, int]] = {}

    def add(self, place: F64) -> int:
        self.new.append(place)
        return len(self.places) + len(self.new) - 1

    def add_on_edge(self, a: int, b: int, place: F64) -> None:
        """A point near an edge of the mesh; none where there is one, or at an end."""
        a, b = min(a, b), max(a, b)
        way = self.places[b] - self.places[a]
        length = float(np.linalg.norm(way))
        t = float((place - self.places[a]) @ way) / length**2
        known = self.on_edge.setdefault((a, b), {})
        if all(abs(t - other) * length > NEAR for other in (0.0, 1.0, *known)):
            known[t] = self.add(self.places[a] + t * way)

    def along(self, a: int, b: int) -> list[int]:
        """The new points from a to b, between them."""
        known = self.on_edge.get((min(a, b), max(a, b)), {})
        return [known[t] for t in sorted(known, reverse=a > b)]

    def place(self, number: int) -> F64:
        count = len(self.places)
        return np.asarray(self.places[number] if number < count else self.new[number - count])


def cut_pieces(pieces: list[Piece], places: F64, corners: I32, facet: I32, report: Report) -> CutTriangles:
    """What takes the place of triangles of the pieces, and of their neighbours. places (n, 3): the welded points of the scene;
    corners (m, 3), facet (m,): of its triangles."""
    nodes = _Nodes(places)
    for nth, piece in enumerate(pieces):
        report(nth / len(pieces))
        _add_border_nodes(nodes, piece, corners)
    sheet = _Sheet.of(list(_with_neighbours(nodes, pieces, places, corners, facet)))
    return _cut(nodes, sheet, corners)


def _add_border_nodes(nodes: _Nodes, piece: Piece, corners: I32) -> None:
    """The nodes at which a piece is parted at its border: neighbours there are cut there, too."""
    ends = piece.parts.reshape(-1, 2)
    ends = ends[distinct_rows(*ends.T)[0]]
    ends = ends[shapely.distance(shapely.points(ends), piece.border) <= NEAR]
    if not len(ends):
        return
    around = np.stack([piece.flat, np.roll(piece.flat, -1, axis=1)], axis=2).reshape(-1, 2, 2)
    at, edge = shapely.STRtree(shapely.linestrings(around)).query(
        shapely.points(ends), predicate="dwithin", distance=NEAR
    )
    for place, nth in zip(ends[at], edge.tolist(), strict=True):
        triangle, k = piece.members[nth // 3], nth % 3
        a, b = int(corners[triangle, k]), int(corners[triangle, (k + 1) % 3])
        (pa, pb), way = nodes.places[[a, b]], around[nth, 1] - around[nth, 0]
        t = float((place - around[nth, 0]) @ way / (way @ way))
        nodes.add_on_edge(a, b, pa + t * (pb - pa))


def _with_neighbours(nodes: _Nodes, pieces: list[Piece], places: F64, corners: I32, facet: I32) -> Iterator[Piece]:
    """The pieces, each less the triangles that nothing meets; and triangles elsewhere that have a new node on an edge."""
    low, high = np.minimum(corners, np.roll(corners, -1, 1)), np.maximum(corners, np.roll(corners, -1, 1))
    edges = np.array(list(nodes.on_edge), np.int64).reshape(-1, 2)
    count = len(places)
    divided = np.asarray(np.isin(low.astype(np.int64) * count + high, edges[:, 0] * count + edges[:, 1]).any(1))
    for piece in pieces:
        meets = shapely.STRtree(shapely.polygons(piece.flat)).query(
            shapely.linestrings(piece.parts), predicate="dwithin", distance=NEAR
        )[1]
        which = divided[piece.members]
        which[meets] = True
        yield dataclasses.replace(piece, members=piece.members[which], flat=piece.flat[which])
    parted = np.zeros(int(facet.max()) + 1, bool)
    parted[facet[[piece.members[0] for piece in pieces]]] = True
    others = np.flatnonzero(divided & ~parted[facet])
    none = np.empty((0, 2, 2))
    for triangle, own in zip(others[:, None], places[corners[others]], strict=True):
        axes = axes_of(own[None])
        yield Piece(triangle, own[None] @ axes, axes, shapely.Point(), none, none)


@dataclass(frozen=True, eq=False)
class _Sheet:
    """Pieces side by side in one plane, where they are cut at once: of each triangle its number in the scene and its piece (t,),
    corners (t, 3, 2), axes (t, 3, 2) and shift (t, 2) from its own plane; stands, parts (n, 2, 2) as of a Piece."""

    members: I64
    piece: I64
    flat: F64
    axes: F64
    shift: F64
    stands: F64
    parts: F64

    @staticmethod
    def of(pieces: list[Piece]) -> _Sheet:
        columns = int(np.ceil(np.sqrt(len(pieces))))
        cells = np.stack([np.arange(len(pieces)) % columns, np.arange(len(pieces)) // columns], axis=1)
        least = np.array([piece.flat.min((0, 1)) for piece in pieces])
        shifts = 2.0 * cells - np.floor(least / FLAT) * FLAT  # none is wider than the scene, which is 1
        count = [len(piece.members) for piece in pieces]
        return _Sheet(
            np.concatenate([piece.members for piece in pieces]),
            np.repeat(np.arange(len(pieces)), count),
            np.concatenate([piece.flat + shift for piece, shift in zip(pieces, shifts, strict=True)]),
            np.repeat([piece.axes for piece in pieces], count, axis=0),
            np.repeat(shifts, count, axis=0),
            np.concatenate([piece.stands + shift for piece, shift in zip(pieces, shifts, strict=True)]),
            np.concatenate([piece.parts + shift for piece, shift in zip(pieces, shifts, strict=True)]),
        )


def _cut(nodes: _Nodes, sheet: _Sheet, corners: I32) -> CutTriangles:
    """What takes the place of a sheet's triangles."""
    own, flat = corners[sheet.members], sheet.flat
    number = dict(zip(keys_of(flat).reshape(-1).tolist(), own.reshape(-1).tolist(), strict=True))
    around = _outlines(nodes, sheet, own, number)
    parts = _snapped(sheet.parts, around[:, 0])
    lines = merged(
        noded(np.concatenate([around, parts])), keys_of(np.concatenate([around[:, 0], parts.reshape(-1, 2)]))
    )
    cells = shapely.get_parts(shapely.polygonize(shapely.linestrings(lines)))
    inside, cell = shapely.STRtree(shapely.point_on_surface(cells)).query(
        shapely.polygons(sheet.flat), predicate="intersects"
    )
    made, which = shapely.get_parts(shapely.constrained_delaunay_triangles(cells[cell]), return_index=True)
    flat = shapely.get_coordinates(made).reshape(-1, 4, 2)[:, :3]
    a, b = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    turned = a[:, 0] * b[:, 1] < a[:, 1] * b[:, 0]
    flat[turned] = flat[turned][:, [0, 2, 1]]
    parent, keys = inside[which], keys_of(flat)
    exact = dict(zip(keys_of(parts).reshape(-1).tolist(), parts.reshape(-1, 2), strict=True))
    unrounded = np.array(
        [exact.get(key, at) for key, at in zip(keys.reshape(-1).tolist(), flat.reshape(-1, 2), strict=True)]
    )
    weights = _weights(unrounded.reshape(-1, 3, 2), sheet.flat[parent])
    for nth, key in enumerate(keys.reshape(-1).tolist()):
        if key not in number:
            number[key] = nodes.add(weights[nth // 3, nth % 3] @ nodes.places[own[parent[nth // 3]]])
    numbers = np.array([number[key] for key in keys.reshape(-1).tolist()], np.int64).reshape(-1, 3)
    solid = has_area(
        np.concatenate([nodes.places, np.reshape(nodes.new, (-1, 3))]), numbers
    )  # nodes may have moved onto a line
    parent, numbers, weights, flat = parent[solid], numbers[solid], weights[solid], flat[solid]
    stands, parted = (_along(lines, flat, numbers, sheet.piece[parent]) for lines in (sheet.stands, parts))
    ends = np.where(stands, JUMPS, np.where(parted, ENDS, GOES_ON)).astype(np.uint8)
    return CutTriangles(sheet.members[parent], numbers, weights, ends, np.reshape(nodes.new, (-1, 3)))


def _outlines(nodes: _Nodes, sheet: _Sheet, own: I32, number: dict[int, int]) -> F64:
    """The edges of a sheet's triangles, of corners own (t, 3), in pieces between new nodes (n, 2, 2), which are numbered."""
    start, end = sheet.flat.reshape(-1, 2), np.roll(sheet.flat, -1, axis=1).reshape(-1, 2)
    a, b = own.reshape(-1).astype(np.int64), np.roll(own, -1, axis=1).reshape(-1).astype(np.int64)
    edges = np.array(list(nodes.on_edge), np.int64).reshape(-1, 2)
    count = len(nodes.places)
    divided = np.isin(np.minimum(a, b) * count + np.maximum(a, b), edges[:, 0] * count + edges[:, 1])
    found = [np.stack([start, end], axis=1)[~divided]]
    for nth in np.flatnonzero(divided).tolist():
        run = nodes.along(int(a[nth]), int(b[nth]))
        between = [nodes.place(n) @ sheet.axes[nth // 3] + sheet.shift[nth // 3] for n in run]
        number |= zip(keys_of(np.reshape(between, (-1, 2))).tolist(), run, strict=True)
        at = np.stack([start[nth], *between, end[nth]])
        found.append(np.stack([at[:-1], at[1:]], axis=1))
    return np.concatenate(found)


def _snapped(parts: F64, places: F64) -> F64:
    """Segments (n, 2, 2) with their ends on those of the places (k, 2) that are next to them."""
    far, nearest = cKDTree(places).query(parts.reshape(-1, 2), distance_upper_bound=2 * NEAR)
    ends = np.where(np.isfinite(far)[:, None], places[np.minimum(nearest, len(places) - 1)], parts.reshape(-1, 2))
    return np.asarray(ends.reshape(-1, 2, 2))


def _weights(places: F64, corners: F64) -> F64:
    """(t, 3, 3) weights of corners (t, 3, 2) that make places (t, 3, 2)."""
    edges = corners[:, 1:] - corners[:, :1]
    rest = (places - corners[:, :1]) @ np.linalg.inv(edges)
    return np.concatenate([1 - rest.sum(2, keepdims=True), rest], axis=2)


def _along(parts: F64, flat: F64, numbers: I64, piece: I64) -> Mask:
    """(t, 3) which edges of triangles (t, 3, 2), of nodes (t, 3) and of pieces (t,), run along the segments."""
    if not len(parts):
        return np.zeros(flat.shape[:2], bool)
    ends = np.sort(np.stack([numbers, np.roll(numbers, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    first, edge, _ = distinct_rows(*ends.T, np.repeat(piece, 3))
    start, end = flat.reshape(-1, 2)[first], np.roll(flat, -1, axis=1).reshape(-1, 2)[first]
    tree, farthest = shapely.STRtree(shapely.linestrings(parts)), np.zeros(len(first))
    left = np.arange(len(first))
    for at in (start + end) / 2, start, end:  # most have their middle elsewhere
        (place, _), distance = tree.query_nearest(
            shapely.points(at[left]), max_distance=NEAR, return_distance=True, all_matches=False
        )
        here = np.full(len(left), np.inf)
        here[place] = distance
        farthest[left] = np.maximum(farthest[left], here)
        left = left[farthest[left] <= NEAR]
    far = farthest[edge].reshape(flat.shape[:2])
    on = far <= NEAR
    # a sliver lies between: of its edges, one goes on
    sliver = np.flatnonzero(on.all(1))
    on[sliver, far[sliver].argmax(1)] = False
    both = np.ones(edge.max() + 1, bool)
    np.logical_and.at(both, edge, on.reshape(-1))
    return np.asarray(both[edge].reshape(on.shape))
