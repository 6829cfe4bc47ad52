"""An error curve, error against time and work: one solve, looked at again and again while its clock stands.

The looks lie evenly in the logarithm of the time, from the first work to convergence or the time limit. All that was issued is
waited for before the clock is stopped, so that a solve pays for its own work and for nothing else.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from app.bench.solves import warm_up
from app.bench.stopwatch import Stopwatch
from app.gpu import Gpu
from app.lightmap.at_points import irradiance_of
from app.lightmap.lightmap import Lightmap
from app.reference.irradiance import ReferenceIrradiance
from app.reference.metrics import point_errors
from app.scene.model import F64
from app.solvers import Family, Progress, Solver
from app.solvers.run import solve_until
from app.util.tables import Row

GROWTH = 2.0**0.25  # of the time from one look to the next
LEVELS = (0.05, 0.04, 0.02, 0.01)  # relative RMS that a solve should come down to


def solve_curve(
    gpu: Gpu,
    solver: Solver[Any],
    batch: int,
    limit: float,
    look: Callable[[], Row],
    *,
    clock: Callable[[], float] = time.perf_counter,
    cpu_clock: Callable[[], float] = time.process_time,
) -> list[Row]:
    """Solve from the start until converged, or for so many seconds: what ``look`` returned, after seconds and CPU seconds of all
    cores."""
    warm_up(gpu, solver, batch)
    rows: list[Row] = []
    watch, cpu, due = Stopwatch(clock), Stopwatch(cpu_clock), 0.0

    def over(now: Progress) -> bool:
        nonlocal due
        if solver.issued == 0 and watch.seconds < limit:
            return False
        end = now.converged or watch.seconds >= limit
        if end or watch.seconds >= due:
            gpu.ctx.finish()
            with watch.held(), cpu.held():
                rows.append({"seconds": watch.seconds, "cpu_seconds": cpu.seconds} | look())
            due = GROWTH * watch.seconds
        return end

    solve_until(solver, batch, over)
    return rows


def look_at(lightmap: Lightmap, solver: Solver[Any], family: Family, reference: ReferenceIrradiance) -> Row:
    """Where a solve stands, by the names of its family, and how far from the reference. Waits for the GPU."""
    now = solver.settle()
    row: Row = {family.unit: now.done, family.threshold: now.remaining, "texels": lightmap.texel_count}
    E = irradiance_of(lightmap, reference.points)
    return row | errors(E, reference) | {"imbalance": solver.energy().imbalance_share}


def errors(E: F64, reference: ReferenceIrradiance) -> Row:
    """Of irradiance (n, 3) at the reference's points: over lit ones, and what leaks to dark ones as a share of the mean at lit
    ones; nothing where it is not finite."""
    lit, right = reference.lit, reference.E
    if not np.isfinite(E).all():
        return {}
    leak = float((E - right)[~lit].mean() / right[lit].mean()) if (~lit).any() else 0.0
    return point_errors(E[lit], right[lit])._asdict() | {"leak": leak}


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
