"""Residual over shots by projection, beside the shots until convergence of [Wallner10, figure 6]."""

from __future__ import annotations

from functools import partial

from app.atlas.options import AtlasOptions
from app.bench.papers.published import WALLNER, WALLNER_FIGURE_6
from app.bench.papers.table import SOLVE, Plot, Table
from app.bench.solves import timed_solve
from app.bench.timing import BATCH
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.session.batch import opened
from app.solvers import ShootingOptions
from app.util.tables import Column, Row
from app.visibility.projections import PROJECTIONS

SCENE, TEXELS = "museum", 31_000
LEVELS = (0.5, 0.2, 0.1, 0.05, 0.02, 0.01)  # of residual


def measure_row(gpu: Gpu, seconds: float, projection: str) -> Row:
    """Shots until so much is unshot."""
    options = ShootingOptions(projection=projection, residual=LEVELS[-1])
    with opened(gpu, SCENE, AtlasOptions(texels=TEXELS), LightmapOptions(), options) as (lightmap, solver):
        solve = timed_solve(gpu, solver, BATCH, SOLVE * seconds)
        row: Row = {"scene": SCENE, "texels": lightmap.texel_count, "imbalance": solver.energy().imbalance_share}
    row |= {"projection": projection, "their_shots": WALLNER_FIGURE_6.get(projection)}
    row |= {"shots": solve.done, "seconds": solve.seconds}
    row |= {level_key(level): first_below(solve.curve, level) for level in LEVELS}
    return row | {"curve": solve.curve}


def level_key(level: float) -> str:
    return f"shots_to_{level:g}"


def first_below(curve: list[tuple[int, float]], level: float) -> int | None:
    """Shots of the first point at or below a residual; None if it never came so far."""
    return next((shots for shots, residual in curve if residual <= level), None)


TABLE = Table(
    "convergence",
    f"Residual over shots by projection: {SCENE}",
    WALLNER.format("figure 6: shootings until converged, a living room"),
    (
        f"Shots until so much of the emitted power is unshot, as far as {SOLVE} times the seconds of other measurements go. "
        "Imbalance: emitted power that is neither absorbed, nor unshot, nor gone from the scene. tables.json holds the curves.",
    ),
    (
        Column("projection", "projection"),
        Column("texels", "texels", ","),
        *(Column(level_key(level), f"{level:.0%}", ",") for level in LEVELS),
        Column("shots", "shots in all", ","),
        Column("seconds", "s", ".1f"),
        Column("imbalance", "imbalance", "+.2%"),
        Column("their_shots", "their shots", ","),
    ),
    tuple((name, partial(measure_row, projection=name)) for name in PROJECTIONS),
    Plot("shots", ("curve",), "projection", ("shots", "unshot share")),
)
