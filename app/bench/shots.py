"""``glowtree bench shots``: milliseconds per shot, by pass, at the sizes of [Coombe03, table 1]: 31K, 172K and 1.6M texels.

The Cornell box is cut three times, then a museum and a grotto of the paper's sizes. A shot is timed in batches, as the headless
solver shoots, and alone, as the viewer does; the passes one by one, each to the end of its GPU work, for the shooters that the
solve chooses. Every figure is a median. Bandwidth is what the receiver pass must move at least: H and r of each texel that
gets light, read and written, and of shaped tiles position, area, normal and ids; beside it a plain copy in the same run.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from app.atlas.lightmap import Lightmap
from app.atlas.options import AtlasOptions
from app.bench.copy import copy_bandwidth
from app.console import Console
from app.gpu import Gpu, gpu_context
from app.loading import load
from app.options import from_flags
from app.solvers import ShootingOptions, UniformShooting
from app.solvers.shooting.stages import BATCH

SIZES = (
    ("cornell-box", 31_000),
    ("cornell-box", 172_000),
    ("cornell-box", 1_600_000),
    ("museum", 172_000),
    ("grotto", 1_600_000),
)
SECONDS = 3.0  # per figure and size
BLEND_BYTES = 2 * 32  # H and r read and written, RGBA32F
READ_BYTES = 16 + 8  # position, area; normal, ids


def bench_shots(flags: argparse.Namespace) -> int:
    """Print the table."""
    console = Console(quiet=flags.json)
    options = from_flags(ShootingOptions, flags)
    rows = []
    with gpu_context() as gpu, console.progress("shots") as tell:
        for i, (name, texels) in enumerate(SIZES):
            tell(f"{name}, {texels:,} texels", i / len(SIZES))
            rows.append(_measure(gpu, name, texels, options))
        values = {"renderer": gpu.limits.renderer, "options": options.as_dict(), "sizes": rows}
    console.result(values, _table(values))
    return 0


def _measure(gpu: Gpu, name: str, texels: int, options: ShootingOptions) -> dict[str, Any]:
    nodes = load(name, AtlasOptions(texels=texels)).nodes
    lightmap = Lightmap(gpu, nodes, storage=options.storage)
    solver = UniformShooting(gpu, lightmap, options)
    solver.step(BATCH)
    shot_ms = _median_ms(gpu, lambda: solver.step(BATCH)) / BATCH
    single_ms = _median_ms(gpu, lambda: solver.step(1))
    passes, received = _passes(gpu, solver)
    shaped = len(nodes.shaped_tiles) / max(nodes.tiles, 1)
    moved = received * (BLEND_BYTES + shaped * READ_BYTES) / (passes["receive"] * 1e-3)
    row = {
        "scene": name,
        "triangles": len(nodes.scene.triangles),
        "texels": lightmap.texel_count,
        "shot_ms": shot_ms,
        "single_shot_ms": single_ms,
        "pass_ms": passes,
        "receive_gb_per_s": moved * 1e-9,
        "copy_gb_per_s": copy_bandwidth(gpu, lightmap.size) * 1e-9,
    }
    solver.release()
    lightmap.release()
    return row


def _median_ms(gpu: Gpu, run: Callable[[], object]) -> float:
    """Median wall time of ``run`` to the end of its GPU work [ms]."""
    gpu.ctx.finish()
    times: list[float] = []
    end = time.perf_counter() + SECONDS
    while time.perf_counter() < end or len(times) < 5:
        times.append(_ms(gpu, run))
    return statistics.median(times)


def _ms(gpu: Gpu, run: Callable[[], object]) -> float:
    start = time.perf_counter()
    run()
    gpu.ctx.finish()
    return (time.perf_counter() - start) * 1e3


def _passes(gpu: Gpu, solver: UniformShooting) -> tuple[dict[str, float], float]:
    """Median milliseconds of each pass over the shooters of a solve, and the mean number of texels that get light."""
    times: dict[str, list[float]] = {label: [] for label in solver.passes()}
    samples: list[int] = []
    end = time.perf_counter() + SECONDS
    while time.perf_counter() < end or len(samples) < 5:
        for label, run in solver.passes().items():
            query = gpu.ctx.query(samples=True)
            with query:
                times[label].append(_ms(gpu, run))
            if label == "receive":
                samples.append(query.samples)
    return {label: statistics.median(values) for label, values in times.items()}, statistics.mean(samples)


def _table(values: dict[str, Any]) -> str:
    """Markdown."""
    labels = list(values["sizes"][0]["pass_ms"])
    head = ["scene", "triangles", "texels", f"shot, of {BATCH}", "shot, alone", *labels, "GB/s", "copy GB/s", "share"]
    lines = [head, ["---"] * len(head)]
    for row in values["sizes"]:
        numbers = [row["shot_ms"], row["single_shot_ms"], *(row["pass_ms"][label] for label in labels)]
        rates = row["receive_gb_per_s"], row["copy_gb_per_s"]
        cells = [row["scene"], f"{row['triangles']:,}", f"{row['texels']:,}", *(f"{n:.2f}" for n in numbers)]
        lines.append([*cells, *(f"{rate:.1f}" for rate in rates), f"{rates[0] / rates[1]:.0%}"])
    widths = np.max([[len(cell) for cell in line] for line in lines], axis=0)
    table = "\n".join("| " + " | ".join(c.rjust(w) for c, w in zip(line, widths, strict=True)) + " |" for line in lines)
    note = f"ms per shot and per pass (choose, book: per batch of {BATCH}); GB/s: of the receiver pass"
    return f"{values['renderer']}\n{note}\n\n{table}"
