"""Flat pieces of a scene, and what parts them: where something stands on one that it does not cover.

A foot that ends inside of a piece is drawn on to whatever is next, since a chart would reach around its end. What a body hides by
standing on a piece (see contacts.py) needs no cut, nor what only touches its rim; but a door is thinner than texels may be, which
would lie on both of its sides, and parts the floor along its middle, and so does a narrow gap between two sheets. Lengths are
over the scene's size.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from app.atlas.contacts import GAP, covers
from app.atlas.intersections import NEAR, Contacts
from app.atlas.planes import Members, Planes
from app.atlas.sides import FLAT, Edges, distinct_rows, groups_of, runs
from app.scene.model import F64, I32, Scene
from app.util.background import Report

MOST_PIECES = 8192  # that are parted, beyond which none is: each takes a millisecond
THIN = 0.01  # width of a body that parts what it stands on along its middle: a texel's, of some 50,000 in a room
WIDE = 3 * THIN  # width of a gap between sheets, from which on texels beside it have neighbours of their own in it
LONG = 4  # its length, over that
MOST_ENDS = 64  # of feet in one flat piece, that are drawn on: those of grass are not

I64 = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Piece:
    """A flat piece of the scene in its plane: its triangles (t,), their corners (t, 3, 2), the axes (3, 2) of the plane, its
    border, and what parts it, segments (n, 2, 2): where something stands, and that with what was drawn on."""

    members: I64
    flat: F64
    axes: F64
    border: shapely.Geometry
    stands: F64
    parts: F64


def parted_pieces(
    scene: Scene, places: F64, corners: I32, facet: I32, edges: Edges, found: Contacts, report: Report
) -> tuple[list[Piece], int]:
    """The flat pieces that contacts part; how many of these lead nowhere. edges: of the triangles."""
    triangles = places[corners]
    members = Members.of(facet)
    owner = facet[found.triangle]
    order = np.argsort(owner, kind="stable")
    pieces: list[tuple[Piece, Contacts]] = []
    for mine in np.split(order, np.flatnonzero(np.diff(owner[order])) + 1):
        report(0.5 * len(pieces) / MOST_PIECES)
        piece = piece_of(triangles, members[owner[mine[0]]])
        lines = shapely.linestrings(found.ends[mine] @ piece.axes)
        inside = shapely.length(shapely.difference(lines, shapely.buffer(piece.border, NEAR))) > NEAR
        if inside.any():
            pieces.append((piece, found.only(mine[inside])))
    if not pieces:
        return [], 0
    first = np.array([piece.members[0] for piece, _ in pieces], np.int64)
    own, two_sided = facet[first].astype(np.int64), scene.sides[first]
    axes = np.stack([piece.axes for piece, _ in pieces])
    planes = Planes.of(places, corners, facet, scene.sides, FLAT, edges)
    hidden, near = (covers(planes, own, axes, within) for within in (FLAT, GAP * THIN))
    out, left = [], 0
    for nth, (piece, there) in enumerate(pieces):
        report(0.5 + 0.5 * nth / len(pieces))
        flat = there.ends @ piece.axes
        lines = shapely.linestrings(flat)
        kept, middles = np.zeros(len(flat), bool), [np.empty((0, 2, 2))]
        for back, outside in enumerate((there.front.copy(), there.back & two_sided[nth])):
            if nth in near[back] and (not back or two_sided[nth]):
                middles.append(_middles_of_thin(near[back][nth], piece.flat))
            if nth in hidden[back]:
                cover = shapely.STRtree(shapely.get_parts(shapely.buffer(hidden[back][nth], NEAR)))
                outside[cover.query(lines, predicate="covered_by")[0]] = False
            kept |= outside
        stands = np.concatenate([flat[kept], *middles])
        parts, loose = _drawn_on(np.concatenate([stands, _through_gaps(flat[kept], piece)]), piece.border)
        left += loose
        if len(parts):
            out.append(dataclasses.replace(piece, stands=stands, parts=parts))
    return out, left


def on_rims(corners: F64, facet: I32, edges: Edges, found: Contacts) -> Mask:
    """Which contacts run along an edge of their triangle (m, 3, 3), and that at the rim of its flat piece. edges: of them."""
    half = (3 * found.triangle[:, None] + np.arange(3)).reshape(-1)
    first, last = edges.first[edges.edge[half]], edges.first[edges.edge[half] + 1]
    which, at = runs(first, last)
    alike = facet[half[which] // 3] == facet[edges.order[at] // 3]
    rim = (np.bincount(which[alike], minlength=len(half)) == 1).reshape(-1, 3)
    mine = corners[found.triangle]
    way = np.roll(mine, -1, axis=1) - mine
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    off = found.ends[:, None] - mine[:, :, None]  # (k, 3, 2, 3): from the start of each edge to each end
    off -= np.einsum("kecx,kex->kec", off, way)[..., None] * way[:, :, None]
    return np.asarray((rim & (np.linalg.norm(off, axis=3).max(2) <= NEAR)).any(1))


def piece_of(corners: F64, members: I64) -> Piece:
    """A flat piece of triangles (m, 3, 3), not parted."""
    axes = axes_of(corners[members])
    flat = corners[members] @ axes
    polygons = shapely.polygons(_on_grid(flat))
    whole = polygons[0] if len(polygons) == 1 else shapely.union_all(polygons, grid_size=FLAT)
    return Piece(members, flat, axes, shapely.boundary(whole), *np.empty((2, 0, 2, 2)))


def _middles_of_thin(hidden: shapely.Geometry, flat: F64) -> F64:
    """Segments (n, 2, 2) along the middle of what is thin and long of what bodies hide of triangles (t, 3, 2)."""
    thick = shapely.buffer(shapely.buffer(hidden, -0.5 * THIN), 0.5 * THIN + NEAR, join_style="mitre")
    middles = _long_boxes(shapely.get_parts(shapely.difference(hidden, thick)), THIN).mean(2)
    if not len(middles):
        return np.empty((0, 2, 2))
    whole = shapely.union_all(shapely.polygons(_on_grid(flat)), grid_size=FLAT)
    lines = shapely.get_parts(shapely.intersection(shapely.linestrings(middles), whole))
    return np.reshape(shapely.get_coordinates(lines[shapely.length(lines) > NEAR]), (-1, 2, 2))


def _through_gaps(stands: F64, piece: Piece) -> F64:
    """Segments (n, 2, 2) along the middle of what is thin and long between sheets that stand on a piece, segments (k, 2, 2), and
    out at its ends, where the piece goes on: a chart around a gap of a texel or two would be its own neighbour across it."""
    if np.linalg.norm(stands[:, 1] - stands[:, 0], axis=1).sum() < 2 * LONG * WIDE:  # both sheets
        return np.empty((0, 2, 2))
    ring, line = shapely.get_coordinates(shapely.get_parts(piece.border), return_index=True)
    follows = np.flatnonzero(line[1:] == line[:-1])
    lines = noded(np.concatenate([stands, np.stack([ring[follows], ring[follows + 1]], axis=1)]))
    boxes = _long_boxes(shapely.get_parts(shapely.polygonize(shapely.linestrings(lines))), WIDE)
    sides = shapely.points(boxes.mean(1))  # (n, 2)
    at_border = shapely.distance(sides, piece.border) <= NEAR
    at_sheets = shapely.distance(sides, shapely.multilinestrings(shapely.linestrings(stands))) <= NEAR
    long = np.linalg.norm(boxes[:, 0, 0] - boxes[:, 1, 0], axis=1) > LONG * WIDE  # what parts rooms, not feet of tables
    middles = boxes[long & (at_sheets & ~at_border).all(1)].mean(2)
    way = middles[:, 1] - middles[:, 0]
    way *= 2 * NEAR / np.linalg.norm(way, axis=1, keepdims=True)
    inside = shapely.distance(shapely.points(middles), piece.border) > NEAR
    out = middles + np.where(inside, 1.0, 0.0)[..., None] * np.stack([-way, way], axis=1)
    return np.asarray(out[inside.any(1)])


def _long_boxes(polygons: NDArray[np.object_], width: float) -> F64:
    """(n, 2, 2, 2) boxes around polygons that are thinner than this, and long: both short sides, each from one long side to the
    other."""
    boxes = shapely.oriented_envelope(polygons)
    boxes = boxes[shapely.area(boxes) > 0]
    rings = shapely.get_coordinates(shapely.get_exterior_ring(boxes)).reshape(-1, 5, 2)
    sides = np.linalg.norm(np.diff(rings[:, :3], axis=1), axis=2)  # (n, 2)
    rings = np.where((sides[:, 0] < sides[:, 1])[:, None, None], rings[:, :4], rings[:, 1:])  # a short side first
    long = (sides.min(1) < width) & (sides.max(1) > LONG * sides.min(1))
    return np.asarray(rings[long][:, [[0, 1], [3, 2]]])


def axes_of(corners: F64) -> F64:
    """(3, 2) of the plane of triangles (t, 3, 3), which are counter-clockwise there."""
    normals = np.array(_cross((corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T)).T
    normal = normals[np.linalg.norm(normals, axis=1).argmax()] if len(normals) > 1 else normals[0].copy()
    normal /= np.sqrt(normal @ normal)
    across = np.array(_cross(normal, np.eye(3)[np.abs(normal).argmin()]))
    across /= np.sqrt(across @ across)
    return np.array([across, _cross(normal, across)]).T


def _cross(a: F64, b: F64) -> tuple[F64, F64, F64]:
    """The cross product of a (3, …) and b (3, …); of single vectors many times faster than np.cross."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _drawn_on(segments: F64, border: shapely.Geometry) -> tuple[F64, int]:
    """Segments (k, 2, 2) cut at each other, with those that end in nothing drawn on to what is next; how many are left out, since
    too many do."""
    parts = noded(segments)
    loose, away = _loose_ends(parts, border)
    if len(loose) > 1:  # contacts shorter than NEAR are none: those beside them may end there
        parts = noded(merged(segments))
        loose, away = _loose_ends(parts, border)
    if len(loose) > MOST_ENDS:
        left = len(loose)
        while len(loose):  # those that lead nowhere
            at = np.isin(keys_of(parts), keys_of(loose)).any(1)
            parts = parts[~at]
            loose, _ = _loose_ends(parts, border)
        return parts, left
    for place, way in zip(loose, away, strict=True):
        ahead = shapely.linestrings([place + NEAR * way, place + 2 * way])  # the scene is 1 wide
        met = shapely.intersection(ahead, np.append(shapely.linestrings(parts), border))
        far = shapely.distance(shapely.points(place), met[~shapely.is_empty(met)])
        if len(far):
            parts = np.concatenate([parts, [[place, place + far.min() * way]]])
    parts = noded(parts) if len(loose) else parts
    exact = dict(zip(keys_of(segments).reshape(-1).tolist(), segments.reshape(-1, 2), strict=True))
    ends = [
        exact.get(key, at) for key, at in zip(keys_of(parts).reshape(-1).tolist(), parts.reshape(-1, 2), strict=True)
    ]
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


