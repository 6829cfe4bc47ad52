"""The flat lightmap as bakes hold it, with filled gutters and, near seams, one light for both charts; how far it still jumps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.points import bilinear
from app.atlas.seams import seam_texels
from app.lightmap.gutter import fill_gutter
from app.scene.model import F32, F64

STEP = 0.5  # texels between places of a seam that are looked at
DARK = 1e-3  # of the mean: darker places are left out, jumps are relative


@dataclass(frozen=True)
class Jumps:
    """How far irradiance jumps, over its mean: median and 90 % quantile of places along all seams. across: from one chart to the
    other; within: from texel to texel of one chart, away from the seam."""

    places: int
    across: tuple[float, float]
    within: tuple[float, float]


def finished(values: F32, covered: NDArray[np.bool_], charts: Charts) -> F32:
    """(H, W, c) of the charts' atlas, where ``covered``: with filled gutters, and faded from chart to chart at seams."""
    filled = fill_gutter(values, covered)
    near = seam_texels(charts.seams, values.shape[0] // charts.size[1])
    if not len(near.weight):
        return filled
    finer = values.shape[0] // charts.size[1]
    seen = np.concatenate([np.where(covered[..., None], values, 0), covered[..., None]], axis=2)
    *sums, weight = bilinear(seen, near.other * finer).T
    there = (weight > 0) & (near.texel >= 0).all(1) & (near.texel < covered.shape[::-1]).all(1)
    x, y = near.texel[there].T
    share = near.weight[there, None]
    out = filled.copy()
    out[y, x] = (1 - share) * filled[y, x] + share * (np.array(sums).T[there] / weight[there, None])
    return out


def jumps(image: F32, charts: Charts) -> Jumps:
    """Of a finished image (H, W, 3)."""
    finer = image.shape[0] // charts.size[1]
    grey = image.mean(2, dtype=np.float64, keepdims=True)
    own, other, inward = charts.seams.points(STEP / finer)
    inside = [_at(grey, (own + k * inward / finer) * finer) for k in (0.5, 1.5)]
    pairs = [(_at(grey, own * finer), _at(grey, other * finer)), (inside[0], inside[1])]
    least = DARK * max(float(np.mean(pairs[0])), np.finfo(float).tiny) if len(own) else 0.0
    bright = np.min(pairs, axis=(0, 1)) > least if len(own) else np.zeros(0, bool)
    across, within = (_quantiles(a[bright], b[bright]) for a, b in pairs)
    return Jumps(int(bright.sum()), across, within)


def _at(grey: F64, place: F64) -> F64:
    return np.asarray(bilinear(grey, place)[:, 0])


def _quantiles(a: F64, b: F64) -> tuple[float, float]:
    if not len(a):
        return 0.0, 0.0
    jump = np.abs(a - b) / ((a + b) / 2)
    return float(np.median(jump)), float(np.quantile(jump, 0.9))
