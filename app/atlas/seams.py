"""Seams are edges across which a smooth surface goes on in another chart, and where the light of both charts is made one.

Texels of two charts have other centres, and each chart ends with its own: bilinear look-ups from both sides of an edge differ by
as much as light does over half a texel or more. So light fades from one chart to the other within a texel of their edge: at a
distance s beyond it (before it: s < 0) [texels],

    H(s) = (1 - w) H_own + w H_other,   w = (1 + s)/2, held in [0, 1],

for every texel near the edge, also those around the chart that cover nothing. Where something stands on an edge, light may jump:
texels that are nearest to such an edge keep the light of their chart, also where a seam goes on from its end.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from app.atlas.rectangles import CREASE
from app.atlas.sides import distinct_rows
from app.atlas.triangle_cuts import JUMPS
from app.scene.model import F64, I32, Scene
from app.util.ahead import ahead

REACH = 1.5  # texels: bilinear look-ups inside of a chart reach √2 beyond its edge
SAME_NORMAL = 1e-3  # that shared vertex normals may differ by
BLOCK = 1 << 12  # edges whose texels are looked for at a time

I64 = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Seams:
    """Each edge from both sides, all from one side first. own (k, 2, 2): its ends in the atlas [texels of level 0], with its
    chart to the left; other (k, 2, 2): the same ends in the other chart, which lies to the right there. jumps (j, 2, 2): edges
    of charts that end where a seam begins, since something stands there."""

    own: F64 = field(default_factory=lambda: np.empty((0, 2, 2)))
    other: F64 = field(default_factory=lambda: np.empty((0, 2, 2)))
    jumps: F64 = field(default_factory=lambda: np.empty((0, 2, 2)))

    def __len__(self) -> int:
        return len(self.own)

    def points(self, step: float) -> tuple[F64, F64, F64]:
        """Places along the edges, from both sides, about so many texels apart: in their own chart (n, 2) and in the other (n, 2);
        the way into their own chart (n, 2), one texel long."""
        own, other = self.own, self.other
        way = own[:, 1] - own[:, 0]
        length = np.linalg.norm(way, axis=1)
        count = np.maximum(np.ceil(length / step), 1).astype(np.int64)
        edge = np.repeat(np.arange(len(own)), count)
        nth = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
        t = ((nth + 0.5) / count[edge])[:, None]
        inward = np.stack([-way[:, 1], way[:, 0]], axis=1) / length[:, None]
        return own[edge, 0] + t * way[edge], other[edge, 0] + t * (other[edge, 1] - other[edge, 0]), inward[edge]


@dataclass(frozen=True, eq=False)
class SeamTexels:
    """Texels of one level near seams: x, y of each (n, 2); other (n, 2): where its surface goes on [texels of level 0];
    weight (n,) of what is there."""

    texel: I64
    other: F64
    weight: F64


def find_seams(
    scene: Scene,
    corners: I32,
    triangle: I32,
    back: NDArray[np.bool_],
    uv: F64,
    chart: I32,
    ends: NDArray[np.uint8] | None,
    rim: NDArray[np.bool_],
) -> Seams:
    """corners (m, 3): welded, of all triangles; triangle, back, uv, chart of the faces; ends as in a Cut, rim as in a Layout."""
    face, k = np.nonzero(rim[triangle])
    # a back is seen the other way round
    first, second = np.where(back[face], (k + 1) % 3, k), np.where(back[face], k, (k + 1) % 3)
    start, end = corners[triangle[face], first], corners[triangle[face], second]
    kind = distinct_rows(np.minimum(start, end), np.maximum(start, end), back[face])
    order = np.argsort(kind[1], kind="stable")
    two = np.flatnonzero(kind[2] == 2)
    at = (np.cumsum(kind[2]) - kind[2])[two]
    a, b = order[at], order[at + 1]
    meets = (start[a] == end[b]) & (start[a] != end[a]) & (chart[face[a]] != chart[face[b]])
    a, b = a[meets], b[meets]
    ta, tb = triangle[face[a]], triangle[face[b]]
    jumps = np.zeros(len(face), bool) if ends is None else ends[triangle[face], k] == JUMPS
    smooth = (scene.material_ids[ta] == scene.material_ids[tb]) & ~(jumps[a] | jumps[b])
    if scene.normals is None:
        normals = scene.normals_areas[0]
        smooth &= np.einsum("ek,ek->e", normals[ta], normals[tb]) > np.cos(CREASE)
    else:
        for mine, theirs in ((first, second), (second, first)):
            apart = scene.normals[ta, mine[a]] - scene.normals[tb, theirs[b]]
            smooth &= np.abs(apart).max(1) < SAME_NORMAL
    a, b = a[smooth], b[smooth]
    one = np.stack([uv[face[a], first[a]], uv[face[a], second[a]]], axis=1)
    other = np.stack([uv[face[b], second[b]], uv[face[b], first[b]]], axis=1)
    at_seams = np.zeros(int(corners.max()) + 1, bool)
    at_seams[start[a]] = at_seams[end[a]] = True
    jump = np.flatnonzero(jumps & (at_seams[start] | at_seams[end]))
    return Seams(
        np.concatenate([one, other[:, ::-1]]),
        np.concatenate([other, one[:, ::-1]]),
        np.stack([uv[face[jump], first[jump]], uv[face[jump], second[jump]]], axis=1),
    )


def seam_texels(seams: Seams, finer: int = 1) -> SeamTexels:
    """The texels near seams where there are so many of them along an edge of a texel of level 0; each by its nearest seam, if
    no edge at which light may jump is nearer."""
    own, other = np.concatenate([seams.own, seams.jumps]) * finer, np.concatenate([seams.other, seams.jumps]) * finer
    way, there = own[:, 1] - own[:, 0], other[:, 1] - other[:, 0]
    length = np.linalg.norm(way, axis=1)
    blocks = [slice(first, first + BLOCK) for first in range(0, len(own), BLOCK)]
    parts = ahead(lambda some: _near(own[some], way[some], length[some], some.start), blocks or [slice(0, 0)])
    seam, x, y, t, far, beyond = (np.concatenate(column) for column in zip(*parts, strict=True))
    texels, texel, _ = distinct_rows(y, x)
    nearest = np.full(len(texels), np.inf)
    np.minimum.at(nearest, texel, far)
    at = np.flatnonzero(far == nearest[texel])[::-1]
    one = np.empty(len(texels), np.int64)
    one[texel[at]] = at  # the first of several as near
    seam, x, y, t, beyond = seam[one], x[one], y[one], t[one, None], beyond[one]
    outward = (
        np.stack([there[:, 1], -there[:, 0]], axis=1) / length[:, None]
    )  # as long as a texel of the own chart is there
    goes_on = other[seam, 0] + t * there[seam] + np.maximum(beyond, 0.0)[:, None] * outward[seam]
    weight = np.clip((1 + beyond) / 2, 0.0, 1.0)
    some = (weight > 0) & (seam < len(seams))
    return SeamTexels(np.stack([x, y], axis=1)[some], goes_on[some] / finer, weight[some])


def _near(own: F64, way: F64, length: F64, first: int) -> tuple[I64, I64, I64, F64, F64, F64]:
    """Texels within REACH of edges own (k, 2, 2), numbered from ``first``, along ``way`` (k, 2) and so long: (n,) edge, x, y of
    each; the nearest place on it, a share of the way; how far that is, and how far beyond the edge, less than 0 before it."""
    low = np.floor(own.min(1) - REACH).astype(np.int64)
    across, up = (np.ceil(own.max(1) + REACH).astype(np.int64) - low).T
    count = across * up
    edge = np.repeat(np.arange(len(own)), count)
    nth = np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
    row = nth // across[edge]
    x, y = low[edge, 0] + nth - row * across[edge], low[edge, 1] + row
    way_x, way_y, size = way[edge, 0], way[edge, 1], length[edge]
    dx, dy = x + 0.5 - own[edge, 0, 0], y + 0.5 - own[edge, 0, 1]
    t = np.clip((dx * way_x + dy * way_y) / size**2, 0.0, 1.0)
    squared = (dx - t * way_x) ** 2 + (dy - t * way_y) ** 2
    near = np.flatnonzero(squared <= REACH**2)
    right = (dx * way_y - dy * way_x)[near] > 0
    far = np.sqrt(squared[near])
    return edge[near] + first, x[near], y[near], t[near], far, np.where(right, far, -far)
