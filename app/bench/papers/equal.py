"""Texels and seconds for equal error: uniform and adaptive lightmaps against the dense float64 reference.

At random points of all lit sides, even in area: E from the lightmap against E gathered from the dense solution,
B = E + ρ F B [Goral84]; see points.py and truth.py.
"""

from __future__ import annotations

import functools

import numpy as np

from app.atlas.options import AtlasOptions
from app.bench.papers.measure import shoot
from app.gpu import Gpu
from app.lightmap.at_points import irradiance_of
from app.lightmap.options import LightmapOptions
from app.reference.metrics import median_local, quantile_local, relative_rms
from app.reference.truth import Truth, dense_truth
from app.scene.load import load_scene
from app.session.batch import opened
from app.solvers import ShootingOptions
from app.util.tables import Row

SCENE = "cornell-box"
POINTS = 1500
CONVERGED = 1e-3  # residual, far below the errors that are compared


@functools.cache
def reference() -> Truth:
    """At random points of the scene. Takes minutes the first time."""
    return dense_truth(load_scene(SCENE), count=POINTS)


def error_row(gpu: Gpu, atlas: AtlasOptions, gradient: float | None = None) -> Row:
    """Error, texels, shots and seconds of a solve, however long it takes. gradient: of quadtrees; uniform texels without."""
    truth, light = reference(), LightmapOptions()
    if gradient is not None:
        light = light.replace(adaptive=True, gradient=gradient)
    with opened(gpu, SCENE, atlas, light, ShootingOptions(residual=CONVERGED)) as (lightmap, solver):
        run = shoot(gpu, solver, np.inf)
        E = irradiance_of(lightmap, truth.points)
        texels = lightmap.texel_count
    row: Row = {"subdivision": "adaptive" if light.adaptive else "uniform", "tile": atlas.tile, "gradient": gradient}
    row |= {
        "texels": texels,
        "shots": run.shots,
        "seconds": run.seconds,
        "rms": relative_rms(E, truth.E),
        "median": median_local(E, truth.E),
    }
    return row | {"q90": quantile_local(E, truth.E, 0.9)}


def compared(rows: list[Row]) -> None:
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
