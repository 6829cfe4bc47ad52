"""Shadow rays are allocated to tiles: more where they bring down the noise most.

The deviation σ of a texel falls with the passes n of its tile by ∂σ/∂n = -D/(2nσ), with D the share of direct light in σ².
Passes are best allocated where Σ D/(nσ) A is the same in all tiles for their cost, the texels T [Veach97, 2.4]. Where direct
light is all of the noise, σ ~ 1/√n, and so

    n' = n (g / (n T λ))^(2/3),    g = Σ (D / σ) A over the texels of a tile,    λ such that all passes are given out

All sets of lamps get as many passes: D is that of all of them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.scene.model import F64

LEAST = 0.25  # of the mean of all tiles: a few shadow rays that agree may all have missed a gap
MOST = 4  # times as many passes as the mean, at once
HALVINGS = 60  # of the interval that λ lies in: to the last bit


def allocate(passes: NDArray[np.int64], gain: F64, texels: NDArray[np.int64], each: int) -> NDArray[np.int64]:
    """(n,) passes more of each tile, ``each`` on average over all texels. passes (n,), gain g (n,), texels T (n,) of each."""
    cost = float(texels.sum())
    if cost == 0 or not np.isfinite(gain).all() or not (passes[texels > 0] > 0).all() or gain.max() <= 0:
        return np.where(texels > 0, each, 0)
    marginal = gain / np.maximum(passes * texels, 1)
    floor = LEAST * (float((passes * texels).sum()) / cost + each)

    def more(scale: float) -> F64:
        wanted = np.maximum(passes * (marginal * scale) ** (2 / 3), floor)
        return np.where(texels > 0, np.clip(wanted - passes, 0.0, MOST * each), 0.0)

    some = marginal > 0
    enough = ((passes + MOST * each)[some] / passes[some]) ** 1.5 / marginal[some]
    low, high = 0.0, float(enough.max())  # there all tiles that gain get the most
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if float(more(middle) @ texels) < each * cost else (low, middle)
    return np.rint(more(high)).astype(np.int64)
