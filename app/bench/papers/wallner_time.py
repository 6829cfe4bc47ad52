"""Milliseconds per iteration by projection, in rooms of as many triangles and texels as in [Wallner10, table 1].

Ours is a shot of one patch; the paper's iteration is all patches of one triangle.
"""

from __future__ import annotations

from functools import partial

from app.atlas.options import AtlasOptions
from app.bench.papers.published import WALLNER, WALLNER_TABLE_1, WallnerRow
from app.bench.papers.sphere_rooms import room_of
from app.bench.papers.table import Plot, Table
from app.bench.timing import BATCH, NEVER, even_residual, ms_per_shot
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.session.batch import opened
from app.solvers import ShootingOptions
from app.util.tables import Column, Row
from app.visibility.projections import PROJECTIONS

PAPER_MAP = 512  # px, a hemicube's edge in [Wallner10]


def measure_row(gpu: Gpu, seconds: float, theirs: WallnerRow) -> Row:
    """Milliseconds per shot by projection in a room of their triangles and texels."""
    options = ShootingOptions(residual=NEVER, resolution=PAPER_MAP)
    row: Row = {
        "scene": theirs.scene,
        "their_texels": theirs.texels,
        "their_cube_ms": theirs.cube_s / theirs.iterations * 1e3,
        "their_sphere_ms": theirs.sphere_s / theirs.iterations * 1e3,
    }
    scene, atlas = room_of(theirs.triangles), AtlasOptions(texels=theirs.texels)
    with opened(gpu, scene, atlas, LightmapOptions(), options) as (lightmap, solver):
        row |= {"triangles": len(lightmap.scene.triangles), "texels": lightmap.texel_count}
        for name in PROJECTIONS:
            solver.set_options(options.replace(projection=name))
            even_residual(lightmap)
            ms_per_shot(gpu, solver, BATCH, seconds / 4)
            row[f"{name}_ms"] = ms_per_shot(gpu, solver, BATCH, seconds)
    return row


TABLE = Table(
    "wallner1",
    "Time per iteration by projection",
    WALLNER.format("table 1"),
    (
        f"Milliseconds per shot of one patch, hemicube faces of {PAPER_MAP} px, in rooms with spheres of exactly as many "
        "triangles as their scenes, see app/bench/papers/sphere_rooms.py. All patches begin with the same residual.",
        "Their iteration is all shots from one triangle, and its time a share of the whole run with all that comes before and "
        "after.",
    ),
    (
        Column("scene", "their scene"),
        Column("triangles", "triangles", ","),
        Column("texels", "texels", ","),
        *(Column(f"{name}_ms", f"{name} ms", ".2f") for name in PROJECTIONS),
        Column("their_texels", "their texels", ","),
        Column("their_cube_ms", "their hemicube ms", ".1f"),
        Column("their_sphere_ms", "their nonlinear ms", ".1f"),
    ),
    tuple((row.scene, partial(measure_row, theirs=row)) for row in WALLNER_TABLE_1),
    Plot("texels", tuple(f"{name}_ms" for name in PROJECTIONS), "triangles", ("texels", "ms per shot")),
)
