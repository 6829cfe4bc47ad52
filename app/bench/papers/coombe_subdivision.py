"""Texels and seconds per shot of uniform and adaptive subdivision, as in [Coombe03, table 1].

A shot is one patch of texels, made in batches as the headless solver does. Loading, unfolding and cutting are not timed.
"""

from __future__ import annotations

from functools import partial

from app.atlas.options import AtlasOptions
from app.bench.papers.published import COOMBE, COOMBE_TABLE_1, CoombeRow
from app.bench.papers.table import SOLVE, Plot, Table
from app.bench.solves import timed_solve
from app.bench.timing import BATCH, NEVER, ms_per_shot
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.session.batch import opened
from app.solvers import ShootingOptions
from app.util.tables import Column, Row

ROOTS = 2  # levels that a tree may grow: its finest leaves are as fine as the uniform texels beside them
DIRECT = 0.1  # share unshot when a tree is looked at: the light that makes shadows has been shot


def measure_row(gpu: Gpu, seconds: float, theirs: CoombeRow, texels: int | None = None) -> Row:
    """Uniform and adaptive texels and seconds per shot of one scene. texels: to aim at, if not theirs."""
    aim = texels or theirs.uniform_texels
    options = ShootingOptions(residual=DIRECT)
    with opened(gpu, theirs.scene, AtlasOptions(texels=aim), LightmapOptions(), options) as (lightmap, solver):
        uniform_texels, triangles = lightmap.texel_count, len(lightmap.scene.triangles)
        uniform = timed_solve(gpu, solver, BATCH, SOLVE * seconds)
    roots = AtlasOptions(texels=max(aim >> 2 * ROOTS, 1))
    quadtrees = LightmapOptions(adaptive=True, depth=ROOTS, budget=max(2 * aim, 65_536))
    with opened(gpu, theirs.scene, roots, quadtrees, options) as (lightmap, solver):
        adaptive = timed_solve(gpu, solver, BATCH, SOLVE * seconds)
        held = lightmap.texel_count
        solver.set_options(options.replace(residual=NEVER))
        later_ms = ms_per_shot(gpu, solver, BATCH, seconds)
    return {
        "scene": theirs.scene,
        "triangles": triangles,
        "uniform_texels": uniform_texels,
        "adaptive_texels": held,
        "uniform_s": uniform.seconds_each,
        "adaptive_s": adaptive.seconds_each,
        "adaptive_later_s": later_ms * 1e-3,
        "stable": "yes" if adaptive.converged else "no",
        "their_uniform_texels": theirs.uniform_texels,
        "their_adaptive_texels": theirs.adaptive_texels,
        "their_uniform_s": theirs.uniform_s,
        "their_adaptive_s": theirs.adaptive_s,
        "uniform_shots": uniform.done,
        "adaptive_shots": adaptive.done,
        "uniform_unshot": uniform.remaining,
        "adaptive_unshot": adaptive.remaining,
    }


TABLE = Table(
    "coombe1",
    "Uniform and adaptive subdivision",
    COOMBE,
    (
        f"Seconds per shot of a solve down to {DIRECT:.0%} unshot, or for {SOLVE} times as long as other measurements; of "
        "adaptive texels with all that their tree needs, earlier shots made again included.",
        f"Stable: the tree had stopped growing by then. Its finest leaves, {ROOTS} levels below its roots, are as fine as the "
        "uniform texels. Later: the shots that follow.",
    ),
    (
        Column("scene", "scene"),
        Column("uniform_texels", "uniform texels", ","),
        Column("adaptive_texels", "adaptive texels", ","),
        Column("uniform_s", "uniform s", ".5f"),
        Column("adaptive_s", "adaptive s", ".5f"),
        Column("adaptive_later_s", "later s", ".5f"),
        Column("stable", "stable"),
        Column("their_uniform_texels", "their uniform texels", ","),
        Column("their_adaptive_texels", "adaptive texels", ","),
        Column("their_uniform_s", "their uniform s", ".2f"),
        Column("their_adaptive_s", "adaptive s", ".2f"),
    ),
    tuple((row.scene, partial(measure_row, theirs=row)) for row in COOMBE_TABLE_1),
    Plot("uniform_texels", ("uniform_s", "adaptive_s", "their_uniform_s", "their_adaptive_s"), "", ("texels", "s")),
)
