"""How far a solution is from the light that it stands for, with no reference: what its points receive of it, gathered.

    d = H'(x) - H(x)                 at random points x; H' gathered, see gather.py, H read from the lightmap
    e = d + s d̄ / (1 - s)            what B lacks comes from everywhere: of light that leaves surfaces a share s comes back
    relative RMS = √(mean e₁e₂) / mean (H + e)

e₁ and e₂ are of two hemicubes above each point, turned at random: what their samples get wrong cancels in the mean.
"""

from __future__ import annotations

import time
from collections.abc import Generator
from typing import NamedTuple

import numpy as np

from app.atlas.lightmap import Lightmap
from app.atlas.points import random_points
from app.compare.probe import Probe
from app.gathering.gather import Gather
from app.gpu import Gpu
from app.metrics import bias, lit_points, median_local
from app.scene.model import F64

POINTS, SEED = 256, 7
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
    """Of one lightmap, ``at_once`` points at a time. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, at_once: int) -> None:
        points = random_points(lightmap.scene, POINTS, SEED)
        self._position, self._normal = points.positions_normals(lightmap.scene)
        self._turn = np.random.default_rng(SEED).uniform(0, 2 * np.pi, (POINTS, TURNS))
        self._probe, self._gather = Probe(gpu, lightmap, points), Gather(gpu, lightmap, TURNS * at_once)
        self._at_once = at_once

    def parts(self, returned: F64, seconds: float) -> Generator[float, None, ExpectedError | None]:
        """Look, some points in each part; yields the share done. returned: s, RGB. After so many seconds FEWEST points are
        enough. None where no point is lit."""
        solution, read = self._probe.look(), []
        looked, end = None, time.perf_counter() + seconds
        for first in range(0, POINTS, self._at_once):
            if first >= FEWEST and time.perf_counter() > end:
                break
            now = slice(first, first + self._at_once)
            position, normal = (np.repeat(x[now], TURNS, axis=0) for x in (self._position, self._normal))
            before, looked = looked, self._gather.look(position, normal, self._turn[now].ravel())
            if before is not None:  # one part late: nothing waits
                read.append(self._gather.irradiance(before))
            yield min(first + self._at_once, POINTS) / POINTS
        assert looked is not None
        read.append(self._gather.irradiance(looked))
        gathered = np.concatenate(read).reshape(-1, TURNS, 3)[:POINTS]
        return expected_error(self._probe.irradiance(solution)[: len(gathered)], gathered, returned)

    def release(self) -> None:
        self._probe.release()
        self._gather.release()


def expected_error(solution: F64, gathered: F64, returned: F64) -> ExpectedError | None:
    """Of irradiance (n, 3) that was gathered at the same points as (n, 2, 3). None where no point is lit, or the light is not
    finite."""
    if not np.isfinite(solution).all() or not np.isfinite(gathered).all():
        return None
    lacking = gathered - solution[:, None]
    comes_back = returned / np.maximum(1 - returned, LEAST_LOST) * lacking.mean((0, 1))
    truth = gathered.mean(1) + comes_back
    if not truth.mean() > 0:
        return None
    lit = lit_points(truth)
    first, second = (lacking[lit] + comes_back).transpose(1, 0, 2)
    rms = float(np.sqrt(max((first * second).mean(), 0.0)) / truth[lit].mean())
    return ExpectedError(rms, bias(solution[lit], truth[lit]), median_local(solution[lit], truth[lit]), int(lit.sum()))
