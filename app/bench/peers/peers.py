"""The table of other programs, and the error curve of each: same scene, same points, same machine."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from app.atlas.options import AtlasOptions
from app.bench.accuracy.error_curve import errors
from app.bench.accuracy.reference_picture import ReferencePicture
from app.bench.choices import chosen_names
from app.bench.peers.blender import bake, no_cycles
from app.bench.stopwatch import Stopwatch
from app.lightmap.at_points import light_at
from app.reference.irradiance import PATHS_SEED, ReferenceIrradiance, no_tracer
from app.scene.model import Scene
from app.session.loading import read_and_unfold
from app.util.tables import Row

PEER_SEED = 7919 * PATHS_SEED  # no path of the reference again


@dataclass(frozen=True)
class Task:
    """What a peer is to do, within about so many seconds. atlas: for one that bakes."""

    scene: Scene
    reference: ReferenceIrradiance
    picture: ReferencePicture | None
    atlas: AtlasOptions
    seconds: float


@dataclass(frozen=True)
class Peer:
    """missing: why it cannot run here, None if it can; curve: its samples."""

    missing: Callable[[], str | None]
    curve: Callable[[Task], list[Row]]


def _mitsuba(task: Task) -> list[Row]:
    """A path tracer with 1, 2, 4 … paths from each point, those before them included; its picture has as many paths altogether.
    Raises UserError."""
    from app.reference import path_tracer as tracer

    scene, reference, picture = task.scene, task.reference, task.picture
    traced = tracer.Tracer(scene)
    place = reference.points.positions_normals(scene)
    rows: list[Row] = []
    total, paths, batch, nth = np.zeros_like(reference.E), 0, 1, 0
    traced.irradiance(*place, batch, PEER_SEED)  # kernels are compiled when they first run
    watch, cpu = Stopwatch(), Stopwatch(time.process_time)
    while not rows or 2 * watch.seconds <= task.seconds:
        nth += 1
        total += batch * traced.irradiance(*place, batch, PEER_SEED + nth)
        paths += batch
        with watch.held(), cpu.held():
            rows.append({"seconds": watch.seconds, "cpu_seconds": cpu.seconds, "paths": paths})
            rows[-1] |= errors(total / paths, reference)
        batch = paths
    if picture is not None:
        each = max(round(paths * len(reference.points) / len(picture.points)), 1)
        rows[-1]["flip"] = picture.flip(traced.irradiance(*picture.points.positions_normals(scene), each, PEER_SEED))
    return rows


def _cycles(task: Task, *, denoise: bool) -> list[Row]:
    """Lightmaps with 1, 2, 4 … samples of each texel, each baked by itself; building the scene is not timed. Raises UserError."""
    reference, picture = task.reference, task.picture
    _, _, charts, _ = read_and_unfold(task.scene, task.atlas, False, lambda text, share: None)
    sides = np.diff(charts.face_uv, axis=1)
    texels = round(np.abs(np.linalg.det(sides)).sum() / 2)
    rows: list[Row] = []
    while not rows or 2 * rows[-1]["seconds"] <= task.seconds:
        baked = bake(task.scene, charts, 1 << len(rows), denoise=denoise)
        row: Row = {"seconds": baked.seconds, "cpu_seconds": baked.cpu_seconds, "paths": 1 << len(rows)}
        row |= {"texels": texels, "made": baked.made}
        rows.append(row | errors(light_at(baked.irradiance, charts, reference.points), reference))
    if picture is not None:
        rows[-1]["flip"] = picture.flip(light_at(baked.irradiance, charts, picture.points))
    return rows


PEERS = {
    "mitsuba": Peer(no_tracer, _mitsuba),
    "cycles": Peer(no_cycles, partial(_cycles, denoise=False)),
    "cycles-oidn": Peer(partial(no_cycles, "pyoidn"), partial(_cycles, denoise=True)),
}


def peer_names(text: str) -> tuple[str, ...]:
    """Of ``--peers``: names with commas between them, or all."""
    return chosen_names(text, PEERS)
