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
    finer = values.shape[0] // charts.size[1]
    near = charts.seam_texels if finer == 1 else seam_texels(charts.seams, finer)
    if not len(near.weight):
        return filled
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
    own, other, inward, grey = _beside(image, charts)
    if not len(own):
        return Jumps(0, (0.0, 0.0), (0.0, 0.0))
    pairs = [
        (bilinear(grey, a), bilinear(grey, b)) for a, b in ((own, other), (own + 0.5 * inward, own + 1.5 * inward))
    ]
    bright = np.min(pairs, axis=(0, 1)) > DARK * np.mean(pairs[0])
    across, within = (_quantiles(_over_mean(a, b)[bright]) for a, b in pairs)
    return Jumps(int(bright.sum()), across, within)


def places_and_jumps(image: F32, charts: Charts) -> tuple[F64, F64]:
    """Places in texels along seams, on both sides (n, 2) [texels of level 0], and how far a finished image (H, W, 3) jumps there,
    over its mean, or where that is dark over what counts as dark (n,)."""
    own, other, inward, grey = _beside(image, charts)
    pair = bilinear(grey, own), bilinear(grey, other)
    least = DARK * float(np.mean(pair)) if len(own) else 0.0
    finer = image.shape[0] // charts.size[1]
    return (own + 0.5 * inward) / finer, _over_mean(*pair, least=least)[:, 0]


def _beside(image: F32, charts: Charts) -> tuple[F64, F64, F64, F64]:
    """Places along seams from both sides, own and other, and the way into the own chart (n, 2) each, [texels of the image]; the
    image in grey (H, W, 1)."""
    finer = image.shape[0] // charts.size[1]
    own, other, inward = charts.seams.points(STEP / finer)
    return own * finer, other * finer, inward, image.mean(2, dtype=np.float64, keepdims=True)


def _over_mean(a: F64, b: F64, least: float = np.finfo(float).tiny) -> F64:
    return np.asarray(np.abs(a - b) / np.maximum((np.abs(a) + np.abs(b)) / 2, max(least, np.finfo(float).tiny)))


def _quantiles(jump: F64) -> tuple[float, float]:
    return (float(np.median(jump)), float(np.quantile(jump, 0.9))) if len(jump) else (0.0, 0.0)
