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
from app.errors import UserError
from app.gpu import Gpu, gpu_context
from app.lightmap.options import LightmapOptions
from app.options import from_flags
from app.scene.options import FileOptions
from app.session.session import Session
from app.session.view import SIZE, View
from app.solvers import SOLVERS
from app.ui.app import Ui
from app.util import cache
from app.util.background import Progress
from app.util.console import Console
from app.util.tables import Column, markdown_table
from app.viewer.ui_frame import UiFrame
from app.viewer.waiting import LOOK_PAUSE, Waiting

RUNS = ("new", "again")
SEEN = {"flat": "flat picture", "coarse": "coarse light", "light": "light"}
STAGES = {"read": "read", "unfold": "unfold", "texels": "cut into texels", "rays": "rays", "upload": "upload"}
COLUMNS = (
    Column("triangles", "triangles", ","),
    Column("texels", "texels", ","),
    Column("run", "run"),
    *(Column(f"{seen}_s", head, ".2f") for seen, head in SEEN.items()),
    *(Column(f"{stage}_s", head, ".2f") for stage, head in STAGES.items()),
    Column("cpu_seconds", "CPU s", ".2f"),
)
NOTE = (
    "Seconds until a window shows the scene flat, with coarse light, where its charts take a while, and with light in the texels "
    "asked for; of these, the seconds of each stage; new: with empty caches, again: with what that left there."
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
    """When what is seen, seconds of each stage. Raises UserError (SceneError)."""
    start, cpu, family = time.perf_counter(), _cpu_seconds(), SOLVERS[flags.solver]
    session = Session(
        gpu,
        solver=flags.solver,
        options=from_flags(family.options, flags),
        atlas=from_flags(AtlasOptions, flags),
        light=from_flags(LightmapOptions, flags),
        default_light=flags.light,
        sky=sky_of(flags),
        expose_on_open=True,
    )
    view, ui = View(session), Ui(live=False)
    frame, texture = UiFrame(gpu, ui, whole=False), gpu.texture(SIZE, 4, "f1")
    target, seen = gpu.target(texture), dict[str, float]()
    try:
        session.open(flags.scene, from_flags(FileOptions, flags))
        waiting = Waiting(session)
        while "light" not in seen:
            if waiting.idle():
                time.sleep(LOOK_PAUSE)
                continue
            what = _step(view, report)
            frame.draw(view, target, size=SIZE)
            session.run.drawn()
            gpu.ctx.finish()
            if what is not None:
                seen.setdefault(what, time.perf_counter() - start)
        return {
            "triangles": len(session.scene.triangles),
            "texels": session.lightmap.texel_count,
            **{f"{what}_s": seconds for what, seconds in (session.load_seconds | seen).items()},
            "cpu_seconds": _cpu_seconds() - cpu,
        }
    finally:
        frame.release()
        ui.release()
        view.release()
        session.release()
        gpu.release_all(target, texture)


def _step(view: View, report: Progress) -> str | None:
    """What a window does before each frame; which of SEEN that will show."""
    session = view.session
    session.poll()
    view.tell_observer()
    session.advance()
    loading = session.loading
    if loading is not None:
        report(loading.stage, loading.fraction)
    elif session.message is not None:
        raise UserError(session.message)
    if session.opened and session.solver.issued > 0:
        return "coarse" if session.coarse else "light"
    return "flat" if loading is not None and loading.flat is not None else None


def _cpu_seconds() -> float:
    """Of this process and of all that it waited for."""
    return float(sum(os.times()[:4]))
