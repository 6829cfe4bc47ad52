"""Parts of opaque surfaces that have another one in their plane, facing the same way: a carpet modelled in the floor's plane.

Both would be lit there, reflect and emit, and depth tests could not tell them apart: one of them is seen, and the covered part of
the other is cut out of the scene. Lengths are over the scene's size.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from app.atlas.flat_pieces import MOST_PIECES, Piece, piece_of
from app.atlas.intersections import NEAR
from app.atlas.planes import Members
from app.atlas.triangle_cuts import CutTriangles, cut_pieces
from app.scene.model import F64, I32, Scene
from app.util.background import Report

SAME_AREA = 1e-6  # relative: one rectangle of other diagonals

I64 = NDArray[np.int64]
Mask = NDArray[np.bool_]


def without_covered(
    scene: Scene, places: F64, corners: I32, facet: I32, overlaps: I64, report: Report
) -> tuple[CutTriangles, Mask, int] | None:
    """What takes the place of some triangles, which triangles (m,) go, those among them, and how many flat pieces are covered in
    part or whole; None if none is.

    places (n, 3), corners (m, 3): the welded triangles, of flat pieces facet (m,); overlaps (k, 2): triangles in one plane that
    overlap. Of pieces that face the same way, one that emits light covers others, else the one with less area,
    else the one listed first; but one with one side covers none with two, whose other side may be seen. Of more than MOST_PIECES
    covered ones, the largest are looked at.
    """
    over, under = _covering(scene, facet, overlaps)
    if not len(under):
        return None
    area = np.bincount(facet, scene.normals_areas[1])
    covered = np.unique(under)
    covered = np.sort(covered[np.argsort(-area[covered], kind="stable")[:MOST_PIECES]])
    triangles, members = places[corners], Members.of(facet)
    covers: dict[int, tuple[F64, shapely.Geometry]] = {}
    whole, pieces = np.zeros(len(corners), bool), []
    for one in covered.tolist():
        piece = piece_of(triangles, members[one])
        lying = np.concatenate([members[other] for other in over[under == one].tolist()])
        cover = shapely.union_all(shapely.polygons(triangles[lying] @ piece.axes))
        covers[one] = piece.axes, cover
        whole[piece.members] = _inside(cover, piece.flat)
        parts = _outline_within(cover, piece)
        if len(parts):
            pieces.append(Piece(piece.members, piece.flat, piece.axes, piece.border, parts[:0], parts))
    if not pieces:
        return (_none(), whole, len(np.unique(facet[whole]))) if whole.any() else None
    made = cut_pieces(pieces, places, corners, facet, report)
    at = np.concatenate([places, made.new])[made.nodes]
    hidden = np.zeros(len(at), bool)
    owner = facet[made.parent]
    for one, (axes, cover) in covers.items():
        mine = np.flatnonzero(owner == one)
        hidden[mine] = _inside(cover, at[mine] @ axes)
    whole[made.parent] = False
    count = len(np.union1d(owner[hidden], facet[whole]))
    whole[made.parent] = True
    return (made.only(~hidden), whole, count) if count else None


def _covering(scene: Scene, facet: I32, overlaps: I64) -> tuple[I64, I64]:
    """Pairs of flat pieces, each once: one that covers (p,) the other (p,)."""
    normals = scene.normals_areas[0]
    opaque = np.array([m.opaque for m in scene.materials], bool)[scene.material_ids]
    one, other = overlaps.T
    alike = (normals[one] * normals[other]).sum(1) > 0
    alike &= opaque[one] & opaque[other] & (facet[one] != facet[other])
    pairs = facet[overlaps[alike]].astype(np.int64)
    if not len(pairs):
        return np.empty((2, 0), np.int64)[0], np.empty(0, np.int64)
    first = np.unique(facet, return_index=True)[1]
    dark = ~np.array([m.emits for m in scene.materials], bool)[scene.material_ids[first]]
    area = np.round(np.log(np.bincount(facet, scene.normals_areas[1])) / SAME_AREA)
    rank = np.empty(len(first), np.int64)
    rank[np.lexsort((first, area, dark))] = np.arange(len(first))
    swapped = rank[pairs[:, 0]] > rank[pairs[:, 1]]
    pairs[swapped] = pairs[swapped][:, ::-1]
    pairs = pairs[scene.sides[first[pairs[:, 0]]] | ~scene.sides[first[pairs[:, 1]]]]
    over, under = np.unique(pairs, axis=0).T
    return over, under


def _outline_within(cover: shapely.Geometry, piece: Piece) -> F64:
    """The outline of a cover where it parts a piece: segments (n, 2, 2), none along the piece's border."""
    whole = shapely.buffer(shapely.union_all(shapely.polygons(piece.flat)), NEAR / 4, join_style="mitre")
    lines = shapely.get_parts(shapely.intersection(shapely.boundary(cover), whole))
    at, line = shapely.get_coordinates(lines, return_index=True)
    follows = np.flatnonzero(line[1:] == line[:-1])
    segments = np.stack([at[follows], at[follows + 1]], axis=1)
    along = shapely.covered_by(shapely.linestrings(segments), shapely.buffer(piece.border, NEAR))
    return np.asarray(segments[~along])


def _inside(cover: shapely.Geometry, flat: F64) -> Mask:
    """(t,) whether a cover has the middle of triangles (t, 3, 2), and, of those not cut by its outline, all."""
    middle = flat.mean(1)
    shapely.prepare(cover)
    return np.asarray(shapely.contains_xy(cover, middle[:, 0], middle[:, 1]))


def _none() -> CutTriangles:
    rows = np.empty((0, 3), np.int64)
    return CutTriangles(rows[:, 0], rows, np.empty((0, 3, 3)), rows.astype(np.uint8), np.empty((0, 3)))
