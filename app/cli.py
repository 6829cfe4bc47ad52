"""The command line: glowtree view | shot | bake | info | bench | doctor.

Flags are the declared options of how scenes are cut, of the solver that ``--solver`` names, of how light is held and of the
display; nothing is listed twice. Bad input is one line on stderr and exit code 2; Ctrl-C ends early, keeps what is there, and
exits with 130.
"""

from __future__ import annotations

import argparse
import itertools
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from app import __version__
from app.atlas.options import AtlasOptions
from app.bake.options import BakeOptions
from app.commands.flags import (
    Parser,
    fill,
    json_flag,
    output_flag,
    path_flags,
    positive,
    reference_flag,
    scene_flags,
    settings_flag,
    settings_named,
    size_flag,
    solver_flags,
    stop_flags,
)
from app.errors import UserError
from app.lightmap.options import LightmapOptions
from app.options import add_flags, specs
from app.render.options import DisplayOptions
from app.session.checkpoint import CheckpointOptions
from app.solvers import DEFAULT_SOLVER, SOLVERS, Family

ERROR_SCENES = ("furnace", "cornell-box")
EDIT_RAYS = 192  # of each texel
# Where nobody names a solver: shooting is what there is to watch; gathering is at 2 % first in every scene, by `bench error`,
# and made to be edited.
SOLVER_OF = {"bake": "gathering", "bench edits": "gathering"}
CURVES_END = {"noise": 1e-3}  # of `bench error`: later than a bake, for what a method comes to
EDIT_SCENES = ("cornell-box", "museum")
RAY_SCENES = ("cornell-box", "museum", "grotto")
PRESET_SCENES = ("cornell-box", "textured-room")
HARD_SIZES = ("small", "large")


