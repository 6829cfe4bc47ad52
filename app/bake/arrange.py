"""A lightmap whose charts lie elsewhere than they were solved: farther apart, so that its mip levels are of use, or on pages, so
that no picture is larger than a renderer takes.

A look-up in level k reads what lies up to 2^(k + 1) - 1 texels beyond a chart; where charts are twice as far apart, all of that
repeats the chart's own border. Pages are of one size, each below the one before it in one atlas; nothing of a page bleeds into
the next.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import GAP, Charts
from app.atlas.packing import MAX_SIDE, outlines, pack
from app.atlas.points import bilinear
from app.atlas.seams import Seams
from app.atlas.texels import texel_surfaces, uniform_leaves
from app.lightmap.gutter import GUTTER, fill_gutter
from app.scene.model import F32, F64, Scene

BESIDE = 1.5  # texels: all eight neighbours
HALVES = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]])  # of a rectangle
FILLED = 0.85  # share of a page that charts fill, at first

I64 = NDArray[np.int64]


@dataclasses.dataclass(frozen=True, eq=False)
class Arranged:
    """Light (H, W, c) f32 [W/m²] over the atlas of the charts, with filled gutters, and how many pages it is cut into, from the
    first row on."""

    charts: Charts
    light: F32
    pages: int = 1

    @property
    def page_size(self) -> tuple[int, int]:
        """Width and height of a page [texels of the image]."""
        height, width = self.light.shape[:2]
        return width, height // self.pages


def arranged(scene: Scene, charts: Charts, light: F32, padding: int, max_size: int | None) -> Arranged:
    """The charts ``padding`` texels apart, on pages that are at most so wide and high, if that is said, and light (H, W, c) of
    the same atlas as it lies there, with filled gutters. A page is larger where a single chart is."""
    most = max_size or MAX_SIDE
    if padding <= GAP and max(light.shape[:2]) <= most:
        return Arranged(charts, light)
    finer = light.shape[0] // charts.size[1]
    apart, moved, pages = _apart(charts, finer, padding, most)
    leaves = uniform_leaves(apart)
    surfaces = texel_surfaces(scene, apart, leaves)
    tile, row, column = np.nonzero(surfaces.face >= 0)
    y, x = leaves.y[tile] * apart.tile + row, leaves.x[tile] * apart.tile + column
    owner, known = np.zeros((*apart.size[::-1], 1), np.float32), np.zeros(apart.size[::-1], bool)
    owner[y, x, 0] = 1 + apart.face_chart[surfaces.face[tile, row, column]]
    known[y, x] = True
    owner = _filled(owner, known, pages, BESIDE)  # what lies there has light of the other side of a seam
    y, x = np.nonzero(owner[..., 0])
    image = np.zeros((*known.shape, light.shape[2]), np.float32)
    chart = owner[y, x, 0].astype(np.int64) - 1
    image[y, x] = bilinear(light, np.column_stack([x, y]) + 0.5 - moved[chart])
    return Arranged(apart, _filled(image, owner[..., 0] > 0, pages, max(padding, GUTTER)), pages)


def _filled(values: F32, known: NDArray[np.bool_], pages: int, reach: float) -> F32:
    """With filled gutters, each page by itself."""
    parts = zip(np.split(values, pages), np.split(known, pages), strict=True)
    return np.concatenate([fill_gutter(part, there, reach) for part, there in parts])


def _apart(charts: Charts, finer: int, padding: int, most: int) -> tuple[Charts, I64, int]:
    """The charts in texels of the image, packed as rectangles; by how far each was moved (c, 2); how many pages there are."""
    _, chart = np.unique(charts.face_chart, return_inverse=True)
    count, uv = int(chart.max(initial=-1)) + 1, charts.face_uv * finer
    low, high = np.full((count, 2), np.inf), np.zeros((count, 2))
    np.minimum.at(low, chart, np.floor(uv.min(axis=1)))
    np.maximum.at(high, chart, np.ceil(uv.max(axis=1)))
    origin, page, (width, height) = _on_pages(high - low + padding - GAP, charts.tile, most)
    pages = int(page.max(initial=0)) + 1
    origin[:, 1] += page * height
    moved = origin - low.astype(np.int64)
    return (
        dataclasses.replace(
            charts,
            size=(width, pages * height),
            face_uv=uv + moved[chart][:, None],
            face_chart=chart.astype(np.int32),
            seams=Seams(),
            hidden_uv=np.empty((0, 3, 2)),
            hidden_face=np.empty(0, np.int64),
        ),
        moved,
        pages,
    )


def _on_pages(size: F64, tile: int, most: int) -> tuple[I64, I64, tuple[int, int]]:
    """Where each rectangle (c, 2) lies on its page (c, 2), the number of that (c,), and the size of all pages.

    Rectangles are dealt out to as few pages as may do, the largest first, each to the page that is emptiest; one page more where
    they do not fit.
    """
    limit = max(most // tile, int(np.ceil(size.max(initial=0.0) / tile))) * tile
    area = (size + GAP).prod(axis=1)
    pages = max(int(np.ceil(area.sum() / (FILLED * limit**2))), 1)
    while True:
        page = _dealt_out(area, pages)
        packed = [_packed(size[page == number], tile) for number in range(pages)]
        width, height = np.max([whole for _, whole in packed], axis=0)
        if max(width, height) <= limit or pages >= len(size):
            break
        pages = min(pages + max(pages // 16, 1), len(size))
    origin = np.zeros((len(size), 2), np.int64)
    for number, (places, _) in enumerate(packed):
        origin[page == number] = places
    return origin, page, (int(width), int(height))


def _dealt_out(area: F64, pages: int) -> I64:
    """The number of the page (c,) of each rectangle."""
    page, used = np.zeros(len(area), np.int64), np.zeros(pages)
    for number in np.argsort(-area, kind="stable"):
        page[number] = used.argmin()
        used[page[number]] += area[number]
    return page


def _packed(size: F64, tile: int) -> tuple[I64, tuple[int, int]]:
    count = len(size)
    triangles = (size[:, None, None] * HALVES).reshape(-1, 3, 2)
    origin, whole = pack(outlines(triangles, np.repeat(np.arange(count), 2), count), tile)
    return origin.astype(np.int64), whole
