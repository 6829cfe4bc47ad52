"""Flags that several commands share, and how their values are read."""

from __future__ import annotations

import argparse
import difflib
import itertools
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from app.atlas.options import AtlasOptions
from app.lightmap.options import LightmapOptions
from app.options import Options, add_flags, option, specs
from app.scene.images import ImageError, linear_from_srgb
from app.scene.options import FileOptions
from app.scene.sky import DEFAULT_SUN, Sky, Sun
from app.scene.sky_image import SUFFIXES, read_sky_image
from app.session.settings import PRESETS, Settings, settings_of
from app.solvers import DEFAULT_SOLVER, SOLVERS, Family
from app.ui.state import Pace
from app.util.words import one_line

DEFAULT_SCENE = "cornell-box"
ALIKE = 0.75  # share of letters in common that makes a flag a likely slip for another; all begin with the same dashes


@dataclass(frozen=True)
class WalkOptions(Options):
    """What is done between the pictures of a walk."""

    work_per_frame: int = option(
        1, "work between two pictures of a --path, until converged", unit="pieces", minimum=0, maximum=100_000
    )


class Parser(argparse.ArgumentParser):
    """argparse, with errors on one line. A flag must be written out, and one that is unknown is named with the nearest."""

    def __init__(self, **keywords: Any) -> None:
        super().__init__(**keywords, allow_abbrev=False)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        flags, unknown = super().parse_known_args(args, namespace)
        if unknown:
            flag = unknown[0].split("=")[0]
            known = re.findall(r"--[\w-]+", self.format_usage())
            owners = [f"--solver {name}" for name, family in SOLVERS.items() if flag in _flags_of(family)]
            close = difflib.get_close_matches(flag, known, n=1, cutoff=ALIKE)
            if owners and "--solver" in known:
                self.error(f"{flag} needs {' or '.join(owners)}")
            self.error(f"unknown argument {unknown[0]}{f'; did you mean {close[0]}?' if close else ''}")
        return flags, unknown

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"{self.prog}: {message} (see {self.prog} --help)\n")


def _flags_of(family: Family) -> set[str]:
    """The flags that a solver's options and its unit of work have."""
    own = specs(family.options)
    return {f"--{family.unit}", *(s.flag for s in own), *(f"--no-{s.flag[2:]}" for s in own if s.type is bool)}


def scene_flags(parser: Parser, *, optional: bool = False, several: bool = False) -> None:
    help = "a file (.glb .gltf .obj .ply .stl .toml) or the name of a scene"
    if several:
        parser.add_argument("scenes", nargs="+", metavar="scene", help=f"{help}, or several of them")
    elif optional:
        parser.add_argument("scene", nargs="?", default=DEFAULT_SCENE, help=f"{help} (default {DEFAULT_SCENE})")
    else:
        parser.add_argument("scene", help=help)
    parser.add_argument("--light", action="store_true", help="add a ceiling light")
    help = "the sky of a scene that has none: a map of it (.hdr .exr), clear, or an even colour #rrggbb"
    parser.add_argument("--sky", type=_sky, metavar="FILE", help=help)
    help = "where the sun stands, degrees from north over east and above the horizon (in a clear sky 135,40)"
    parser.add_argument("--sun", type=_sun, metavar="AZIMUTH,HEIGHT", help=help)
    add_flags(parser, FileOptions)
    add_flags(parser, AtlasOptions)


def settings_flag(parser: Parser) -> None:
    help = f"settings from a .toml file, or {', '.join(PRESETS)}; flags come before them"
    parser.add_argument("--settings", metavar="FILE", help=help)


def settings_named(arguments: Sequence[str]) -> Settings:
    """Those that are asked for by --settings, before flags are read: which ones there are depends on the solver. Raises
    UserError."""
    words = [word for argument in arguments for word in argument.split("=", 1)]
    named = [value for flag, value in itertools.pairwise(words) if flag == "--settings"]
    return settings_of(named[-1], {"pace": Pace}) if named else Settings()


def fill(flags: argparse.Namespace, solver: str, settings: Settings) -> None:
    """Give the flags that were not given the values of settings, as far as the command has such flags: no two options share one.
    solver: that is asked for by a flag or settings."""
    flags.given = settings
    if hasattr(flags, "solver") and (flags.solver is not None or settings.solver is not None):
        flags.solver = solver
    for values in settings.tables.values():
        for name, value in values.items():
            if getattr(flags, name, 0) is None:
                setattr(flags, name, value)


