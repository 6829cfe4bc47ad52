"""xatlas in a process of its own: ``python -m app.atlas.unwrap_worker in.npz out.npz``.

xatlas holds the interpreter for the whole call, cannot be cancelled and can hang or crash, so whoever wants charts
starts this and waits with a time limit.

in.npz: positions (n, 3) f32, triangles (m, 3) u32, groups (m,) i32 from 0, scale (g,) f32; charts never mix groups, each to its
scale, in which no chart grows beyond most_area, if that is not 0.
out.npz: chart (m,) i32, -1 where xatlas made none; uv (m, 3, 2) f32 in texels of xatlas's page, not to scale.
"""

from __future__ import annotations

import sys

import numpy as np
import xatlas
from numpy.typing import NDArray

UNASSIGNED = np.uint32(0xFFFFFFFF)
# Side of the page that xatlas packs for itself. It rounds the sizes of charts to its texels, so that a coarse page
# distorts them; a finer one costs packing time and gains nothing.
PAGE = 1024
MAX_COST = 0.7  # at which a chart ends: xatlas's own 2.0 takes up to twice as long, for seams no shorter on average


def unwrap(
    positions: NDArray[np.float32],
    triangles: NDArray[np.uint32],
    groups: NDArray[np.int32],
    scale: NDArray[np.float32],
    most_area: float,
) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
    """Charts of one xatlas run, as in ``out.npz``."""
    corners = positions[triangles].astype(np.float64) * scale[groups][:, None, None]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum() / 2
    atlas = xatlas.Atlas()
    members = np.split(np.argsort(groups, kind="stable"), np.cumsum(np.bincount(groups))[:-1])
    for group, rows in enumerate(members):
        used, local = np.unique(triangles[rows], return_inverse=True)
        atlas.add_mesh(np.ascontiguousarray(positions[used] * scale[group]), local.reshape(-1, 3).astype(np.uint32))
    pack = xatlas.PackOptions()
    pack.texels_per_unit = PAGE / float(np.sqrt(area))
    options = xatlas.ChartOptions()
    options.max_chart_area = most_area
    options.max_cost = MAX_COST
    atlas.generate(options, pack)
    chart = np.full(len(triangles), -1, np.int32)
    uv = np.zeros((len(triangles), 3, 2), np.float32)
    first = 0
    for number, rows in enumerate(members):
        _, indices, uvs = atlas[number]
        page, local_chart = atlas.get_mesh_vertex_assignment(number)
        placed = (page[indices] != UNASSIGNED).all(axis=1) & (local_chart[indices] != UNASSIGNED).all(axis=1)
        chart[rows[placed]] = first + local_chart[indices[placed, 0]].astype(np.int32)
        uv[rows] = uvs[indices] * np.array([atlas.width, atlas.height], np.float32)
        first = int(chart.max()) + 1
    return chart, uv


def main() -> None:
    source, target = sys.argv[1:]
    with np.load(source) as given:
        chart, uv = unwrap(
            given["positions"], given["triangles"], given["groups"], given["scale"], float(given["most_area"])
        )
    np.savez(target, chart=chart, uv=uv)


if __name__ == "__main__":
    main()
