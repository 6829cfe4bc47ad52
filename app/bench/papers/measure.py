"""What the tables of the papers are made of: one function for each kind of row, that measures it on this machine.

A shot is one patch of texels, made in batches as the headless solver does; the second paper's iteration is all patches of one
triangle. Loading, unfolding and cutting are not timed.
"""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from app.atlas.options import AtlasOptions
from app.bench.papers.published import CoombeRow, RmsRow, WallnerRow
from app.bench.papers.rooms import room_of
from app.bench.speed.shots import ms_per_shot, passes_ms
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.lightmap.options import LightmapOptions
from app.session.batch import opened, solve_until
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View
from app.solvers import Progress, ShootingOptions, Solver
from app.solvers.shooting.stages import BATCH
from app.util.parts import run_to_end
from app.util.tables import FLIP, Row, missing
from app.viewer.picture import picture
from app.visibility.projections import PROJECTIONS

SOLVE = 10  # times as long as a measurement a solve may take
ROOTS = 2  # levels that a tree may grow: its finest leaves are as fine as the uniform texels beside them
DIRECT = 0.1  # share unshot when a tree is looked at: the light that makes shadows has been shot
LEVELS = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01)  # of residual
NEVER = 1e-9  # residual that no measurement reaches
PICTURE = (640, 480)
PAPER_MAP = 512  # px, a hemicube's edge in [Wallner10]
PASSES = ("see", "receive")
ROOT_TEXELS = 2000 / 32**2  # of the Cornell box for each texel of a texture in [Wallner10, table 2]


@dataclass
class Run:
    """A solve from the start. curve: (shots, residual after them)."""

    shots: int = 0
    seconds: float = 0.0
    residual: float = 1.0
    settled: bool = False
    curve: list[tuple[int, float]] = field(default_factory=list)

    @property
    def seconds_per_shot(self) -> float:
        return self.seconds / max(self.shots, 1)


def warm_up(gpu: Gpu, solver: Solver[Any]) -> None:
    """Draw once with each program, for drivers compile it then: each pass, and a batch with what is not part of every one."""
    for _ in solver.warm_up():
        pass
    solver.reset()
    run_to_end(solver.work(BATCH))
    solver.poll(wait=True)
    solver.reset()
    gpu.ctx.finish()


def shoot(gpu: Gpu, solver: Solver[Any], seconds: float) -> Run:
    """Solve from the start until converged, or for so many seconds."""
    warm_up(gpu, solver)
    run, heard, start = Run(curve=[(0, 1.0)]), 0, time.perf_counter()

    def over(now: Progress) -> bool:
        nonlocal heard
        if now.done > heard:  # its residual is that before its own shots
            run.curve += [(heard, now.remaining)] if heard else []
            heard = now.done
        run.settled = now.converged
        run.seconds = time.perf_counter() - start
        return run.settled or run.seconds >= seconds

    solve_until(solver, BATCH, over)
    gpu.ctx.finish()
    run.seconds = time.perf_counter() - start
    run.shots = solver.poll(wait=True).done
    run.residual = solver.settle().remaining
    if run.shots > run.curve[-1][0]:
        run.curve.append((run.shots, run.residual))
    return run


def light_up(lightmap: Lightmap) -> None:
    """Give all texels the same residual: whatever the scene, no shot of a batch is too weak beside its best and left out."""
    width, height = lightmap.size
    lightmap.texture("t_residual").write(np.ones((height, width, 4), np.float32).tobytes())


def coombe_row(gpu: Gpu, seconds: float, theirs: CoombeRow, texels: int | None = None) -> Row:
    """Uniform and adaptive texels and seconds per shot of one scene. texels: to aim at, if not theirs."""
    aim = texels or theirs.uniform_texels
    options = ShootingOptions(residual=DIRECT)
    with opened(gpu, theirs.scene, AtlasOptions(texels=aim), LightmapOptions(), options) as (lightmap, solver):
        uniform_texels, triangles = lightmap.texel_count, len(lightmap.scene.triangles)
        uniform = shoot(gpu, solver, SOLVE * seconds)
    roots = AtlasOptions(texels=max(aim >> 2 * ROOTS, 1))
    light = LightmapOptions(adaptive=True, depth=ROOTS, budget=max(2 * aim, 65_536))
    with opened(gpu, theirs.scene, roots, light, options) as (lightmap, solver):
        adaptive = shoot(gpu, solver, SOLVE * seconds)
        held = lightmap.texel_count
        solver.set_options(options.replace(residual=NEVER))
        later_ms = ms_per_shot(gpu, solver, BATCH, seconds)
    return {
        "scene": theirs.scene,
        "triangles": triangles,
        "uniform_texels": uniform_texels,
        "adaptive_texels": held,
        "uniform_s": uniform.seconds_per_shot,
        "adaptive_s": adaptive.seconds_per_shot,
        "adaptive_later_s": later_ms * 1e-3,
        "calm": "yes" if adaptive.settled else "no",
        "their_uniform_texels": theirs.uniform_texels,
        "their_adaptive_texels": theirs.adaptive_texels,
        "their_uniform_s": theirs.uniform_s,
        "their_adaptive_s": theirs.adaptive_s,
        "uniform_shots": uniform.shots,
        "adaptive_shots": adaptive.shots,
        "uniform_unshot": uniform.residual,
        "adaptive_unshot": adaptive.residual,
    }


