"""Charts that are there at once, for the light that is shown while better ones are made: each smooth piece of a surface as it is
seen along one of the axes.

Pieces end where normals turn to another axis, so that lengths are shortened by no more than √3. Where a piece folds over itself,
two places share a texel. Nothing is cut where surfaces meet, and flat pieces are not looked for: every triangle is a facet.
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

MOST_PIECES = 1 << 14  # beyond which placing them takes as long as better charts do


def coarse_charts(scene: Scene, tile: int, texels: int, report: Report) -> Charts | None:
    """Those of a scene's lit sides, of about so many texels; None where it falls apart into too many pieces. tile: texels along
    the edge of a leaf. report(share) is called now and then and may raise to cancel."""
    lit = sides_with_texels(scene)
    normals = scene.normals_areas[0]
    axis = np.abs(normals).argmax(axis=1)
    way = 2 * axis + (np.take_along_axis(normals, axis[:, None], 1)[:, 0] < 0)
    report(0.3)
    edges = Edges.of(distinct_rows(*scene.positions.T)[1][scene.triangles].astype(np.int32))
    count, piece = _pieces(scene, edges, way)
    report(0.5)
    if count > MOST_PIECES:
        return None
    layout = scaled(measured(piece, _seen_along(scene.corners, way), np.empty((0, 2)), lit, edges), scene)
    density = density_for(layout, texels)
    facet = np.arange(len(piece), dtype=np.int32)
    report(0.8)
    return place(layout, lit, facet, density, tile, f"{count} pieces seen along an axis", report)


def _pieces(scene: Scene, edges: Edges, way: NDArray[np.int64]) -> tuple[int, I32]:
    """How many pieces there are, and the number of that of each triangle (m,): of one material and way (m,), joined at edges."""
    kind = way * len(scene.materials) + scene.material_ids
    i, j = (half // 3 for half in edges.pairs())
    joined = kind[i] == kind[j]
    count, label = groups_of(len(way), np.stack([i[joined], j[joined]], axis=1))
    return count, label.astype(np.int32)


def _seen_along(corners: F64, way: NDArray[np.int64]) -> F64:
    """Corners (m, 3, 3) as seen from where each triangle's way (m,) points to, (m, 3, 2) [m], counter-clockwise."""
    across, up = (way // 2 + 1) % 3, (way // 2 + 2) % 3
    u, v = (np.take_along_axis(corners, axis[:, None, None], 2)[..., 0] for axis in (across, up))
    return np.stack([np.where(way[:, None] % 2, -u, u), v], axis=2)
