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
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

from app import __version__
from app.atlas.lightmap import STORAGE
from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.options import add_flags
from app.render.options import DisplayOptions
from app.solvers import ShootingOptions

DEFAULT_SCENE = "cornell-box"
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


def build_parser() -> Parser:
    parser = Parser(prog="glowtree", description="Interactive radiosity: watch light being shot until it converges.")
    parser.add_argument("--version", action="version", version=f"glowtree {__version__}")
    commands = parser.add_subparsers(required=True, metavar="command", parser_class=Parser)

    view = _scene_command(commands, "view", _view, "open the viewer", optional=True)
    add_flags(view, ShootingOptions)
    view.add_argument("--size", type=_size, default=(1280, 720), metavar="WxH", help="window size (default 1280x720)")
    view.add_argument("--frames", type=_positive(int), metavar="N", help="close after N frames (for tests)")
    add_flags(view, DisplayOptions)

    shot = _scene_command(commands, "shot", _shot, "solve without a window and save a picture")
    shot.add_argument("-o", "--output", type=Path, required=True, metavar="PNG", help="the picture to write")
    shot.add_argument("--size", type=_size, default=(1280, 720), metavar="WxH", help="picture size (default 1280x720)")
    shot.add_argument("--camera", metavar="NAME", help="a camera of the scene (default: its first)")
    shot.add_argument("--ui", action="store_true", help="draw the viewer's panels too")
    _json_flag(shot)
    add_flags(shot, ShootingOptions)
    _stop_flags(shot)
    add_flags(shot, DisplayOptions)

    bake = _scene_command(commands, "bake", _bake, "solve and write scene.glb, irradiance.exr and report.json")
    bake.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="the folder to write")
    _json_flag(bake)
    add_flags(bake, ShootingOptions)
    _stop_flags(bake)

    info = _scene_command(commands, "info", _info, "what a scene would take, before any work")
    _json_flag(info)
    info.add_argument(
        "--storage", choices=tuple(STORAGE), default=ShootingOptions().storage, help="as for shot and bake"
    )

    bench = commands.add_parser("bench", help="measure", description="Measure on this machine.")
    benches = bench.add_subparsers(required=True, metavar="what", parser_class=Parser)
    shots = benches.add_parser("shots", help="milliseconds per shot, by pass, at the papers' sizes")
    _json_flag(shots)
    add_flags(shots, ShootingOptions)
    shots.set_defaults(command=_bench_shots)
    frames = benches.add_parser("frames", help="milliseconds per frame of the viewer, by part")
    frames.add_argument("scene", nargs="?", default=DEFAULT_SCENE, help=f"a file or a name (default {DEFAULT_SCENE})")
    frames.add_argument("--drag", action="store_true", help="drag the sliders of the quadtrees (with --adaptive)")
    _json_flag(frames)
    add_flags(frames, AtlasOptions)
    add_flags(frames, ShootingOptions)
    frames.set_defaults(command=_bench_frames)
    tables = benches.add_parser("tables", help="the papers' tables, ours beside theirs; minutes")
    tables.add_argument("-o", "--output", type=Path, required=True, metavar="DIR", help="the folder to write")
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
    tables.set_defaults(command=_bench_tables)

    hard = benches.add_parser("hard", help="scenes that are hard on a light solver, against the answers they must give")
    hard.add_argument("--only", nargs="+", metavar="NAME", help="only these cases (default all)")
    hard.add_argument("--size", choices=HARD_SIZES, default=HARD_SIZES[0], help="of scenes and texels (default small)")
    _json_flag(hard)
    hard.set_defaults(command=_bench_hard)

    doctor = commands.add_parser("doctor", help="what this machine has, and what is missing")
    _json_flag(doctor)
    doctor.set_defaults(command=_doctor)
    return parser


def _scene_command(
    commands: argparse._SubParsersAction[Parser],
    name: str,
    command: Callable[[argparse.Namespace], int],
    help: str,
    *,
    optional: bool = False,
) -> Parser:
    parser = commands.add_parser(name, help=help, description=help[0].upper() + help[1:] + ".")
    scene_help = "a file (.glb .gltf .obj .ply .stl .toml) or the name of a scene"
    if optional:
        parser.add_argument("scene", nargs="?", default=DEFAULT_SCENE, help=f"{scene_help} (default {DEFAULT_SCENE})")
    else:
        parser.add_argument("scene", help=scene_help)
    parser.add_argument("--light", action="store_true", help="add a ceiling light")
    add_flags(parser, AtlasOptions)
    parser.set_defaults(command=command)
    return parser


def _json_flag(parser: Parser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")


def _stop_flags(parser: Parser) -> None:
    stop = parser.add_argument_group("stop (whichever comes first; --residual is always on)")
    stop.add_argument("--shots", type=_positive(int), metavar="N", help="after N shots")
    stop.add_argument("--time", type=_positive(float), metavar="S", help="after S seconds of shooting")


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
    from app.bench.tables import table_names

    return table_names(text)


# Each command imports what it needs: --help and errors answer at once.


def _view(flags: argparse.Namespace) -> int:
    from app.headless import view_or_shot

    return view_or_shot(flags)


def _shot(flags: argparse.Namespace) -> int:
    from app.headless import shot

    return shot(flags)


def _bake(flags: argparse.Namespace) -> int:
    from app.headless import bake

    return bake(flags)


def _info(flags: argparse.Namespace) -> int:
    from app.info import info

    return info(flags)


def _bench_shots(flags: argparse.Namespace) -> int:
    from app.bench.shots import bench_shots

    return bench_shots(flags)


def _bench_frames(flags: argparse.Namespace) -> int:
    from app.bench.frames import bench_frames

    return bench_frames(flags)


def _bench_tables(flags: argparse.Namespace) -> int:
    from app.bench.tables import bench_tables

    return bench_tables(flags)


def _bench_hard(flags: argparse.Namespace) -> int:
    from app.bench.hard import bench_hard

    return bench_hard(flags)


def _doctor(flags: argparse.Namespace) -> int:
    from app.doctor import doctor

    return doctor(flags)