def run(arguments: list[str]) -> int:
    """Run one command. Returns the exit code."""
    arguments = arguments or ["view"]
    try:
        settings = settings_named(arguments)
    except UserError as error:
        print(f"glowtree: --settings {error}", file=sys.stderr)
        return 2
    solver = solver_named(arguments, settings.solver)
    flags = build_parser(solver).parse_args(arguments)
    fill(flags, solver, settings)
    command: Callable[[argparse.Namespace], int] = flags.command
    try:
        code = command(flags)
        sys.stdout.flush()
        return code
    except UserError as error:
        print(f"glowtree: {error}", file=sys.stderr)
        return 2
    except MemoryError:
        print("glowtree: not enough memory: ask for fewer --texels", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("glowtree: stopped, nothing was written", file=sys.stderr)
        return 130
    except BrokenPipeError:  # whoever read stdout has gone, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


class Command(NamedTuple):
    """What a word after ``glowtree`` does. flags: adds its own, and those of a solver, to a parser. run: with them, returns the
    exit code; none where another word follows."""

    help: str
    flags: Callable[[Parser, Family], None]
    run: Callable[[argparse.Namespace], int] | None = None


def solver_named(arguments: Sequence[str], other: str | None = None) -> str:
    """The solver that is asked for, whose flags are then known; where none is, or none of that name, the ``other`` one, else the
    command's default."""
    words = [word for argument in arguments for word in argument.split("=", 1)]
    named = [value for flag, value in itertools.pairwise(words) if flag == "--solver" and value in SOLVERS]
    command = " ".join(arguments[: 2 if arguments[:1] == ["bench"] else 1])
    return named[-1] if named else other or SOLVER_OF.get(command, DEFAULT_SOLVER)


def build_parser(solver: str = DEFAULT_SOLVER) -> Parser:
    """solver: whose options are flags."""
    parser = Parser(prog="glowtree", description="Interactive radiosity: watch light being shot until it converges.")
    parser.add_argument("--version", action="version", version=f"glowtree {__version__}")
    commands = {
        "view": Command("open the viewer", _view_flags, _view),
        "shot": Command("solve without a window and save a picture", _shot_flags, _shot),
        "bake": Command("solve and write scene.glb, irradiance.exr and report.json", _bake_flags, _bake),
        "info": Command("what a scene would take, before any work", _info_flags, _info),
        "bench": Command("measure on this machine", _bench_flags),
        "doctor": Command("what this machine has, and what is missing", _doctor_flags, _doctor),
    }
    _add_commands(parser, "command", commands, SOLVERS[solver])
    return parser


def _bench_flags(parser: Parser, family: Family) -> None:
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
    _add_commands(parser, "what", benches, family)


def _add_commands(parser: Parser, what: str, commands: Mapping[str, Command], family: Family) -> None:
    words = parser.add_subparsers(required=True, metavar=what, parser_class=Parser)
    for word, command in commands.items():
        own = words.add_parser(word, help=command.help, description=command.help[0].upper() + command.help[1:] + ".")
        command.flags(own, family)
        if command.run:
            own.set_defaults(command=command.run)


# -- flags -------------------------------------------------------------------------------------------------------------


def _view_flags(view: Parser, family: Family) -> None:
    scene_flags(view, optional=True)
    solver_flags(view, family)
    size_flag(view, "window")
    reference_flag(view)
    view.add_argument("--frames", type=positive(int), metavar="N", help="close after N frames (for tests)")
    add_flags(view, DisplayOptions)


def _shot_flags(shot: Parser, family: Family) -> None:
    scene_flags(shot)
    output_flag(
        shot, "FILE", "the .png to write; with --path a .webp, .gif or animated .png, or a folder for numbered ones"
    )
    size_flag(shot, "picture")
    shot.add_argument("--camera", metavar="NAME", help="a camera of the scene (default: its first)")
    path_flags(shot)
    reference_flag(shot)
    shot.add_argument("--ui", action="store_true", help="draw the viewer's panels too")
    json_flag(shot)
    solver_flags(shot, family)
    stop_flags(shot, family)
    add_flags(shot, DisplayOptions)


def _bake_flags(bake: Parser, family: Family) -> None:
    scene_flags(bake, several=True)
    output_flag(bake, "DIR", "the folder to write; of several scenes, one in it for each")
    help = "lay the lightmap out anew, also where the file has a layout for it (TEXCOORD_1 within 0 to 1, without overlaps)"
    bake.add_argument("--unwrap", action="store_true", help=help)
    add_flags(bake, BakeOptions)
    add_flags(bake, CheckpointOptions)
    help = "go on with the bake that was not finished in DIR: with the same scene and flags, but for when to stop"
    bake.add_argument("--resume", action="store_true", help=help)
    json_flag(bake)
    solver_flags(bake, family, default=SOLVER_OF["bake"])
    stop_flags(bake, family)


def _info_flags(info: Parser, family: Family) -> None:
    scene_flags(info)
    settings_flag(info)
    add_flags(info, LightmapOptions, only=("adaptive", "storage", "depth"))
    json_flag(info)


def _scenes_flag(parser: Parser, default: Sequence[str]) -> None:
    help = f"files or names (default {' '.join(default)})"
    parser.add_argument("scenes", nargs="*", default=default, metavar="scene", help=help)


def _shots_flags(shots: Parser, family: Family) -> None:
    json_flag(shots)
    add_flags(shots, SOLVERS["shooting"].options)
    add_flags(shots, LightmapOptions, only=("storage",))


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


def _presets_flags(presets: Parser, family: Family) -> None:
    _scenes_flag(presets, PRESET_SCENES)
    help = "from each point of a path-traced reference (default %(default)s)"
    presets.add_argument("--paths", type=positive(int), default=16384, metavar="N", help=help)
    json_flag(presets)


def _hard_flags(hard: Parser, family: Family) -> None:
    hard.add_argument("--only", nargs="+", metavar="NAME", help="only these cases (default all)")
    help = "by this one only (default all but pairs, whose time grows with the square of the texels)"
    hard.add_argument("--solver", choices=tuple(SOLVERS), help=help)
    hard.add_argument("--size", choices=HARD_SIZES, default=HARD_SIZES[0], help="of scenes and texels (default small)")
    json_flag(hard)


def _error_flags(error: Parser, family: Family) -> None:
    _scenes_flag(error, ERROR_SCENES)
    error.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="the folder to write")
    error.add_argument(
        "--methods",
        type=_method_names,
        default="uniform,adaptive,gathering,disc,item-id,level-1,level-3",
        metavar="A,B",
        help="all, or some of uniform, adaptive, gathering, gathering-adaptive, disc, item-id, depth, stereographic, nonlinear, "
        "rgba16f, fixed8, level-1, level-3 (default %(default)s)",
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
    json_flag(error)
    for row in SOLVERS.values():
        add_flags(error, row.options, defaults=CURVES_END)
    add_flags(error, LightmapOptions, only=[spec.name for spec in specs(LightmapOptions) if spec.name != "adaptive"])


def _doctor_flags(doctor: Parser, family: Family) -> None:
    json_flag(doctor)


def _table_names(text: str) -> tuple[str, ...]:
    from app.bench.papers.tables import table_names

    return table_names(text)


def _method_names(text: str) -> tuple[str, ...]:
    from app.bench.accuracy.methods import method_names

    return method_names(text)


def _peer_names(text: str) -> tuple[str, ...]:
    from app.bench.peers.peers import peer_names

    return peer_names(text)


# -- commands: each imports what it needs, so that --help and errors answer at once ------------------------------------


def _view(flags: argparse.Namespace) -> int:
    from app.commands.view import view_or_shot

    return view_or_shot(flags)


def _shot(flags: argparse.Namespace) -> int:
    from app.commands.shot import shot

    return shot(flags)


def _bake(flags: argparse.Namespace) -> int:
    from app.commands.bake import bake

    return bake(flags)


def _info(flags: argparse.Namespace) -> int:
    from app.commands.info import info

    return info(flags)


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


def _doctor(flags: argparse.Namespace) -> int:
    from app.commands.doctor import doctor

    return doctor(flags)
