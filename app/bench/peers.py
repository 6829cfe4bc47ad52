"""Other programs on the same plot: same scene, same points, same machine."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from app.bench.curve import Stopwatch, errors
from app.bench.methods import names_of
from app.bench.report import Row
from app.bench.truth import PATHS_SEED, Truth, no_tracer
from app.bench.view import View
from app.scene.model import Scene

PEER_SEED = 7919 * PATHS_SEED  # no path of the reference again


@dataclass(frozen=True)
class Peer:
    """missing: why it cannot run here, None if it can; curve: its samples within about so many seconds."""

    missing: Callable[[], str | None]
    curve: Callable[[Scene, Truth, View | None, float], list[Row]]


def _mitsuba(scene: Scene, truth: Truth, view: View | None, limit: float) -> list[Row]:
    """A path tracer with 1, 2, 4 … paths from each point, those before them included; its picture has as many paths altogether.
    Raises UserError."""
    from app.bench import tracer

    traced = tracer.Tracer(scene)
    place = truth.points.positions_normals(scene)
    rows: list[Row] = []
    total, paths, batch, nth = np.zeros_like(truth.E), 0, 1, 0
    traced.irradiance(*place, batch, PEER_SEED)  # kernels are compiled when they first run
    watch, cpu = Stopwatch(), Stopwatch(time.process_time)
    while not rows or 2 * watch.seconds <= limit:
        nth += 1
        total += batch * traced.irradiance(*place, batch, PEER_SEED + nth)
        paths += batch
        with watch.held(), cpu.held():
            rows.append({"seconds": watch.seconds, "cpu_seconds": cpu.seconds, "paths": paths})
            rows[-1] |= errors(total / paths, truth)
        batch = paths
    if view is not None:
        each = max(round(paths * len(truth.points) / len(view.points)), 1)
        rows[-1]["flip"] = view.flip(traced.irradiance(*view.points.positions_normals(scene), each, PEER_SEED))
    return rows


PEERS = {"mitsuba": Peer(no_tracer, _mitsuba)}


def peer_names(text: str) -> tuple[str, ...]:
    """Of ``--peers``: names with commas between them, or all."""
    return names_of(text, PEERS)
