"""Triangles are cut where other surfaces touch or pierce them, since light jumps there [Heckbert92, D0 discontinuities].

A wall without thickness that stands on a floor leaves light on one side and none on the other: no texel may lie on both. So
the floor's triangles are cut along the wall's foot, neighbours along with them, and charts end there.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.covered import without_covered
from app.atlas.facets import facets
from app.atlas.flat_pieces import MOST_ENDS, MOST_PIECES, Piece, on_rims, parted_pieces
from app.atlas.intersections import Contacts, contacts, standing_on_edges, surfaces
from app.atlas.sides import Welded, numbered, scene_size
from app.atlas.triangle_cuts import CutTriangles, cut_pieces
from app.scene.model import F32, F64, I32, Scene
from app.util.background import Report
from app.util.threads import threads
from app.util.words import counted

# where triangles are not cut, for people
BLEEDS = "light and shadow may reach a texel too far there; finer texels make that less"


@dataclass(frozen=True, eq=False)
class Cut:
    """A scene with its triangles cut. ends (m, 3) u8: what there is at the edge from corner k to k + 1 of each triangle, GOES_ON,
    or ENDS or JUMPS, where charts end; None where nothing was cut. facet (m,): the flat piece of each triangle, as ``facets`` has
    it. welded: the triangles of the scene; None where some were cut."""

    scene: Scene
    ends: NDArray[np.uint8] | None
    facet: I32
    welded: Welded | None = None


@dataclass(frozen=True, eq=False)
class _Met:
    """What surfaces of a scene meet: its welded triangles, their points places (n, 3) over the scene's size, the flat piece facet
    (m,) of each; where they meet, pairs (k, 2) that overlap in one plane, and whether there are too many to say."""

    welded: Welded
    places: F64
    facet: I32
    found: Contacts
    overlaps: NDArray[np.int64]
    crowded: bool

    @staticmethod
    def of(scene: Scene, tell: Report) -> _Met:
        tell(0.0)
        welded = Welded.of(scene)
        points, corners, edges = welded.points, welded.corners, welded.edges
        tell(0.1)
        size = scene_size(scene)
        places = (points - points.min(0)) / size
        with threads(1) as beside:
            flat = beside.submit(facets, points, corners, scene.material_ids, size, edges)
            met = contacts(places[corners], surfaces(edges), lambda share: tell(0.1 + 0.4 * share))
            tell(0.5)
            found = met[0].with_more(standing_on_edges(places[corners], edges))
            return _Met(welded, places, flat.result(), found, *met[1:])


def cut_at_contacts(scene: Scene, report: Report | None = None) -> Cut:
    """The scene with its triangles cut where others meet them; as it is where none does. report(share) is called now and then and
    may raise to cancel."""
    tell = report or (lambda share: None)
    met = _Met.of(scene, tell)
    if len(met.overlaps):
        uncovered = _uncovered(scene, met, lambda share: tell(0.5))
        if uncovered is not scene:
            scene, met = uncovered, _Met.of(uncovered, tell)
    welded, places, facet, found, crowded = met.welded, met.places, met.facet, met.found, met.crowded
    corners, edges = welded.corners, welded.edges
    if len(found.triangle):
        found = found.only(~on_rims(places[corners], facet, edges, found))
    notes: list[str] = []
    pieces: list[Piece] = []
    loose = 0
    if crowded:
        notes.append(f"too many surfaces meet to cut each where others meet it: {BLEEDS}")
    elif len(found.triangle):
        largest, left = _largest(facet, scene.normals_areas[1], found)
        if left:
            few = f"{left:,} small surfaces are not cut where others meet them, only the {MOST_PIECES:,} largest are"
            notes.append(f"{few}: {BLEEDS}")
        found = found.only(largest)
        pieces, loose = parted_pieces(
            scene, places, corners, facet, edges, found, lambda share: tell(0.5 + 0.4 * share)
        )
    if loose:
        crowd = f"{loose:,} thin things stand in crowds, as grass does, of more than {MOST_ENDS} on one flat piece"
        notes.append(f"{crowd}, which is not cut there: {BLEEDS}")
    if notes:
        scene = dataclasses.replace(scene, warnings=(*scene.warnings, *notes))
    if not pieces:
        return Cut(scene, None, facet, welded)
    made = cut_pieces(pieces, places, corners, facet, lambda share: tell(0.9 + 0.1 * share))
    cut, source, ends = _joined(scene, welded, made)
    return Cut(cut, ends, numbered(facet[source]).astype(np.int32))  # slivers may have been a piece


def _largest(facet: I32, area: F64, found: Contacts) -> tuple[NDArray[np.bool_], int]:
    """Which contacts are those of the MOST_PIECES flat pieces that have most area, of those that have any; how many are left out.
    facet, area (m,): of triangles."""
    met = np.unique(facet[found.triangle])
    areas = np.bincount(facet, area)[met]
    chosen = met[np.argsort(-areas, kind="stable")[:MOST_PIECES]]
    return np.isin(facet[found.triangle], chosen), len(met) - len(chosen)


def _uncovered(scene: Scene, met: _Met, report: Report) -> Scene:
    """The scene less the parts of surfaces that others in their planes cover, see covered.py; itself where none is."""
    found = without_covered(scene, met.places, met.welded.corners, met.facet, met.overlaps, report)
    if found is None:
        return scene
    made, gone, count = found
    covered = counted(count, "surface was", "surfaces were")
    note = f"{covered} cut away where another one lies in the same plane and faces the same way"
    return dataclasses.replace(_joined(scene, met.welded, made, gone)[0], warnings=(*scene.warnings, note))


def _joined(
    scene: Scene, mesh: Welded, made: CutTriangles, gone: NDArray[np.bool_] | None = None
) -> tuple[Scene, NDArray[np.int64], NDArray[np.uint8]]:
    """The scene with triangles in the places of those that they were made of, less some that go (m,); of each the one (t,) that
    it was made of, and its ends (t, 3) as in Cut. mesh: of the scene."""
    corners, origin, size = mesh.corners, mesh.points.min(0), scene_size(scene)
    welded = int(corners.max()) + 1
    parent, numbers, weights, ends = made.parent, made.nodes, made.weights, made.ends
    count = len(scene.triangles)
    gone = np.zeros(count, bool) if gone is None else gone
    gone[parent] = True
    kept = np.flatnonzero(~gone)
    source = np.concatenate([kept, parent])
    order = np.argsort(source, kind="stable")
    vertex = np.empty(welded, np.int64)  # one of those that were welded
    vertex[corners] = scene.triangles
    old = vertex[np.minimum(numbers, welded - 1)]
    new = np.where(numbers < welded, old, len(scene.positions) + numbers - welded)
    triangles = np.concatenate([scene.triangles[kept], new])[order].astype(np.int32)
    positions = np.concatenate([scene.positions, origin + size * made.new])
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
    return cut, source, np.concatenate([np.zeros((len(kept), 3), np.uint8), ends])[order]
