"""A lightmap whose charts lie farther apart than they were solved with, so that its mip levels are of use.

A look-up in level k reads what lies up to 2^(k + 1) - 1 texels beyond a chart; where charts are twice as far apart, all of that
repeats the chart's own border.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import GAP, Charts
from app.atlas.packing import outlines, pack
from app.atlas.points import bilinear
from app.atlas.seams import Seams
from app.atlas.texels import texel_surfaces, uniform_leaves
from app.lightmap.gutter import fill_gutter
from app.scene.model import F32, Scene

BESIDE = 1.5  # texels: all eight neighbours


def padded(scene: Scene, charts: Charts, light: F32, padding: int) -> tuple[Charts, F32]:
    """The charts ``padding`` texels apart, and light (H, W, c) of the same atlas, with filled gutters, as it lies there."""
    finer = light.shape[0] // charts.size[1]
    apart, moved = _apart(charts, finer, padding)
    leaves = uniform_leaves(apart)
    surfaces = texel_surfaces(scene, apart, leaves)
    tile, row, column = np.nonzero(surfaces.face >= 0)
    y, x = leaves.y[tile] * apart.tile + row, leaves.x[tile] * apart.tile + column
    owner, known = np.zeros((*apart.size[::-1], 1), np.float32), np.zeros(apart.size[::-1], bool)
    owner[y, x, 0] = 1 + apart.face_chart[surfaces.face[tile, row, column]]
    known[y, x] = True
    owner = fill_gutter(owner, known, BESIDE)  # what lies there has light of the other side of a seam
    y, x = np.nonzero(owner[..., 0])
    image = np.zeros((*known.shape, light.shape[2]), np.float32)
    chart = owner[y, x, 0].astype(np.int64) - 1
    image[y, x] = bilinear(light, np.column_stack([x, y]) + 0.5 - moved[chart])
    return apart, fill_gutter(image, owner[..., 0] > 0, padding)


def _apart(charts: Charts, finer: int, padding: int) -> tuple[Charts, NDArray[np.int64]]:
    """The charts in texels of the image, packed as rectangles; by how far each was moved (c, 2)."""
    _, chart = np.unique(charts.face_chart, return_inverse=True)
    count, uv = int(chart.max(initial=-1)) + 1, charts.face_uv * finer
    low, high = np.full((count, 2), np.inf), np.zeros((count, 2))
    np.minimum.at(low, chart, np.floor(uv.min(axis=1)))
    np.maximum.at(high, chart, np.ceil(uv.max(axis=1)))
    size = high - low + padding - GAP
    halves = size[:, None, None] * np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]])
    origin, whole = pack(outlines(halves.reshape(-1, 3, 2), np.repeat(np.arange(count), 2), count), charts.tile)
    moved = origin.astype(np.int64) - low.astype(np.int64)
    return dataclasses.replace(
        charts,
        size=whole,
        face_uv=uv + moved[chart][:, None],
        face_chart=chart.astype(np.int32),
        seams=Seams(),
        hidden_uv=np.empty((0, 3, 2)),
        hidden_face=np.empty(0, np.int64),
    ), moved
