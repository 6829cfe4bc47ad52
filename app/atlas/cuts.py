"""Triangles are cut where other surfaces touch or pierce them, since light jumps there [Heckbert92, D0 discontinuities].

A wall without thickness that stands on a floor leaves light on one side and none on the other: no texel may lie on both. So
the floor's triangles are cut along the wall's foot, neighbours along with them, and charts end there. A foot that ends inside of
a flat piece is drawn on to whatever is next, since a chart would reach around its end. What a body hides by standing on a piece
(see contacts.py) needs no cut, nor what only touches its rim.

Lengths are over the scene's size. A piece is cut in its plane, with all nodes on a grid of FLAT: noding is robust then.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from app.atlas.contacts import Members, covers
from app.atlas.intersections import NEAR, Contacts, contacts, surfaces
from app.atlas.sides import FLAT, distinct_rows, facets, scene_size, weld
from app.scene.model import F32, F64, I32, Scene
from app.scene.validate import has_area
from app.util.background import Report

MOST_PIECES = 4096  # that are parted, beyond which none is: each takes a millisecond
MOST_ENDS = 64  # of feet in one flat piece, that are drawn on: those of grass are not
GOES_ON, ENDS, JUMPS = 0, 1, 2  # at an edge: nothing; a chart; a chart, since something stands there and light may jump

I64 = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Cut:
    """A scene with its triangles cut. ends (m, 3) u8: what there is at the edge from corner k to k + 1 of each triangle, GOES_ON,
    or ENDS or JUMPS, where charts end; None where nothing was cut."""

    scene: Scene
    ends: NDArray[np.uint8] | None


@dataclass(frozen=True, eq=False)
class _Piece:
    """A flat piece of the scene in its plane: its triangles (t,), their corners (t, 3, 2), the axes (3, 2) of the plane, its
    border, and what parts it, segments (n, 2, 2): where something stands, and that with what was drawn on."""

    members: I64
    flat: F64
    axes: F64
    border: shapely.Geometry
    stands: F64
    parts: F64


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


def cut_at_contacts(scene: Scene, report: Report | None = None) -> Cut:
    """The scene with its triangles cut where others meet them; as it is where none does. report(share) is called now and then and
    may raise to cancel."""
    tell = report or (lambda share: None)
    tell(0.0)
    points, corners = weld(scene)
    tell(0.1)
    size, origin = scene_size(scene), points.min(0)
    places = (points - origin) / size
    found, crowded = contacts(places[corners], surfaces(corners), lambda share: tell(0.1 + 0.4 * share))
    tell(0.5)
    facet = np.zeros(len(corners), np.int32)
    if len(found.triangle):
        facet = facets(points, corners, scene.material_ids, size)
        found = found.only(~_on_rims(places[corners], corners, facet, found))
    notes: list[str] = []
    pieces: list[_Piece] = []
    loose = 0
    if crowded or len(np.unique(facet[found.triangle])) > MOST_PIECES:
        notes.append("too many surfaces meet to cut them all: charts do not end where they do")
    elif len(found.triangle):
        pieces, loose = _parted_pieces(scene, places, corners, facet, found, lambda share: tell(0.5 + 0.4 * share))
    if loose:
        notes.append(f"{loose} thin things end on surfaces that thousands share: charts do not end where they stand")
    if notes:
        scene = dataclasses.replace(scene, warnings=(*scene.warnings, *notes))
    if not pieces:
        return Cut(scene, None)
    nodes = _Nodes(places)
    for piece in pieces:
        tell(0.9)
        _add_border_nodes(nodes, piece, corners)
    sheet = _Sheet.of(list(_with_neighbours(nodes, pieces, places, corners, facet)))
    return _joined(scene, nodes, corners, _cut(nodes, sheet, corners), origin, size)


# -- what parts a flat piece -------------------------------------------------------------------------------------------


def _parted_pieces(
    scene: Scene, places: F64, corners: I32, facet: I32, found: Contacts, report: Report
) -> tuple[list[_Piece], int]:
    """The flat pieces that contacts part; how many of these lead nowhere."""
    triangles = places[corners]
    members = Members.of(facet)
    owner = facet[found.triangle]
    order = np.argsort(owner, kind="stable")
    pieces: list[tuple[_Piece, Contacts]] = []
    for mine in np.split(order, np.flatnonzero(np.diff(owner[order])) + 1):
        report(0.5 * len(pieces) / MOST_PIECES)
        piece = _piece(triangles, members[owner[mine[0]]])
        lines = shapely.linestrings(found.ends[mine] @ piece.axes)
        inside = shapely.length(shapely.difference(lines, shapely.buffer(piece.border, NEAR))) > NEAR
        if inside.any():
            pieces.append((piece, found.only(mine[inside])))
    if not pieces:
        return [], 0
    first = np.array([piece.members[0] for piece, _ in pieces], np.int64)
    own, two_sided = facet[first].astype(np.int64), scene.sides[first]
    axes = np.stack([piece.axes for piece, _ in pieces])
    hidden = covers(places, corners, facet, scene.sides, own, axes, FLAT)
    out, left = [], 0
    for nth, (piece, there) in enumerate(pieces):
        report(0.5 + 0.5 * nth / len(pieces))
        flat = there.ends @ piece.axes
        lines = shapely.linestrings(flat)
        kept = np.zeros(len(flat), bool)
        for back, outside in enumerate((there.front.copy(), there.back & two_sided[nth])):
            if nth in hidden[back]:
                cover = shapely.STRtree(shapely.get_parts(shapely.buffer(hidden[back][nth], NEAR)))
                outside[cover.query(lines, predicate="covered_by")[0]] = False
            kept |= outside
        parts, loose = _drawn_on(flat[kept], piece.border)
        left += loose
        if len(parts):
            out.append(dataclasses.replace(piece, stands=flat[kept], parts=parts))
    return out, left


def _on_rims(corners: F64, triangles: I32, facet: I32, found: Contacts) -> Mask:
    """Which contacts run along an edge of their triangle (m, 3, 3), and that at the rim of its flat piece."""
    start, end = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    _, edge, uses = distinct_rows(np.minimum(start, end), np.maximum(start, end), np.repeat(facet, 3))
    rim = (uses[edge] == 1).reshape(-1, 3)[found.triangle]
    mine = corners[found.triangle]
    way = np.roll(mine, -1, axis=1) - mine
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    off = found.ends[:, None] - mine[:, :, None]  # (k, 3, 2, 3): from the start of each edge to each end
    off -= np.einsum("kecx,kex->kec", off, way)[..., None] * way[:, :, None]
    return np.asarray((rim & (np.linalg.norm(off, axis=3).max(2) <= NEAR)).any(1))


def _piece(corners: F64, members: I64) -> _Piece:
    """A flat piece of triangles (m, 3, 3), not parted."""
    axes = _axes(corners[members])
    flat = corners[members] @ axes
    polygons = shapely.polygons(_on_grid(flat))
    whole = polygons[0] if len(polygons) == 1 else shapely.union_all(polygons, grid_size=FLAT)
    return _Piece(members, flat, axes, shapely.boundary(whole), *np.empty((2, 0, 2, 2)))


def _axes(corners: F64) -> F64:
    """(3, 2) of the plane of triangles (t, 3, 3), which are counter-clockwise there."""
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = normals[np.linalg.norm(normals, axis=1).argmax()]
    normal = normal / np.linalg.norm(normal)
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(normal, across)], axis=1)


def _drawn_on(segments: F64, border: shapely.Geometry) -> tuple[F64, int]:
    """Segments (k, 2, 2) cut at each other, with those that end in nothing drawn on to what is next; how many are left out, since
    too many do."""
    parts = _noded(segments)
    loose, away = _loose_ends(parts, border)
    if len(loose) > MOST_ENDS:
        left = len(loose)
        while len(loose):  # those that lead nowhere
            at = np.isin(_keys(parts), _keys(loose)).any(1)
            parts = parts[~at]
            loose, _ = _loose_ends(parts, border)
        return parts, left
    for place, way in zip(loose, away, strict=True):
        ahead = shapely.linestrings([place + NEAR * way, place + 2 * way])  # the scene is 1 wide
        met = shapely.intersection(ahead, np.append(shapely.linestrings(parts), border))
        far = shapely.distance(shapely.points(place), met[~shapely.is_empty(met)])
        if len(far):
            parts = np.concatenate([parts, [[place, place + far.min() * way]]])
    parts = _noded(parts) if len(loose) else parts
    exact = dict(zip(_keys(segments).reshape(-1).tolist(), segments.reshape(-1, 2), strict=True))
    ends = [exact.get(key, at) for key, at in zip(_keys(parts).reshape(-1).tolist(), parts.reshape(-1, 2), strict=True)]
    return np.reshape(ends, (-1, 2, 2)), 0


def _loose_ends(parts: F64, border: shapely.Geometry) -> tuple[F64, F64]:
    """Where only one of the segments ends, and not at the border (n, 2); the way out there (n, 2)."""
    ends = parts.reshape(-1, 2)
    first, _, uses = distinct_rows(*_on_grid(ends).T)
    once = first[uses == 1]
    once = once[shapely.distance(shapely.points(ends[once]), border) > NEAR] if len(once) else once
    way = ends[once] - ends[once ^ 1]
    return ends[once], way / np.linalg.norm(way, axis=1, keepdims=True)


def _on_grid(places: F64) -> F64:
    return np.asarray(np.round(places / FLAT) * FLAT)


def _keys(places: F64) -> I64:
    """One number for each point (…, 2) of the grid."""
    cells = np.round(places / FLAT).astype(np.int64)
    return np.asarray((cells[..., 0] << 32) + cells[..., 1])


def _noded(segments: F64) -> F64:
    """Segments (k, 2, 2) cut where they cross or touch (n, 2, 2), on the grid, each once."""
    if not len(segments):
        return segments
    whole = shapely.union_all(shapely.linestrings(_on_grid(segments)), grid_size=FLAT)
    places, line = shapely.get_coordinates(shapely.get_parts(whole), return_index=True)
    follows = np.flatnonzero(line[1:] == line[:-1])
    return np.stack([places[follows], places[follows + 1]], axis=1)


# -- cutting -----------------------------------------------------------------------------------------------------------


def _add_border_nodes(nodes: _Nodes, piece: _Piece, corners: I32) -> None:
    """The nodes at which a piece is parted at its border: neighbours there are cut there, too."""
    ends = np.unique(piece.parts.reshape(-1, 2), axis=0)
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


def _with_neighbours(nodes: _Nodes, pieces: list[_Piece], places: F64, corners: I32, facet: I32) -> Iterator[_Piece]:
    """The pieces, each less the triangles that nothing meets; and triangles elsewhere that have a new node on an edge."""
    low, high = np.minimum(corners, np.roll(corners, -1, 1)), np.maximum(corners, np.roll(corners, -1, 1))
    edges = np.array(list(nodes.on_edge), np.int64).reshape(-1, 2)
    count = len(places)
    noded = np.asarray(np.isin(low.astype(np.int64) * count + high, edges[:, 0] * count + edges[:, 1]).any(1))
    for piece in pieces:
        meets = shapely.STRtree(shapely.polygons(piece.flat)).query(
            shapely.linestrings(piece.parts), predicate="dwithin", distance=NEAR
        )[1]
        which = noded[piece.members]
        which[meets] = True
        yield dataclasses.replace(piece, members=piece.members[which], flat=piece.flat[which])
    parted = np.zeros(int(facet.max()) + 1, bool)
    parted[facet[[piece.members[0] for piece in pieces]]] = True
    others = np.flatnonzero(noded & ~parted[facet])
    none = np.empty((0, 2, 2))
    for triangle, own in zip(others[:, None], places[corners[others]], strict=True):
        axes = _axes(own[None])
        yield _Piece(triangle, own[None] @ axes, axes, shapely.Point(), none, none)


@dataclass(frozen=True, eq=False)
class _Made:
    """Triangles that take the place of others: parent (t,), nodes (t, 3), weights (t, 3, 3) of the parent's corners at each, ends
    (t, 3) as in Cut."""

    parent: I64
    nodes: I64
    weights: F64
    ends: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class _Sheet:
    """Pieces side by side in one plane, where they are cut at once: of each triangle its number in the scene and its piece (t,),
    corners (t, 3, 2), axes (t, 3, 2) and shift (t, 2) from its own plane; stands, parts (n, 2, 2) as of a _Piece."""

    members: I64
    piece: I64
    flat: F64
    axes: F64
    shift: F64
    stands: F64
    parts: F64

    @staticmethod
    def of(pieces: list[_Piece]) -> _Sheet:
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


def _cut(nodes: _Nodes, sheet: _Sheet, corners: I32) -> _Made:
    """What takes the place of a sheet's triangles."""
    own, flat = corners[sheet.members], sheet.flat
    number = dict(zip(_keys(flat).reshape(-1).tolist(), own.reshape(-1).tolist(), strict=True))
    around = _outlines(nodes, sheet, own, number)
    parts = _snapped(sheet.parts, around[:, 0])
    noded = _merged(
        _noded(np.concatenate([around, parts])), _keys(np.concatenate([around[:, 0], parts.reshape(-1, 2)]))
    )
    cells = shapely.get_parts(shapely.polygonize(shapely.linestrings(noded)))
    inside, cell = shapely.STRtree(shapely.point_on_surface(cells)).query(
        shapely.polygons(sheet.flat), predicate="intersects"
    )
    made, which = shapely.get_parts(shapely.constrained_delaunay_triangles(cells[cell]), return_index=True)
    flat = shapely.get_coordinates(made).reshape(-1, 4, 2)[:, :3]
    a, b = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    turned = a[:, 0] * b[:, 1] < a[:, 1] * b[:, 0]
    flat[turned] = flat[turned][:, [0, 2, 1]]
    parent, keys = inside[which], _keys(flat)
    exact = dict(zip(_keys(parts).reshape(-1).tolist(), parts.reshape(-1, 2), strict=True))
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
    return _Made(sheet.members[parent], numbers, weights, ends)


