"""Charts in metres, and how they are laid out in one atlas at a density.

Texels that a chart covers are predicted by Steiner's formula: a shape of area A and extents of its boundary X = ∮|dx|, Y = ∮|dy|
meets about A + (X + Y)/2 + 1 unit squares.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import ALIGN, GAP, Charts
from app.atlas.packing import MAX_SIDE, outlines_of_edges, pack
from app.atlas.sides import Edges, Sides, distinct_rows, least, most, totals
from app.scene.model import F64, I32, Scene
from app.util.background import Report

LEAST_BY_AREA = 0.5  # of the texels asked for, that surfaces have by their area, whatever small charts need beside them
WHOLE_PATCHES_FROM = 6  # texels: shorter sides of rectangles are not rounded to whole patches


@dataclass(frozen=True, eq=False)
class Layout:
    """Charts in metres, one per unfolded piece, not yet placed nor split by side.

    chart (m,) i32 and uv (m, 3, 2) f64 [m] per scene triangle (-1 where no side is lit), u and v from 0;
    extent (c, 2) f64 [m]; area (c,) f64 [m²]; border (c,) f64: (X + Y)/2 [m]; the first ``rectangles`` are whole
    rectangles. sides (c,): 1 or 2 lit sides. rim (m, 3): which edges of triangles, from corner k to k + 1, may be at the border
    of their chart: those that no neighbour continues. scale (c,): how many times longer than the surface all these lengths are.
    """

    chart: I32
    uv: F64
    extent: F64
    area: F64
    border: F64
    rectangles: int
    sides: I32
    rim: NDArray[np.bool_]
    scale: NDArray[np.float64]


def measured(chart: I32, uv: F64, rectangle_size: F64, lit: Sides, edges: Edges | None = None) -> Layout:
    """Move every chart's corner to the origin and measure it. edges: of the triangles, faster where they are known."""
    used = np.flatnonzero(chart >= 0)
    count = int(chart.max()) + 1
    owner, local = chart[used], uv[used]
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, owner, least(local))
    np.maximum.at(high, owner, most(local))
    rectangles = len(rectangle_size)
    low[:rectangles], high[:rectangles] = 0.0, rectangle_size
    local = local - low[owner][:, None]
    moved = uv.copy()
    moved[used] = local
    a, b = local[:, 1] - local[:, 0], local[:, 2] - local[:, 0]
    area = totals(owner, np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2, count)
    charts = distinct_rows(chart[lit.triangle], lit.back)[0]
    rim = _rim(chart, moved, lit, edges)
    sides = np.bincount(chart[lit.triangle[charts]], minlength=count).astype(np.int32)
    borders = _borders(chart, moved, rim, count)
    return Layout(chart, moved, high - low, area, borders, rectangles, sides, rim, np.ones(count))


