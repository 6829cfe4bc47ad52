"""The command line: glowtree view | shot | bake | info | bench | doctor.

Flags are the declared options of scene cutting, shooting and display; nothing is listed twice. Bad input is one line on stderr
and exit code 2; Ctrl-C ends early, keeps what is there, and exits with 130.
"""

from __future__ import annotations

import argparse
import difflib
import os
import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from app import __version__
from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.lightmap.options import STORAGE
from app.options import add_flags
from app.render.options import DisplayOptions
from app.solvers import ShootingOptions

DEFAULT_SCENE = "cornell-box"
ERROR_SCENES = ("furnace", "cornell-box")
HARD_SIZES = ("small", "large")
ALIKE = 0.75  # share of letters in common that makes a flag a likely slip for another; all begin with the same dashes


class Parser(argparse.ArgumentParser):
    """argparse, with errors on one line. A flag must be written out, and one that is unknown is named with the nearest."""

    def __init__(self, **keywords: Any) -> None:
        super().__init__(**keywords, allow_abbrev=False)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        flags, unknown = super().parse_known_args(args, namespace)
        if unknown:
            known = re.findall(r"--[\w-]+", self.format_usage())
            close = difflib.get_close_matches(unknown[0].split("=")[0], known, n=1, cutoff=ALIKE)
            self.error(f"unknown argument {unknown[0]}" + (f"; did you mean {close[0]}?" if close else ""))
        return flags, unknown

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


def run(arguments: list[str]) -> int:
    """Run one command. Returns the exit code."""
    flags = build_parser().parse_args(arguments or ["view"])
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
    """What a word after ``glowtree`` does. flags: adds its own to a parser. run: with them, returns the exit code; none where
    another word follows."""

    help: str
    flags: Callable[[Parser], None]
    run: Callable[[argparse.Namespace], int] | None = None


def build_parser() -> Parser:
    parser = Parser(prog="glowtree", description="Interactive radiosity: watch light being shot until it converges.")
    parser.add_argument("--version", action="version", version=f"glowtree {__version__}")
    commands = {
        "view": Command("open the viewer", _view_flags, _view),
        "shot": Command("solve without a window and save a picture", _shot_flags, _shot),
        "bake": Command("solve and write scene.glb, irradiance.exr and report.json", _bake_flags, _bake),
        "info": Command("what a scene would take, before any work", _info_flags, _info),
        "bench": Command("measure on this machine", _bench_flags),
        "doctor": Command("what this machine has, and what is missing", _json_flag, _doctor),
    }
    _add_commands(parser, "command", commands)
    return parser


def _bench_flags(parser: Parser) -> None:
    benches = {
        "shots": Command("milliseconds per shot, by pass, at the papers' sizes", _shots_flags, _bench_shots),
        "frames": Command("milliseconds per frame of the viewer, by part", _frames_flags, _bench_frames),
        "tables": Command("the papers' tables, ours beside theirs; minutes", _tables_flags, _bench_tables),
        "error": Command("error against time and shots, of each method; minutes", _error_flags, _bench_error),
        "hard": Command(
            "scenes that are hard on a light solver, against the answers they must give", _hard_flags, _bench_hard
        ),
    }
    _add_commands(parser, "what", benches)


def _add_commands(parser: Parser, what: str, commands: Mapping[str, Command]) -> None:
    words = parser.add_subparsers(required=True, metavar=what, parser_class=Parser)
    for word, command in commands.items():
        own = words.add_parser(word, help=command.help, description=command.help[0].upper() + command.help[1:] + ".")
        command.flags(own)
        if command.run:
            own.set_defaults(command=command.run)


# -- flags -------------------------------------------------------------------------------------------------------------


def _view_flags(view: Parser) -> None:
    _scene_flags(view, optional=True)
    add_flags(view, ShootingOptions)
    _size_flag(view, "window")
    _reference_flag(view)
    view.add_argument("--frames", type=_positive(int), metavar="N", help="close after N frames (for tests)")
    add_flags(view, DisplayOptions)


def _shot_flags(shot: Parser) -> None:
    _scene_flags(shot)
    _output_flag(shot, "PNG", "the picture to write")
    _size_flag(shot, "picture")
    shot.add_argument("--camera", metavar="NAME", help="a camera of the scene (default: its first)")
    _reference_flag(shot)
    shot.add_argument("--ui", action="store_true", help="draw the viewer's panels too")
    _json_flag(shot)
    add_flags(shot, ShootingOptions)
    _stop_flags(shot)
    add_flags(shot, DisplayOptions)


def _bake_flags(bake: Parser) -> None:
    _scene_flags(bake)
    _output_flag(bake, "DIR", "the folder to write")
    _json_flag(bake)
    add_flags(bake, ShootingOptions)
    _stop_flags(bake)


def _info_flags(info: Parser) -> None:
    _scene_flags(info)
    _json_flag(info)
    default = ShootingOptions().storage
    info.add_argument("--storage", choices=tuple(STORAGE), default=default, help="as for shot and bake")


def _shots_flags(shots: Parser) -> None:
    _json_flag(shots)
    add_flags(shots, ShootingOptions)


def _frames_flags(frames: Parser) -> None:
    frames.add_argument("scene", nargs="?", default=DEFAULT_SCENE, help=f"a file or a name (default {DEFAULT_SCENE})")
    frames.add_argument("--drag", action="store_true", help="drag the sliders of the quadtrees (with --adaptive)")
    _json_flag(frames)
    add_flags(frames, AtlasOptions)
    add_flags(frames, ShootingOptions)


