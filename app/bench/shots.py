"""``glowtree bench shots``: milliseconds per shot, by pass, at the three sizes of [Coombe03, table 1].

Every pass is timed by the clock around ``glFinish``, alone, many times; its cost is the median. The whole shot is timed the same
way, in batches as the headless solver shoots. Bandwidth is what the receiver pass must move at least (read 24 and blend 2·32
bytes per texel that is not hidden) against a copy of the same textures measured in the same run.
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

SIZES = (("cornell-box", 31_000), ("museum", 172_000), ("grotto", 1_600_000))  # the paper's Cornell, Museum, Grotto
SECONDS = 1.0  # per pass and size
RECEIVE_BYTES = 24 + 2 * 32  # position, area, normal, ids; H and r read and written, in RGBA32F


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
    shot_ms = median_ms(gpu, lambda: solver.step(BATCH), SECONDS * 2) / BATCH
    single_ms = median_ms(gpu, lambda: solver.step(1), SECONDS * 2)
    passes = {label: median_ms(gpu, run, SECONDS) for label, run in solver.passes().items()}
    copied = copy_bandwidth(gpu, lightmap.size)
    moved = RECEIVE_BYTES * lightmap.texel_count / (passes["receive"] * 1e-3)
    row = {
        "scene": name,
        "triangles": len(nodes.scene.triangles),
        "texels": lightmap.texel_count,
        "shot_ms": shot_ms,
        "single_shot_ms": single_ms,
        "pass_ms": passes,
        "receive_gb_per_s": moved * 1e-9,
        "copy_gb_per_s": copied * 1e-9,
    }
    solver.release()
    lightmap.release()
    return row


def median_ms(gpu: Gpu, run: Callable[[], object], seconds: float) -> float:
    """Median wall time of ``run`` to the end of its GPU work [ms], over about so many seconds."""
    run()
    gpu.ctx.finish()
    times: list[float] = []
    end = time.perf_counter() + seconds
    while time.perf_counter() < end or len(times) < 5:
        start = time.perf_counter()
        run()
        gpu.ctx.finish()
        times.append((time.perf_counter() - start) * 1e3)
    return statistics.median(times)


def _table(values: dict[str, Any]) -> str:
    rows = values["sizes"]
    labels = list(rows[0]["pass_ms"])
    head = ["scene", "triangles", "texels", f"shot (of {BATCH})", "shot (of 1)", *labels, "receive GB/s", "copy GB/s"]
    lines = [head, ["---"] * len(head)]
    for row in rows:
        numbers = [row["shot_ms"], row["single_shot_ms"], *(row["pass_ms"][label] for label in labels)]
        rates = [row["receive_gb_per_s"], row["copy_gb_per_s"]]
        lines.append(
            [
                row["scene"],
                f"{row['triangles']:,}",
                f"{row['texels']:,}",
                *(f"{n:.2f}" for n in numbers),
                *(f"{r:.1f}" for r in rates),
            ]
        )
    widths = np.max([[len(cell) for cell in line] for line in lines], axis=0)
    table = "\n".join("| " + " | ".join(c.rjust(w) for c, w in zip(line, widths, strict=True)) + " |" for line in lines)
    return f"{values['renderer']}: ms per shot, and per pass of it (choose and zero: per batch of {BATCH})\n\n{table}"
