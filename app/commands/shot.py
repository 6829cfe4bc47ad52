"""``glowtree shot``: solve without a window and save a picture."""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path

from app.commands.report import report, summary
from app.commands.steps import check_display, open_scene, session_options, solve
from app.errors import UserError
from app.gpu import gpu_context
from app.options import from_flags
from app.render.layers import LAYER_SHADERS
from app.render.options import DisplayOptions
from app.session.session import Session
from app.session.view import View
from app.util.console import Console
from app.viewer.picture import check_size, picture, save_png
from app.viewer.ui_frame import ui_image

__all__ = ["shot"]


def shot(flags: argparse.Namespace, note: str | None = None) -> int:
    """Solve and save a picture. note: what else the user should know. Raises UserError."""
    _check_file(flags.output)
    check_display(flags)
    console = Console(quiet=flags.json)
    with gpu_context() as gpu:
        session = Session(gpu, **session_options(flags))
        view = View(session, from_flags(DisplayOptions, flags))
        check_size(gpu, flags.size)
        shows_light = flags.ui or LAYER_SHADERS[view.display.layer].light is not None
        open_scene(session, flags.scene, console, note, needs_light=shows_light)
        _choose_camera(view, flags.camera)
        if flags.reference is not None:
            _open_reference(session, flags.reference, console)
        view.tell_observer()
        failure = solve(session, flags, console)
        session.compare(wait=True)
        if flags.exposure is None:
            view.expose()
        if flags.ui:
            image = ui_image(view, flags.size)
        else:
            image = picture(view, flags.size)
        save_png(flags.output, image)
        result = {"output": str(flags.output), **report(session)}
        line = summary(session, result)
        view.release()
        session.release()
    if failure is not None:
        raise UserError(f"{failure}; {flags.output} shows it as it is")
    console.result(result, f"{flags.output}: {line}")
    return 130 if result["interrupted"] else 0


def _open_reference(session: Session, path: Path, console: Console) -> None:
    """Read it, and say what there is to say. Raises UserError."""
    session.compared.open_now(path)
    assert session.compared.comparison is not None
    for note in session.compared.comparison.notes(session.lightmap):
        console.warn(note)


def _choose_camera(view: View, name: str | None) -> None:
    if name is None:
        return
    cameras = {camera.name: camera for camera in view.session.scene.cameras}
    if name not in cameras:
        raise UserError(f"--camera {name}: must be one of {', '.join(cameras)}")
    view.look_through(cameras[name])


def _check_file(path: Path) -> None:
    """Raise UserError now rather than after the work."""
    if path.is_dir() or path.suffix.lower() != ".png":
        raise UserError(f"-o {path}: must be a .png file")
    if not path.parent.is_dir():
        raise UserError(f"-o {path}: the folder {path.parent} does not exist")
    if path.exists() and not os.access(path, os.W_OK):
        raise UserError(f"-o {path}: cannot be written")
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise UserError(f"-o {path}: cannot be written: {error.strerror or error}") from None
