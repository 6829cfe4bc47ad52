"""``glowtree bench edits``: how long an edit of a material takes until its light is there, of a lamp and of a wall.

The scene is solved, then the lamp of most power is made to emit twice as much, or the material that reflects most half as much,
and back, again and again. Timed is, to the end of its GPU work, until the first picture that has all bounces along some of the
rays, where a solver shows such, and until the whole new solution is there: the end of the piece of work that follows an edit,
or, of solvers that distribute light, the moment when as little of it remains as before. CPU time is that of the whole process
over all cores. Beside it stands how far the edited light is from light that is solved afresh: along the same rays, to the end, by
a solver that keeps them; else from nothing, until as little remains.
"""

from __future__ import annotations

import argparse
import statistics
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from app.atlas.options import AtlasOptions
from app.bench.solves import warm_up
from app.errors import UserError
from app.gpu import Gpu, gpu_context
from app.lightmap.lightmap import Lightmap
from app.lightmap.options import LightmapOptions
from app.options import from_flags
from app.reference.metrics import PointErrors, lit_points, point_errors
from app.scene.model import F64, RGB, Material, Scene
from app.session.batch import opened
from app.solvers import SOLVERS, Family, Solver
from app.solvers.gathering.solver import Gathering
from app.solvers.run import solve_until
from app.util.console import Console
from app.util.tables import Column, Row, markdown_table

SAME = 1 + 1e-5  # times as much remains, where it is as before but for rounding
SETTLED = 3  # times that the bounces are solved for, each time to a thousandth of what was missing
OVER = object()  # no part is left
COLUMNS = (
    Column("scene", "scene"),
    Column("texels", "texels", ","),
    Column("before", "before"),
    Column("edit", "edit"),
    Column("first_ms", "ms, first picture", ".0f"),
    Column("first_cpu_ms", "CPU", ".0f"),
    Column("whole_ms", "ms, whole solution", ".0f"),
    Column("whole_cpu_ms", "CPU", ".0f"),
    Column("longest_ms", "longest part", ".1f"),
    Column("work", "work"),
    Column("traced", "rays traced", ","),
    Column("rms", "RMS", ".3%"),
    Column("median", "median", ".3%"),
)
NOTE = (
    "Medians, in milliseconds, of wall time and of CPU time over all cores. Longest part: of all edits, what a frame waits for "
    "at most. Work: of the longest edit. RMS (over the mean) and median of local errors: from light that is solved afresh."
)


@dataclass
class EditTimes:
    """Of one edit. first: until the first picture, if there was one that is not the last; whole: until the new solution; each
    (wall, CPU) [ms]. longest: of its parts [ms]."""

    first: tuple[float, float] | None
    whole: tuple[float, float]
    longest: float


def bench_edits(flags: argparse.Namespace) -> int:
    """Print the table. Raises UserError."""
    console, family = Console(quiet=flags.json), SOLVERS[flags.solver]
    options, light = from_flags(family.options, flags), from_flags(LightmapOptions, flags)
    rows = list[Row]()
    with gpu_context() as gpu, console.progress("edits") as tell:
        for i, name in enumerate(flags.scenes):
            tell(str(name), i / len(flags.scenes))
            with opened(gpu, name, from_flags(AtlasOptions, flags), light, options, flags.solver) as (lightmap, solver):
                if not lightmap.scene.emits:
                    raise UserError(f"{name}: nothing in the scene emits light")
                bench = _Bench(gpu, lightmap, solver, family, flags.work)
                rows += [{"scene": Path(name).stem} | row for row in bench.rows(flags.repeats)]
        values = {
            "renderer": gpu.limits.renderer,
            "solver": flags.solver,
            "options": options.as_dict(),
            "unit": family.unit,
            "edits": rows,
        }
    columns = [c for c in COLUMNS if any(row.get(c.key) is not None for row in rows)]
    title = f"{values['renderer']}: {flags.solver}, work in {family.unit}"
    console.result(values, "\n\n".join([title, NOTE, markdown_table(columns, rows)]))
    return 0


def edits_of(scene: Scene) -> dict[str, tuple[Material, ...]]:
    """The scene's materials after each edit, by what it is of: the lamp of most power twice as bright, and what reflects most of
    all that is no lamp, if there is any, half as much."""
    materials = scene.materials
    area = np.bincount(scene.material_ids, scene.normals_areas[1], len(materials))
    lamp = max(range(len(materials)), key=lambda i: area[i] * sum(materials[i].emission))
    wall = max(range(len(materials)), key=lambda i: (not materials[i].emits, area[i] * sum(materials[i].albedo)))
    brighter = replace(materials[lamp], emission=_times(materials[lamp].emission, 2.0))
    darker = replace(materials[wall], albedo=_times(materials[wall].albedo, 0.5))
    return {
        "emission": (*materials[:lamp], brighter, *materials[lamp + 1 :]),
        "albedo": (*materials[:wall], darker, *materials[wall + 1 :]),
    }


