"""From a scene to its charts: lit sides, whole rectangles, unfolded rest, one atlas at the density asked for.

The unfolding is in metres and is made once; a density only lays it out. Texels that a chart covers are predicted by
Steiner's formula: a shape of area A and extents of its boundary X = ∮|dx|, Y = ∮|dy| meets about
A + (X + Y)/2 + 1 unit squares.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from app.atlas.charts import ALIGN, DEFAULT_TILE, GAP, Charts
from app.atlas.contacts import hidden_pieces
from app.atlas.cuts import GOES_ON
from app.atlas.packing import MAX_SIDE, outlines, pack
from app.atlas.rectangles import Rectangles, find_rectangles
from app.atlas.seams import find_seams
from app.atlas.sides import Sides, distinct_rows, facets, least, lit_sides, most, scene_size, totals, weld
from app.atlas.unwrap import unwrap
from app.errors import UserError
from app.scene.model import F64, I32, Scene

Progress = Callable[[str, float], None]

TEXELS_PER_FACE = 8
DEFAULT_TEXELS = (32_000, 2_000_000)  # from a plain room to what two cores still shoot at interactive rates
LEAST_BY_AREA = 0.5  # of the texels asked for, that surfaces have by their area, whatever small charts need beside them
ROOT_SHARE = 16  # of the texels that uniform ones would have: two levels below the roots are as fine as these
MAX_TEXELS = 1 << 24
MUCH = 0.1  # of all area: so much of it smaller than a texel is worth a word
UNFOLDED = 0.7  # of the work, that is done by then
WHOLE_PATCHES_FROM = 6  # texels: shorter sides of rectangles are not rounded to whole patches


@dataclass(frozen=True, eq=False)
class Layout:
    """Charts in metres, one per unfolded piece, not yet placed nor split by side.

    chart (m,) i32 and uv (m, 3, 2) f64 [m] per scene triangle (-1 where no side is lit), u and v from 0;
    extent (c, 2) f64 [m]; area (c,) f64 [m²]; border (c,) f64: (X + Y)/2 [m]; the first ``rectangles`` are whole
    rectangles. sides (c,): 1 or 2 lit sides. scale (c,): how many times longer than the surface all of these lengths are.
    """

    chart: I32
    uv: F64
    extent: F64
    area: F64
    border: F64
    rectangles: int
    sides: I32
    scale: NDArray[np.float64]


def parametrize(
    scene: Scene,
    *,
    density: float | None = None,
    texels: int | None = None,
    tile: int = DEFAULT_TILE,
    roots: bool = False,
    ends: NDArray[np.uint8] | None = None,
    progress: Progress | None = None,
    time_limit: float | None = None,
) -> Charts:
    """Unfold the lit sides of a scene into an atlas.

    density [texels/m], or texels: how many to aim at; by default 8 for each lit side, within 32 000 and 2 million, and for
    ``roots`` of quadtrees a sixteenth of that.
    A material's ``lightmap_scale`` is so many times that density; where neither was given, others keep the density that they have
    without it. Rectangles are made of whole patches, so that a small number of texels is met only roughly. Charts that are
    smaller than a texel have one all the same: where there are so many that a large floor among them would be left with one, too,
    more texels are made than were asked for. tile: texels along the edge of a leaf. time_limit [s] for xatlas. progress(stage,
    share) is called from time to time and may raise to cancel.
    Raises UserError for a density or number out of range, or when more than 16 777 216 texels are needed.
    """
    check(density, texels)
    report = progress or (lambda stage, share: None)
    report("finding sides that light can reach", 0.0)
    lit = lit_sides(scene)
    report("joining corners", 0.05)
    points, corners = weld(scene)
    report("finding flat pieces", 0.1)
    facet = facets(points, corners, scene.material_ids, scene_size(scene))
    layout, method, warnings = _unfold(scene, lit, points, corners, facet, ends, time_limit, report)
    report("placing pieces side by side", UNFOLDED)
    plain, layout = layout, _scaled(layout, scene)
    if density is None:
        aim = texels if texels is not None else default_texels(len(lit.triangle), roots)
        density = _density_for(plain if texels is None else layout, aim)
    need = _texel_count(layout, density)
    if need > MAX_TEXELS:
        best = _density_for(layout, MAX_TEXELS)
        raise UserError(
            f"--density {density:g} needs {need:,.0f} texels: the limit is {MAX_TEXELS:,} (density {best:.3g})"
        )
    charts = _place(layout, lit, facet, density, tile)
    report("finding what lies on surfaces", 0.8)
    face_uv, face_chart, face_facet, rects, size = charts
    hidden = hidden_pieces(scene, points, corners, facet, lit.triangle, lit.back, face_uv, density)
    if hidden.left_out:
        soup = (
            f"{hidden.left_out} sides share a plane with thousands of loose pieces: what stands there leaves dark feet"
        )
        warnings = (*warnings, soup)
    if not roots:
        warnings += _too_small(layout, density)
    report("joining edges of pieces", 0.95)
    return Charts(
        size=size,
        tile=tile,
        density=density,
        face_triangle=lit.triangle,
        face_back=lit.back,
        face_uv=face_uv,
        face_chart=face_chart,
        face_facet=face_facet,
        chart_rects=rects,
        dark_faces=lit.dark,
        method=method,
        warnings=warnings,
        seams=find_seams(scene, corners, lit.triangle, lit.back, face_uv, face_chart, ends),
        hidden_uv=hidden.uv,
        hidden_face=hidden.face,
    )


def _too_small(layout: Layout, density: float) -> tuple[str, ...]:
    """What to say of surfaces that are smaller than a texel, where they have much of the area: a density at which nine tenths of
    that are not."""
    width, area = np.sqrt(layout.area), layout.area / layout.scale**2 * layout.sides
    order = np.argsort(width)
    small = order[: np.count_nonzero(width * density < 1)]
    held = np.cumsum(area[small])
    if not len(small) or held[-1] < MUCH * area.sum():
        return ()
    enough = 1.05 / float(width[small[np.searchsorted(held, 0.1 * held[-1])]])
    what = (
        f"{len(small):,} of {len(order):,} surfaces, {held[-1] / area.sum():.0%} of the area, are smaller than a texel"
    )
    return (f"{what}: --density {enough:.2g} would do",)


def default_texels(sides: int, roots: bool) -> int:
    """How many texels to aim at where nobody says."""
    uniform = int(np.clip(TEXELS_PER_FACE * sides, *DEFAULT_TEXELS))
    return uniform // ROOT_SHARE if roots else uniform


def check(density: float | None, texels: int | None) -> None:
    """Raises UserError for a density or number out of range."""
    if density is not None and texels is not None:
        raise UserError(f"--density {density:g} --texels {texels}: only one of the two can be set")
    if density is not None and not (math.isfinite(density) and density > 0):
        raise UserError(f"--density {density:g}: must be a finite number above 0 [texels/m]")
    if texels is not None and not 1 <= texels <= MAX_TEXELS:
        raise UserError(f"--texels {texels}: must be 1 to {MAX_TEXELS}")


def _unfold(
    scene: Scene,
    lit: Sides,
    points: F64,
    corners: I32,
    facet: I32,
    ends: NDArray[np.uint8] | None,
    time_limit: float | None,
    report: Progress,
) -> tuple[Layout, str, tuple[str, ...]]:
    """Charts in metres for every triangle with a lit side; their story in words; warnings."""
    report("laying out rectangles", 0.2)
    used = np.unique(lit.triangle)
    rectangles = find_rectangles(points, corners[used], scene.material_ids[used], facet[used])
    slot = np.full(int(facet.max()) + 1, -1, np.int32)
    slot[rectangles.facet] = np.arange(len(rectangles.facet), dtype=np.int32)
    count = len(rectangles.facet)
    chart = np.full(len(facet), -1, np.int32)
    uv = np.zeros((len(facet), 3, 2))
    chart[used] = slot[facet[used]]
    whole, rest = used[chart[used] >= 0], used[chart[used] < 0]
    uv[whole] = _in_rectangle(scene.corners[whole], rectangles, chart[whole])
    unfolded = unwrap(
        points,
        corners[rest],
        scene.corners[rest],
        scene.material_ids[rest],
        facet[rest],
        time_limit=time_limit,
        progress=lambda stage, share: report(stage, 0.3 + (UNFOLDED - 0.3) * share),
    )
    chart[rest], uv[rest] = count + unfolded.chart, unfolded.uv
    flat = int(unfolded.chart.max(initial=-1)) + 1 - unfolded.by_xatlas
    kinds = ((count, "rectangles"), (unfolded.by_xatlas, "xatlas charts"), (flat, "flat pieces"))
    method = ", ".join(f"{number} {kind}" for number, kind in kinds if number)
    size = rectangles.size
    if ends is not None:
        chart, uv, size = _parted(chart, uv, size, corners, ends)
    return _measured(chart, uv, size, lit), method, unfolded.warnings


def _parted(
    chart: I32, uv: F64, rectangle_size: F64, corners: I32, ends: NDArray[np.uint8]
) -> tuple[I32, F64, NDArray[np.float64]]:
    """Charts in the pieces that are joined at edges where they go on: chart, uv, and the sizes of those that are pieces of
    rectangles, which come first."""
    some = np.flatnonzero((chart >= 0) & np.isin(chart, chart[ends.any(1)]))
    start, end = corners[some].reshape(-1), np.roll(corners[some], -1, axis=1).reshape(-1)
    owner = np.repeat(chart[some], 3)
    edge = distinct_rows(owner, np.minimum(start, end), np.maximum(start, end))[1]
    joins = np.flatnonzero(ends[some].reshape(-1) == GOES_ON)
    size = len(some) + len(edge)
    graph = coo_array((np.ones(len(joins), bool), (joins // 3, len(some) + edge[joins])), shape=(size, size))
    label = np.zeros(len(chart), np.int32)
    label[some] = connected_components(graph, directed=False)[1][: len(some)]
    used = np.flatnonzero(chart >= 0)
    first, piece, _ = distinct_rows(chart[used], label[used])
    of = chart[used[first]]
    pieces = np.full(len(chart), -1, np.int32)
    pieces[used] = piece
    count = int((of < len(rectangle_size)).sum())
    low, high = np.zeros((count, 2)), rectangle_size[of[:count]]
    parted = np.isin(of[:count], chart[some])
    low[parted], high[parted] = np.inf, -np.inf
    mine = some[pieces[some] < count]
    np.minimum.at(low, pieces[mine], least(uv[mine]))
    np.maximum.at(high, pieces[mine], most(uv[mine]))
    moved = uv.copy()
    moved[mine] -= low[pieces[mine]][:, None]
    return pieces, moved, high - low


def _in_rectangle(corners: F64, rectangles: Rectangles, chart: I32) -> F64:
    """Corners (m, 3, 3) in their rectangle's axes [m], (m, 3, 2), held inside against rounding."""
    local = corners - rectangles.corner[chart][:, None]
    axes = np.stack([rectangles.u, rectangles.v], axis=1)[chart]
    return np.asarray(np.clip(np.einsum("mck,mak->mca", local, axes), 0.0, rectangles.size[chart][:, None]))


