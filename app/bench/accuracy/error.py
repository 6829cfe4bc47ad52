"""``glowtree bench error``: error against time and against shots, for each scene and method, and peers beside them.

Each curve is one solve, see curve.py; what is compared is the irradiance at random points, see truth.py. Loading, unfolding,
cutting and compiling are not timed. What is finished is written when the rest is stopped.
"""

from __future__ import annotations

import argparse
import importlib.util
import itertools
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from app import __version__
from app.atlas.options import AtlasOptions
from app.bake import prepare_directory
from app.bench.accuracy.curve import LEVELS, first_at, look_at, solve_curve
from app.bench.accuracy.methods import METHODS
from app.bench.accuracy.view import SIZE, View, view_of
from app.bench.machine import load, machine, processor
from app.bench.peers.peers import PEERS, Task
from app.errors import UserError
from app.estimate.error import Expectation
from app.gpu import Gpu, gpu_context
from app.lightmap.at_points import irradiance_of
from app.lightmap.options import LightmapOptions
from app.options import from_flags
from app.reference.truth import Truth, choose, truth_of
from app.scene.load import load_scene
from app.scene.model import Scene
from app.session.batch import opened
from app.solvers import ShootingOptions
from app.util.console import Console, Tell
from app.util.json_text import json_text
from app.util.parts import run_to_end
from app.util.tables import FLIP, Column, Row, csv_text, markdown_table, missing

TITLE = "Error against time"
CLOCKS = {"seconds": "s", "cpu_seconds": "CPU s"}  # what is read when a curve comes down to a level
SAMPLES = (
    *(
        Column(key, key)
        for key in ("scene", "method", "seconds", "cpu_seconds", "shots", "paths", "residual", "texels")
    ),
    *(Column(key, key) for key in ("rms", "expected", "bias", "median", "q90", "leak", "imbalance", "flip")),
)
SUMMARY = (
    Column("method", "method"),
    Column("texels", "texels", ","),
    Column("shots", "shots", ","),
    Column("paths", "paths per point", ","),
    Column("seconds", "s", ".2f"),
    Column("cpu_seconds", "CPU s", ".2f"),
    Column("residual", "unshot", ".2%"),
    Column("rms", "RMS", ".2%"),
    Column("expected", "expected", ".2%"),
    Column("bias", "bias", "+.2%"),
    Column("median", "median", ".2%"),
    Column("q90", "90 %", ".2%"),
    Column("leak", "leak", ".3%"),
    Column("imbalance", "imbalance", "+.2%"),
    Column("flip", "FLIP", ".4f", FLIP),
    *(
        Column(f"{key}_to_{level:g}", f"{head} to {level:.0%}", ".2f")
        for key, head in CLOCKS.items()
        for level in LEVELS
    ),
)
NOTES = (
    "Error of the irradiance at random points of the surfaces. RMS: root mean square over all lit points and colours, over the "
    "mean. Expected: the RMS that the solution says of itself, with no reference. Bias: of the mean. Median, 90 %: quantiles of "
    "the error at each lit point, over the irradiance there. Leak: light at dark points, over the mean at lit ones. Imbalance: "
    "emitted light that is neither absorbed, nor unshot, nor gone. s to: seconds of solving until the RMS was that small, read "
    "between two looks; looking stops the clock, and loading is not timed. CPU s: of all cores, "
    "which other programs on the machine do not change. FLIP: how different what the first camera sees "
    f"looks by this light and by the reference's, {SIZE[0]}×{SIZE[1]} pixels, 0 to 1; none where the reference has no picture.",
)


SECONDS = 5.0  # for the expected error, unless fewer points would be too few
MAPS = 16  # hemicubes of the expected error at once
STATED = 4  # looks from one at which it is to the next
JUDGED = 1.5  # times the reference's noise, from where on an RMS says something
TWICE = 2.0  # or half: so far off is still well expected