def keys_of(places: F64) -> I64:
    """One number for each point (…, 2) of the grid."""
    cells = np.round(places / FLAT).astype(np.int64)
    return np.asarray((cells[..., 0] << 32) + cells[..., 1])


def noded(segments: F64) -> F64:
    """Segments (k, 2, 2) cut where they cross or touch (n, 2, 2), on the grid, each once."""
    if not len(segments):
        return segments
    whole = shapely.union_all(shapely.linestrings(_on_grid(segments)), grid_size=FLAT)
    places, line = shapely.get_coordinates(shapely.get_parts(whole), return_index=True)
    follows = np.flatnonzero(line[1:] == line[:-1])
    return np.stack([places[follows], places[follows + 1]], axis=1)


def merged(segments: F64, known: I64 | tuple[()] = ()) -> F64:
    """Segments (n, 2, 2), each once, with ends that are near to each other made one; those of known keys (k,) stay."""
    first, kind, _ = distinct_rows(*segments.reshape(-1, 2).T)
    places = segments.reshape(-1, 2)[first]
    stays = np.asarray(np.isin(keys_of(places), known))
    goal, moved = np.arange(len(places)), np.flatnonzero(~stays)
    if stays.any():
        far, nearest = cKDTree(places[stays]).query(places[moved], distance_upper_bound=NEAR)
        found = np.isfinite(far)
        goal[moved[found]] = np.flatnonzero(stays)[np.asarray(nearest)[found]]
        moved = moved[~found]
    pairs = cKDTree(places[moved]).query_pairs(NEAR, output_type="ndarray")
    if len(pairs):
        label = groups_of(len(moved), pairs)[1]
        goal[moved] = moved[np.unique(label, return_index=True)[1]][label]
    ends = np.asarray(np.sort(goal[kind].reshape(-1, 2), axis=1))
    ends = ends[ends[:, 0] != ends[:, 1]]
    return np.asarray(places[ends[distinct_rows(*ends.T)[0]]])
