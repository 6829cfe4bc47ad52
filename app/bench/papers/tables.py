"""``glowtree bench tables``: the tables of [Coombe03], [Wallner10], [Kahl22] and [Shcherbakov19], ours beside theirs, on one
machine in one run.

Theirs are published numbers of other scenes on other hardware: they show proportions. A table is a file of its own and a line of
``all_tables``. Its rows are measured one by one; what is finished is written when the rest is stopped.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from app.bake import prepare_directory
from app.bench.machine import load, machine
from app.bench.papers import (
    convergence,
    coombe_subdivision,
    equal_error,
    kahl,
    scaling,
    shcherbakov,
    wallner_rms,
    wallner_time,
)
from app.bench.papers.table import Table
from app.errors import UserError
from app.gpu import Gpu, gpu_context
from app.util.console import Console, Tell
from app.util.json_text import json_text
from app.util.tables import Row, csv_text, markdown_table, missing


def all_tables() -> tuple[Table, ...]:
    tables = coombe_subdivision, equal_error, wallner_time, scaling, convergence, wallner_rms, kahl, shcherbakov
    return tuple(module.TABLE for module in tables)


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
        from app.bench.papers.table_plot import draw

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
        if verdicts := table.verdicts(rows):
            parts.append("\n".join(f"- {line}" for line in verdicts))
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


def table_names(text: str) -> tuple[str, ...]:
    """Of ``--only``: names with commas between them."""
    known = [t.name for t in all_tables()]
    names = tuple(text.split(","))
    for name in names:
        if name not in known:
            raise argparse.ArgumentTypeError(f"{name}: must be one of {', '.join(known)}")
    return names
