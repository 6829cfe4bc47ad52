"""``glowtree bench error``: error against time and work, for each scene and method, and other programs beside them.

Each curve is one solve, see error_curve.py; what is compared is the irradiance at random points, see reference/irradiance.py.
Loading, unfolding, cutting and compiling are not timed. What is finished is written when the rest is stopped.
"""

from __future__ import annotations

import argparse
import itertools
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from app import __version__
from app.atlas.cuts import cut_at_contacts
from app.bake import prepare_directory
from app.bench.accuracy.error_curve import look_at, solve_curve
from app.bench.accuracy.error_report import SceneCurves, document, plot, write
from app.bench.accuracy.methods import METHODS, Setup
from app.bench.accuracy.reference_picture import reference_picture
from app.bench.choices import CURVES_END
from app.bench.machine import load, machine
from app.bench.peers.peers import PEERS, Task
from app.errors import UserError
from app.estimate.error import ErrorEstimator
from app.gpu import Gpu, gpu_context
from app.lightmap.at_points import irradiance_of
from app.lightmap.options import LightmapOptions
from app.options import from_flags
from app.reference.irradiance import ReferenceIrradiance, choose_reference, reference_irradiance
from app.scene.load import load_scene
from app.session.batch import opened
from app.solvers import SOLVERS
from app.util.console import Console, Tell
from app.util.parts import run_to_end
from app.util.tables import FLIP, Row, missing

SECONDS = 5.0  # for the error estimate, unless fewer points would be too few
NODES = 64  # of the error estimate at once
ESTIMATED = 4  # looks from one with an error estimate to the next


@dataclass(frozen=True)
class Plan:
    """What is measured of each scene. texels: uniform ones, None for as many as suit it; seconds: of each curve; paths: from each
    point of a path-traced reference; flags: options of the lightmap and of the solvers."""

    methods: tuple[str, ...]
    peers: tuple[str, ...]
    texels: int | None
    flags: argparse.Namespace
    seconds: float
    paths: int

    def setup(self, method: str) -> Setup:
        """Raises UserError."""
        return METHODS[method].setup(self.texels, self.flags)


def bench_error(flags: argparse.Namespace) -> int:
    """Measure and write error.json, error.csv, error.md, and with matplotlib a PNG for each scene. Raises UserError."""
    console = Console(quiet=flags.json)
    plan = Plan(flags.methods, flags.peers, flags.texels, flags, flags.seconds, flags.paths)
    for name in plan.methods:
        plan.setup(name)  # whose mistakes are told before anything is measured
    scenes = _scenes(flags.scenes, flags.reference)
    folder = prepare_directory(flags.output)
    if reason := missing(FLIP):
        console.warn(f"no FLIP: {reason}")
    plan = replace(plan, peers=tuple(name for name in plan.peers if _is_here(name, console)))
    with gpu_context() as gpu, console.progress("error") as tell:
        values: dict[str, Any] = {"glowtree": __version__, "renderer": gpu.limits.renderer, "machine": machine()}
        values |= {"load": load(), "seconds": plan.seconds, "texels": plan.texels}
        values |= {"lightmap": from_flags(LightmapOptions, flags).as_dict()}
        solvers = dict.fromkeys(METHODS[name].solver for name in plan.methods)
        values |= {name: from_flags(SOLVERS[name].options, flags, CURVES_END).as_dict() for name in solvers}
        interrupted = not _measured(gpu, scenes, plan, console, tell)
    done = [one for one in scenes if one.curves]
    if not done:
        raise KeyboardInterrupt if interrupted else UserError("bench error: nothing could be measured")
    if interrupted:
        console.warn("stopped: only finished curves are written")
    values |= {"interrupted": interrupted, "scenes": [_values(one, plan) for one in done]}
    text = document(values, done)
    write(folder, values, done, text)
    plot(folder, values, done, console)
    console.result(values, text)
    return 130 if interrupted else 0


