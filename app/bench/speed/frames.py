"""``glowtree bench frames``: milliseconds per frame of the viewer at 1280×720 while it solves, by part.

The scene opens as in the window, beside the first frames. A frame is the window's own, drawn into a texture instead: poll and
solve, build the interface and draw it with the view, wait until the GPU has done it. Every part ends with glFinish, so that its
time is its own. CPU time is that of the whole process over all cores: on a software rasteriser it includes the GPU's work, and
other programs on the machine do not change it. Then work per second is counted at both paces of the window, and without one.

With ``--drag`` a hand moves the sliders of the quadtrees meanwhile, a little in each frame: see slider_drag.py. With ``--walk``
the eye walks along a path, a thirtieth of a second of it in each frame, once what is around its beginning is lit; then its lamps
are dimmed and made as they were.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from app.bench.machine import peak_memory
from app.bench.speed.slider_drag import DRAGGED, drag
from app.commands.steps import session_options
from app.errors import UserError
from app.gpu import Gpu, gpu_context
from app.lightmap.options import LightmapOptions
from app.options import from_flags
from app.render.camera import CameraView
from app.render.camera_path import load_path
from app.scene.model import Material
from app.scene.options import FileOptions
from app.session.pacing import Turns
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View
from app.solvers.local.solver import Local
from app.ui.app import Ui
from app.util.console import Console
from app.viewer.ui_frame import UiFrame

SIZE = (1280, 720)
PARTS = ("poll", "solve", "draw")
WARM_UP = 30  # frames: shaders are compiled, the panels stand
FRAMES = 300
RATE_SECONDS = 4.0  # of a solve from nothing, over which work is counted
FRAMES_PER_SECOND = 30.0  # of a walk
SLOW = 1e3 / FRAMES_PER_SECOND  # ms
STANDING = 60.0  # s at most, in which what is around the beginning of a walk is lit
SWITCHED = 3  # times that lamps are dimmed and made as they were
GROWTH = 1.0  # s from opening on, in which a tree has grown visibly


def bench_frames(flags: argparse.Namespace) -> int:
    """Print what a frame costs. Raises UserError."""
    if flags.drag and not flags.adaptive:
        raise UserError("--drag: only --adaptive has the sliders that it moves")
    console = Console(quiet=flags.json)
    with gpu_context() as gpu, console.progress("frames") as tell:
        session = Session(gpu, **session_options(flags), expose_on_open=True)
        view = View(session)
        tell(f"opening {flags.scene}", 0.0)
        session.open(flags.scene, from_flags(FileOptions, flags))
        viewer = _Viewer(gpu, view)
        try:
            if flags.walk:
                times = _measure_walk(viewer, flags.walk, tell)
            else:
                times = _measure_drags(viewer, tell) if flags.drag else _measure(viewer)
        finally:
            viewer.release()
        values = {"scene": session.name, "renderer": gpu.limits.renderer, "texels": session.stats.texels, **times}
        view.release()
        session.release()
    table = _drag_table if flags.drag else _walk_table if flags.walk else _table
    console.result(values, table(values))
    return 0


class _Viewer:
    """The viewer's frames, drawn into a texture."""

    def __init__(self, gpu: Gpu, view: View) -> None:
        self._gpu, self._view, self.session = gpu, view, view.session
        self._texture = gpu.texture(SIZE, 4, "f1")
        self._target = gpu.target(self._texture)
        self._ui = Ui()
        self._frame = UiFrame(gpu, self._ui, whole=False)
        self._turns, self._seconds = Turns(), 0.0
        gpu.timers.enabled = True  # as in the window

    def open(self) -> list[list[float]]:
        """The frames beside which the scene is opened. Raises UserError."""
        rows = []
        while self.session.loading is not None:
            rows.append(self.frame())
        if not self.session.opened:
            raise UserError(self.session.message or f"{self.session.name}: did not open")
        return rows

    def frame(
        self, light: LightmapOptions | None = None, camera: CameraView | None = None, *, fast: bool = False
    ) -> list[float]:
        """One frame: milliseconds by part, and of CPU time. light: the options that a hand at a slider asks for; camera: where it
        leads the eye. fast: of that pace, else one step is watched."""
        session, held = self.session, light is not None or camera is not None
        if camera is not None:
            self._view.camera = camera
        cpu, clock = time.process_time(), [time.perf_counter()]
        session.poll(interactive=held)
        self._view.tell_observer()
        clock.append(time.perf_counter())
        solve, look = self._turns.next(self._seconds) if session.solving and (held or not fast) else (True, True)
        if solve:
            session.advance(fast=fast, interactive=held)
        self._gpu.ctx.finish()
        clock.append(time.perf_counter())
        if light is not None and light != session.light:
            session.set_light(light)
        self._frame.draw(self._view, self._target, size=SIZE, look=look)
        self._gpu.ctx.finish()
        session.run.drawn()
        clock.append(time.perf_counter())
        self._seconds = clock[-1] - clock[0]
        return [*(np.diff(clock) * 1e3), (time.process_time() - cpu) * 1e3]

    def release(self) -> None:
        self._gpu.timers.enabled = False
        self._frame.release()
        self._ui.release()
        self._gpu.release_all(self._target, self._texture)


