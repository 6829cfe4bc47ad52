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
from collections.abc import Callable, Sequence

from app import __version__
from app.bake.options import BakeOptions
from app.bench.commands import bench_flags
from app.commands.command import SOLVER_OF, Command, add_commands
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
from app.options import add_flags
from app.render.options import DisplayOptions
from app.session.checkpoint import CheckpointOptions
from app.solvers import DEFAULT_SOLVER, SOLVERS, Family
from app.util.interrupt import stopped


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
        print(stopped(arguments), file=sys.stderr)
        return 130
    except BrokenPipeError:  # whoever read stdout has gone, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


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
        "bench": Command("measure on this machine", bench_flags),
        "doctor": Command("what this machine has, and what is missing", _doctor_flags, _doctor),
    }
    add_commands(parser, "command", commands, SOLVERS[solver])
    return parser


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


def _doctor_flags(doctor: Parser, family: Family) -> None:
    json_flag(doctor)


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


def _doctor(flags: argparse.Namespace) -> int:
    from app.commands.doctor import doctor

    return doctor(flags)
