"""How far a solution is from the light that it stands for, with no reference: what its points receive of it, gathered.

    d = H'(x) - H(x)                 at random points x; H' gathered, see gather.py, H read from the lightmap
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
from app.estimate.gather import Gather
from app.gpu import Gpu, ReadBack
from app.lightmap.lightmap import Lightmap
from app.lightmap.probe import Probe
from app.reference.metrics import DARK
from app.scene.model import F64

CANDIDATES, POINTS, SEED = 4096, 256, 7  # points that are even in area, and those of them that are looked from
FEWEST = 64  # points that are enough where they take long
TURNS = 2  # hemicubes above each point
LEAST_LOST = 1e-3  # of light that leaves surfaces: below, what comes back would be noise many times over


class ExpectedError(NamedTuple):
    """Of the irradiance, over so many lit points: relative RMS, bias of the mean, median of local errors [-]."""

    rms: float
    bias: float
    median: float
    points: int


class Expectation:
    """Of one lightmap, so many ``maps`` at a time. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, maps: int) -> None:
        points = random_points(lightmap.scene, CANDIDATES, SEED)
        self._position, self._normal = points.positions_normals(lightmap.scene)
        self._probe, self._gather = Probe(gpu, lightmap, points), Gather(gpu, lightmap, maps)

    def parts(self, returned: F64, seconds: float) -> Generator[float, None, ExpectedError | None]:
        """Look, some points in each part; yields the share done. returned: s, RGB. After so many seconds FEWEST points are
        enough. None where no point is lit."""
        random, end, read = np.random.default_rng(SEED), time.perf_counter() + seconds, []
        solution = self._probe.irradiance(self._probe.look())
        if not np.isfinite(solution).all():
            return None
        chosen, weights = choose(solution, random)
        turn = random.uniform(0, 2 * np.pi, TURNS * POINTS)
        position, normal = (np.repeat(x[chosen], TURNS, axis=0) for x in (self._position, self._normal))
        pending: ReadBack | None = None
        try:
            for first in range(0, TURNS * POINTS, self._gather.maps):
                if first >= TURNS * FEWEST and time.perf_counter() > end:
                    break
                now = slice(first, first + self._gather.maps)
                looked = self._gather.look(position[now], normal[now], turn[now])
                if pending is not None:  # one part late: nothing waits
                    read.append(self._gather.irradiance(pending))
                pending = looked
                yield min(now.stop / (TURNS * POINTS), 1.0)
            if pending is not None:
                read.append(self._gather.irradiance(pending))
                pending = None
        finally:
            if pending is not None:
                pending.take()
        gathered = np.concatenate(read)
        count = min(len(gathered) // TURNS, POINTS)
        gathered = gathered[: TURNS * count].reshape(count, TURNS, 3)
        return expected_error(solution[chosen][:count], gathered, weights[:count], returned)

    def release(self) -> None:
        self._probe.release()
        self._gather.release()


def choose(solution: F64, random: np.random.Generator) -> tuple[NDArray[np.int64], F64]:
    """POINTS of the candidates by their irradiance (n, 3), and the weight of each (POINTS,) in means."""
    light = np.maximum(solution.mean(1), 0.0)
    wanted = 1.0 + light / max(float(light.mean()), 1e-300)
    chosen = random.choice(len(solution), POINTS, p=wanted / wanted.sum())
    return chosen, np.asarray(1.0 / wanted[chosen])


def expected_error(solution: F64, gathered: F64, weights: F64, returned: F64) -> ExpectedError | None:
    """Of irradiance (n, 3) that was gathered at the same points as (n, 2, 3), with weights (n,). None where no point is lit, or
    the light is not finite."""
    if not np.isfinite(solution).all() or not np.isfinite(gathered).all():
        return None
    share = weights / weights.sum()
    lacking = gathered - solution[:, None]
    lacks = share @ lacking.mean(1)
    again = 1 / np.maximum(1 - returned, LEAST_LOST)  # how often what lacks on average is missing in all
    truth = gathered.mean(1) + (again - 1) * lacks
    if not share @ truth.mean(1) > 0:
        return None
    lit = truth.mean(1) > DARK * (share @ truth.mean(1))
    share, lacking, truth = share[lit] / share[lit].sum(), lacking[lit], truth[lit]
    first, second = (lacking + (again - 1) * lacks).transpose(1, 0, 2)
    chance = (share**2) @ (lacking.mean(1) - share @ lacking.mean(1)) ** 2  # variance of the mean, which is in both
    square = float(share @ (first * second).mean(1) - ((again**2 - 1) * chance).mean())
    mean = float(share @ truth.mean(1))
    length = np.linalg.norm(truth, axis=1)
    local, noise = (
        _median(np.linalg.norm(of, axis=1) / length, share) for of in ((first + second) / 2, (first - second) / 2)
    )
    return ExpectedError(
        rms=float(np.sqrt(max(square, 0.0))) / mean,
        bias=-float(share @ (first + second).mean(1)) / 2 / mean,
        median=float(np.sqrt(max(local**2 - noise**2, 0.0))),
        points=int(lit.sum()),
    )


def _median(values: F64, share: F64) -> float:
    order = np.argsort(values)
    return float(values[order][np.searchsorted(np.cumsum(share[order]), 0.5)])
