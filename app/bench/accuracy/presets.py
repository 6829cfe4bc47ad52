"""``glowtree bench presets``: what the settings that come along, and those of a file, cost and how far off their light is, by
scene.

Each is solved from nothing until converged; the clock stands while it is compared with a reference, at random points,
see reference/irradiance.py.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from app.atlas.cuts import cut_at_contacts
from app.atlas.options import AtlasOptions
from app.bench.accuracy.error_curve import look_at, solve_curve
from app.errors import UserError
from app.gpu import Gpu, gpu_context
from app.lightmap.options import LightmapOptions
from app.reference.irradiance import ReferenceIrradiance, choose_reference, reference_irradiance
from app.scene.load import NO_LIGHT, load_scene
from app.scene.model import Scene
from app.session.batch import opened
from app.session.settings import PRESETS, Settings, settings_of
from app.solvers import DEFAULT_SOLVER, SOLVERS
from app.util.console import Console
from app.util.tables import Column, Row, markdown_table

LONGEST = 600.0  # s, of a solve
COLUMNS = (
    Column("scene", "scene"),
    Column("preset", "preset"),
    Column("texels", "texels", ","),
    Column("seconds", "s", ".1f"),
    Column("cpu_seconds", "CPU s", ".1f"),
    Column("rms", "RMS", ".2%"),
    Column("median", "median", ".2%"),
)
NOTE = "Seconds of solving until converged, without loading; irradiance against a reference, at random lit points."


def bench_presets(flags: argparse.Namespace) -> int:
    """Print the table. Raises UserError. Ctrl-C ends it with what was measured."""
    console, rows, interrupted = Console(quiet=flags.json), list[Row](), False
    chosen = {name: settings_of(name) for name in PRESETS}
    if flags.settings is not None:
        chosen[Path(flags.settings).stem] = flags.given
    with gpu_context() as gpu, console.progress("presets") as tell:
        renderer = gpu.limits.renderer
        try:
            for source in flags.scenes:
                scene = load_scene(source)
                if not scene.emits:
                    raise UserError(f"{source}: {NO_LIGHT}")
                kind = choose_reference(scene, None)
                scene = cut_at_contacts(scene).scene  # as solvers see it: points are told by its triangles
                reference = reference_irradiance(scene, kind, flags.paths, tell)
                for nth, (name, settings) in enumerate(chosen.items()):
                    tell(f"{Path(source).stem}, {name}", nth / len(chosen))
                    row = measured(gpu, scene, reference, settings)
                    rows.append({"scene": Path(source).stem, "preset": name} | row)
        except KeyboardInterrupt:
            interrupted = True
    table = markdown_table(COLUMNS, rows)
    console.result({"renderer": renderer, "presets": rows}, f"{renderer}\n\n{NOTE}\n\n{table}")
    return 130 if interrupted else 0


def measured(gpu: Gpu, scene: Scene, reference: ReferenceIrradiance, settings: Settings) -> Row:
    """Time and error by these settings."""
    name = settings.solver or DEFAULT_SOLVER
    family = SOLVERS[name]
    atlas, light = settings.of("texels", AtlasOptions()), settings.of("lightmap", LightmapOptions())
    with opened(gpu, scene, atlas, light, settings.of(name, family.options()), name) as (lightmap, solver):
        return solve_curve(gpu, solver, family.batch, LONGEST, lambda: look_at(lightmap, solver, family, reference))[-1]


__all__ = ["bench_presets"]