def _scenes(sources: Iterable[str], reference: str | None) -> list[SceneCurves]:
    """Raises UserError for one that does not exist, has no light, or cannot be judged."""
    out: list[SceneCurves] = []
    for source in sources:
        scene, name = load_scene(source), Path(source).name
        if not scene.emits:
            raise UserError(f"{source}: nothing in the scene emits light")
        file = re.sub(r"[^\w-]", "-", name)
        while any(one.file == file for one in out):
            file += "-again"
        out.append(SceneCurves(name, file, scene, choose_reference(scene, reference)))
    return out


def _is_here(name: str, console: Console) -> bool:
    """Whether a peer can run; a warning says why not."""
    reason = PEERS[name].missing()
    if reason is not None:
        console.warn(f"{name} is left out: {reason}")
    return reason is None


def _measured(gpu: Gpu, scenes: list[SceneCurves], plan: Plan, console: Console, tell: Tell) -> bool:
    """Fill in the curves. False if Ctrl-C stopped it."""
    try:
        for one in scenes:
            _measure(gpu, one, plan, console, tell)
    except KeyboardInterrupt:
        return False
    return True


def _measure(gpu: Gpu, one: SceneCurves, plan: Plan, console: Console, tell: Tell) -> None:
    """Fill in the curves of a scene; what this machine cannot do is left out with a warning."""

    def told(text: str, share: float) -> None:
        tell(f"{one.name}, {text}", share)

    scene = cut_at_contacts(one.scene).scene  # as methods see it: points are told by its triangles
    try:
        reference = reference_irradiance(scene, one.compared_with, plan.paths, told)
        picture = reference_picture(gpu, scene, reference, plan.paths, told)
    except UserError as error:
        console.warn(f"{one.name}: left out: {error}")
        return
    one.reference, one.picture = reference, picture
    names = (*plan.methods, *plan.peers)
    for i, name in enumerate(names):
        tell(f"{one.name}, {name}", i / len(names))
        try:
            if name in PEERS:
                task = Task(scene, reference, picture, plan.setup("uniform").atlas, plan.seconds)
                one.curves[name] = PEERS[name].curve(task)
            else:
                one.curves[name] = _curve(gpu, one, reference, name, plan)
        except (UserError, MemoryError) as error:
            console.warn(f"{one.name}, {name}: left out: {error or 'not enough memory'}")


def _curve(gpu: Gpu, one: SceneCurves, reference: ReferenceIrradiance, name: str, plan: Plan) -> list[Row]:
    """Of a method; the observer of what lights the surroundings of one is the first camera. Raises UserError."""
    setup = plan.setup(name)
    with opened(gpu, one.scene, setup.atlas, setup.light, setup.options, setup.solver) as (lightmap, solver):
        solver.set_observer(one.scene.cameras[0].world_from_camera[:3, 3])
        estimator, looks = ErrorEstimator(gpu, lightmap, NODES), itertools.count()

        def estimate() -> Row:
            error = run_to_end(estimator.parts(SECONDS))
            return {} if error is None else {"expected": error.rms, "expected_median": error.median}

        def look() -> Row:
            row = look_at(lightmap, solver, setup.family, reference)
            return row | estimate() if next(looks) % ESTIMATED == 0 else row

        try:
            rows = solve_curve(gpu, solver, setup.family.batch, plan.seconds, look)
            if "expected" not in rows[-1]:
                rows[-1] |= estimate()
        finally:
            estimator.release()
        if one.picture is not None:
            rows[-1]["flip"] = one.picture.flip(irradiance_of(lightmap, one.picture.points))
    return rows


def _values(one: SceneCurves, plan: Plan) -> dict[str, Any]:
    """All there is to know of a scene's curves, for error.json."""
    assert one.reference is not None
    curves: dict[str, dict[str, Any]] = {}
    for name, rows in one.curves.items():
        curves[name] = {"samples": rows}
        if name not in PEERS:
            curves[name] |= {"axis": METHODS[name].axis} | plan.setup(name).as_dict()
    return {
        "scene": one.name,
        "source": str(one.scene.source),
        "triangles": len(one.scene.triangles),
        "truth": one.reference.as_dict(),
        "view": None if one.picture is None else one.picture.as_dict(),
        "curves": curves,
        "foretold": one.well_estimated("rms"),
        "foretold_median": one.well_estimated("median"),
        "summary": one.summary,
    }
