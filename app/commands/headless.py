"""The viewer's twin without a window: pictures and bakes from the same session."""

from __future__ import annotations

import argparse
import contextlib
import itertools
import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from app import __version__
from app.atlas.options import AtlasOptions
from app.bake import prepare_directory, write_bake
from app.errors import UserError
from app.gpu import Gpu, gpu_context
from app.lightmap.collapse import collapse
from app.options import from_flags
from app.render.false_colour import measured
from app.render.layers import LAYER_SHADERS
from app.render.options import DisplayOptions
from app.scene.load import NO_LIGHT
from app.session.session import Session, Stats, Stop
from app.session.solve import NotFiniteError, share_done
from app.solvers import ShootingOptions
from app.util.console import Console
from app.viewer.ui_frame import SAMPLES, pixels, ui_image


def shot(flags: argparse.Namespace, note: str | None = None) -> int:
    """Solve and save a picture. note: what else the user should know. Raises UserError."""
    _check_file(flags.output)
    check_reference(flags)
    console = Console(quiet=flags.json)
    with gpu_context() as gpu:
        session = Session(gpu, **session_options(flags))
        check_size(gpu, flags.size)
        shows_light = flags.ui or LAYER_SHADERS[session.display.layer].light is not None
        _open(session, flags.scene, console, note, needs_light=shows_light)
        _choose_camera(session, flags.camera)
        if flags.reference is not None:
            _open_reference(session, flags.reference, console)
        failure = _solve(session, flags, console)
        session.measure()
        if flags.exposure is None:
            session.expose()
        if flags.ui:
            image = ui_image(gpu, session, flags.size)
        else:
            image = picture(session, flags.size)
        _save_png(flags.output, image)
        result = {"output": str(flags.output), **report(session)}
        session.release()
    if failure is not None:
        raise UserError(f"{failure}; {flags.output} shows it as it is")
    console.result(result, f"{flags.output}: {_summary(result)}")
    return 130 if result["interrupted"] else 0


def bake(flags: argparse.Namespace) -> int:
    """Solve and write scene.glb, irradiance.exr and report.json. Raises UserError."""
    console = Console(quiet=flags.json)
    with _folder(flags.output), gpu_context() as gpu:
        session = Session(gpu, **session_options(flags))
        _open(session, flags.scene, console)
        failure = _solve(session, flags, console)
        whole = failure is not None or session.interrupted or _expect(session, console)
        clock = time.perf_counter()
        lightmap = session.lightmap
        irradiance, covered = collapse(lightmap.pool, lightmap.irradiance(ambient=True))
        session.load_seconds["read back"] = time.perf_counter() - clock
        finite = np.asarray(np.isfinite(irradiance).all(-1))
        lost = int((covered & ~finite).sum())
        result = report(session) | {"texels_not_finite": lost}
        irradiance = np.where(finite[..., None], np.maximum(irradiance, 0), np.float32(0))  # no light is still owed
        files = write_bake(flags.output, session.scene, session.charts, irradiance, covered & finite, result)
        session.release()
    if failure is not None:
        raise UserError(f"{failure}; {flags.output} has the light of all texels but {lost}")
    result = {"output": [str(path) for path in vars(files).values()], **result}
    console.result(result, f"{flags.output}: {_summary(result)}")
    return 130 if result["interrupted"] or not whole else 0


def view_or_shot(flags: argparse.Namespace) -> int:
    """Open the viewer; without a display, render the same headless and say where. Raises UserError for no such scene."""
    from app.scene.load import scene_file
    from app.viewer.window import no_display

    scene_file(flags.scene)

    if reason := no_display():
        if flags.frames is not None:
            raise UserError(f"--frames {flags.frames}: no window can be opened here ({reason}), so there are no frames")
        flags.output = Path(f"{Path(flags.scene).stem}.png")
        flags.shots = flags.time = flags.camera = None
        flags.ui, flags.json = True, False
        return shot(flags, f"no window can be opened here ({reason}): rendering to {flags.output} instead")
    return view(flags)