def _measured(chart: I32, uv: F64, rectangle_size: F64, lit: Sides) -> Layout:
    """Move every chart's corner to the origin and measure it."""
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
    sides = np.bincount(chart[lit.triangle[charts]], minlength=count).astype(np.int32)
    return Layout(chart, moved, high - low, area, _borders(owner, local, count), rectangles, sides, np.ones(count))


def _scaled(layout: Layout, scene: Scene) -> Layout:
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


def _borders(chart: I32, uv: F64, count: int) -> NDArray[np.float64]:
    """(X + Y)/2 of each chart: half the extents of its boundary, along u and along v [m]."""
    p, q = uv.reshape(-1, 2), np.roll(uv, -1, axis=1).reshape(-1, 2)
    owner = np.repeat(chart, 3)
    # an inner edge is walked both ways, with the same ends
    swap = (p[:, 0] > q[:, 0]) | ((p[:, 0] == q[:, 0]) & (p[:, 1] > q[:, 1]))
    a, b = np.where(swap[:, None], q, p), np.where(swap[:, None], p, q)
    grain = np.maximum(np.abs(uv).max(), np.finfo(float).tiny) * 1e-9
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


def _texel_count(layout: Layout, density: float) -> float:
    """Texels that the charts will cover, both sides; exact for rectangles."""
    box = np.prod(_sizes(layout, density), axis=1)
    met = layout.area * density**2 + layout.border * density + 1
    met[: layout.rectangles] = np.inf
    return float((np.minimum(box, met) * layout.sides).sum())


