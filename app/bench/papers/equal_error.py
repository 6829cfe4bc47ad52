"""Texels and seconds that uniform and adaptive lightmaps take for equal error, against the dense float64 reference.

At random points of all lit sides, even in area: E from the lightmap against E gathered from the dense solution,
B = E + ρ F B [Goral84]; see reference/irradiance.py.
"""

from __future__ import annotations

import functools

import numpy as np

from app.atlas.options import AtlasOptions
from app.bench.papers.table import Measure, Plot, Table
from app.bench.solves import timed_solve
from app.bench.timing import BATCH
from app.gpu import Gpu
from app.lightmap.at_points import irradiance_of
from app.lightmap.options import LightmapOptions
from app.reference.irradiance import PATCHES, ReferenceIrradiance, dense_irradiance
from app.reference.metrics import median_local, quantile_local, relative_rms
from app.scene.load import load_scene
from app.session.batch import opened
from app.solvers import ShootingOptions
from app.util.tables import Column, Row

SCENE = "cornell-box"
POINTS = 1500
CONVERGED = 1e-3  # residual, far below the errors that are compared
UNIFORM_TEXELS = 8_000, 32_000, 128_000, 256_000
TREES = (16, 0.5), (8, 0.5), (8, 0.25)  # texels along a leaf, gradient


@functools.cache
def reference() -> ReferenceIrradiance:
    """At random points of the scene. Takes minutes the first time."""
    return dense_irradiance(load_scene(SCENE), count=POINTS)


def measure_row(gpu: Gpu, atlas: AtlasOptions, gradient: float | None = None) -> Row:
    """Error, texels, shots and seconds of a solve, however long it takes. gradient: of quadtrees; uniform texels without."""
    right, light = reference(), LightmapOptions()
    if gradient is not None:
        light = light.replace(adaptive=True, gradient=gradient)
    with opened(gpu, SCENE, atlas, light, ShootingOptions(residual=CONVERGED)) as (lightmap, solver):
        solve = timed_solve(gpu, solver, BATCH, np.inf)
        E = irradiance_of(lightmap, right.points)
        texels = lightmap.texel_count
    row: Row = {"subdivision": "adaptive" if light.adaptive else "uniform", "tile": atlas.tile, "gradient": gradient}
    row |= {
        "texels": texels,
        "shots": solve.done,
        "seconds": solve.seconds,
        "rms": relative_rms(E, right.E),
        "median": median_local(E, right.E),
    }
    return row | {"q90": quantile_local(E, right.E, 0.9)}


def add_equal_uniform(rows: list[Row]) -> None:
    """Enter in each adaptive row what uniform texels would take for its RMS: between the measured ones, straight in logarithms;
    nothing where its error is beyond theirs."""
    uniform = sorted((row for row in rows if row["subdivision"] == "uniform"), key=lambda row: -float(row["rms"]))
    if len(uniform) < 2:
        return
    errors = np.log([row["rms"] for row in uniform])[::-1]
    for row in rows:
        at = np.log(row["rms"])
        if row["subdivision"] != "adaptive" or not errors[0] <= at <= errors[-1]:
            continue
        for key in ("texels", "seconds"):
            equal = float(np.exp(np.interp(at, errors, np.log([u[key] for u in uniform])[::-1])))
            row |= {f"equal_{key}": equal, f"{key}_share": row[key] / equal}


def _job(atlas: AtlasOptions, gradient: float | None = None) -> Measure:
    return lambda gpu, seconds: measure_row(gpu, atlas, gradient)


TABLE = Table(
    "equal",
    "Texels and seconds for equal error",
    "no numbers for this",
    (
        f"Cornell box down to {CONVERGED:.1%} unshot, all seconds counted. Error: irradiance at {POINTS} random points against "
        f"the dense float64 reference of {PATCHES:,} patches.",
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
        *((f"{texels:,} uniform texels", _job(AtlasOptions(texels=texels))) for texels in UNIFORM_TEXELS),
        *(
            (f"leaves of {tile}, gradient {gradient:g}", _job(AtlasOptions(tile=tile), gradient))
            for tile, gradient in TREES
        ),
    ),
    Plot("seconds", ("rms",), "subdivision", ("s", "relative RMS")),
    add_equal_uniform,
)