def view(flags: argparse.Namespace) -> int:
    """Open the window on a scene. Raises UserError."""
    check_reference(flags)
    from app.scene.library import scene_names
    from app.scene.load import LOADERS
    from app.viewer.window import run_window

    def make_session(gpu: Any) -> Session:
        session = Session(gpu, **session_options(flags), expose_on_open=flags.exposure is None)
        session.open(flags.scene, reference=flags.reference)
        return session

    run_window(
        make_session,
        size=flags.size,
        scenes=scene_names(),
        suffixes=tuple(LOADERS),
        layout_file=_layout_file(),
        frames=flags.frames,
    )
    return 0


def _layout_file() -> Path | None:
    """Where the window keeps the places of its panels; None, and a note, where nothing can be kept."""
    from platformdirs import user_config_path

    folder = user_config_path("glowtree")
    try:
        prepare_directory(folder)
    except UserError as error:
        Console().warn(f"the layout of the panels is not kept: {error}")
        return None
    return folder / "layout.ini"


def session_options(flags: argparse.Namespace) -> dict[str, Any]:
    """What the flags say, as a Session takes it."""
    return {
        "shooting": from_flags(ShootingOptions, flags),
        "atlas": from_flags(AtlasOptions, flags),
        "display": from_flags(DisplayOptions, flags),
        "default_light": flags.light,
    }


def check_reference(flags: argparse.Namespace) -> None:
    """Raise UserError for what cannot be shown without a reference."""
    display = from_flags(DisplayOptions, flags)
    for name, asks in (("layer", LAYER_SHADERS[display.layer].compares), ("show", display.show != "solution")):
        if asks and flags.reference is None:
            raise UserError(f"--{name} {getattr(display, name)}: needs a --reference")


def picture(session: Session, size: tuple[int, int]) -> np.ndarray:
    """(height, width, 3) u8 sRGB of the session as it is, top row first. Raises UserError for sizes beyond the GPU's."""
    check_size(session.gpu, size)
    if measured(session.shown) != "off" or session.shown.show == "split":
        return ui_image(session.gpu, session, size, panels=False)  # with the legend, or the line between both
    texture = session.gpu.texture(size, 4, "f1")
    target = session.gpu.target(texture)
    try:
        session.draw(target, size, samples=SAMPLES)
        return pixels(target, size)
    finally:
        session.gpu.release_all(target, texture)


def check_size(gpu: Gpu, size: tuple[int, int]) -> None:
    """Raise UserError for a picture whose samples do not fit a texture of this GPU."""
    limit = gpu.limits.max_texture // SAMPLES
    if max(size) > limit:
        raise UserError(f"--size {size[0]}x{size[1]}: at most {limit} pixels along a side on this GPU")


def report(session: Session) -> dict[str, Any]:
    """Everything that shaped the solution and what came of it."""
    stats, books = session.stats, session.books
    return {
        "glowtree": __version__,
        "scene": session.name,
        "source": str(session.source),
        "renderer": session.gpu.limits.renderer,
        "gl_version": session.gpu.limits.version,
        "parameters": session.parameters,
        "charts": {"count": stats.charts, "method": session.charts.method, "texels_per_metre": session.charts.density},
        "triangles": stats.triangles,
        "texels": stats.texels,
        "atlas": list(session.charts.size),
        "memory_mib": stats.memory_mib,
        "shots": stats.shots,
        "residual": stats.residual,
        "converged": stats.converged,
        "interrupted": session.interrupted,
        "seconds": {**session.load_seconds, "shoot": stats.seconds},
        "energy_w": {
            name: [float(x) for x in getattr(books, name)]
            for name in ("emitted", "absorbed", "escaped", "unshot", "imbalance")
        },
        "imbalance": stats.imbalance,
        **_error(session),
        **({} if session.expected is None else {"expected_error": session.expected._asdict()}),
        "warnings": [*session.scene.warnings, *session.charts.warnings, *_notes(session)],
    }


