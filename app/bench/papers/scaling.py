"""How the milliseconds of a shot grow with triangles and with texels."""

from __future__ import annotations

import itertools

import numpy as np

from app.atlas.options import AtlasOptions
from app.bench.papers.sphere_rooms import room_of
from app.bench.papers.table import Measure, Plot, Table
from app.bench.timing import NEVER, even_residual, passes_ms
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.session.batch import opened
from app.solvers import ShootingOptions
from app.util.tables import Column, Row

TRIANGLES = (1_000, 3_000, 10_000, 30_000, 100_000, 300_000)
TEXELS = (10_000, 30_000, 100_000, 300_000, 1_000_000, 4_000_000)
AT_TEXELS, AT_TRIANGLES = 100_000, 10_000  # of the sweep over the other
PASSES = ("see", "receive")


def measure_row(gpu: Gpu, seconds: float, sweep: str, triangles: int, texels: int) -> Row:
    """Milliseconds per shot, the sum of its passes, and of the two large ones. sweep: which of the two numbers is varied."""
    scene, atlas = room_of(triangles), AtlasOptions(texels=texels)
    with opened(gpu, scene, atlas, LightmapOptions(), ShootingOptions(residual=NEVER)) as (lightmap, solver):
        even_residual(lightmap)
        passes = passes_ms(gpu, solver, seconds)
        row: Row = {"sweep": sweep, "triangles": len(lightmap.scene.triangles), "texels": lightmap.texel_count}
    return row | {"n": row[sweep], "shot_ms": sum(passes.values())} | {f"{name}_ms": passes[name] for name in PASSES}


def add_exponents(rows: list[Row]) -> None:
    """Enter in each row of a sweep by which power of n the times have grown since the row before."""
    for before, row in itertools.pairwise(rows):
        if before["sweep"] == row["sweep"]:
            grown = np.log(row["n"] / before["n"])
            for name in ("shot", "receive"):
                row[f"{name}_power"] = float(np.log(row[f"{name}_ms"] / before[f"{name}_ms"]) / grown)


def _job(sweep: str, triangles: int, texels: int) -> tuple[str, Measure]:
    label = f"{triangles:,} triangles, {texels:,} texels"
    return label, lambda gpu, seconds: measure_row(gpu, seconds, sweep, triangles, texels)


TABLE = Table(
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
        *(_job("triangles", n, AT_TEXELS) for n in TRIANGLES),
        *(_job("texels", AT_TRIANGLES, n) for n in TEXELS),
    ),
    Plot("n", ("shot_ms", "see_ms", "receive_ms"), "sweep", ("triangles or texels", "ms per shot")),
    add_exponents,
)