def solver_flags(parser: Parser, family: Family, *, default: str = DEFAULT_SOLVER) -> None:
    """Settings; which solver, its options, and how light is held."""
    settings_flag(parser)
    help = "; ".join(f"{name}: {row.help}" for name, row in SOLVERS.items())
    parser.add_argument("--solver", choices=tuple(SOLVERS), default=default, help=f"{help} (default %(default)s)")
    add_flags(parser, family.options)
    add_flags(parser, LightmapOptions)


def output_flag(parser: Parser, what: str, help: str) -> None:
    parser.add_argument("-o", "--output", type=Path, required=True, metavar=what, help=help)


def reference_flag(parser: Parser) -> None:
    help = "a bake of the same scene, to compare with: the error, and --layer error and --show"
    parser.add_argument("--reference", type=Path, metavar="DIR", help=help)


def path_flags(parser: Parser) -> None:
    """A walk instead of one picture."""
    help = "a walk of the camera instead of one picture: a .toml file or the name of one that comes along"
    parser.add_argument("--path", metavar="FILE", help=help)
    add_flags(parser, WalkOptions)


def size_flag(parser: Parser, what: str) -> None:
    default = (1280, 720)
    help = f"{what} size (default {default[0]}x{default[1]})"
    parser.add_argument("--size", type=_size, default=default, metavar="WxH", help=help)


def json_flag(parser: Parser) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")


def stop_flags(parser: Parser, family: Family) -> None:
    stop = parser.add_argument_group(f"stop (whichever comes first; --{family.threshold} is always on)")
    after = f"after {family.words('N')}"
    stop.add_argument(f"--{family.unit}", dest="work", type=positive(int), metavar="N", help=after)
    stop.add_argument(
        "--time", type=positive(float), metavar="S", help="after S seconds of solving, or one piece of work"
    )
    for flag, what in (("--error", "median of local errors"), ("--error-rms", "relative RMS")):
        help = f"once the expected error, the {what}, is P per cent"
        stop.add_argument(flag, type=positive(float), metavar="P", help=help)


def sky_of(flags: argparse.Namespace) -> Sky | None:
    """The sky that --sky and --sun ask for; a clear one with a sun alone."""
    sky: Sky | None = flags.sky
    if flags.sun is None:
        return sky
    return Sky("clear", sun=flags.sun) if sky is None else replace(sky, sun=flags.sun)


# -- values ------------------------------------------------------------------------------------------------------------


def positive(kind: type[int] | type[float]) -> Callable[[str], float]:
    def read(text: str) -> float:
        try:
            value = kind(text)
        except ValueError:
            value = kind(0)
        if not 0 < value < 1e12:
            raise argparse.ArgumentTypeError(f"{text}: must be a {'whole ' if kind is int else ''}number above 0")
        return value

    return read


def _sky(text: str) -> Sky:
    if text == "clear":
        return Sky("clear", sun=DEFAULT_SUN)
    if re.fullmatch(r"#[0-9a-fA-F]{6}", text):
        encoded = np.frombuffer(bytes.fromhex(text[1:]), np.uint8).astype(np.float32) / np.float32(255)
        red, green, blue = linear_from_srgb(encoded).tolist()
        return Sky("uniform", (red, green, blue))
    path = Path(text).expanduser()
    if path.suffix.lower() not in SUFFIXES:
        raise argparse.ArgumentTypeError(f"{text}: must be a file {' or '.join(SUFFIXES)}, clear, or #rrggbb")
    try:
        return Sky("image", image=read_sky_image(path), name=path.name, path=path)
    except ImageError as error:
        raise argparse.ArgumentTypeError(f"{text}: is not a readable sky: {one_line(str(error))}") from error


def _sun(text: str) -> Sun:
    try:
        azimuth, height = map(float, text.split(","))
    except ValueError:
        azimuth = height = math.nan
    if not (math.isfinite(azimuth) and 0 < height <= 90):
        raise argparse.ArgumentTypeError(f"{text}: must be AZIMUTH,HEIGHT in degrees, the height above 0 and up to 90")
    return Sun(azimuth % 360, height)


def _size(text: str) -> tuple[int, int]:
    sides = re.fullmatch(r"(\d{1,6})x(\d{1,6})", text.lower(), re.ASCII)
    width, height = map(int, sides.groups()) if sides else (0, 0)
    if not (16 <= width <= 16384 and 16 <= height <= 16384):
        raise argparse.ArgumentTypeError(f"{text}: must be WIDTHxHEIGHT, each 16 to 16384")
    return width, height