@dataclass
class SceneCurves:
    """What was measured of one scene. name: for people; file: for file names; curves: samples of each method and peer."""

    name: str
    file: str
    scene: Scene
    reference: str
    truth: Truth | None = None
    view: View | None = None
    curves: dict[str, list[Row]] = field(default_factory=dict)

    @property
    def texels(self) -> int | None:
        """Uniform ones, if any were measured."""
        uniform = (name for name in self.curves if name in METHODS and not METHODS[name].adaptive)
        return next((self.curves[name][-1]["texels"] for name in uniform), None)

    @property
    def summary(self) -> list[Row]:
        """The end of each curve, and when it had come down to each level."""
        return [
            rows[-1]
            | {"method": name}
            | {f"{key}_to_{level:g}": first_at(level, rows, key) for key in CLOCKS for level in LEVELS}
            for name, rows in self.curves.items()
        ]

    @property
    def foretold(self) -> tuple[int, int]:
        """How many looks had expected their RMS within a factor of two, and of how many that the reference can judge. Its
        noise is none of theirs."""
        assert self.truth is not None
        noise, good, stated = self.truth.noise or 0.0, 0, 0
        for row in itertools.chain.from_iterable(self.curves.values()):
            if row.get("expected") is not None and row.get("rms", 0.0) > JUDGED * noise:
                true = (row["rms"] ** 2 - noise**2) ** 0.5
                good += true / TWICE <= row["expected"] <= true * TWICE
                stated += 1
        return good, stated


@dataclass(frozen=True)
class Plan:
    """What is measured of each scene. texels: uniform ones, None for as many as suit it; seconds: of each curve; paths: from each
    point of a path-traced reference."""

    methods: tuple[str, ...]
    peers: tuple[str, ...]
    texels: int | None
    light: LightmapOptions
    shooting: ShootingOptions
    seconds: float
    paths: int

    def options(self, method: str) -> tuple[AtlasOptions, LightmapOptions, ShootingOptions]:
        """Of a method. Raises UserError."""
        return METHODS[method].options(self.texels, self.light, self.shooting)


def bench_error(flags: argparse.Namespace) -> int:
    """Measure and write error.json, error.csv, error.md, and with matplotlib a PNG for each scene. Raises UserError."""
    console = Console(quiet=flags.json)
    shooting, light = from_flags(ShootingOptions, flags), from_flags(LightmapOptions, flags)
    plan = Plan(flags.methods, flags.peers, flags.texels, light, shooting, flags.seconds, flags.paths)
    for name in plan.methods:
        plan.options(name)  # whose mistakes are told before anything is measured
    scenes = _scenes(flags.scenes, flags.reference)
    folder = prepare_directory(flags.output)
    if reason := missing(FLIP):
        console.warn(f"no FLIP: {reason}")
    plan = replace(plan, peers=tuple(name for name in plan.peers if _is_here(name, console)))
    with gpu_context() as gpu, console.progress("error") as tell:
        values: dict[str, Any] = {"glowtree": __version__, "renderer": gpu.limits.renderer, "machine": machine()}
        values |= {"load": load(), "seconds": plan.seconds, "texels": plan.texels, "shooting": shooting.as_dict()}
        interrupted = not _measured(gpu, scenes, plan, console, tell)
    done = [one for one in scenes if one.curves]
    if not done:
        raise KeyboardInterrupt if interrupted else UserError("bench error: nothing could be measured")
    if interrupted:
        console.warn("stopped: only finished curves are written")
    values |= {"interrupted": interrupted, "scenes": [_values(one, plan) for one in done]}
    text = document(values, done)
    write(folder, values, done, text)
    _plot(folder, values, done, console)
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
        out.append(SceneCurves(name, file, scene, choose(scene, reference)))
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

    try:
        truth = truth_of(one.scene, one.reference, plan.paths, told)
        view = view_of(gpu, one.scene, truth, plan.paths, told)
    except UserError as error:
        console.warn(f"{one.name}: left out: {error}")
        return
    one.truth, one.view = truth, view
    names = (*plan.methods, *plan.peers)
    for i, name in enumerate(names):
        tell(f"{one.name}, {name}", i / len(names))
        try:
            one.curves[name] = _curve(gpu, one, truth, name, plan)
        except (UserError, MemoryError) as error:
            console.warn(f"{one.name}, {name}: left out: {error or 'not enough memory'}")


def _curve(gpu: Gpu, one: SceneCurves, truth: Truth, name: str, plan: Plan) -> list[Row]:
    """Of a method or a peer. Raises UserError."""
    if name in PEERS:
        atlas, _, _ = plan.options("uniform")
        return PEERS[name].curve(Task(one.scene, truth, one.view, atlas, plan.seconds))
    with opened(gpu, one.scene, *plan.options(name)) as (lightmap, solver):
        expectation, looks = Expectation(gpu, lightmap, MAPS), itertools.count()

        def expected() -> Row:
            error = run_to_end(expectation.parts(solver.energy().returned, SECONDS))
            return {} if error is None else {"expected": error.rms}

        def look() -> Row:
            row = look_at(lightmap, solver, truth)
            return row | expected() if next(looks) % STATED == 0 else row

        try:
            rows = solve_curve(gpu, solver, plan.seconds, look)
            if "expected" not in rows[-1]:
                rows[-1] |= expected()
        finally:
            expectation.release()
        if one.view is not None:
            rows[-1]["flip"] = one.view.flip(irradiance_of(lightmap, one.view.points))
    return rows


