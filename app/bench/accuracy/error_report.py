"""The report of ``glowtree bench error``: a table for each scene as Markdown, all samples as CSV, and plots."""

from __future__ import annotations

import importlib.util
import itertools
import os
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from app.bench.accuracy.error_curve import LEVELS, first_at
from app.bench.accuracy.methods import METHODS
from app.bench.accuracy.reference_picture import SIZE, ReferencePicture
from app.bench.machine import processor
from app.bench.peers.peers import PEERS
from app.errors import UserError
from app.reference.irradiance import ReferenceIrradiance
from app.scene.model import Scene
from app.solvers import SOLVERS
from app.util.console import Console
from app.util.json_text import json_text
from app.util.tables import FLIP, Column, Row, csv_text, markdown_table

TITLE = "Error against time"
CLOCKS = {"seconds": "s", "cpu_seconds": "CPU s"}  # what is read when a curve comes down to a level
NOTES = (
    "Error of the irradiance at random points of the surfaces. RMS: root mean square over all lit points and colours, over the "
    "mean. Expected: the RMS, and the median, that the solution says of itself, with no reference. Bias: of the mean. Median, 90 "
    "%: quantiles of the error at each lit point, over the irradiance there. Leak: light at dark points, over the mean at lit "
    "ones. Imbalance: "
    "emitted light that is neither absorbed, nor unshot, nor gone. s to: seconds of solving until the RMS was that small, read "
    "between two looks; looking stops the clock, and loading is not timed. CPU s: of all cores, "
    "which other programs on the machine do not change. FLIP: how different what the first camera sees "
    f"looks by this light and by the reference's, {SIZE[0]}×{SIZE[1]} pixels, 0 to 1; none where the reference has no picture.",
)
JUDGED = 1.5  # times the reference's noise, from where on an RMS says something
EXPECTED = {"rms": "expected", "median": "expected_median"}  # what is said of each error
TWICE = 2.0  # or half: so far off is still well expected


def units() -> tuple[str, ...]:
    """In which the solvers count their work: a column for each."""
    return tuple(dict.fromkeys(family.unit for family in SOLVERS.values()))


def remains() -> dict[str, str]:
    """What is left of what they have to do: a column's key, and its head."""
    return {family.threshold: family.remains for family in SOLVERS.values()}


def sample_columns() -> list[Column]:
    """Of error.csv."""
    where = ("scene", "method", "seconds", "cpu_seconds", *units(), "paths", *remains(), "texels")
    errors = ("rms", "expected", "bias", "median", "expected_median", "q90", "leak", "imbalance", "flip")
    return [Column(key, key) for key in (*where, *errors)]


def summary_columns() -> list[Column]:
    """Of a scene's table."""
    return [
        Column("method", "method"),
        Column("texels", "texels", ","),
        *(Column(unit, unit, ",") for unit in units()),
        Column("paths", "paths per point", ","),
        Column("seconds", "s", ".2f"),
        Column("cpu_seconds", "CPU s", ".2f"),
        *(Column(key, head, ".2%") for key, head in remains().items()),
        Column("rms", "RMS", ".2%"),
        Column("expected", "expected", ".2%"),
        Column("bias", "bias", "+.2%"),
        Column("median", "median", ".2%"),
        Column("expected_median", "expected", ".2%"),
        Column("q90", "90 %", ".2%"),
        Column("leak", "leak", ".3%"),
        Column("imbalance", "imbalance", "+.2%"),
        Column("flip", "FLIP", ".4f", FLIP),
        *(
            Column(f"{key}_to_{level:g}", f"{head} to {level:.0%}", ".2f")
            for key, head in CLOCKS.items()
            for level in LEVELS
        ),
    ]


@dataclass
class SceneCurves:
    """What was measured of one scene. name: for people; file: for file names; compared_with: name of the reference;
    curves: samples of each method and peer."""

    name: str
    file: str
    scene: Scene
    compared_with: str
    reference: ReferenceIrradiance | None = None
    picture: ReferencePicture | None = None
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

    def well_estimated(self, kind: str) -> tuple[int, int]:
        """At how many looks the estimated error (``rms`` or ``median``) was within a factor of two, and of how many that the
        reference can judge. Its noise is none of theirs."""
        right = self.reference
        assert right is not None
        noise = (right.noise if kind == "rms" else right.median_noise) or 0.0
        said = EXPECTED[kind]
        good, stated = 0, 0
        for row in itertools.chain.from_iterable(self.curves.values()):
            if row.get(said) is not None and row.get(kind, 0.0) > JUDGED * noise:
                true = (row[kind] ** 2 - noise**2) ** 0.5
                good += true / TWICE <= row[said] <= true * TWICE
                stated += 1
        return good, stated


def document(values: dict[str, Any], scenes: Iterable[SceneCurves]) -> str:
    """A table for each scene as Markdown, with what it was measured on."""
    busy = "" if values["load"] is None else f", load {values['load']:.1f} when it began"
    measured_on = f"{values['renderer']}; {values['machine']}{busy}; up to {values['seconds']:g} s for each curve."
    parts = [f"# {TITLE}", measured_on, *NOTES]
    for one in scenes:
        right = one.reference
        assert right is not None
        noise = ""
        if right.noise is not None:
            noise = f"; its own noise is {right.noise:.2%} RMS, {right.median_noise:.2%} in the median"
        if one.picture is not None and one.picture.noise is not None:
            noise += f"; pictures by two halves of its paths differ by a FLIP of {one.picture.noise:.4f}"
        lit = int(right.lit.sum())
        parts += [
            f"## {one.name}",
            f"{len(one.scene.triangles):,} triangles. Compared with: {right.made}, at {len(right.points):,} points, of which "
            f"{lit:,} are lit{noise}.",
            "Expected within a factor of two of the measured, less the noise of the reference: RMS at {} of {} looks, "
            "median at {} of {}.".format(*one.well_estimated("rms"), *one.well_estimated("median")),
            markdown_table(
                [c for c in summary_columns() if any(row.get(c.key) is not None for row in one.summary)], one.summary
            ),
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
    files = {"error.md": text + "\n", "error.json": json_text(values), "error.csv": csv_text(sample_columns(), rows)}
    try:
        for name, content in files.items():
            (folder / name).write_text(content, encoding="utf-8")
    except OSError as error:
        raise UserError(f"{folder}: cannot write the report ({error.strerror or error})") from error


def plot(folder: Path, values: dict[str, Any], scenes: Iterable[SceneCurves], console: Console) -> None:
    """Raises UserError."""
    if importlib.util.find_spec("matplotlib") is None:
        console.warn("no plots: pip install 'glowtree[bench]'")
        return
    from app.bench.accuracy.error_plot import draw_curves

    for one in scenes:
        assert one.reference is not None
        texels = "" if one.texels is None else f", {one.texels:,} uniform texels"
        title = f"{one.name}{texels}\n{values['renderer']}; {processor()}, {os.cpu_count()} cores"
        labels = {name: _label(name, rows, one.texels) for name, rows in one.curves.items()}
        curves = {labels[name]: rows for name, rows in one.curves.items()}
        peers = tuple(label for name, label in labels.items() if name in PEERS)
        used = tuple(unit for unit in units() if any(unit in rows[-1] for rows in one.curves.values()))
        draw_curves(folder / f"{one.file}.png", title, curves, peers, one.reference.noise, used)


def _label(name: str, rows: list[Row], texels: int | None) -> str:
    """Of a curve, with its texels where they are others than those that the title has."""
    own = rows[-1].get("texels")
    return name if own in (None, texels) else f"{name}, {own:,} texels"
