"""``glowtree bench shots``: milliseconds per shot, by pass, at the sizes of [Coombe03, table 1]: 31K, 172K and 1.6M texels.

The Cornell box is cut three times, then a museum and a grotto of the paper's sizes. A shot is timed alone, as the viewer shoots,
and in batches, as the headless solver does (means over the shots made); the passes of a batch one by one, each to the end of its
GPU work, for the shooters that the solve chooses (medians, divided by the shots of a batch). Audits, of the first strong shots of
a solve only, are timed by themselves. What bounds them is measured beside them, in turns: the bytes that they must
move (receiver_traffic.py) against a plain copy, and the receiver pass without its arithmetic.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from app.atlas.options import AtlasOptions
from app.bench.speed.memory_copy import MemoryCopy
from app.bench.speed.receiver_traffic import ReceiverTraffic
from app.bench.timing import BATCH, ms_per_shot, passes_ms
from app.gpu import Gpu, gpu_context
from app.lightmap.lightmap import Lightmap
from app.lightmap.options import LightmapOptions
from app.options import from_flags
from app.session.loading import load
from app.solvers import ShootingOptions
from app.solvers.shooting.solver import Shooting
from app.util.console import Console
from app.util.tables import Column, Row, markdown, markdown_table

SIZES = (
    ("cornell-box", 31_000),
    ("cornell-box", 172_000),
    ("cornell-box", 1_600_000),
    ("museum", 172_000),
    ("grotto", 1_600_000),
)
SECONDS = 3.0  # per figure and size
WARM_UP = 1.0  # seconds of shots before: lamps first, and programs are compiled when they first draw
HALF = 0.5  # of the time, or of a copy's bandwidth: from here on it is what bounds a pass
BOUNDS = (
    Column("scene", "scene"),
    Column("texels", "texels", ","),
    Column("shot_mb", "MB, shot", ".2f"),
    Column("shot_gb_per_s", "GB/s", ".2f"),
    Column("copy_gb_per_s", "copy GB/s", ".1f"),
    Column("shot_share", "share", ".0%"),
    Column("receive_mb", "MB, receive", ".2f"),
    Column("receive_ms", "ms", ".2f"),
    Column("receive_share", "share", ".0%"),
    Column("copy_ms", "ms, copy", ".2f"),
    Column("stream_ms", "ms, reads and blends", ".2f"),
    Column("bound", "bound by"),
)
NOTE = (
    f"Milliseconds per shot, and of each pass per shot of a batch of {BATCH}. Audit: of one shot that is tried before it is "
    "made, which the first, strong ones of a solve are; the shots here are not."
)
BOUNDS_NOTE = (
    "What bounds a shot of a batch: the megabytes that all its passes must move at least, at what rate they do, and its share of "
    "a copy's in the same run. Then the receiver pass by itself; beside its time that of a copy of as many bytes, and of the "
    "same texels drawn with the same reads and blends but nothing computed. It is bound by memory where it reaches half of the "
    "copy's rate; by arithmetic where leaving it out saves half of the time or more; by fragments where reads and blends do not "
    "reach half of the copy's rate by themselves, so that memory waits for the renderer; else by several of them."
)


def bench_shots(flags: argparse.Namespace) -> int:
    """Print the table."""
    console = Console(quiet=flags.json)
    options, light = from_flags(ShootingOptions, flags), from_flags(LightmapOptions, flags)
    rows = []
    with gpu_context() as gpu, console.progress("shots") as tell:
        for i, (name, texels) in enumerate(SIZES):
            tell(f"{name}, {texels:,} texels", i / len(SIZES))
            rows.append(_measure(gpu, name, texels, options, light))
        values = {
            "renderer": gpu.limits.renderer,
            "options": options.as_dict() | {"storage": light.storage},
            "sizes": rows,
        }
    console.result(values, _table(values))
    return 0


def _measure(gpu: Gpu, name: str, texels: int, options: ShootingOptions, light: LightmapOptions) -> dict[str, Any]:
    pool = load(name, AtlasOptions(texels=texels)).pool
    lightmap = Lightmap(gpu, pool, light)
    shooting = Shooting(gpu, lightmap, options, audits=False)  # as later in a solve, when no shot is strong
    ms_per_shot(gpu, shooting, 1, WARM_UP)
    single_ms = ms_per_shot(gpu, shooting, 1, SECONDS)
    ms_per_shot(gpu, shooting, BATCH, WARM_UP)
    shot_ms = ms_per_shot(gpu, shooting, BATCH, SECONDS)
    traffic, copy = ReceiverTraffic(gpu, shooting), MemoryCopy(gpu, lightmap.size)
    beside = {"stream": traffic.run, "copy": copy.run, "audit": shooting.try_one}
    times = passes_ms(gpu, shooting, SECONDS, beside)
    stream_ms, copy_ms, audit_ms = (times.pop(name) for name in beside)
    row = {
        "scene": name,
        "triangles": len(pool.scene.triangles),
        "texels": lightmap.texel_count,
        "shot_ms": shot_ms,
        "single_shot_ms": single_ms,
        "pass_ms": times,
        "audit_ms": audit_ms * BATCH,
    }
    row |= bounds(times, traffic.moved(), stream_ms, copy.moved / (BATCH * copy_ms * 1e-3))
    copy.release()
    shooting.release()
    lightmap.release()
    return row


def bounds(pass_ms: Mapping[str, float], moved: Mapping[str, float], stream_ms: float, copy_rate: float) -> Row:
    """What bounds a shot and its receiver pass: bytes that each pass must move, and a copy's bytes per second."""
    shot_bytes, shot_ms = sum(moved.values()), sum(pass_ms.values())
    receive_ms, copy_ms = pass_ms["receive"], moved["receive"] / copy_rate * 1e3
    if copy_ms >= HALF * receive_ms:
        bound = "memory"
    elif stream_ms <= HALF * receive_ms:
        bound = "arithmetic"
    else:
        bound = "fragments" if copy_ms <= HALF * stream_ms else "several"
    return {
        "shot_mb": shot_bytes * 1e-6,
        "shot_gb_per_s": shot_bytes / shot_ms * 1e-6,
        "copy_gb_per_s": copy_rate * 1e-9,
        "shot_share": shot_bytes / shot_ms * 1e3 / copy_rate,
        "moved_mb": {label: value * 1e-6 for label, value in moved.items()},
        "receive_mb": moved["receive"] * 1e-6,
        "receive_ms": receive_ms,
        "receive_share": copy_ms / receive_ms,
        "copy_ms": copy_ms,
        "stream_ms": stream_ms,
        "bound": bound,
    }


def _table(values: dict[str, Any]) -> str:
    """Markdown."""
    labels = list(values["sizes"][0]["pass_ms"])
    head = ["scene", "triangles", "texels", f"shot, of {BATCH}", "shot, alone", *labels, "audit"]
    lines = []
    for row in values["sizes"]:
        numbers = [row["shot_ms"], row["single_shot_ms"], *(row["pass_ms"][label] for label in labels)]
        numbers.append(row["audit_ms"])
        lines.append([row["scene"], f"{row['triangles']:,}", f"{row['texels']:,}", *(f"{n:.2f}" for n in numbers)])
    parts = [values["renderer"], NOTE, markdown(head, lines), BOUNDS_NOTE, markdown_table(BOUNDS, values["sizes"])]
    return "\n\n".join(parts)