def _measure(viewer: _Viewer) -> dict[str, Any]:
    opening = viewer.open() + [viewer.frame() for _ in range(WARM_UP)]
    rows = []
    for _ in range(FRAMES):
        if viewer.session.run.converged:
            viewer.session.restart()
        rows.append(viewer.frame())
    first = np.array(opening)[1:, :-1].sum(1)  # the very first builds the interface
    rates = {pace: _rate(viewer, fast=pace == "fast") for pace in ("watch", "fast")}
    rates["no window"] = _rate_without_window(viewer.session)
    return _summary(rows) | {"opening_worst_ms": float(first.max()), "unit": viewer.session.family.unit, "rates": rates}


def _rate(viewer: _Viewer, *, fast: bool) -> dict[str, float]:
    """Work and frames per second of the first seconds of a solve."""
    session = viewer.session
    session.restart()
    frames, start = 0, time.perf_counter()
    while (seconds := time.perf_counter() - start) < RATE_SECONDS and not session.run.converged:
        viewer.frame(fast=fast)
        frames += 1
    return {"work_per_second": session.solver.issued / seconds, "frames_per_second": frames / seconds}


def _rate_without_window(session: Session) -> dict[str, float]:
    """Work per second of the same seconds, where nothing is drawn."""
    session.restart()
    session.solve(Stop(seconds=RATE_SECONDS))
    return {"work_per_second": session.solver.issued / session.run.seconds}


def _measure_drags(viewer: _Viewer, tell: Callable[[str, float], None]) -> dict[str, Any]:
    """How the tree grows, and frames while a hand is at each slider."""
    viewer.open()
    session, start = viewer.session, time.perf_counter()
    opened = session.lightmap.tiles
    while time.perf_counter() - start < GROWTH:
        viewer.frame()
    grown = session.lightmap.tiles
    for _ in range(WARM_UP):
        viewer.frame()
    drags = {}
    for nth, name in enumerate(DRAGGED):
        tell(f"dragging {name}", nth / len(DRAGGED))
        rows = [viewer.frame(light) for light in drag(name, session.light)]
        drags[name] = _summary(rows) | {"leaves": session.lightmap.tiles}
    return {"leaves_opened": opened, "leaves_after_1_s": grown, "drags": drags}


def _measure_walk(viewer: _Viewer, source: str, tell: Callable[[str, float], None]) -> dict[str, Any]:
    """Frames along a path, once the light at its beginning stands."""
    cameras = load_path(source, frames_per_second=FRAMES_PER_SECOND).cameras
    start = time.perf_counter()
    viewer.open()
    session, opened = viewer.session, time.perf_counter()
    viewer.frame(camera=cameras[0])
    whole = 0.0
    while not session.run.converged and (stood := time.perf_counter() - opened) < STANDING:
        tell("lighting the beginning", stood / STANDING)
        viewer.frame()
        if not whole and not _to_come(session):
            whole = time.perf_counter() - opened
    rows, to_come = [], []
    for nth, camera in enumerate(cameras):
        tell("walking", nth / len(cameras))
        rows.append(viewer.frame(camera=camera))
        to_come.append(_to_come(session))
    switched = [_switched(viewer, materials) for _ in range(SWITCHED) for materials in _dimmed_and_back(session)]
    return _summary(rows) | {
        "nodes_to_come": float(np.mean(to_come)),
        "open_s": opened - start,
        "set_whole_s": whole or None,
        "first_switch_ms": switched[0],
        "switch_ms": float(np.median(switched[1:])),
        "peak_mib": peak_memory(),
    }


def _to_come(session: Session) -> int:
    """Nodes of a local set that are not in it yet."""
    local = session.solver
    return local.to_come if isinstance(local, Local) else 0


