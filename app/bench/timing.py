"""Milliseconds of a solver's shots and of their passes, each to the end of its GPU work."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.solvers import SOLVERS, Solver
from app.solvers.run import solve_until

BATCH = SOLVERS["shooting"].batch  # shots made at once
FEWEST = 5  # batches that a median is taken of
NEVER = 1e-9  # residual that no measurement reaches


def even_residual(lightmap: Lightmap) -> None:
    """Give all texels the same residual: whatever the scene, no shot of a batch is too weak beside its best and left out."""
    width, height = lightmap.size
    lightmap.texture("t_residual").write(np.ones((height, width, 4), np.float32).tobytes())


def ms_per_shot(gpu: Gpu, solver: Solver[Any], batch: int, seconds: float) -> float:
    """Mean wall time of a shot that was made [ms]; a batch leaves out those too weak beside its best."""
    before = solver.poll(wait=True).done
    gpu.ctx.finish()
    start = time.perf_counter()
    solve_until(solver, batch, lambda now: time.perf_counter() >= start + seconds)
    gpu.ctx.finish()
    elapsed = time.perf_counter() - start
    return elapsed * 1e3 / max(solver.poll(wait=True).done - before, 1)


def passes_ms(
    gpu: Gpu, solver: Solver[Any], seconds: float, beside: Mapping[str, Callable[[], None]] | None = None
) -> dict[str, float]:
    """Median milliseconds of each pass per shot of a batch, over the shooters of a solve; ``beside``: more to run and time after
    each batch. Leaves the light wrong."""
    times: dict[str, list[float]] = {label: [] for label in (*solver.passes(BATCH), *(beside or {}))}
    end, batches = time.perf_counter() + seconds, 0
    while time.perf_counter() < end or batches < FEWEST:
        for label, run in (solver.passes(BATCH) | dict(beside or {})).items():
            times[label].append(_ms(gpu, run))
        batches += 1
    return {label: statistics.median(values) / BATCH for label, values in times.items()}


def _ms(gpu: Gpu, run: Callable[[], object]) -> float:
    start = time.perf_counter()
    run()
    gpu.ctx.finish()
    return (time.perf_counter() - start) * 1e3
