"""A scene opened for a program, without a session: what benches and hard cases solve, see solvers/run.py."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.lightmap.options import LightmapOptions
from app.options import Options
from app.scene.model import Scene
from app.session.loading import load
from app.solvers import DEFAULT_SOLVER, SOLVERS, Solver


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