def _outlines(nodes: _Nodes, sheet: _Sheet, own: I32, number: dict[int, int]) -> F64:
    """The edges of a sheet's triangles, of corners own (t, 3), in pieces between new nodes (n, 2, 2), which are numbered."""
    start, end = sheet.flat.reshape(-1, 2), np.roll(sheet.flat, -1, axis=1).reshape(-1, 2)
    a, b = own.reshape(-1).astype(np.int64), np.roll(own, -1, axis=1).reshape(-1).astype(np.int64)
    edges = np.array(list(nodes.on_edge), np.int64).reshape(-1, 2)
    count = len(nodes.places)
    noded = np.isin(np.minimum(a, b) * count + np.maximum(a, b), edges[:, 0] * count + edges[:, 1])
    found = [np.stack([start, end], axis=1)[~noded]]
    for nth in np.flatnonzero(noded).tolist():
        run = nodes.along(int(a[nth]), int(b[nth]))
        between = [nodes.place(n) @ sheet.axes[nth // 3] + sheet.shift[nth // 3] for n in run]
        number |= zip(_keys(np.reshape(between, (-1, 2))).tolist(), run, strict=True)
        at = np.stack([start[nth], *between, end[nth]])
        found.append(np.stack([at[:-1], at[1:]], axis=1))
    return np.concatenate(found)


def _snapped(parts: F64, places: F64) -> F64:
    """Segments (n, 2, 2) with their ends on those of the places (k, 2) that are next to them."""
    far, nearest = cKDTree(places).query(parts.reshape(-1, 2), distance_upper_bound=2 * NEAR)
    ends = np.where(np.isfinite(far)[:, None], places[np.minimum(nearest, len(places) - 1)], parts.reshape(-1, 2))
    return np.asarray(ends.reshape(-1, 2, 2))


def _merged(segments: F64, known: I64) -> F64:
    """Segments (n, 2, 2) with ends that are near to each other made one; those of known keys (k,) stay."""
    first, kind, _ = distinct_rows(*segments.reshape(-1, 2).T)
    places = segments.reshape(-1, 2)[first]
    stays = np.asarray(np.isin(_keys(places), known))
    goal, moved = np.arange(len(places)), np.flatnonzero(~stays)
    far, nearest = cKDTree(places[stays]).query(places[moved], distance_upper_bound=NEAR)
    found = np.isfinite(far)
    goal[moved[found]] = np.flatnonzero(stays)[np.asarray(nearest)[found]]
    moved = moved[~found]
    for one, other in cKDTree(places[moved]).query_pairs(NEAR):
        goal[moved[max(one, other)]] = goal[moved[min(one, other)]]
    ends = np.asarray(np.sort(goal[kind].reshape(-1, 2), axis=1))
    ends = ends[ends[:, 0] != ends[:, 1]]
    return np.asarray(places[ends[distinct_rows(*ends.T)[0]]])


def _weights(places: F64, corners: F64) -> F64:
    """(t, 3, 3) weights of corners (t, 3, 2) that make places (t, 3, 2)."""
    edges = corners[:, 1:] - corners[:, :1]
    rest = (places - corners[:, :1]) @ np.linalg.inv(edges)
    return np.concatenate([1 - rest.sum(2, keepdims=True), rest], axis=2)


def _along(parts: F64, flat: F64, numbers: I64, piece: I64) -> Mask:
    """(t, 3) which edges of triangles (t, 3, 2), of nodes (t, 3) and of pieces (t,), run along the segments."""
    if not len(parts):
        return np.zeros(flat.shape[:2], bool)
    follows = np.roll(flat, -1, axis=1)
    tree, far = shapely.STRtree(shapely.linestrings(parts)), np.zeros(flat.shape[:2])
    for at in flat, (flat + follows) / 2, follows:
        (place, _), distance = tree.query_nearest(
            shapely.points(at.reshape(-1, 2)), max_distance=NEAR, return_distance=True, all_matches=False
        )
        here = np.full(flat[..., 0].size, np.inf)
        here[place] = distance
        far = np.maximum(far, here.reshape(far.shape))
    on = far <= NEAR
    # a sliver lies between: of its edges, one goes on
    sliver = np.flatnonzero(on.all(1))
    on[sliver, far[sliver].argmax(1)] = False
    ends = np.sort(np.stack([numbers, np.roll(numbers, -1, axis=1)], axis=2).reshape(-1, 2), axis=1)
    edge = distinct_rows(*ends.T, np.repeat(piece, 3))[1]
    both = np.ones(edge.max() + 1, bool)
    np.logical_and.at(both, edge, on.reshape(-1))
    return np.asarray(both[edge].reshape(on.shape))


def _joined(scene: Scene, nodes: _Nodes, corners: I32, made: _Made, origin: F64, size: float) -> Cut:
    """The scene with triangles in the places of those that they were made of."""
    parent, numbers, weights, ends = made.parent, made.nodes, made.weights, made.ends
    count, welded = len(scene.triangles), len(nodes.places)
    gone = np.zeros(count, bool)
    gone[parent] = True
    kept = np.flatnonzero(~gone)
    source = np.concatenate([kept, parent])
    order = np.argsort(source, kind="stable")
    vertex = np.empty(welded, np.int64)  # one of those that were welded
    vertex[corners] = scene.triangles
    old = vertex[np.minimum(numbers, welded - 1)]
    new = np.where(numbers < welded, old, len(scene.positions) + numbers - welded)
    triangles = np.concatenate([scene.triangles[kept], new])[order].astype(np.int32)
    positions = np.concatenate([scene.positions, origin + size * np.reshape(nodes.new, (-1, 3))])
    whole = np.tile(np.eye(3), (len(kept), 1, 1))
    weights = np.concatenate([whole, weights])[order]
    source = source[order]

    def shared(values: F32 | None) -> F32 | None:
        return None if values is None else np.einsum("tnk,tkc->tnc", weights, values[source]).astype(np.float32)

    normals = shared(scene.normals)
    if normals is not None:
        normals /= np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), np.float32(1e-12))
    cut = dataclasses.replace(
        scene,
        positions=positions,
        triangles=triangles,
        material_ids=scene.material_ids[source],
        object_ids=scene.object_ids[source],
        listed=None if scene.listed is None else scene.listed[source],
        uv0=shared(scene.uv0),
        uv1=shared(scene.uv1),
        colours=shared(scene.colours),
        normals=normals,
    )
    return Cut(cut, np.concatenate([np.zeros((len(kept), 3), np.uint8), ends])[order])