def _times(colour: RGB, factor: float) -> RGB:
    r, g, b = colour
    return factor * r, factor * g, factor * b


class _Bench:
    """Edits of one lightmap's materials. most: work before the edits; None: until converged."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, solver: Solver[Any], family: Family, most: int | None) -> None:
        self._gpu, self._lightmap, self._solver, self._family, self._most = gpu, lightmap, solver, family, most
        warm_up(gpu, solver, family.batch)

    def rows(self, repeats: int) -> list[Row]:
        """What each edit costs, so many times."""
        plain = self._lightmap.scene.materials
        return [self._row(what, plain, edited, repeats) for what, edited in edits_of(self._lightmap.scene).items()]

    def _row(self, what: str, plain: tuple[Material, ...], edited: tuple[Material, ...], repeats: int) -> Row:
        solver = self._solver
        solver.set_materials(plain)
        solver.reset()
        solve_until(solver, self._family.batch, lambda now: self._most is None and now.converged, most=self._most)
        before = solver.settle()
        times, work, traced = list[EditTimes](), 0, 0
        for nth in range(repeats + 1):
            if nth:
                self.edit(plain, before.remaining)
            done, rays = solver.poll(wait=True).done, self._traced
            took = self.edit(edited, before.remaining)
            if nth:  # the first compiles what only edits draw
                times.append(took)
                work = max(work, solver.poll(wait=True).done - done)
                traced += self._traced - rays
        first = [t.first for t in times if t.first is not None]
        errors = self._errors(edited)
        return {
            "texels": self._lightmap.texel_count,
            "before": before.done,
            "edit": what,
            "first_ms": statistics.median(wall for wall, _ in first) if first else None,
            "first_cpu_ms": statistics.median(cpu for _, cpu in first) if first else None,
            "whole_ms": statistics.median(t.whole[0] for t in times),
            "whole_cpu_ms": statistics.median(t.whole[1] for t in times),
            "longest_ms": max(t.longest for t in times),
            "work": work,
            "traced": traced if isinstance(solver, Gathering) else None,
            "rms": errors.rms,
            "median": errors.median,
        }

    @property
    def _traced(self) -> int:
        """Rays so far, of a solver that traces any."""
        return self._solver.traced if isinstance(self._solver, Gathering) else 0

    def edit(self, materials: tuple[Material, ...], remaining: float) -> EditTimes:
        """Use these materials, and work until their light is there. remaining: as little as there was before."""
        solver, gpu = self._solver, self._gpu
        gpu.ctx.finish()
        drawn, pieces = self._drawn, 0
        start = last = time.perf_counter()
        cpu, longest, first = time.process_time(), 0.0, None

        def lap() -> tuple[float, float]:
            """What has been spent so far (wall, CPU) [ms], all of it done."""
            nonlocal last, longest
            gpu.ctx.finish()
            now = time.perf_counter()
            longest, last = max(longest, (now - last) * 1e3), now
            return (now - start) * 1e3, (time.process_time() - cpu) * 1e3

        solver.set_materials(materials)
        spent = lap()
        while not self._there(pieces, remaining):
            parts = solver.work(self._family.batch)
            over = False
            while not over:
                over = next(parts, OVER) is OVER
                spent = lap()
                if first is None and not over and self._drawn > drawn:
                    first = spent
            pieces += 1
        return EditTimes(first, spent, longest)

    def _there(self, pieces: int, remaining: float) -> bool:
        """Whether the light of an edit is there, after so many pieces of work."""
        if self._family.distributes:
            return self._solver.poll(wait=True).remaining <= remaining * SAME
        return pieces > 0

    @property
    def _drawn(self) -> int:
        """How often all bounces were drawn, by a solver that shows them before it has all of their light."""
        return self._solver.drawn if isinstance(self._solver, Gathering) else 0

    def _errors(self, edited: tuple[Material, ...]) -> PointErrors:
        """The errors of the edited light, from light that is solved afresh."""
        solver, H, remaining = self._solver, self._light(), self._solver.poll(wait=True).remaining
        if isinstance(gathering := solver, Gathering):
            gathering.bounces.clear()
            for _ in range(SETTLED):
                self.edit(edited, remaining)
        else:
            solver.reset()
            solve_until(solver, self._family.batch, lambda now: now.remaining <= remaining)
            solver.settle()
        afresh = self._light()
        lit = lit_points(afresh)
        return point_errors(H[lit], afresh[lit])

    def _light(self) -> F64:
        """H of all texels that cover a surface (n, 3) [W/m²]."""
        covered = self._lightmap.pool.surfaces.area > 0
        return self._lightmap.irradiance()[covered].astype(np.float64)
