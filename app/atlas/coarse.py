"""Charts that are there at once, for the light that is shown while better ones are made: each smooth piece of a surface as it is
seen along one of the axes.

Pieces end where normals turn to another axis, so that lengths are shortened by no more than √3; specks of few triangles go with a
larger piece beside them, shortened by no more than 3. Where a piece folds over itself, two places share a texel. Nothing is cut
where surfaces meet, and flat pieces are not looked for: every triangle is a facet.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.enclosed import sides_with_texels
from app.atlas.layout import density_for, measured, place, scaled
from app.atlas.sides import Edges, distinct_rows, groups_of
from app.scene.model import F64, I32, Scene
from app.util.background import Report

SPECK = 8  # triangles of a piece that is one, at most,
LEAST_SEEN = 1 / 3  # and the cosine of what goes along with others, at least
MOST_PIECES = 1 << 12  # beyond which most are copies or loose parts, whose better charts are there as soon


def coarse_charts(scene: Scene, tile: int, texels: int, report: Report) -> Charts | None:
    """Those of a scene's lit sides, of about so many texels; None where it falls apart into too many pieces. tile: texels along
    the edge of a leaf. report(share) is called now and then and may raise to cancel."""
    normals = scene.normals_areas[0]
    axis = np.abs(normals).argmax(axis=1)
    way = 2 * axis + (np.take_along_axis(normals, axis[:, None], 1)[:, 0] < 0)
    report(0.3)
    edges = Edges.of(distinct_rows(*scene.positions.T)[1][scene.triangles].astype(np.int32))
    pairs = np.stack([half // 3 for half in edges.pairs()])
    pairs = pairs[:, scene.material_ids[pairs[0]] == scene.material_ids[pairs[1]]]
    way = _without_specks(normals, pairs, way)
    count, piece = _pieces(pairs, way)
    report(0.5)
    if count > MOST_PIECES:
        return None
    lit = sides_with_texels(scene)
    layout = scaled(measured(piece, _seen_along(scene.corners, way), np.empty((0, 2)), lit, edges), scene)
    density = density_for(layout, texels)
    facet = np.arange(len(piece), dtype=np.int32)
    report(0.8)
    return place(layout, lit, facet, density, tile, f"{count} pieces seen along an axis", report)


def _without_specks(normals: F64, pairs: NDArray[np.int64], way: NDArray[np.int64]) -> NDArray[np.int64]:
    """Ways (m,), of triangles in specks those of larger pieces beside them. pairs (2, p): of neighbours."""
    _, piece = _pieces(pairs, way)
    speck, ways = np.bincount(piece)[piece] <= SPECK, way.copy()
    for one, other in (pairs, pairs[::-1]):
        at = speck[one] & ~speck[other]
        mine, towards = one[at], way[other[at]]
        off = normals[mine, towards // 2] * np.where(towards % 2, -1.0, 1.0)
        near = off > LEAST_SEEN
        ways[mine[near]] = towards[near]
    return ways


def _pieces(pairs: NDArray[np.int64], way: NDArray[np.int64]) -> tuple[int, I32]:
    """How many pieces there are, and the number of that of each triangle (m,): of neighbours, pairs (2, p), that have one way
    (m,)."""
    joined = pairs[:, way[pairs[0]] == way[pairs[1]]]
    count, label = groups_of(len(way), joined.T)
    return count, label.astype(np.int32)


def _seen_along(corners: F64, way: NDArray[np.int64]) -> F64:
    """Corners (m, 3, 3) as seen from where each triangle's way (m,) points to, (m, 3, 2) [m], counter-clockwise."""
    across, up = (way // 2 + 1) % 3, (way // 2 + 2) % 3
    u, v = (np.take_along_axis(corners, axis[:, None, None], 2)[..., 0] for axis in (across, up))
    return np.stack([np.where(way[:, None] % 2, -u, u), v], axis=2)