def _density_for(layout: Layout, texels: int) -> float:
    """The density [texels/m] at which the charts cover about so many texels, and no chart outgrows the atlas."""
    longest = (MAX_SIDE - ALIGN) / float(layout.extent.max())
    by_area = math.sqrt(texels / float((layout.area * layout.sides).sum()))
    least = min(math.sqrt(LEAST_BY_AREA) * by_area, longest)
    if _texel_count(layout, least) > texels:
        return least
    high = min(by_area, longest)
    while high < longest and _texel_count(layout, high) < texels:
        high = min(2 * high, longest)
    low = high / 2
    while low > least and _texel_count(layout, low) > texels:
        low /= 2
    # no finer: sizes jump at some densities, and rectangles alike but for rounding must jump together
    while high > low * (1 + 1e-3):
        middle = math.sqrt(low * high)
        if _texel_count(layout, middle) < texels:
            low = middle
        else:
            high = middle
    return min((low, high), key=lambda d: abs(_texel_count(layout, d) - texels))


def _place(
    layout: Layout, lit: Sides, facet: I32, density: float, tile: int
) -> tuple[F64, I32, I32, NDArray[np.int32], tuple[int, int]]:
    """face_uv, face_chart, face_facet, chart_rects and the atlas's size."""
    box = _sizes(layout, density)
    stretch = np.full_like(box, density)
    stretch[: layout.rectangles] = (box / layout.extent)[: layout.rectangles]
    piece = layout.chart[lit.triangle]
    uv = np.clip(layout.uv[lit.triangle] * stretch[piece][:, None], 0.0, box[piece][:, None])
    # the back of a chart is its front seen in a mirror
    uv[lit.back, :, 0] = box[piece[lit.back], 0][:, None] - uv[lit.back, :, 0]
    first, chart, _ = distinct_rows(lit.back, piece)
    origins, size = pack(outlines(uv, chart, len(first)), tile)
    uv += origins[chart][:, None]
    rects = np.concatenate([origins, box[piece[first]].astype(np.int32)], axis=1)
    face_facet = distinct_rows(chart, facet[lit.triangle])[1]
    return uv, chart.astype(np.int32), face_facet.astype(np.int32), rects, size


assert GAP < ALIGN, "outlines let gaps stick out by one column only"
