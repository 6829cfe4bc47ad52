"""Error against time and against shots: one solve, looked at again and again while its clock stands.

The looks lie evenly in the logarithm of the time, from the first shots to convergence or the time limit. All that was issued is
waited for before the clock is stopped, so that a solve pays for its own work and for nothing else.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator

import numpy as np

from app.bench.papers.measure import warm_up
from app.gpu import Gpu
from app.lightmap.at_points import irradiance_of
from app.lightmap.lightmap import Lightmap
from app.reference.metrics import bias, median_local, quantile_local, relative_rms
from app.reference.truth import Truth
from app.scene.model import F64
from app.solvers import ShootingOptions, Solver
from app.solvers.shooting.stages import BATCH
from app.util.parts import run_to_end
from app.util.tables import Row

GROWTH = 2.0**0.25  # of the time from one look to the next
LEVELS = (0.05, 0.04, 0.02, 0.01)  # relative RMS that a solve should come down to


class Stopwatch:
    """Seconds since it was made, less those while it was held."""

    def __init__(self, clock: Callable[[], float] = time.perf_counter) -> None:
        self._clock, self._start = clock, clock()
        self._held_at: float | None = None

    @property
    def seconds(self) -> float:
        return (self._clock() if self._held_at is None else self._held_at) - self._start

    @contextlib.contextmanager
    def held(self) -> Iterator[None]:
        """It stands while inside."""
        self._held_at = self._clock()
        try:
            yield
        finally:
            self._start += self._clock() - self._held_at
            self._held_at = None


def solve_curve(
    gpu: Gpu,
    solver: Solver[ShootingOptions],
    limit: float,
    look: Callable[[], Row],
    *,
    clock: Callable[[], float] = time.perf_counter,
    cpu_clock: Callable[[], float] = time.process_time,
) -> list[Row]:
    """Solve from the start until converged and settled, or for so many seconds: what ``look`` returned, and before it seconds and
    CPU seconds of all cores."""
    warm_up(gpu, solver)
    rows: list[Row] = []
    watch, cpu, due, over = Stopwatch(clock), Stopwatch(cpu_clock), 0.0, False
    while not over:
        run_to_end(solver.work(BATCH))
        over = solver.poll().converged or watch.seconds >= limit
        if over or watch.seconds >= due:
            gpu.ctx.finish()
            with watch.held(), cpu.held():
                rows.append({"seconds": watch.seconds, "cpu_seconds": cpu.seconds} | look())
            due = GROWTH * watch.seconds
    return rows


def look_at(lightmap: Lightmap, solver: Solver[ShootingOptions], truth: Truth) -> Row:
    """Where a solve stands and how far from the truth. Waits for the GPU."""
    now = solver.settle()
    row: Row = {"shots": now.done, "residual": now.remaining, "texels": lightmap.texel_count}
    return row | errors(irradiance_of(lightmap, truth.points), truth) | {"imbalance": solver.energy().imbalance_share}


def errors(E: F64, truth: Truth) -> Row:
    """Of irradiance (n, 3) at the truth's points: over lit ones, and what leaks to dark ones as a share of the mean at lit ones;
    nothing where it is not finite."""
    lit = truth.lit
    v, r = E[lit], truth.E[lit]
    if not np.isfinite(E).all():
        return {}
    leak = float((E - truth.E)[~lit].mean() / r.mean()) if (~lit).any() else 0.0
    return {
        "rms": relative_rms(v, r),
        "bias": bias(v, r),
        "median": median_local(v, r),
        "q90": quantile_local(v, r, 0.9),
        "leak": leak,
    }


def first_at(level: float, rows: list[Row], key: str = "seconds") -> float | None:
    """Seconds until the RMS had first come down to a level: between two looks straight in logarithms, at the first look not more
    than known; None where it never did."""
    before: Row | None = None
    for row in rows:
        rms = row.get("rms")
        if rms is not None and rms <= level:
            if before is None or rms <= 0:
                return float(row[key])
            share = np.log(level / before["rms"]) / np.log(rms / before["rms"])
            return float(before[key] * (row[key] / before[key]) ** share)
        before = row if rms is not None else before
    return None
