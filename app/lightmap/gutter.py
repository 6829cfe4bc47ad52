"""Filled gutters: texels around a chart repeat its nearest texel, so that bilinear look-ups at its border are right.

A bilinear look-up inside a covered texel reads its eight neighbours. Charts lie ``atlas.charts.GAP`` = 2 texels apart,
so such a neighbour is at most √2 from its own chart and at least 2 from any other: the nearest texel is its own.

That is at full size. A texel of mip level 1 is the mean of four, and its neighbours reach three texels beyond a chart: there
charts bleed into each other, and more so in every further level, so that a lightmap is for use without mip-maps. How much,
tests/unit/test_bleeding.py measures.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.scene.model import F32

GUTTER = 4  # texels; one is needed at full size, others lessen what mip levels take from where there is nothing


def fill_gutter(values: F32, covered: NDArray[np.bool_], reach: float = GUTTER) -> F32:
    """(H, W, c): uncovered texels within ``reach`` of a covered one get the nearest one's value, those beyond 0."""
    filled: F32 = np.where(covered[:, :, None], values, np.float32(0.0))
    height, width = covered.shape
    y, x = np.nonzero(~covered)
    for dy, dx in _offsets(reach):
        source_y, source_x = y + dy, x + dx
        found = (source_y >= 0) & (source_y < height) & (source_x >= 0) & (source_x < width)
        found[found] = covered[source_y[found], source_x[found]]
        filled[y[found], x[found]] = values[source_y[found], source_x[found]]
        y, x = y[~found], x[~found]
    return filled


def _offsets(reach: float) -> list[tuple[int, int]]:
    """All steps (dy, dx) no longer than that, nearest first."""
    way = range(-int(reach), int(reach) + 1)
    steps = [(dy, dx) for dy in way for dx in way if 0 < dy * dy + dx * dx <= reach * reach]
    return sorted(steps, key=lambda step: step[0] ** 2 + step[1] ** 2)
