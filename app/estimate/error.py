"""Estimate of a solution's own error, without any reference: irradiance gathered from it at random points, against what it holds.

    d = H'(x) - H(x)                 at random points x; H' gathered, see hemicube_irradiance.py, H read from the lightmap
    e = d + s d̄ / (1 - s)            what B lacks comes from everywhere: of light that leaves surfaces a share s comes back
    relative RMS = √(mean e₁e₂) / mean (H + e)

e₁ and e₂ are of two hemicubes above each point, turned at random: what their samples get wrong cancels in the mean, and is taken
from the median, as their difference tells it. What d̄ has by chance is taken from the mean square. Few bright
points may hold most of the error, so more points lie where light is: means are weighted with 1 / p, p ∝ 1 + H / H̄.
"""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.atlas.points import random_points
from app.estimate.hemicube_irradiance import HemicubeIrradiance
from app.gpu import Gpu, ReadBack
from app.lightmap.lightmap import Lightmap
from app.lightmap.probe import Probe
from app.reference.metrics import DARK
from app.scene.model import F64

CANDIDATES, POINTS, SEED = 4096, 256, 7  # points that are even in area, and those of them that are looked from
FEWEST = 64  # points that are enough where they take long
TURNS = 2  # hemicubes above each point
LEAST_LOST = 1e-3  # of light that leaves surfaces: below, what comes back would be noise many times over


class ErrorEstimate(NamedTuple):
    """Estimated error of the irradiance, over so many lit points: relative RMS, bias of the mean, median of local errors [-]."""

    rms: float
    bias: float
    median: float
    points: int

    def within(self, *, median: float | None = None, rms: float | None = None) -> bool:
        """Whether it is as little as asked for, where it is."""
        return (median is None or self.median <= median) and (rms is None or self.rms <= rms)


class ErrorEstimator:
    """Estimates the error of one lightmap, from so many hemicubes (``maps``) at a time. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, maps: int) -> None:
        points = random_points(lightmap.scene, CANDIDATES, SEED)
        self._position, self._normal = points.positions_normals(lightmap.scene)
        self._probe, self._hemicubes = Probe(gpu, lightmap, points), HemicubeIrradiance(gpu, lightmap, maps)

    def parts(self, returned: F64, seconds: float) -> Generator[float, None, ErrorEstimate | None]:
        """Look, some points in each part; yields the share done. returned: s, RGB. After so many seconds FEWEST points are
        enough. None where no point is lit."""
        random, end, read = np.random.default_rng(SEED), time.perf_counter() + seconds, []
        solution = self._probe.irradiance(self._probe.look())
        if not np.isfinite(solution).all():
            return None
        chosen, weights = choose_points(solution, random)
        turn = random.uniform(0, 2 * np.pi, TURNS * POINTS)
        position, normal = (np.repeat(x[chosen], TURNS, axis=0) for x in (self._position, self._normal))
        pending: ReadBack | None = None
        try:
            for first in range(0, TURNS * POINTS, self._hemicubes.maps):
                if first >= TURNS * FEWEST and time.perf_counter() > end:
                    break
                now = slice(first, first + self._hemicubes.maps)
                looked = self._hemicubes.look(position[now], normal[now], turn[now])
                if pending is not None:  # one part late: nothing waits
                    read.append(self._hemicubes.irradiance(pending))
                pending = looked
                yield min(now.stop / (TURNS * POINTS), 1.0)
            if pending is not None:
                read.append(self._hemicubes.irradiance(pending))
                pending = None
        finally:
            if pending is not None:
                pending.take()
        gathered = np.concatenate(read)
        count = min(len(gathered) // TURNS, POINTS)
        gathered = gathered[: TURNS * count].reshape(count, TURNS, 3)
        return estimate_error(solution[chosen][:count], gathered, weights[:count], returned)

    def release(self) -> None:
        self._probe.release()
        self._hemicubes.release()


def choose_points(solution: F64, random: np.random.Generator) -> tuple[NDArray[np.int64], F64]:
    """POINTS of the candidates by their irradiance (n, 3), and the weight of each (POINTS,) in means."""
    light = np.maximum(solution.mean(1), 0.0)
    wanted = 1.0 + light / max(float(light.mean()), 1e-300)
    chosen = random.choice(len(solution), POINTS, p=wanted / wanted.sum())
    return chosen, np.asarray(1.0 / wanted[chosen])


def estimate_error(solution: F64, gathered: F64, weights: F64, returned: F64) -> ErrorEstimate | None:
    """Of irradiance (n, 3) that was gathered at the same points as (n, 2, 3), with weights (n,). None where no point is lit, or
    the light is not finite."""
    if not np.isfinite(solution).all() or not np.isfinite(gathered).all():
        return None
    share = weights / weights.sum()
    lacking = gathered - solution[:, None]
    lacks = share @ lacking.mean(1)
    again = 1 / np.maximum(1 - returned, LEAST_LOST)  # how often what lacks on average is missing in all
    right = gathered.mean(1) + (again - 1) * lacks  # what the solution should be
    if not share @ right.mean(1) > 0:
        return None
    lit = right.mean(1) > DARK * (share @ right.mean(1))
    share, lacking, right = share[lit] / share[lit].sum(), lacking[lit], right[lit]
    first, second = (lacking + (again - 1) * lacks).transpose(1, 0, 2)
    chance = (share**2) @ (lacking.mean(1) - share @ lacking.mean(1)) ** 2  # variance of the mean, which is in both
    square = float(share @ (first * second).mean(1) - ((again**2 - 1) * chance).mean())
    mean = float(share @ right.mean(1))
    length = np.linalg.norm(right, axis=1)
    local, noise = (
        _median(np.linalg.norm(of, axis=1) / length, share) for of in ((first + second) / 2, (first - second) / 2)
    )
    return ErrorEstimate(
        rms=float(np.sqrt(max(square, 0.0))) / mean,
        bias=-float(share @ (first + second).mean(1)) / 2 / mean,
        median=float(np.sqrt(max(local**2 - noise**2, 0.0))),
        points=int(lit.sum()),
    )


def _median(values: F64, share: F64) -> float:
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(share[order]), 0.5)])