def _rim(chart: I32, uv: F64, lit: Sides, edges: Edges | None) -> NDArray[np.bool_]:
    """(m, 3) the edges of triangles with a chart, less those between two that lie side by side in it, lit on the same sides."""
    rim = np.repeat(chart >= 0, 3)
    if edges is not None:
        two = edges.first[:-1][edges.uses == 2]
        i, j = edges.order[two], edges.order[two + 1]
        places = np.ascontiguousarray(uv).view(np.complex128).reshape(-1)  # one number each, for speed
        kind = 4 * chart
        kind[lit.triangle[~lit.back]] += 1
        kind[lit.triangle[lit.back]] += 2
        for _ in range(2):  # the start of each at the end of the other
            same = (kind[i // 3] == kind[j // 3]) & (places[i] == places[_next(j)])
            i, j = j[same], i[same]
        rim[i] = rim[j] = False
    return rim.reshape(-1, 3)


def _next(half: NDArray[np.int64]) -> NDArray[np.int64]:
    """The half-edges that follow some in their triangles."""
    return half - half % 3 + (half + 1) % 3


def scaled(layout: Layout, scene: Scene) -> Layout:
    """Charts as long as their material's ``lightmap_scale`` makes them: one density then gives each its own."""
    used = np.flatnonzero(layout.chart >= 0)
    scale = np.ones(len(layout.area))
    scale[layout.chart[used]] = np.array([m.lightmap_scale for m in scene.materials])[scene.material_ids[used]]
    if (scale == 1).all():
        return layout
    return dataclasses.replace(
        layout,
        uv=layout.uv * scale[layout.chart][:, None, None],
        extent=layout.extent * scale[:, None],
        area=layout.area * scale**2,
        border=layout.border * scale,
        scale=scale,
    )


def _borders(chart: I32, uv: F64, rim: NDArray[np.bool_], count: int) -> NDArray[np.float64]:
    """(X + Y)/2 of each chart: half the extents of its boundary, along u and along v [m]."""
    half = np.flatnonzero(rim)
    owner, places = chart[half // 3], uv.reshape(-1, 2)
    p, q = places[half], places[_next(half)]
    # an inner edge is walked both ways, with the same ends
    swap = (p[:, 0] > q[:, 0]) | ((p[:, 0] == q[:, 0]) & (p[:, 1] > q[:, 1]))
    a, b = np.where(swap[:, None], q, p), np.where(swap[:, None], p, q)
    grain = np.maximum(np.abs(uv).max(initial=0.0), np.finfo(float).tiny) * 1e-9
    key = np.round(np.concatenate([a, b], axis=1) / grain).astype(np.int64)
    index, _, uses = distinct_rows(owner, *key.T)
    outer = index[uses == 1]
    return totals(owner[outer], np.abs(q - p)[outer].sum(axis=1) / 2, count)


def _sizes(layout: Layout, density: float) -> NDArray[np.float64]:
    """(c, 2) whole texels of every chart's box, as floats: a hopeless density may ask for more than an int holds."""
    exact = layout.extent * density
    whole = np.where(exact >= WHOLE_PATCHES_FROM, ALIGN * np.floor(exact / ALIGN + 0.5), np.floor(exact + 0.5))
    box = np.maximum(np.ceil(exact - 1e-9), 1.0)
    box[: layout.rectangles] = np.maximum(whole, 1.0)[: layout.rectangles]
    return box


def texel_count(layout: Layout, density: float) -> float:
    """Texels that the charts will cover, both sides; exact for rectangles."""
    box = np.prod(_sizes(layout, density), axis=1)
    met = layout.area * density**2 + layout.border * density + 1
    met[: layout.rectangles] = np.inf
    return float((np.minimum(box, met) * layout.sides).sum())


def density_for(layout: Layout, texels: int) -> float:
    """The density [texels/m] at which the charts cover about so many texels, and no chart outgrows the atlas."""
    longest = (MAX_SIDE - ALIGN) / float(layout.extent.max())
    by_area = math.sqrt(texels / float((layout.area * layout.sides).sum()))
    least = min(math.sqrt(LEAST_BY_AREA) * by_area, longest)
    if texel_count(layout, least) > texels:
        return least
    high = min(by_area, longest)
    while high < longest and texel_count(layout, high) < texels:
        high = min(2 * high, longest)
    low = high / 2
    while low > least and texel_count(layout, low) > texels:
        low /= 2
    # no finer: sizes jump at some densities, and rectangles alike but for rounding must jump together
    while high > low * (1 + 1e-3):
        middle = math.sqrt(low * high)
        if texel_count(layout, middle) < texels:
            low = middle
        else:
            high = middle
    return min((low, high), key=lambda d: abs(texel_count(layout, d) - texels))


def place(layout: Layout, lit: Sides, facet: I32, density: float, tile: int, method: str, report: Report) -> Charts:
    """Charts side by side in an atlas, without seams or what is hidden. facet (m,): flat piece of each triangle; density
    [texels/m]; method: how they were made."""
    box = _sizes(layout, density)
    stretch = np.full_like(box, density)
    stretch[: layout.rectangles] = (box / layout.extent)[: layout.rectangles]
    piece = layout.chart[lit.triangle]
    uv = np.clip(layout.uv[lit.triangle] * stretch[piece][:, None], 0.0, box[piece][:, None])
    # the back of a chart is its front seen in a mirror
    uv[lit.back, :, 0] = box[piece[lit.back], 0][:, None] - uv[lit.back, :, 0]
    first, chart, _ = distinct_rows(lit.back, piece)
    face, k = np.nonzero(layout.rim[lit.triangle])
    rims = outlines_of_edges(uv[face, k], uv[face, (k + 1) % 3], chart[face], len(first))
    origins, size = pack(rims, tile, report)
    uv += origins[chart][:, None]
    rects = np.concatenate([origins, box[piece[first]].astype(np.int32)], axis=1)
    face_facet = distinct_rows(chart, facet[lit.triangle])[1]
    return Charts(
        size=size,
        tile=tile,
        density=density,
        face_triangle=lit.triangle,
        face_back=lit.back,
        face_uv=uv,
        face_chart=chart.astype(np.int32),
        face_facet=face_facet.astype(np.int32),
        chart_rects=rects,
        dark_faces=lit.dark,
        method=method,
    )


assert GAP < ALIGN, "outlines let gaps stick out by one column only"
