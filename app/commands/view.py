"""``glowtree view``: the viewer in a window; without a display, the same picture headless."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from app.bake import prepare_directory
from app.commands.shot import shot
from app.commands.steps import check_display, session_options
from app.errors import UserError
from app.options import from_flags
from app.render.options import DisplayOptions
from app.render.units import UNITS
from app.scene.options import FileOptions
from app.session.keeping import SUFFIX, check_session
from app.session.session import Session
from app.session.settings import Settings
from app.session.view import View
from app.ui import text_size
from app.ui.state import Pace
from app.util.console import Console
from app.util.kept import keep, kept

__all__ = ["view", "view_or_shot"]


def view_or_shot(flags: argparse.Namespace) -> int:
    """Open the viewer; without a display, render the same headless and say where. Raises UserError for no such scene."""
    from app.scene.load import scene_file
    from app.viewer.window import no_display

    session_file = Path(flags.scene).suffix.lower() == SUFFIX
    if session_file:
        check_session(Path(flags.scene))
    else:
        scene_file(flags.scene)

    if reason := no_display():
        if session_file:
            raise UserError(f"{flags.scene}: a session opens in a window, and none can be opened here ({reason})")
        if flags.frames is not None:
            raise UserError(f"--frames {flags.frames}: no window can be opened here ({reason}), so there are no frames")
        flags.output = Path(f"{Path(flags.scene).stem}.png")
        flags.work = flags.time = flags.error = flags.error_rms = None
        flags.camera = flags.path = flags.work_per_frame = None
        flags.ui, flags.json = True, False
        return shot(flags, f"no window can be opened here ({reason}): rendering to {flags.output} instead")
    return view(flags)


def view(flags: argparse.Namespace) -> int:
    """Open the window on a scene. Raises UserError."""
    check_display(flags)
    session_file = Path(flags.scene).suffix.lower() == SUFFIX
    from platformdirs import user_state_path

    from app.scene.library import scene_names
    from app.scene.load import LOADERS
    from app.viewer.window import run_window

    folder = _folder()
    views: list[View] = []

    def make_view(gpu: Any) -> View:
        session = Session(gpu, **session_options(flags), expose_on_open=flags.exposure is None)
        view = View(session, _display(flags, folder))
        views.append(view)
        put_solver_options(session, flags.given)
        if not session_file:
            session.open(flags.scene, from_flags(FileOptions, flags), reference=flags.reference)
        return view

    drawn = run_window(
        make_view,
        size=flags.size,
        scenes=scene_names(),
        suffixes=tuple(LOADERS),
        layout_file=None if folder is None else folder / "layout.ini",
        state_folder=None if flags.frames is not None else user_state_path("glowtree"),
        pace=flags.given.of("pace", Pace()),
        text_size=text_size.legal(None if folder is None else kept(folder).get("text_size")),
        first=Path(flags.scene) if session_file else None,
        frames=flags.frames,
    )
    if folder is not None:
        for made in views:
            keep(folder, quantities=made.display.quantities, text_size=drawn.text_size)
    if flags.frames is not None:
        Console().result({}, f"drew {drawn.frames} frames in {drawn.seconds:.1f} s")
    return 0


def put_solver_options(session: Session, settings: Settings) -> None:
    """Those of the other solvers, too: each can be chosen in the window."""
    chosen = session.chosen_solver
    given = {name: settings.of(name, old) for name, old in session.solver_options.items() if name != chosen}
    session.set_solver_options({**given, chosen: session.options})


def _display(flags: argparse.Namespace, folder: Path | None) -> DisplayOptions:
    """As the flags say; light is counted as in the last run, where they say nothing."""
    display = from_flags(DisplayOptions, flags)
    last = None if folder is None else kept(folder).get("quantities")
    return display.replace(quantities=last) if flags.quantities is None and last in UNITS else display


def _folder() -> Path | None:
    """Where the window keeps the places of its panels and what was chosen; None, and a note, where nothing can be kept."""
    from platformdirs import user_config_path

    folder = user_config_path("glowtree")
    try:
        prepare_directory(folder)
    except UserError as error:
        Console().warn(f"the layout of the panels is not kept: {error}")
        return None
    return folder