def _tables_flags(tables: Parser) -> None:
    _output_flag(tables, "DIR", "the folder to write")
    tables.add_argument(
        "--only",
        type=_table_names,
        metavar="A,B",
        help="coombe1, equal, wallner1, scaling, convergence, wallner2 (default all)",
    )
    tables.add_argument(
        "--seconds",
        type=_positive(float),
        default=2.0,
        metavar="S",
        help="of each measurement, of a solve ten times as long; loading comes on top (default 2)",
    )
    tables.add_argument("--plots", action="store_true", help="draw PNGs too (needs matplotlib)")
    _json_flag(tables)


def _hard_flags(hard: Parser) -> None:
    hard.add_argument("--only", nargs="+", metavar="NAME", help="only these cases (default all)")
    hard.add_argument("--size", choices=HARD_SIZES, default=HARD_SIZES[0], help="of scenes and texels (default small)")
    _json_flag(hard)


def _error_flags(error: Parser) -> None:
    error.add_argument(
        "scenes",
        nargs="*",
        default=ERROR_SCENES,
        metavar="scene",
        help=f"files or names (default {' '.join(ERROR_SCENES)})",
    )
    error.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="the folder to write")
    error.add_argument(
        "--methods",
        type=_method_names,
        default="uniform,adaptive,disc,item-id,level-1,level-3",
        metavar="A,B",
        help="all, or some of uniform, adaptive, disc, item-id, depth, stereographic, nonlinear, rgba16f, fixed8, level-1, "
        "level-3 (default %(default)s)",
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
        type=_positive(float),
        default=30.0,
        metavar="S",
        help="of solving, for each curve at most (default 30)",
    )
    error.add_argument(
        "--texels",
        type=_positive(int),
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
        type=_positive(int),
        default=16384,
        metavar="N",
        help="from each point of a path-traced reference (default 16384)",
    )
    _json_flag(error)
    add_flags(error, ShootingOptions)


def _scene_flags(parser: Parser, *, optional: bool = False) -> None:
    help = "a file (.glb .gltf .obj .ply .stl .toml) or the name of a scene"
    if optional:
        parser.add_argument("scene", nargs="?", default=DEFAULT_SCENE, help=f"{help} (default {DEFAULT_SCENE})")
    else:
        parser.add_argument("scene", help=help)
    parser.add_argument("--light", action="store_true", help="add a ceiling light")
    add_flags(parser, AtlasOptions)


def _output_flag(parser: Parser, what: str, help: str) -> None:
    parser.add_argument("-o", "--output", type=Path, required=True, metavar=what, help=help)


def _reference_flag(parser: Parser) -> None:
    help = "a bake of the same scene, to compare with: the error, and --layer error and --show"
    parser.add_argument("--reference", type=Path, metavar="DIR", help=help)


def _size_flag(parser: Parser, what: str) -> None:
    default = (1280, 720)
    help = f"{what} size (default {default[0]}x{default[1]})"
    parser.add_argument("--size", type=_size, default=default, metavar="WxH", help=help)


def _json_flag(parser: Parser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")


def _stop_flags(parser: Parser) -> None:
    stop = parser.add_argument_group("stop (whichever comes first; --residual is always on)")
    stop.add_argument("--shots", type=_positive(int), metavar="N", help="after N shots")
    stop.add_argument("--time", type=_positive(float), metavar="S", help="after S seconds of shooting")


# -- values ------------------------------------------------------------------------------------------------------------


def _positive(kind: type[int] | type[float]) -> Callable[[str], float]:
    def read(text: str) -> float:
        try:
            value = kind(text)
        except ValueError:
            value = kind(0)
        if not 0 < value < 1e12:
            raise argparse.ArgumentTypeError(f"{text}: must be a {'whole ' if kind is int else ''}number above 0")
        return value

    return read


def _size(text: str) -> tuple[int, int]:
    sides = re.fullmatch(r"(\d{1,6})x(\d{1,6})", text.lower(), re.ASCII)
    width, height = map(int, sides.groups()) if sides else (0, 0)
    if not (16 <= width <= 16384 and 16 <= height <= 16384):
        raise argparse.ArgumentTypeError(f"{text}: must be WIDTHxHEIGHT, each 16 to 16384")
    return width, height


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
    from app.commands.headless import view_or_shot

    return view_or_shot(flags)


def _shot(flags: argparse.Namespace) -> int:
    from app.commands.headless import shot

    return shot(flags)


def _bake(flags: argparse.Namespace) -> int:
    from app.commands.headless import bake

    return bake(flags)


def _info(flags: argparse.Namespace) -> int:
    from app.commands.info import info

    return info(flags)


def _bench_shots(flags: argparse.Namespace) -> int:
    from app.bench.speed.shots import bench_shots

    return bench_shots(flags)


def _bench_frames(flags: argparse.Namespace) -> int:
    from app.bench.speed.frames import bench_frames

    return bench_frames(flags)


def _bench_tables(flags: argparse.Namespace) -> int:
    from app.bench.papers.tables import bench_tables

    return bench_tables(flags)


def _bench_error(flags: argparse.Namespace) -> int:
    from app.bench.accuracy.error import bench_error

    return bench_error(flags)


def _bench_hard(flags: argparse.Namespace) -> int:
    from app.validation.run import bench_hard

    return bench_hard(flags)


def _doctor(flags: argparse.Namespace) -> int:
    from app.commands.doctor import doctor

    return doctor(flags)
