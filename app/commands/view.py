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
from app.session.session import Session
from app.session.view import View
from app.util.console import Console
from app.util.kept import keep, kept

__all__ = ["view", "view_or_shot"]


def view_or_shot(flags: argparse.Namespace) -> int:
    """Open the viewer; without a display, render the same headless and say where. Raises UserError for no such scene."""
    from app.scene.load import scene_file
    from app.viewer.window import no_display

    scene_file(flags.scene)

    if reason := no_display():
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
    from app.scene.library import scene_names
    from app.scene.load import LOADERS
    from app.viewer.window import run_window

    folder = _folder()
    views: list[View] = []

    def make_view(gpu: Any) -> View:
        session = Session(gpu, **session_options(flags), expose_on_open=flags.exposure is None)
        view = View(session, _display(flags, folder))
        views.append(view)
        session.open(flags.scene, from_flags(FileOptions, flags), reference=flags.reference)
        return view

    run_window(
        make_view,
        size=flags.size,
        scenes=scene_names(),
        suffixes=tuple(LOADERS),
        layout_file=None if folder is None else folder / "layout.ini",
        frames=flags.frames,
    )
    if folder is not None:
        for made in views:
            keep(folder, quantities=made.display.quantities)
    return 0


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
