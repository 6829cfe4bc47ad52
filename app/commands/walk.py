"""A walk: pictures along a path of the camera, between which the solver goes on as it does in a window."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from app.render.camera import CameraView
from app.render.camera_path import CameraPath
from app.session.run import NotFiniteError
from app.session.session import Session
from app.session.view import View
from app.util.console import Console
from app.viewer.animation import animated, frame_folder, save_animation

__all__ = ["Walk", "save_walk", "walk"]


@dataclass
class Walk:
    """What came of a walk. solving, drawing: milliseconds of each picture but the first, which waits for a solve and for shaders.
    failure: what broke the light; the walk ends there. interrupted: whether Ctrl-C ended it."""

    frames: int = 0
    solving: list[float] = field(default_factory=list)
    drawing: list[float] = field(default_factory=list)
    failure: NotFiniteError | None = None
    interrupted: bool = False

    def report(self, session: Session) -> dict[str, Any]:
        """For programs, beside that of the session."""
        times = {"solving": _spread(self.solving), "drawing": _spread(self.drawing)}
        interrupted = self.interrupted or session.run.interrupted
        return {"frames": self.frames, "frame_ms": times, "interrupted": interrupted}

    @property
    def summary(self) -> str:
        """For people, part of a line."""
        count = f"{self.frames} frame{'s' if self.frames != 1 else ''}"
        solving, drawing = _spread(self.solving), _spread(self.drawing)
        if solving is None or drawing is None:
            return count
        return (
            f"{count}, in the median {solving['median']:.1f} ms of solving each (99 % below {solving['p99']:.1f}) "
            f"and {drawing['median']:.1f} ms of drawing (99 % below {drawing['p99']:.1f})"
        )


def save_walk(
    view: View, path: CameraPath, output: Path, draw: Callable[[], np.ndarray], console: Console, *, work: int
) -> Walk:
    """Draw the pictures of a walk and write them, with progress on the terminal. Raises UserError, and KeyboardInterrupt where
    there is nothing to keep."""
    with frame_folder(output) as folder:
        with console.progress("walking") as tell:
            done = walk(view, path.cameras, draw, folder.add, work=work, tell=tell)
        if done.frames == 0:
            raise KeyboardInterrupt
        if animated(output):
            with console.progress("writing") as tell:
                save_animation(output, folder, path.frames_per_second, lambda k: tell(f"frame {k}", k / folder.count))
        elif folder.left_over is not None:
            console.warn(f"{folder.left_over} is of an earlier walk: this one has {done.frames} frames")
    return done


def walk(
    view: View,
    cameras: Sequence[CameraView],
    draw: Callable[[], np.ndarray],
    add: Callable[[np.ndarray], None],
    *,
    work: int,
    tell: Callable[[str, float], None],
) -> Walk:
    """Draw what each of ``cameras`` sees and ``add`` it: the first in the light that there is, the others after up to ``work``
    pieces of work more. Ctrl-C and light that is not finite end it with the pictures so far. Raises UserError from ``add``."""
    done = Walk()
    try:
        for camera in cameras:
            view.camera = camera
            if done.frames > 0:
                done.solving.append(1e3 * _solve(view, work))
            start = time.perf_counter()
            image = draw()
            if done.frames > 0:
                done.drawing.append(1e3 * (time.perf_counter() - start))
            add(image)
            done.frames += 1
            tell(f"frame {done.frames} of {len(cameras)}", done.frames / len(cameras))
    except KeyboardInterrupt:
        done.interrupted = True
    except NotFiniteError as error:
        done.failure = error
    return _settled(view, done)


def _solve(view: View, work: int) -> float:
    """Up to so many pieces of work, for the eye where it is now; the seconds until the GPU had done them."""
    session = view.session
    start = time.perf_counter()
    view.tell_observer()
    session.poll(interactive=True)
    for _ in range(work):
        if not session.solving:
            break
        session.work()
        session.poll(interactive=True)
    session.gpu.ctx.finish()
    seconds = time.perf_counter() - start
    session.run.seconds += seconds
    return seconds


def _settled(view: View, done: Walk) -> Walk:
    """With progress and energy brought up to the last piece of work."""
    try:
        if not view.session.run.settled:
            view.session.run.settle()
    except NotFiniteError as error:
        done.failure = done.failure or error
    return done


def _spread(milliseconds: Sequence[float]) -> dict[str, float] | None:
    if not milliseconds:
        return None
    return {"median": float(np.median(milliseconds)), "p99": float(np.percentile(milliseconds, 99))}