def _error(session: Session) -> dict[str, Any]:
    """Against the reference, at random points; nothing without one."""
    comparison = session.comparison
    if comparison is None or comparison.error is None:
        return {}
    light = comparison.light
    known = {"reference": light.name, "reference_texels": light.texels, "reference_residual": light.unshot}
    return {"error": known | {"points": comparison.lit} | comparison.error._asdict()}


def _open_reference(session: Session, path: Path, console: Console) -> None:
    """Read it, and say what there is to say. Raises UserError."""
    session.open_reference_now(path)
    assert session.comparison is not None
    for note in session.comparison.notes(session.lightmap):
        console.warn(note)


def _notes(session: Session) -> list[str]:
    """What the solver has to say of the solution."""
    return [] if session.solver.note is None else [session.solver.note]


def _open(session: Session, scene: str, console: Console, note: str | None = None, *, needs_light: bool = True) -> None:
    """Load, and say what there is to say. Raises UserError for a scene that needs light and has none."""
    with console.progress("loading") as tell:
        session.open_now(scene, tell)
    if needs_light and not session.scene.emits:
        raise UserError(f"{scene}: {NO_LIGHT}")
    for warning in (*([note] if note else []), *session.scene.warnings, *session.charts.warnings):
        console.warn(warning)


def _solve(session: Session, flags: argparse.Namespace, console: Console) -> NotFiniteError | None:
    """Solve. What broke the light is returned: what there is can still be written."""
    stop = Stop(shots=flags.shots, seconds=flags.time)

    def say(stats: Stats) -> None:
        tell(f"{stats.shots} shots, {stats.residual:.3%} unshot", share_done(session, stop))

    with console.progress("shooting") as tell:
        try:
            session.solve(stop, say)
        except NotFiniteError as error:
            return error
    for note in _notes(session):
        console.warn(note)
    return None


def _expect(session: Session, console: Console) -> bool:
    """Work out how far off the light is expected to be. False where Ctrl-C goes without."""
    clock = time.perf_counter()
    try:
        with console.progress("gathering") as tell:
            session.expect(lambda share: tell("the error that is expected", share))
    except KeyboardInterrupt:
        console.warn("stopped: nothing is said of the error that is expected")
        return False
    session.load_seconds["expected error"] = time.perf_counter() - clock
    return True


def _choose_camera(session: Session, name: str | None) -> None:
    if name is None:
        return
    cameras = {camera.name: camera for camera in session.scene.cameras}
    if name not in cameras:
        raise UserError(f"--camera {name}: must be one of {', '.join(cameras)}")
    session.look_through(cameras[name])


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


def _save_png(path: Path, image: np.ndarray) -> None:
    """Beside its name first, so that a picture is whole or not there."""
    partial = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        Image.fromarray(image).save(partial, format="PNG")
        partial.replace(path)
    except OSError as error:
        raise UserError(f"-o {path}: cannot be written: {error.strerror or error}") from None
    finally:
        partial.unlink(missing_ok=True)


@contextlib.contextmanager
def _folder(path: Path) -> Iterator[None]:
    """A folder that can be written to; what was made of it is gone again if nothing came of it. Raises UserError."""
    made = list(itertools.takewhile(lambda folder: not folder.exists(), (path, *path.parents)))
    prepare_directory(path)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):  # not empty: that is the normal case
            for folder in made:
                folder.rmdir()


def _summary(result: dict[str, Any]) -> str:
    error = result.get("error")
    compared = "" if error is None else f", off by {error['rms']:.2%} RMS and {error['median']:.2%} in the median"
    expected = result.get("expected_error")
    if expected is not None:
        compared += f", expected to be off by {expected['rms']:.1%} RMS and {expected['median']:.1%} in the median"
    state = "stopped early" if result["interrupted"] else "converged" if result["converged"] else "stopped as asked"
    return (
        f"{result['shots']} shots in {result['seconds']['shoot']:.1f} s, {result['residual']:.2%} unshot ({state}), "
        f"{result['texels']} texels, energy imbalance {result['imbalance']:+.2%}{compared}, {result['renderer']}"
    )


__all__ = ["bake", "check_size", "picture", "report", "shot", "view", "view_or_shot"]