def _dimmed_and_back(session: Session) -> Iterator[tuple[Material, ...]]:
    """All lamps with half of their light, and as they were."""
    plain = session.materials
    yield tuple(replace(m, emission=(m.emission[0] / 2, m.emission[1] / 2, m.emission[2] / 2)) for m in plain)
    yield plain


def _switched(viewer: _Viewer, materials: tuple[Material, ...]) -> float:
    """Milliseconds from an edit of the lamps until a frame with their light is drawn, after one piece of work."""
    start = time.perf_counter()
    viewer.session.set_materials(materials)
    viewer.session.run.work(1)
    viewer.frame()
    return (time.perf_counter() - start) * 1e3


def _summary(rows: list[list[float]]) -> dict[str, Any]:
    """Of frames as ``_Viewer.frame`` returns them."""
    parts, cpu = np.array(rows)[:, :-1], np.array(rows)[:, -1]
    whole = parts.sum(1)
    return {
        "frames": len(rows),
        "median_ms": float(np.median(whole)),
        "p99_ms": float(np.percentile(whole, 99)),
        "worst_ms": float(whole.max()),
        "frames_per_second": float(1e3 / whole.mean()),
        "slow_frames": int((whole > SLOW).sum()),
        "cpu_ms": float(cpu.mean()),
        "parts_ms": dict(zip(PARTS, np.median(parts, 0).tolist(), strict=True)),
    }


def _title(values: dict[str, Any]) -> str:
    size = f"{SIZE[0]}×{SIZE[1]}"
    return f"{values['renderer']}: {values['scene']}, {values['texels']:,} texels, {size}, 1 shot per frame"


def _table(values: dict[str, Any]) -> str:
    lines = [
        _title(values),
        "",
        f"median {values['median_ms']:.1f} ms ({1e3 / values['median_ms']:.0f} frames/s), "
        f"99 % below {values['p99_ms']:.1f} ms, worst {values['worst_ms']:.1f} ms, CPU {values['cpu_ms']:.1f} ms",
        f"while the scene opens, and the first {WARM_UP} frames after: worst {values['opening_worst_ms']:.1f} ms",
        *_parts(values["parts_ms"]),
        "",
        *(
            f"  {name:<10}{rate['work_per_second']:8.1f} {values['unit']}/s"
            + (f"{rate['frames_per_second']:8.1f} frames/s" if "frames_per_second" in rate else "")
            for name, rate in values["rates"].items()
        ),
    ]
    return "\n".join(lines)


def _walk_table(values: dict[str, Any]) -> str:
    lines = [
        _title(values),
        "",
        f"a walk of {values['frames']} frames: median {values['median_ms']:.1f} ms, 99 % below {values['p99_ms']:.1f} ms, "
        f"worst {values['worst_ms']:.1f} ms, {values['frames_per_second']:.1f} frames/s, CPU {values['cpu_ms']:.1f} ms",
        f"{values['slow_frames']} frames above {SLOW:.0f} ms; nodes of a local set still to come: {values['nodes_to_come']:.0f}",
        f"opened in {values['open_s']:.1f} s"
        + ("" if values["set_whole_s"] is None else f", all of the set there {values['set_whole_s']:.1f} s later")
        + ("" if values["peak_mib"] is None else f", {values['peak_mib']:,.0f} MiB at most"),
        f"lamps dimmed, until it is seen: {values['first_switch_ms']:.0f} ms the first time, {values['switch_ms']:.0f} ms then",
        *_parts(values["parts_ms"]),
    ]
    return "\n".join(lines)


def _drag_table(values: dict[str, Any]) -> str:
    lines = [
        _title(values),
        f"{values['leaves_opened']:,} leaves when opened, {values['leaves_after_1_s']:,} after {GROWTH:g} s",
    ]
    for name, row in values["drags"].items():
        lines += [
            "",
            f"dragging {name}, {row['frames']} frames: median {row['median_ms']:.1f} ms, 99 % below {row['p99_ms']:.1f} ms, "
            f"worst {row['worst_ms']:.1f} ms, {row['frames_per_second']:.1f} frames/s, CPU {row['cpu_ms']:.1f} ms",
            f"{row['slow_frames']} frames above {SLOW:.0f} ms; {row['leaves']:,} leaves at the end",
            *_parts(row["parts_ms"]),
        ]
    return "\n".join(lines)


def _parts(parts: dict[str, float]) -> list[str]:
    total = sum(parts.values())
    return [f"  {name:<6}{ms:7.2f} ms  {ms / total:4.0%}" for name, ms in parts.items()]