def _values(one: SceneCurves, plan: Plan) -> dict[str, Any]:
    """All there is to know of a scene's curves, for error.json."""
    assert one.truth is not None
    curves: dict[str, dict[str, Any]] = {}
    for name, rows in one.curves.items():
        curves[name] = {"samples": rows}
        if name not in PEERS:
            atlas, light, options = plan.options(name)
            curves[name] |= {"axis": METHODS[name].axis, "atlas": atlas.as_dict()}
            curves[name] |= {"lightmap": light.as_dict(), "shooting": options.as_dict()}
    return {
        "scene": one.name,
        "source": str(one.scene.source),
        "triangles": len(one.scene.triangles),
        "truth": one.truth.as_dict(),
        "view": None if one.view is None else one.view.as_dict(),
        "curves": curves,
        "foretold": one.foretold,
        "summary": one.summary,
    }


def document(values: dict[str, Any], scenes: Iterable[SceneCurves]) -> str:
    """A table for each scene as Markdown, with what it was measured on."""
    busy = "" if values["load"] is None else f", load {values['load']:.1f} when it began"
    measured_on = f"{values['renderer']}; {values['machine']}{busy}; up to {values['seconds']:g} s for each curve."
    parts = [f"# {TITLE}", measured_on, *NOTES]
    for one in scenes:
        truth = one.truth
        assert truth is not None
        noise = ""
        if truth.noise is not None:
            noise = f"; its own noise is {truth.noise:.2%} RMS, {truth.median_noise:.2%} in the median"
        if one.view is not None and one.view.noise is not None:
            noise += f"; pictures by two halves of its paths differ by a FLIP of {one.view.noise:.4f}"
        lit = int(truth.lit.sum())
        parts += [
            f"## {one.name}",
            f"{len(one.scene.triangles):,} triangles. Compared with: {truth.made}, at {len(truth.points):,} points, of which "
            f"{lit:,} are lit{noise}.",
            "Expected RMS within a factor of two of the measured one, less the noise of the reference: at {} of {} looks.".format(
                *one.foretold
            ),
            markdown_table([c for c in SUMMARY if any(row.get(c.key) is not None for row in one.summary)], one.summary),
        ]
    return "\n\n".join(parts)


def write(folder: Path, values: dict[str, Any], scenes: Iterable[SceneCurves], text: str) -> None:
    """Raises UserError."""
    rows = [
        row | {"scene": one.name, "method": name}
        for one in scenes
        for name, curve in one.curves.items()
        for row in curve
    ]
    files = {"error.md": text + "\n", "error.json": json_text(values), "error.csv": csv_text(SAMPLES, rows)}
    try:
        for name, content in files.items():
            (folder / name).write_text(content, encoding="utf-8")
    except OSError as error:
        raise UserError(f"{folder}: cannot write the report ({error.strerror or error})") from error


def _plot(folder: Path, values: dict[str, Any], scenes: Iterable[SceneCurves], console: Console) -> None:
    """Raises UserError."""
    if importlib.util.find_spec("matplotlib") is None:
        console.warn("no plots: pip install 'glowtree[bench]'")
        return
    from app.bench.papers.plots import draw_curves

    for one in scenes:
        assert one.truth is not None
        texels = "" if one.texels is None else f", {one.texels:,} uniform texels"
        title = f"{one.name}{texels}\n{values['renderer']}; {processor()}, {os.cpu_count()} cores"
        labels = {name: _label(name, rows, one.texels) for name, rows in one.curves.items()}
        curves = {labels[name]: rows for name, rows in one.curves.items()}
        peers = tuple(label for name, label in labels.items() if name in PEERS)
        draw_curves(folder / f"{one.file}.png", title, curves, peers, one.truth.noise)


def _label(name: str, rows: list[Row], texels: int | None) -> str:
    """Of a curve, with its texels where they are others than those that the title has."""
    own = rows[-1].get("texels")
    return name if own in (None, texels) else f"{name}, {own:,} texels"
