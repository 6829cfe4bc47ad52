"""``glowtree shot``: solve without a window and save a picture, or with ``--path`` those of a walk."""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path

import numpy as np

from app.commands.flags import WalkOptions
from app.commands.steps import check_display, estimate, open_scene, session_options, solve, stop_of
from app.commands.walk import Walk, save_walk
from app.errors import UserError
from app.gpu import gpu_context
from app.options import from_flags
from app.render.camera_path import CameraPath, load_path
from app.render.layers import LAYER_SHADERS
from app.render.options import DisplayOptions
from app.session.report import report, summary
from app.session.session import Session
from app.session.view import View
from app.util.console import Console
from app.viewer.animation import check_animation
from app.viewer.picture import SUFFIXES, check_size, picture, save_picture, save_png
from app.viewer.ui_frame import ui_image

__all__ = ["shot"]


def shot(flags: argparse.Namespace, note: str | None = None) -> int:
    """Solve and save a picture, or the pictures of a walk. note: what else the user should know. Raises UserError."""
    path = _path(flags)
    _check_output(flags, path)
    check_display(flags)
    console = Console(quiet=flags.json)
    with gpu_context() as gpu:
        session = Session(gpu, **session_options(flags))
        view = View(session, from_flags(DisplayOptions, flags))
        check_size(gpu, flags.size)
        shows_light = flags.ui or LAYER_SHADERS[view.display.layer].light is not None
        open_scene(session, flags, console, note, needs_light=shows_light)
        if path is None:
            _choose_camera(view, flags.camera)
        else:
            view.camera = path.cameras[0]
        if flags.reference is not None:
            _open_reference(session, flags.reference, console)
        view.tell_observer()
        failure = solve(session, flags, console)
        if stop_of(flags).by_error and session.run.converged:
            estimate(session, flags, console)
        session.compare(wait=True)
        trapped = view.look_for_light()
        if trapped is not None:
            console.warn(trapped)
        if flags.exposure is None:
            view.expose(flags.size)
        walked = None
        if path is None:
            _save(view, flags)
        else:
            stopped = failure is not None or session.run.interrupted
            walked = _walk(view, path.first_only if stopped else path, flags, console)
            failure = failure or walked.failure
        result = {"output": str(flags.output), **report(session), **(walked.report(session) if walked else {})}
        if trapped is not None:
            result["warnings"].append(trapped)
        line = summary(session, result)
        view.release()
        session.release()
    if failure is not None:
        raise UserError(f"{failure}; {flags.output} shows it as it is")
    console.result(result, f"{flags.output}: {f'{walked.summary}; ' if walked else ''}{line}")
    return 130 if result["interrupted"] else 0


def _save(view: View, flags: argparse.Namespace) -> None:
    if flags.ui:
        save_png(flags.output, ui_image(view, flags.size))
    else:
        save_picture(view, flags.output, flags.size)


def _draw(view: View, flags: argparse.Namespace) -> np.ndarray:
    return ui_image(view, flags.size) if flags.ui else picture(view, flags.size)


def _walk(view: View, path: CameraPath, flags: argparse.Namespace, console: Console) -> Walk:
    work = from_flags(WalkOptions, flags).work_per_frame
    return save_walk(view, path, flags.output, lambda: _draw(view, flags), console, work=work)


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


def _path(flags: argparse.Namespace) -> CameraPath | None:
    """The walk that is asked for. Raises UserError, also for what goes with a walk only, or not with one."""
    if flags.path is None:
        if flags.work_per_frame is not None:
            raise UserError(f"--work-per-frame {flags.work_per_frame}: needs a --path")
        return None
    if flags.camera is not None:
        raise UserError(f"--camera {flags.camera}: not with --path, which has its own")
    return load_path(flags.path)


def _check_output(flags: argparse.Namespace, path: CameraPath | None) -> None:
    """Raise UserError now rather than after the work."""
    output: Path = flags.output
    if path is None:
        if output.is_dir() or output.suffix.lower() not in SUFFIXES:
            raise UserError(f"-o {output}: must be a {' or '.join(SUFFIXES)} file")
        if flags.ui and output.suffix.lower() != ".png":
            raise UserError(f"-o {output}: what the viewer would show, --ui, is a .png file")
    else:
        check_animation(output, len(path.cameras), path.frames_per_second, flags.size)
    _check_writable(output)


def _check_writable(path: Path) -> None:
    """Raise UserError where no such file, or file in such a folder, can be made."""
    if not path.parent.is_dir():
        raise UserError(f"-o {path}: the folder {path.parent} does not exist")
    if path.exists() and not os.access(path, os.W_OK):
        raise UserError(f"-o {path}: cannot be written")
    try:
        with tempfile.TemporaryFile(dir=path if path.is_dir() else path.parent):
            pass
    except OSError as error:
        raise UserError(f"-o {path}: cannot be written: {error.strerror or error}") from None
