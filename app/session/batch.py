"""A scene solved from a program, without a session: what benches and hard cases drive."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from typing import Any

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.lightmap.options import LightmapOptions
from app.options import Options
from app.scene.model import Scene
from app.session.loading import load
from app.solvers import DEFAULT_SOLVER, SOLVERS, Progress, Solver
from app.util.parts import run_to_end


@contextlib.contextmanager
def opened(
    gpu: Gpu,
    source: str | Scene,
    atlas: AtlasOptions,
    light: LightmapOptions,
    options: Options,
    solver: str = DEFAULT_SOLVER,
) -> Iterator[tuple[Lightmap, Solver[Any]]]:
    """A scene's lightmap and the solver of it, before any work; both are released afterwards. Raises UserError."""
    loaded = load(source, atlas, light)
    lightmap = Lightmap(gpu, loaded.pool, light)
    try:
        made = SOLVERS[solver].make(gpu, lightmap, options)
        try:
            yield lightmap, made
        finally:
            made.release()
    finally:
        lightmap.release()


def solve_until(solver: Solver[Any], batch: int, over: Callable[[Progress], bool]) -> None:
    """Work, ``batch`` at a time, until ``over`` says so of the progress that has arrived; it is asked after each piece of work,
    and before the first."""
    while not over(solver.poll()):
        run_to_end(solver.work(batch))
