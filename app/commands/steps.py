"""What commands have in common: a session as the flags ask for it, opened and solved with progress on the terminal."""

from __future__ import annotations

import argparse
import time
from typing import Any

from app.atlas.options import AtlasOptions
from app.commands.flags import sky_of
from app.errors import UserError
from app.lightmap.options import LightmapOptions
from app.options import Options, from_flags
from app.render.layers import LAYER_SHADERS, layers_with
from app.render.options import DisplayOptions
from app.scene.load import NO_LIGHT
from app.scene.options import FileOptions
from app.session.goal import options_for_error
from app.session.report import notes
from app.session.run import Keeper, NotFiniteError, Stop
from app.session.session import Session
from app.session.stats import Stats
from app.solvers import SOLVERS
from app.util.console import Console

__all__ = ["check_display", "estimate", "open_scene", "session_options", "solve", "stop_of"]


def session_options(flags: argparse.Namespace) -> dict[str, Any]:
    """What the flags say, as a Session takes it."""
    return {
        "solver": flags.solver,
        "options": _solver_options(flags),
        "atlas": from_flags(AtlasOptions, flags),
        "light": from_flags(LightmapOptions, flags),
        "default_light": flags.light,
        "sky": sky_of(flags),
    }


def _solver_options(flags: argparse.Namespace) -> Options:
    """What the flags say; where they ask for an error, and not how little may remain, no more remains than that error allows."""
    family = SOLVERS[flags.solver]
    options: Options = from_flags(family.options, flags)
    asked = [error for name in ("error", "error_rms") if (error := getattr(flags, name, None)) is not None]
    if not asked or getattr(flags, family.threshold) is not None:
        return options
    return options_for_error(family, options, min(asked) / 100)


def _not_reached(session: Session, flags: argparse.Namespace) -> str | None:
    """What to say where a solve has converged and its expected error is still larger than was asked for."""
    for flag, asked, name in (("--error", flags.error, "median"), ("--error-rms", flags.error_rms, "rms")):
        expected = None if session.expected is None else getattr(session.expected, name)
        if asked is not None and expected is not None and session.run.converged and 100 * expected > asked:
            end = f"--{session.family.threshold}, or the texels, end at"
            return f"{flag} {asked:g} was not reached: {end} {expected:.1%}"
    return None


def check_display(flags: argparse.Namespace) -> None:
    """Raise UserError for what cannot be shown without a reference, or with this solver."""
    display = from_flags(DisplayOptions, flags)
    if display.layer not in layers_with(SOLVERS[flags.solver].layers):
        able = [name for name, family in SOLVERS.items() if display.layer in layers_with(family.layers)]
        raise UserError(f"--layer {display.layer}: needs --solver {' or '.join(able)}")
    for name, asks in (("layer", LAYER_SHADERS[display.layer].compares), ("show", display.show != "solution")):
        if asks and flags.reference is None:
            raise UserError(f"--{name} {getattr(display, name)}: needs a --reference")


def open_scene(
    session: Session, flags: argparse.Namespace, console: Console, note: str | None = None, *, needs_light: bool = True
) -> None:
    """Load what the flags name, and say what there is to say. Raises UserError for a scene that needs light and has none."""
    with console.progress("loading") as tell:
        session.open_now(flags.scene, tell, from_flags(FileOptions, flags))
    if needs_light and not session.scene.emits:
        raise UserError(f"{flags.scene}: {NO_LIGHT}")
    for warning in (*([note] if note else []), *session.warnings):
        console.warn(warning)


def stop_of(flags: argparse.Namespace) -> Stop:
    """When the solve is to end."""
    error, rms = (None if asked is None else asked / 100 for asked in (flags.error, flags.error_rms))
    return Stop(flags.work, flags.time, error, rms)


def solve(
    session: Session, flags: argparse.Namespace, console: Console, keeper: Keeper | None = None
) -> NotFiniteError | None:
    """Solve. What broke the light is returned: what there is can still be written. keeper: of the light as it goes on."""
    stop = stop_of(flags)
    said = set()

    def say(stats: Stats) -> None:
        if stats.note is not None and stats.note not in said:
            said.add(stats.note)
            console.warn(stats.note)
        tell(f"{session.family.words(stats.done)}, {stats.remaining:.3%} {stats.remains}", session.run.share_done(stop))

    with console.progress(session.family.title.lower()) as tell:
        try:
            session.solve(stop, say, keeper)
        except NotFiniteError as error:
            return error
    for note in notes(session):
        if note not in said:
            console.warn(note)
    return None


def estimate(session: Session, flags: argparse.Namespace, console: Console) -> bool:
    """Work out how far off the light is expected to be, and say where that is more than was asked for. False where Ctrl-C goes
    without."""
    clock = time.perf_counter()
    try:
        with console.progress("gathering") as tell:
            session.estimate_now(lambda share: tell("the error that is expected", share))
    except KeyboardInterrupt:
        console.warn("stopped: nothing is said of the error that is expected")
        return False
    session.load_seconds["expected error"] = time.perf_counter() - clock
    if (unreached := _not_reached(session, flags)) is not None:
        console.warn(unreached)
    return True
