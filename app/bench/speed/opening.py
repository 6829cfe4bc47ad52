"""``glowtree bench open``: seconds from a scene's file to its first light, by stage, new and again from the caches.

Caches are in a folder of their own, empty at first. CPU seconds, of this process and of those that it starts, tell what a busy
machine does not change.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from pathlib import Path
from typing import Any

from app.atlas.options import AtlasOptions
from app.commands.flags import sky_of
from app.gpu import Gpu, gpu_context
from app.lightmap.options import LightmapOptions
from app.options import from_flags
from app.render.flat import FlatMesh, FlatScene
from app.render.frame import FrameRenderer
from app.render.options import DisplayOptions
from app.scene.options import FileOptions
from app.session.loading import load
from app.session.opening import Opening
from app.session.view import SIZE
from app.solvers import SOLVERS
from app.util import cache
from app.util.background import Progress
from app.util.console import Console
from app.util.parts import run_to_end
from app.util.tables import Column, markdown_table

RUNS = ("new", "again")
STAGES = {
    "read": "read",
    "flat": "flat picture",
    "unfold": "unfold",
    "texels": "cut into texels",
    "rays": "rays",
    "upload": "upload",
    "light": "first light",
}
COLUMNS = (
    Column("triangles", "triangles", ","),
    Column("texels", "texels", ","),
    Column("run", "run"),
    *(Column(f"{stage}_s", head, ".2f") for stage, head in STAGES.items()),
    Column("seconds", "all, s", ".2f"),
    Column("cpu_seconds", "CPU s", ".2f"),
)
NOTE = (
    "Seconds of each stage until one piece of work of the solver is done, on the GPU too; flat picture: of the scene as it is "
    "read, before it has light; new: with empty caches, again: with what that left there."
)


def bench_open(flags: argparse.Namespace) -> int:
    """Print the table. Raises UserError (SceneError)."""
    console = Console(quiet=flags.json)
    rows = []
    with (
        gpu_context() as gpu,
        console.progress("opening") as tell,
        tempfile.TemporaryDirectory(prefix="glowtree-") as folder,
        cache.elsewhere(Path(folder)),
    ):
        for k, run in enumerate(RUNS):

            def report(stage: str, share: float, k: int = k, run: str = run) -> None:
                tell(f"{run}: {stage}", (k + share) / len(RUNS))

            rows.append({"run": run, **_opened(gpu, flags, report)})
    values = {"renderer": gpu.limits.renderer, "scene": flags.scene, "solver": flags.solver, "runs": rows}
    console.result(values, "\n\n".join([values["renderer"], NOTE, markdown_table(COLUMNS, rows)]))
    return 0


def _opened(gpu: Gpu, flags: argparse.Namespace, report: Progress) -> dict[str, Any]:
    """Seconds of each stage."""
    start, cpu, family = time.perf_counter(), _cpu_seconds(), SOLVERS[flags.solver]
    renderer = FrameRenderer(gpu)

    def draw(flat: FlatScene) -> None:
        texture, mesh = gpu.texture(SIZE, 4, "f1"), FlatMesh(gpu, flat)
        target = gpu.target(texture)
        renderer.render_flat(target, SIZE, mesh, DisplayOptions())
        gpu.ctx.finish()
        mesh.release()
        gpu.release_all(target, texture)

    try:
        loaded = load(
            flags.scene,
            from_flags(AtlasOptions, flags),
            from_flags(LightmapOptions, flags),
            file=from_flags(FileOptions, flags),
            default_light=flags.light,
            sky=sky_of(flags),
            expose=True,
            rays=family.rays,
            progress=report,
            show=draw,
        )
    finally:
        renderer.release()
    seconds = dict(loaded.seconds)
    before = time.perf_counter()
    ready = Opening(gpu).at_once(loaded, flags.solver, {flags.solver: from_flags(family.options, flags)})
    gpu.ctx.finish()
    seconds["upload"] = time.perf_counter() - before
    before = time.perf_counter()
    run_to_end(ready.solver.work(1))
    gpu.ctx.finish()
    seconds["light"] = time.perf_counter() - before
    whole = {"seconds": time.perf_counter() - start, "cpu_seconds": _cpu_seconds() - cpu}
    ready.solver.release()
    ready.lightmap.release()
    return {
        "triangles": len(loaded.pool.scene.triangles),
        "texels": loaded.pool.texel_count,
        **{f"{stage}_s": value for stage, value in seconds.items()},
        **whole,
    }


def _cpu_seconds() -> float:
    """Of this process and of all that it waited for."""
    return float(sum(os.times()[:4]))
