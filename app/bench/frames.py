"""``glowtree bench frames``: milliseconds per frame of the viewer at 1280×720 while it shoots, by part.

The scene opens as in the window, beside the first frames. A frame is the window's own, drawn into a texture instead: hear and
shoot, build the interface and draw it with the view, wait until the GPU has done it. Every part ends with glFinish, so that its
time is its own. CPU time is that of the whole process over all cores: on a software rasteriser it includes the GPU's work, and
other programs on the machine do not change it.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

from app.atlas.options import AtlasOptions
from app.console import Console
from app.errors import UserError
from app.gpu import Framebuffer, Gpu, gpu_context
from app.headless_ui import UiFrame
from app.options import from_flags
from app.session import Session
from app.solvers import ShootingOptions
from app.ui.app import Ui
from app.ui.state import Pace

SIZE = (1280, 720)
PARTS = ("hear", "shoot", "draw")
WARM_UP = 30  # frames: shaders are compiled, the panels stand
FRAMES = 300


def bench_frames(flags: argparse.Namespace) -> int:
    """Print what a frame costs."""
    console = Console(quiet=flags.json)
    with gpu_context() as gpu, console.progress("frames") as tell:
        session = Session(
            gpu, shooting=from_flags(ShootingOptions, flags), atlas=from_flags(AtlasOptions, flags), expose_on_open=True
        )
        tell(f"opening {flags.scene}", 0.0)
        session.open(flags.scene)
        times = _measure(gpu, session)
        values = {"scene": session.name, "renderer": gpu.limits.renderer, "texels": session.stats.texels, **times}
        session.release()
    console.result(values, _table(values))
    return 0


def _measure(gpu: Gpu, session: Session) -> dict[str, Any]:
    texture = gpu.texture(SIZE, 4, "f1")
    target = gpu.target(texture)
    ui = Ui()
    frame = UiFrame(gpu, ui, whole=False)
    gpu.timers.enabled = True  # as in the window
    try:
        opening = []
        while session.loading is not None:
            opening.append(_frame(gpu, session, frame, target))
        if not session.opened:
            raise UserError(session.message or f"{session.name}: did not open")
        opening += [_frame(gpu, session, frame, target) for _ in range(WARM_UP)]
        rows = np.array([_frame(gpu, session, frame, target) for _ in range(FRAMES)])
    finally:
        gpu.timers.enabled = False
        frame.release()
        ui.release()
        gpu.release_all(target, texture)
    parts, cpu = rows[:, :-1], rows[:, -1]
    whole, first = parts.sum(1), np.array(opening)[1:, :-1].sum(1)  # the very first builds the interface
    return {
        "frames": FRAMES,
        "median_ms": float(np.median(whole)),
        "p99_ms": float(np.percentile(whole, 99)),
        "worst_ms": float(whole.max()),
        "cpu_ms": float(cpu.mean()),
        "opening_worst_ms": float(first.max()),
        "parts_ms": dict(zip(PARTS, np.median(parts, 0).tolist(), strict=True)),
    }


def _frame(gpu: Gpu, session: Session, frame: UiFrame, target: Framebuffer) -> list[float]:
    """One frame: milliseconds by part, and of CPU time. A scene that has converged begins again."""
    if session.opened and session.converged:
        session.restart()
    cpu, clock = time.process_time(), [time.perf_counter()]
    session.poll()
    clock.append(time.perf_counter())
    session.advance(budget_ms=Pace().frame_budget, shots=1)
    gpu.ctx.finish()
    clock.append(time.perf_counter())
    frame.draw(session, target, size=SIZE)
    gpu.ctx.finish()
    clock.append(time.perf_counter())
    return [*(np.diff(clock) * 1e3), (time.process_time() - cpu) * 1e3]


def _table(values: dict[str, Any]) -> str:
    total = sum(values["parts_ms"].values())
    lines = [
        f"{values['renderer']}: {values['scene']}, {values['texels']:,} texels, {SIZE[0]}×{SIZE[1]}, 1 shot per frame",
        "",
        f"median {values['median_ms']:.1f} ms ({1e3 / values['median_ms']:.0f} frames/s), "
        f"99 % below {values['p99_ms']:.1f} ms, worst {values['worst_ms']:.1f} ms, CPU {values['cpu_ms']:.1f} ms",
        f"while the scene opens, and the first {WARM_UP} frames after: worst {values['opening_worst_ms']:.1f} ms",
        *(f"  {name:<6}{ms:7.2f} ms  {ms / total:4.0%}" for name, ms in values["parts_ms"].items()),
    ]
    return "\n".join(lines)
