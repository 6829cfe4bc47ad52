"""From a scene to its charts: lit sides, whole rectangles, unfolded rest, one atlas at the density asked for.

The unfolding is in metres and is made once; a density only lays it out, see layout.py.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from app.atlas.charts import DEFAULT_TILE, Charts
from app.atlas.contacts import hidden_pieces
from app.atlas.enclosed import without_enclosed
from app.atlas.facets import facets
from app.atlas.layout import Layout, density_for, measured, place, scaled, texel_count
from app.atlas.planes import Planes
from app.atlas.rectangles import Rectangles, find_rectangles
from app.atlas.seams import find_seams
from app.atlas.sides import Sides, Welded, distinct_rows, least, lit_sides, most, scene_size
from app.atlas.triangle_cuts import GOES_ON
from app.atlas.unwrap import unwrap
from app.errors import UserError
from app.scene.model import F64, I32, Scene
from app.util.threads import threads

Progress = Callable[[str, float], None]

TEXELS_PER_FACE = 8
DEFAULT_TEXELS = (32_000, 2_000_000)  # from a plain room to what two cores still shoot at interactive rates
ROOT_SHARE = 16  # of the texels that uniform ones would have: two levels below the roots are as fine as these
MAX_TEXELS = 1 << 24
MUCH = 0.1  # of all area: so much of it smaller than a texel is worth a word
UNFOLDED = 0.7  # of the work, that is done by then


def parametrize(
    scene: Scene,
    *,
    density: float | None = None,
    texels: int | None = None,
    tile: int = DEFAULT_TILE,
    roots: bool = False,
    ends: NDArray[np.uint8] | None = None,
    facet: I32 | None = None,
    welded: Welded | None = None,
    uncut: int | None = None,
    progress: Progress | None = None,
    time_limit: float | None = None,
) -> Charts:
    """Unfold the lit sides of a scene into an atlas.

    density [texels/m], or texels: how many to aim at; by default 8 for each lit side, within 32 000 and 2 million, and for
    ``roots`` of quadtrees a sixteenth of that.
    A material's ``lightmap_scale`` is so many times that density; where neither was given, others keep the density that they have
    without it. Rectangles are made of whole patches, so that a small number of texels is met only roughly. Charts that are
    smaller than a texel have one all the same: where there are so many that a large floor among them would be left with one, too,
    more texels are made than were asked for. ends, facet, welded: as in a Cut, if the scene was cut; uncut: its triangles before
    that, for which there are texels by default. tile: texels along the edge of a leaf. time_limit [s] for xatlas. progress(stage,
    share) is called now and then and may raise to cancel.
    Raises UserError for a density or number out of range, or when more than 16 777 216 texels are needed.
    """
    check(density, texels)
    report = progress or (lambda stage, share: None)
    report("joining corners", 0.0)
    with threads(1) as beside:
        sides = beside.submit(lit_sides, scene)
        welded = welded or Welded.of(scene)
        points, corners, edges = welded.points, welded.corners, welded.edges
        if facet is None:
            report("finding flat pieces", 0.05)
            facet = facets(points, corners, scene.material_ids, scene_size(scene), edges)
        report("finding sides that light can reach", 0.15)
        planes = beside.submit(Planes.of_scene, scene, points, corners, facet, edges)
        lit = without_enclosed(sides.result(), scene, points, corners)
        layout, method, warnings = _unfold(scene, lit, welded, facet, ends, time_limit, report)
        all_planes = planes.result()
    report("placing pieces side by side", UNFOLDED)
    plain, layout = layout, scaled(layout, scene)
    if density is None:
        share = 1.0 if uncut is None else uncut / len(scene.triangles)
        aim = texels if texels is not None else default_texels(round(share * len(lit.triangle)), roots)
        density = density_for(plain if texels is None else layout, aim)
    need = texel_count(layout, density)
    if need > MAX_TEXELS:
        best = density_for(layout, MAX_TEXELS)
        raise UserError(
            f"--density {density:g} needs {need:,.0f} texels: the limit is {MAX_TEXELS:,} (density {best:.3g})"
        )
    charts = place(
        layout,
        lit,
        facet,
        density,
        tile,
        method,
        lambda share: report("placing pieces side by side", UNFOLDED + 0.1 * share),
    )
    with threads(1) as also:
        joins = also.submit(
            find_seams, scene, corners, lit.triangle, lit.back, charts.face_uv, charts.face_chart, ends, layout.rim
        )
        hidden = hidden_pieces(
            scene,
            all_planes,
            facet,
            lit.triangle,
            lit.back,
            charts.face_uv,
            density,
            lambda share: report("finding what lies on surfaces", 0.8 + 0.15 * share),
        )
        report("joining edges of pieces", 0.95)
        seams = joins.result()
    lasting = not warnings  # these are of xatlas
    if hidden.left_out:
        soup = (
            f"{hidden.left_out} sides share a plane with thousands of loose pieces: what stands there leaves dark feet"
        )
        warnings = (*warnings, soup)
    if not roots:
        warnings += _too_small(layout, density)
    notes: dict[str, Any] = {"warnings": warnings, "lasting": lasting}
    return dataclasses.replace(charts, seams=seams, hidden_uv=hidden.uv, hidden_face=hidden.face, **notes)


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
    welded: Welded,
    facet: I32,
    ends: NDArray[np.uint8] | None,
    time_limit: float | None,
    report: Progress,
) -> tuple[Layout, str, tuple[str, ...]]:
    """Charts in metres for every triangle with a lit side; their story in words; warnings."""
    report("laying out rectangles", 0.2)
    points, corners = welded.points, welded.corners
    is_lit = np.zeros(len(corners), bool)
    is_lit[lit.triangle] = True
    used = np.flatnonzero(is_lit)
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
    flat = int(unfolded.chart.max(initial=-1)) + 1 - unfolded.by_xatlas - unfolded.seen_whole
    kinds = (
        (count, "rectangles"),
        (unfolded.by_xatlas, "xatlas charts"),
        (unfolded.seen_whole, "pieces seen whole from one side"),
        (flat, "flat pieces"),
    )
    method = ", ".join(f"{number} {kind}" for number, kind in kinds if number)
    size = rectangles.size
    if ends is not None:
        before = int(chart.max(initial=-1)) + 1
        chart, uv, size = _parted(chart, uv, size, corners, ends)
        after = int(chart.max(initial=-1)) + 1
        method += f", parted into {after} charts where others stand on them" if after > before else ""
    return measured(chart, uv, size, lit, welded.edges), method, unfolded.warnings


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
