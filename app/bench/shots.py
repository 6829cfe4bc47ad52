"""``glowtree bench shots``: milliseconds per shot, by pass, at the sizes of [Coombe03, table 1]: 31K, 172K and 1.6M texels.

The Cornell box is cut three times, then a museum and a grotto of the paper's sizes. A shot is timed alone, as the viewer shoots,
and in batches, as the headless solver does (means over the shots made); the passes of a batch one by one, each to the end of its
GPU work, for the shooters that the solve chooses (medians, divided by the shots of a batch). Bandwidth is what the receiver pass
must move at least: H and r of each texel that gets light, read and written once in a batch, and of shaped tiles position, area,
normal and ids; beside it a plain copy in the same run.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

from app.atlas.lightmap import STORAGE, Lightmap
from app.atlas.options import AtlasOptions
from app.bench.copy import copy_bandwidth
from app.bench.report import markdown
from app.console import Console
from app.gpu import Gpu, gpu_context
from app.loading import load
from app.options import from_flags
from app.solvers import ShootingOptions, Solver, UniformShooting
from app.solvers.shooting.stages import BATCH

SIZES = (
    ("cornell-box", 31_000),
    ("cornell-box", 172_000),
    ("cornell-box", 1_600_000),
    ("museum", 172_000),
    ("grotto", 1_600_000),
)
SECONDS = 3.0  # per figure and size
WARM_UP = 1.0  # seconds of shots before: lamps first, and programs are compiled when they first draw
BLENDED = 2 * 2 * 4  # numbers per texel: H and r, read and written, RGBA
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
    ms_per_shot(gpu, solver, 1, WARM_UP)
    single_ms = ms_per_shot(gpu, solver, 1, SECONDS)
    ms_per_shot(gpu, solver, BATCH, WARM_UP)
    shot_ms = ms_per_shot(gpu, solver, BATCH, SECONDS)
    passes, received = passes_ms(gpu, solver, SECONDS)
    shaped = len(nodes.shaped_tiles) / max(nodes.tiles, 1)
    blend_bytes = BLENDED * int(STORAGE[options.storage][1:])
    moved = received * (blend_bytes + shaped * READ_BYTES) / (passes["receive"] * 1e-3)
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


def ms_per_shot(gpu: Gpu, solver: Solver[ShootingOptions], batch: int, seconds: float) -> float:
    """Mean wall time of a shot that was made [ms]; a batch leaves out those too weak beside its best."""
    before = solver.poll(wait=True).shots
    gpu.ctx.finish()
    start = time.perf_counter()
    while time.perf_counter() < start + seconds:
        solver.step(batch)
        solver.poll()
    gpu.ctx.finish()
    elapsed = time.perf_counter() - start
    return elapsed * 1e3 / max(solver.poll(wait=True).shots - before, 1)


def _ms(gpu: Gpu, run: Callable[[], object]) -> float:
    start = time.perf_counter()
    run()
    gpu.ctx.finish()
    return (time.perf_counter() - start) * 1e3


def passes_ms(gpu: Gpu, solver: Solver[ShootingOptions], seconds: float) -> tuple[dict[str, float], float]:
    """Median milliseconds of each pass per shot of a batch, over the shooters of a solve, and how many texels are written.
    Leaves the light wrong."""
    times: dict[str, list[float]] = {label: [] for label in solver.passes(BATCH)}
    samples: list[int] = []
    end = time.perf_counter() + seconds
    while time.perf_counter() < end or len(samples) < 5:
        for label, run in solver.passes(BATCH).items():
            query = gpu.ctx.query(samples=True)
            with query:
                times[label].append(_ms(gpu, run))
            if label == "receive":
                samples.append(query.samples)
    return {label: statistics.median(values) / BATCH for label, values in times.items()}, statistics.mean(
        samples
    ) / BATCH


def _table(values: dict[str, Any]) -> str:
    """Markdown."""
    labels = list(values["sizes"][0]["pass_ms"])
    head = ["scene", "triangles", "texels", f"shot, of {BATCH}", "shot, alone", *labels, "GB/s", "copy GB/s", "share"]
    lines = []
    for row in values["sizes"]:
        numbers = [row["shot_ms"], row["single_shot_ms"], *(row["pass_ms"][label] for label in labels)]
        rates = row["receive_gb_per_s"], row["copy_gb_per_s"]
        cells = [row["scene"], f"{row['triangles']:,}", f"{row['texels']:,}", *(f"{n:.2f}" for n in numbers)]
        lines.append([*cells, *(f"{rate:.1f}" for rate in rates), f"{rates[0] / rates[1]:.0%}"])
    note = f"ms per shot, and of each pass per shot of a batch of {BATCH}; GB/s: of the receiver pass"
    return f"{values['renderer']}\n{note}\n\n{markdown(head, lines)}"