def wallner_row(gpu: Gpu, seconds: float, theirs: WallnerRow) -> Row:
    """Milliseconds per shot by projection in a room of their triangles and texels."""
    options = ShootingOptions(residual=NEVER, resolution=PAPER_MAP)
    row: Row = {
        "scene": theirs.scene,
        "their_texels": theirs.texels,
        "their_cube_ms": theirs.cube_s / theirs.iterations * 1e3,
        "their_sphere_ms": theirs.sphere_s / theirs.iterations * 1e3,
    }
    with opened(gpu, room_of(theirs.triangles), AtlasOptions(texels=theirs.texels), LightmapOptions(), options) as (
        lightmap,
        solver,
    ):
        row |= {"triangles": len(lightmap.scene.triangles), "texels": lightmap.texel_count}
        for name in PROJECTIONS:
            solver.set_options(options.replace(projection=name))
            light_up(lightmap)
            ms_per_shot(gpu, solver, BATCH, seconds / 4)
            row[f"{name}_ms"] = ms_per_shot(gpu, solver, BATCH, seconds)
    return row


def scaling_row(gpu: Gpu, seconds: float, sweep: str, triangles: int, texels: int) -> Row:
    """Milliseconds per shot, the sum of its passes, and of the two large ones. sweep: which of the two numbers is varied."""
    options = ShootingOptions(residual=NEVER)
    with opened(gpu, room_of(triangles), AtlasOptions(texels=texels), LightmapOptions(), options) as (
        lightmap,
        solver,
    ):
        light_up(lightmap)
        passes = passes_ms(gpu, solver, seconds)
        row: Row = {"sweep": sweep, "triangles": len(lightmap.scene.triangles), "texels": lightmap.texel_count}
    return row | {"n": row[sweep], "shot_ms": sum(passes.values())} | {f"{name}_ms": passes[name] for name in PASSES}


def exponents(rows: list[Row]) -> None:
    """Enter in each row of a sweep by which power of n the times have grown since the row before."""
    for before, row in itertools.pairwise(rows):
        if before["sweep"] == row["sweep"]:
            grown = np.log(row["n"] / before["n"])
            for name in ("shot", "receive"):
                row[f"{name}_power"] = float(np.log(row[f"{name}_ms"] / before[f"{name}_ms"]) / grown)


def convergence_row(gpu: Gpu, seconds: float, scene: str, texels: int, projection: str, theirs: int | None) -> Row:
    """Shots until so much is unshot. theirs: shots of the paper's scene."""
    options = ShootingOptions(projection=projection, residual=LEVELS[-1])
    with opened(gpu, scene, AtlasOptions(texels=texels), LightmapOptions(), options) as (lightmap, solver):
        run = shoot(gpu, solver, SOLVE * seconds)
        row: Row = {"scene": scene, "texels": lightmap.texel_count, "imbalance": solver.energy().imbalance_share}
    row |= {"projection": projection, "their_shots": theirs, "shots": run.shots, "seconds": run.seconds}
    row |= {level_key(level): first_below(run.curve, level) for level in LEVELS}
    return row | {"curve": run.curve}


def level_key(level: float) -> str:
    return f"shots_to_{level:g}"


def first_below(curve: list[tuple[int, float]], level: float) -> int | None:
    """Shots of the first point at or below a residual; None if it never came so far."""
    return next((shots for shots, residual in curve if residual <= level), None)


def rms_row(gpu: Gpu, seconds: float, theirs: RmsRow) -> Row:
    """RMS and FLIP of the picture against the hemicube's for both hemispheres, at the same residual; none where time ran out, and
    no FLIP where it is not installed."""
    roots = round(ROOT_TEXELS * theirs.size**2) if theirs.level else round(ROOT_TEXELS * theirs.size**2 / 4)
    adaptive = theirs.subdivision == "adaptive"
    atlas = AtlasOptions(texels=roots if adaptive else roots << 2 * theirs.level)
    light = LightmapOptions(adaptive=adaptive, depth=theirs.level)
    row: Row = {"subdivision": theirs.subdivision, "level": theirs.level, "size": theirs.size}
    pictures, converged = {}, True
    session = Session(gpu, atlas=atlas, light=light)
    view = View(session)
    try:
        for name in PROJECTIONS:
            session.set_options(ShootingOptions(projection=name, residual=LEVELS[-1]))
            session.open_now("cornell-box")
            session.solve(Stop(seconds=SOLVE * seconds))
            if session.run.interrupted:
                raise KeyboardInterrupt
            converged = converged and session.run.converged
            pictures[name] = picture(view, PICTURE).astype(np.float64) / 255
            row |= {f"{name}_s": session.run.seconds, f"{name}_texels": session.lightmap.texel_count}
            row[f"{name}_unshot"] = session.run.progress.remaining
    finally:
        view.release()
        session.release()
    if converged:  # else the pictures differ by their shots
        for name in ("stereographic", "nonlinear"):
            row[f"{name}_rms"] = rms(pictures[name] - pictures["hemicube"])
            if not missing(FLIP):
                from app.bench.accuracy.flip import flip

                row[f"{name}_flip"] = flip(pictures["hemicube"], pictures[name])
    return row | {"their_stereographic": theirs.stereographic, "their_nonlinear": theirs.nonlinear}


def rms(difference: np.ndarray) -> float:
    return float(np.sqrt(np.mean(difference**2)))
