"""Command lines in processes of their own: Ctrl-C and SIGTERM, and a system without EGL."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from cli_folder import folder
from PIL import Image
from processes import started

__all__ = ["folder"]

ROOT = Path(__file__).parent.parent.parent


def without_screen(**more: str) -> dict[str, str]:
    """The environment of a process."""
    environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
    return {**environment, "PYTHONPATH": str(ROOT), **more}


def glowtree(*arguments: str) -> contextlib.AbstractContextManager[subprocess.Popen[str]]:
    return started([sys.executable, "-m", "app", *arguments], without_screen())


NO_X11 = """
import sys
import glcontext

def no_screen():
    raise Exception("no X11")  # as glcontext raises

glcontext.default_backend = no_screen
from app.cli import run
sys.exit(run(["doctor"]))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="EGL's vendors are chosen by this variable on Linux only")
def test_doctor_without_egl_says_what_to_install() -> None:
    """No EGL, and no X11 either: glcontext opens the screen :0 whatever DISPLAY says, and there may be one."""
    env = without_screen(__EGL_VENDOR_LIBRARY_FILENAMES=os.devnull)
    done = subprocess.run([sys.executable, "-c", NO_X11], env=env, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert "apt-get install" in done.stdout and "libegl1" in done.stdout
    assert "Traceback" not in done.stderr


def until(condition: Callable[[], bool], worker: subprocess.Popen[str]) -> None:
    end = time.monotonic() + 60
    while not condition():
        assert worker.poll() is None, worker.communicate()
        assert time.monotonic() < end
        time.sleep(0.05)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for one process")
@pytest.mark.parametrize(
    ("kind", "number"), [("shot", signal.SIGINT), ("shot", signal.SIGTERM), ("bake", signal.SIGINT)]
)
def test_ctrl_c_while_shooting_keeps_what_is_there(folder: Path, kind: str, number: signal.Signals) -> None:
    output = folder / ("a.png" if kind == "shot" else "out")
    more = (
        ["--size", "64x48", "--residual", "1e-9", "--level", "1", "--no-coarsen"]
        if kind == "shot"
        else ["--noise", "1e-5"]
    )
    line = [kind, "room.obj", "--light", "-o", str(output), *more]
    with glowtree(*line) as worker:
        assert worker.stderr is not None
        assert worker.stderr.readline() == "glowtree: note: 1 material is not defined: grey with albedo 0.5\n"
        time.sleep(1)  # the note is the last thing before the shots
        worker.send_signal(number)
        out, err = worker.communicate(timeout=60)
    assert worker.returncode == 130, err
    resumable = "glowtree: note: stopped: the same line with --resume goes on from here\n"
    assert "stopped early" in out and err == (resumable if kind == "bake" else "")
    if kind == "shot":
        assert Image.open(output).size == (64, 48)
    else:
        report = json.loads((output / "report.json").read_text())
        assert report["interrupted"] and report["rays"] > 0 and not report["converged"]
        names = ["bake.checkpoint", "irradiance.exr", "report.json", "scene.glb"]
        assert sorted(p.name for p in output.iterdir()) == names


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for one process")
def test_ctrl_c_while_loading_writes_nothing(folder: Path) -> None:
    line = ["bake", "cornell-box", "-o", "out/deep", "--texels", "8000000"]  # takes many seconds to cut
    with glowtree(*line) as worker:
        until((folder / "out").exists, worker)
        time.sleep(1)  # for the context
        worker.send_signal(signal.SIGINT)
        out, err = worker.communicate(timeout=60)
    assert worker.returncode == 130
    assert out == "" and err == "glowtree: stopped, nothing was written\n"
    assert not (folder / "out").exists()
