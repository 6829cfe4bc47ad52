"""The words after ``glowtree bench``: the flags of each measurement, and what it runs."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from app.atlas.options import AtlasOptions
from app.bench.choices import CURVES_END
from app.commands.command import SOLVER_OF, Command, add_commands
from app.commands.flags import Parser, json_flag, output_flag, positive, scene_flags, settings_flag, solver_flags
from app.lightmap.options import LightmapOptions
from app.options import add_flags, specs
from app.solvers import SOLVERS, Family

ERROR_SCENES = ("furnace", "cornell-box")
EDIT_RAYS = 192  # of each texel
EDIT_SCENES = ("cornell-box", "museum")
RAY_SCENES = ("cornell-box", "museum", "grotto")
PRESET_SCENES = ("cornell-box", "textured-room")
HARD_SIZES = ("small", "large")


def bench_flags(parser: Parser, family: Family) -> None:
    """Its words."""
    benches = {
        "shots": Command("milliseconds per shot, by pass, at the papers' sizes", _shots_flags, _bench_shots),
        "rays": Command(
            "millions of rays a second, and what the tree they walk takes to build", _rays_flags, _bench_rays
        ),
        "open": Command(
            "seconds from a file to its first light, by stage, new and from the caches", _open_flags, _bench_open
        ),
        "edits": Command("milliseconds from an edit of a material to its light", _edits_flags, _bench_edits),
        "frames": Command("milliseconds per frame of the viewer, by part", _frames_flags, _bench_frames),
        "tables": Command("the papers' tables, ours beside theirs; minutes", _tables_flags, _bench_tables),
        "error": Command("error against time and shots, of each method; minutes", _error_flags, _bench_error),
        "presets": Command("time and error of the settings that come along; minutes", _presets_flags, _bench_presets),
        "hard": Command(
            "scenes that are hard on a light solver, against the answers they must give", _hard_flags, _bench_hard
        ),
    }
    add_commands(parser, "what", benches, family)


# -- flags ------------------------------------------------------------------------------------------------------------


def _scenes_flag(parser: Parser, default: Sequence[str]) -> None:
    help = f"files or names (default {' '.join(default)})"
    parser.add_argument("scenes", nargs="*", default=default, metavar="scene", help=help)


def _shots_flags(shots: Parser, family: Family) -> None:
    settings_flag(shots)
    json_flag(shots)
    add_flags(shots, SOLVERS["shooting"].options)
    add_flags(shots, LightmapOptions, only=("storage",))


def _rays_flags(rays: Parser, family: Family) -> None:
    _scenes_flag(rays, RAY_SCENES)
    rays.add_argument(
        "--seconds", type=positive(float), default=2.0, metavar="S", help="of each figure, about (default %(default)s)"
    )
    json_flag(rays)


def _open_flags(opening: Parser, family: Family) -> None:
    scene_flags(opening, optional=True)
    json_flag(opening)
    solver_flags(opening, family)


def _edits_flags(edits: Parser, family: Family) -> None:
    _scenes_flag(edits, EDIT_SCENES)
    add_flags(edits, AtlasOptions, only=("texels",))
    before = EDIT_RAYS if family is SOLVERS[SOLVER_OF["bench edits"]] else None
    edits.add_argument(
        f"--{family.unit}",
        dest="work",
        type=positive(int),
        default=before,
        metavar="N",
        help=f"{family.unit} before the edit (default {before or 'until converged'})",
    )
    edits.add_argument(
        "--repeats",
        type=positive(int),
        default=5,
        metavar="N",
        help="edits that each figure is of (default %(default)s)",
    )
    json_flag(edits)
    solver_flags(edits, family, default=SOLVER_OF["bench edits"])


def _frames_flags(frames: Parser, family: Family) -> None:
    scene_flags(frames, optional=True)
    hands = frames.add_mutually_exclusive_group()
    hands.add_argument("--drag", action="store_true", help="drag the sliders of the quadtrees (with --adaptive)")
    hands.add_argument(
        "--walk",
        nargs="?",
        const="village",
        metavar="PATH",
        help="walk along a path: its name or .toml (default village)",
    )
    json_flag(frames)
    solver_flags(frames, family)


def _tables_flags(tables: Parser, family: Family) -> None:
    output_flag(tables, "DIR", "the folder to write")
    tables.add_argument(
        "--only",
        type=_table_names,
        metavar="A,B",
        help="coombe1, equal, wallner1, scaling, convergence, wallner2, kahl, shcherbakov (default all)",
    )
    tables.add_argument(
        "--seconds",
        type=positive(float),
        default=2.0,
        metavar="S",
        help="of each measurement, of a solve ten times as long, of a walk thirty; loading comes on top (default 2)",
    )
    tables.add_argument("--plots", action="store_true", help="draw PNGs too (needs matplotlib)")
    json_flag(tables)


def _error_flags(error: Parser, family: Family) -> None:
    _scenes_flag(error, ERROR_SCENES)
    error.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="the folder to write")
    error.add_argument(
        "--methods",
        type=_method_names,
        default="uniform,adaptive,gathering,disc,item-id,level-1,level-3",
        metavar="A,B",
        help="all, or some of uniform, adaptive, gathering, gathering-adaptive, local, pairs, disc, item-id, depth, "
        "stereographic, nonlinear, rgba16f, fixed8, level-1, level-3 (default %(default)s)",
    )
    error.add_argument(
        "--peers",
        type=_peer_names,
        default=(),
        metavar="A,B",
        help="all, or some of other programs on the same plot: mitsuba, cycles, cycles-oidn (need glowtree[peers], or a Python "
        "with bpy and pyoidn that GLOWTREE_BLENDER_PYTHON names)",
    )
    error.add_argument(
        "--seconds",
        type=positive(float),
        default=30.0,
        metavar="S",
        help="of solving, for each curve at most (default 30)",
    )
    error.add_argument(
        "--texels",
        type=positive(int),
        metavar="N",
        help="uniform ones; quadtrees begin with a sixteenth (default: chosen from the scene)",
    )
    error.add_argument(
        "--reference",
        choices=("closed-form", "path-traced", "dense"),
        help="what errors are measured from (default: the first that can judge the scene)",
    )
    error.add_argument(
        "--paths",
        type=positive(int),
        default=16384,
        metavar="N",
        help="from each point of a path-traced reference (default 16384)",
    )
    settings_flag(error)
    json_flag(error)
    for row in SOLVERS.values():
        add_flags(error, row.options, defaults=CURVES_END)
    add_flags(error, LightmapOptions, only=[spec.name for spec in specs(LightmapOptions) if spec.name != "adaptive"])


def _presets_flags(presets: Parser, family: Family) -> None:
    _scenes_flag(presets, PRESET_SCENES)
    help = "from each point of a path-traced reference (default %(default)s)"
    presets.add_argument("--paths", type=positive(int), default=16384, metavar="N", help=help)
    settings_flag(presets)
    json_flag(presets)


def _hard_flags(hard: Parser, family: Family) -> None:
    hard.add_argument("--only", nargs="+", metavar="NAME", help="only these cases (default all)")
    help = "by this one only (default all but pairs, whose time grows with the square of the texels)"
    hard.add_argument("--solver", choices=tuple(SOLVERS), help=help)
    hard.add_argument("--size", choices=HARD_SIZES, default=HARD_SIZES[0], help="of scenes and texels (default small)")
    settings_flag(hard)
    json_flag(hard)


def _table_names(text: str) -> tuple[str, ...]:
    from app.bench.papers.tables import table_names

    return table_names(text)


def _method_names(text: str) -> tuple[str, ...]:
    from app.bench.accuracy.methods import method_names

    return method_names(text)


def _peer_names(text: str) -> tuple[str, ...]:
    from app.bench.peers.peers import peer_names

    return peer_names(text)


# -- measurements: each imports what it needs, so that --help and errors answer at once --------------------------------


def _bench_shots(flags: argparse.Namespace) -> int:
    from app.bench.speed.shots import bench_shots

    return bench_shots(flags)


def _bench_rays(flags: argparse.Namespace) -> int:
    from app.bench.speed.rays import bench_rays

    return bench_rays(flags)


def _bench_open(flags: argparse.Namespace) -> int:
    from app.bench.speed.opening import bench_open

    return bench_open(flags)


def _bench_edits(flags: argparse.Namespace) -> int:
    from app.bench.speed.edits import bench_edits

    return bench_edits(flags)


def _bench_frames(flags: argparse.Namespace) -> int:
    from app.bench.speed.frames import bench_frames

    return bench_frames(flags)


def _bench_tables(flags: argparse.Namespace) -> int:
    from app.bench.papers.tables import bench_tables

    return bench_tables(flags)


def _bench_error(flags: argparse.Namespace) -> int:
    from app.bench.accuracy.error import bench_error

    return bench_error(flags)


def _bench_presets(flags: argparse.Namespace) -> int:
    from app.bench.accuracy.presets import bench_presets

    return bench_presets(flags)


def _bench_hard(flags: argparse.Namespace) -> int:
    from app.validation.run import bench_hard

    return bench_hard(flags)
