"""Where each lit side of each triangle lies in the virtual atlas.

The *virtual atlas* is one rectangle of W×H texels at the root level, cut into tiles of t×t, t = ``Charts.tile``. A *face* is one
side of a triangle that light can reach (a double-sided triangle has two faces). Faces that unfold together are a *chart*: one
axis-aligned chart for each flat rectangle, xatlas for the rest. Charts keep ``GAP`` empty texels between them, so that
bilinear look-ups and filled gutters never bleed, and start at multiples of ``ALIGN`` texels, so that the 4×4 patches that
shoot are whole. A *facet* is a connected flat piece of one chart: nothing in it can hide anything else in it.
"""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from app.atlas.seams import Seams, SeamTexels, seam_texels

TILES = (8, 16, 32)  # texels along the edge of a leaf tile
DEFAULT_TILE = 16  # [Coombe03, 4.1]
GAP = 2  # empty texels between charts: one gutter texel for each neighbour
ALIGN = 4  # charts start at multiples of the default shooting patch (mip level 2)


@dataclass(frozen=True, eq=False)
class Charts:
    """The unfolding of a scene's lit sides into the virtual atlas.

    size: (W, H) texels, multiples of tile.
    tile: texels along the edge of a leaf tile, one of TILES.
    density: texels per metre that was aimed at.
    face_triangle (f,) i32: the scene's triangle; face_back (f,) bool: whether it is its back side.
    face_uv (f, 3, 2) f64: atlas position [texels] of the triangle's corners, in the triangle's own corner order.
    face_chart (f,) i32 in [0, chart_count); face_facet (f,) i32 in [0, facet_count).
    chart_rects (c, 4) i32: x, y, width, height of each chart in whole texels.
    dark_faces: number of sides left out: nothing in the scene lies in front of them, or they are the inside of a closed body,
    see enclosed.py.
    method: how the charts were made, e.g. ``12 rectangles, 932 xatlas charts``. lasting: whether another try would come to the
    same: not where xatlas failed, which may have been for want of time.
    seams: edges across which a surface goes on in another chart.
    hidden_uv (k, 3, 2) f64, hidden_face (k,): pieces of faces that something lies on, no part of any texel, see contacts.py.
    """

    size: tuple[int, int]
    tile: int
    density: float
    face_triangle: NDArray[np.int32]
    face_back: NDArray[np.bool_]
    face_uv: NDArray[np.float64]
    face_chart: NDArray[np.int32]
    face_facet: NDArray[np.int32]
    chart_rects: NDArray[np.int32]
    dark_faces: int
    method: str
    warnings: tuple[str, ...] = ()
    lasting: bool = True
    seams: Seams = field(default_factory=Seams)
    hidden_uv: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3, 2)))
    hidden_face: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))

    def with_faces(self, faces: NDArray[np.int64]) -> Charts:
        """Only those faces, in that order."""
        now = np.full(len(self.face_triangle), -1, np.int64)
        now[faces] = np.arange(len(faces))
        hidden = now[self.hidden_face]
        return dataclasses.replace(
            self,
            face_triangle=self.face_triangle[faces],
            face_back=self.face_back[faces],
            face_uv=self.face_uv[faces],
            face_chart=self.face_chart[faces],
            face_facet=self.face_facet[faces],
            hidden_uv=self.hidden_uv[hidden >= 0],
            hidden_face=hidden[hidden >= 0],
        )

    @functools.cached_property
    def narrow(self) -> float:
        """The width [m] below which charts have a tenth of the area, as whole texels."""
        size = self.chart_rects[:, 2:] / self.density
        width, area = size.min(axis=1), size.prod(axis=1)
        order = np.argsort(width)
        return float(width[order[np.searchsorted(np.cumsum(area[order]), area.sum() / 10)]])

    @functools.cached_property
    def seam_texels(self) -> SeamTexels:
        """Those of level 0 near seams."""
        return seam_texels(self.seams)

    @property
    def chart_count(self) -> int:
        return len(self.chart_rects)

    @property
    def facet_count(self) -> int:
        return int(self.face_facet.max(initial=-1)) + 1


def corner_places(charts: Charts, count: int) -> NDArray[np.float64]:
    """(count, 3, 4): of each corner of the scene's triangles the place in the virtual atlas [texels of level 0] on the front
    (u, v) and on the back (u, v), -1 where a side has no texels."""
    places = np.full((count, 3, 4), -1.0)
    for back in (False, True):
        mine = charts.face_back == back
        places[charts.face_triangle[mine], :, 2 * back : 2 * back + 2] = charts.face_uv[mine]
    return places
