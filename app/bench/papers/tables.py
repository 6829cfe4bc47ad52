"""``glowtree bench tables``: the tables of [Coombe03] and [Wallner10], ours beside theirs, on one machine in one run.

Theirs are published numbers of other scenes on other hardware: they show proportions. Each table is a list of jobs that measure
its rows one by one; what is finished is written when the rest is stopped.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from app.atlas.options import AtlasOptions
from app.bake import prepare_directory
from app.bench.machine import load, machine
from app.bench.papers import equal, measure, published
from app.bench.papers.table import Measure, Plot, Table
from app.errors import UserError
from app.gpu import Gpu, gpu_context
from app.reference.truth import PATCHES
from app.util.console import Console, Tell
from app.util.json_text import json_text
from app.util.tables import FLIP, Column, Row, csv_text, markdown_table, missing
from app.visibility.projections import PROJECTIONS

TRIANGLES = (1_000, 3_000, 10_000, 30_000, 100_000, 300_000)
TEXELS = (10_000, 30_000, 100_000, 300_000, 1_000_000, 4_000_000)
AT_TEXELS, AT_TRIANGLES = 100_000, 10_000  # of the sweep over the other
CONVERGENCE = ("museum", 31_000)
EQUAL_TEXELS = 8_000, 32_000, 128_000, 256_000  # uniform ones
EQUAL_TREES = (16, 0.5), (8, 0.5), (8, 0.25)  # texels along a leaf, gradient


def bench_tables(flags: argparse.Namespace) -> int:
    """Measure and write tables.md, tables.json, and for each table NAME.csv and with --plots NAME.png. Raises UserError."""
    if flags.plots and (lacks := missing("matplotlib")):
        raise UserError(f"glowtree bench tables --plots {lacks}")
    tables, warnings = possible(all_tables(), flags.only)
    folder = prepare_directory(flags.output)
    console = Console(quiet=flags.json)
    for warning in warnings:
        console.warn(warning)

    def warn(text: str) -> None:
        warnings.append(text)
        console.warn(text)

    rows: dict[str, list[Row]] = {t.name: [] for t in tables}
    with gpu_context() as gpu, console.progress("tables") as tell:
        values = {"renderer": gpu.limits.renderer, "machine": machine(), "seconds": flags.seconds}
        values["load"] = load()
        interrupted = not measured(gpu, flags.seconds, tables, rows, tell, warn)
    values |= {"interrupted": interrupted, "warnings": warnings, "tables": {t.name: rows[t.name] for t in tables}}
    text = document(values, tables)
    write(folder, values, tables, text)
    if flags.plots:
        from app.bench.papers.plots import draw

        for table in tables:
            if table.plot is not None and rows[table.name]:
                draw(folder / f"{table.name}.png", table.title, table.plot, rows[table.name], values["renderer"])
    console.result(values, text)
    return 130 if interrupted else 0


def possible(tables: Iterable[Table], only: Sequence[str] | None) -> tuple[list[Table], list[str]]:
    """Those asked for, without columns that need what is not installed, and a warning for each that had some. Raises UserError
    for one that was named."""
    kept, warnings = [], []
    for table in tables:
        if only is not None and table.name not in only:
            continue
        absent = {c.key: lacks for c in table.columns if c.needs and (lacks := missing(c.needs))}
        for lacks in dict.fromkeys(absent.values()):
            if only is not None:
                raise UserError(f"glowtree bench tables: table {table.name} {lacks}")
            heads = ", ".join(c.head for c in table.columns if absent.get(c.key) == lacks)
            warnings.append(f"table {table.name}: left out: {heads}: {lacks}")
        kept.append(replace(table, columns=tuple(c for c in table.columns if c.key not in absent)))
    return kept, warnings


def measured(
    gpu: Gpu,
    seconds: float,
    tables: Iterable[Table],
    rows: dict[str, list[Row]],
    tell: Tell,
    warn: Callable[[str], None],
) -> bool:
    """Fill in the rows. False if Ctrl-C stopped it; rows that this machine cannot do are left out with a warning."""
    jobs = [(table, label, job) for table in tables for label, job in table.jobs]
    try:
        for i, (table, label, job) in enumerate(jobs):
            tell(f"{table.name}, {label}", i / len(jobs))
            try:
                rows[table.name].append(job(gpu, seconds))
            except (UserError, MemoryError) as error:
                warn(f"{table.name}, {label}: left out: {error or 'not enough memory'}")
    except KeyboardInterrupt:
        warn("stopped: only finished rows are written")
        return False
    finally:
        for table in tables:
            table.finish(rows[table.name])
    return True


def document(values: dict[str, Any], tables: Iterable[Table]) -> str:
    """All tables as Markdown, with what they were measured on."""
    busy = "" if values["load"] is None else f", load {values['load']:.1f} when it began"
    parts = [
        "# The papers' tables, measured",
        f"Ours: {values['renderer']}; {values['machine']}{busy}; about {values['seconds']:g} s per measurement. "
        "Theirs: as published, other scenes and other hardware.",
    ]
    for table in tables:
        rows = values["tables"][table.name]
        parts += [f"## {table.title}", "  \n".join((f"Theirs: {table.theirs}.", *table.notes))]
        parts.append(markdown_table(table.columns, rows) if rows else "Nothing was measured.")
    return "\n\n".join(parts)


def write(folder: Path, values: dict[str, Any], tables: Iterable[Table], text: str) -> None:
    """Raises UserError."""
    files = {"tables.md": text + "\n", "tables.json": json_text(values)}
    files |= {f"{t.name}.csv": csv_text(t.columns, values["tables"][t.name]) for t in tables}
    try:
        for name, content in files.items():
            (folder / name).write_text(content, encoding="utf-8")
    except OSError as error:
        raise UserError(f"{folder}: cannot write the tables ({error.strerror or error})") from error


def all_tables() -> tuple[Table, ...]:
    return _coombe_1(), _equal(), _wallner_1(), _scaling(), _convergence(), _wallner_2()


def table_names(text: str) -> tuple[str, ...]:
    """Of ``--only``: names with commas between them."""
    known = [t.name for t in all_tables()]
    names = tuple(text.split(","))
    for name in names:
        if name not in known:
            raise argparse.ArgumentTypeError(f"{name}: must be one of {', '.join(known)}")
    return names


def _coombe_1() -> Table:
    def job(theirs: published.CoombeRow) -> Measure:
        return lambda gpu, seconds: measure.coombe_row(gpu, seconds, theirs)

    return Table(
        "coombe1",
        "Uniform and adaptive subdivision",
        published.COOMBE,
        (
            f"Seconds per shot of a solve down to {measure.DIRECT:.0%} unshot, or for {measure.SOLVE} times as long as other "
            "measurements; of adaptive texels with all that their tree needs, earlier shots made again included.",
            f"Calm: the tree had stopped growing by then. Its finest leaves, {measure.ROOTS} levels below its roots, are as "
            "fine as the uniform texels. Later: the shots that follow.",
        ),
        (
            Column("scene", "scene"),
            Column("uniform_texels", "uniform texels", ","),
            Column("adaptive_texels", "adaptive texels", ","),
            Column("uniform_s", "uniform s", ".5f"),
            Column("adaptive_s", "adaptive s", ".5f"),
            Column("adaptive_later_s", "later s", ".5f"),
            Column("calm", "calm"),
            Column("their_uniform_texels", "their uniform texels", ","),
            Column("their_adaptive_texels", "adaptive texels", ","),
            Column("their_uniform_s", "their uniform s", ".2f"),
            Column("their_adaptive_s", "adaptive s", ".2f"),
        ),
        tuple((row.scene, job(row)) for row in published.COOMBE_TABLE_1),
        Plot("uniform_texels", ("uniform_s", "adaptive_s", "their_uniform_s", "their_adaptive_s"), "", ("texels", "s")),
    )


def _equal() -> Table:
    def job(label: str, atlas: AtlasOptions, gradient: float | None = None) -> tuple[str, Measure]:
        return label, lambda gpu, _: equal.error_row(gpu, atlas, gradient)

    return Table(
        "equal",
        "Texels and seconds for equal error",
        "no numbers for this",
        (
            f"Cornell box down to {equal.CONVERGED:.1%} unshot, all seconds counted. Error: irradiance at {equal.POINTS} random "
            f"points against the dense float64 reference of {PATCHES:,} patches.",
            "Equal: what uniform texels would take for the adaptive ones' RMS, between the measured ones.",
        ),
        (
            Column("subdivision", "subdivision"),
            Column("tile", "tile"),
            Column("gradient", "gradient", ".2f"),
            Column("texels", "texels", ","),
            Column("shots", "shots", ","),
            Column("seconds", "s", ".1f"),
            Column("rms", "RMS", ".2%"),
            Column("median", "median", ".2%"),
            Column("q90", "90 %", ".2%"),
            Column("equal_texels", "equal texels", ",.0f"),
            Column("texels_share", "share", ".2f"),
            Column("equal_seconds", "equal s", ".1f"),
            Column("seconds_share", "share", ".2f"),
        ),
        (
            *(job(f"{texels:,} uniform texels", AtlasOptions(texels=texels)) for texels in EQUAL_TEXELS),
            *(
                job(f"leaves of {tile}, gradient {gradient:g}", AtlasOptions(tile=tile), gradient)
                for tile, gradient in EQUAL_TREES
            ),
        ),
        Plot("seconds", ("rms",), "subdivision", ("s", "relative RMS")),
        equal.compared,
    )


def _wallner_1() -> Table:
    def job(theirs: published.WallnerRow) -> Measure:
        return lambda gpu, seconds: measure.wallner_row(gpu, seconds, theirs)

    return Table(
        "wallner1",
        "Time per iteration by projection",
        published.WALLNER.format("table 1"),
        (
            f"Milliseconds per shot of one patch, hemicube faces of {measure.PAPER_MAP} px, in rooms with spheres of exactly "
            "as many triangles as their scenes, see app/bench/rooms.py. All patches begin with the same residual.",
            "Their iteration is all shots from one triangle, and its time a share of the whole run with all that comes "
            "before and after.",
        ),
        (
            Column("scene", "their scene"),
            Column("triangles", "triangles", ","),
            Column("texels", "texels", ","),
            *(Column(f"{name}_ms", f"{name} ms", ".2f") for name in PROJECTIONS),
            Column("their_texels", "their texels", ","),
            Column("their_cube_ms", "their hemicube ms", ".1f"),
            Column("their_sphere_ms", "their nonlinear ms", ".1f"),
        ),
        tuple((row.scene, job(row)) for row in published.WALLNER_TABLE_1),
        Plot("texels", tuple(f"{name}_ms" for name in PROJECTIONS), "triangles", ("texels", "ms per shot")),
    )


def _scaling() -> Table:
    def job(sweep: str, triangles: int, texels: int) -> tuple[str, Measure]:
        label = f"{triangles:,} triangles, {texels:,} texels"
        return label, lambda gpu, seconds: measure.scaling_row(gpu, seconds, sweep, triangles, texels)

    return Table(
        "scaling",
        "Time per iteration over triangles and texels",
        "no numbers for this",
        (
            "Milliseconds per shot, the sum of its passes, and of drawing the visibility map (see) and lighting the texels "
            "(receive), in rooms with spheres. All patches begin with the same residual.",
            "Power: p of time ~ n^p since the row before, n what is varied; 1 is linear.",
        ),
        (
            Column("sweep", "varied"),
            Column("triangles", "triangles", ","),
            Column("texels", "texels", ","),
            Column("shot_ms", "shot ms", ".2f"),
            Column("shot_power", "power", ".2f"),
            Column("see_ms", "see ms", ".2f"),
            Column("receive_ms", "receive ms", ".2f"),
            Column("receive_power", "power", ".2f"),
        ),
        (
            *(job("triangles", n, AT_TEXELS) for n in TRIANGLES),
            *(job("texels", AT_TRIANGLES, n) for n in TEXELS),
        ),
        Plot("n", ("shot_ms", "see_ms", "receive_ms"), "sweep", ("triangles or texels", "ms per shot")),
        measure.exponents,
    )


def _convergence() -> Table:
    scene, texels = CONVERGENCE

    def job(projection: str) -> Measure:
        theirs = published.WALLNER_FIGURE_6.get(projection)
        return lambda gpu, seconds: measure.convergence_row(gpu, seconds, scene, texels, projection, theirs)

    return Table(
        "convergence",
        f"Residual over shots by projection: {scene}",
        published.WALLNER.format("figure 6: shootings until converged, a living room"),
        (
            f"Shots until so much of the emitted power is unshot, as far as {measure.SOLVE} times the seconds of other "
            "measurements go. Imbalance: emitted power that is neither absorbed, nor unshot, nor gone from the scene. "
            "tables.json holds the curves.",
        ),
        (
            Column("projection", "projection"),
            Column("texels", "texels", ","),
            *(Column(measure.level_key(level), f"{level:.0%}", ",") for level in measure.LEVELS),
            Column("shots", "shots in all", ","),
            Column("seconds", "s", ".1f"),
            Column("imbalance", "imbalance", "+.2%"),
            Column("their_shots", "their shots", ","),
        ),
        tuple((name, job(name)) for name in PROJECTIONS),
        Plot("shots", ("curve",), "projection", ("shots", "unshot share")),
    )


def _wallner_2() -> Table:
    def job(theirs: published.RmsRow) -> Measure:
        return lambda gpu, seconds: measure.rms_row(gpu, seconds, theirs)

    return Table(
        "wallner2",
        "Hemispheres against the hemicube: Cornell box",
        published.WALLNER.format("table 2: RMS of lightmaps"),
        (
            f"Ours: RMS and mean FLIP of the picture, sRGB from 0 to 1, each solved to {measure.LEVELS[-1]:.0%} unshot or, "
            f"without them, for {measure.SOLVE} times the seconds of other measurements. Regular: uniform texels as fine as "
            "the finest leaves of adaptive ones. Theirs: RMS.",
        ),
        (
            Column("subdivision", "subdivision"),
            Column("level", "level"),
            Column("size", "their px"),
            Column("hemicube_texels", "texels", ","),
            Column("stereographic_rms", "stereographic", ".6f"),
            Column("nonlinear_rms", "nonlinear", ".6f"),
            Column("stereographic_flip", "stereographic FLIP", ".4f", FLIP),
            Column("nonlinear_flip", "nonlinear FLIP", ".4f", FLIP),
            *(Column(f"{name}_s", f"{name} s", ".1f") for name in PROJECTIONS),
            *(Column(f"{name}_unshot", "unshot", ".1%") for name in PROJECTIONS),
            Column("their_stereographic", "their stereographic", ".6f"),
            Column("their_nonlinear", "their nonlinear", ".6f"),
        ),
        tuple((f"{r.subdivision} {r.level}, {r.size} px", job(r)) for r in published.WALLNER_TABLE_2),
    )
