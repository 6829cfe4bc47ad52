"""The real window under Xvfb, driven with xdotool like a user would: click, drag, drop, screenshot, quit."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
SIZE = (1280, 720)
PATIENCE = 60.0  # s: a software rasteriser on a busy machine
NEEDS = ("Xvfb", "xdotool")
MISSING = [tool for tool in NEEDS if shutil.which(tool) is None]

pytestmark = pytest.mark.skipif(
    bool(MISSING), reason=f"needs {' and '.join(MISSING)} (Debian: apt-get install xvfb xdotool)"
)


@pytest.fixture
def display() -> Iterator[str]:
    """A screen of its own, on a number that Xvfb chooses."""
    read, write = os.pipe()
    screen = ["-screen", "0", f"{SIZE[0]}x{SIZE[1]}x24"]
    command = ["Xvfb", "-displayfd", str(write), "-nolisten", "tcp", *screen]
    server = subprocess.Popen(command, pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    with os.fdopen(read) as answer:
        number = answer.readline().strip()
    assert number, "Xvfb did not start"
    yield f":{number}"
    server.terminate()
    server.wait(10)


def environment(display: str | None) -> dict[str, str]:
    kept = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY", "PYTHONPATH")}
    path = os.pathsep.join([str(ROOT), str(ROOT / "tests" / "gpu")])
    return kept | {"PYTHONPATH": path} | ({"DISPLAY": display} if display else {})


class Driven:
    """A window in a process of its own, and a hand on its mouse and keyboard."""

    def __init__(self, display: str, folder: Path) -> None:
        self.folder, self._environment = folder, environment(display)
        command = [sys.executable, str(HERE / "drive_window.py"), str(folder)]
        self.process = subprocess.Popen(
            command, cwd=folder, env=self._environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )

    def state(self) -> dict[str, Any]:
        """What the window last said of itself; empty before the first time."""
        file = self.folder / "state.json"
        return json.loads(file.read_text()) if file.exists() else {}

    def until(self, wanted: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
        """Wait for a state; fail with what the program printed."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            state = self.state()
            if state and wanted(state):
                return state
            if self.process.poll() is not None:
                break
            time.sleep(0.05)
        self.process.kill()
        pytest.fail(f"the window did not get there: {self.state()}\n{self.process.communicate()[0]}")

    def frames(self, count: int) -> None:
        last = self.state()["frame"]
        self.until(lambda s: s["frame"] >= last + count)

    def do(self, *actions: object) -> None:
        """An xdotool command, and time for the window to see it."""
        subprocess.run(["xdotool", *map(str, actions)], env=self._environment, check=True, timeout=PATIENCE)
        self.frames(6)


@pytest.fixture
def window(display: str, tmp_path: Path) -> Iterator[Driven]:
    driven = Driven(display, tmp_path)
    yield driven
    if driven.process.poll() is None:
        driven.process.kill()
    driven.process.communicate()


def test_a_user_at_the_window(window: Driven, tmp_path: Path) -> None:
    state = window.until(lambda s: s["frame"] >= 12 and "exposure" in s["places"])
    assert state["running"]

    x, y = (round(v) for v in state["places"]["run"])
    window.do("mousemove", x, y, "click", 1)
    window.until(lambda s: not s["running"])

    x, y = (round(v) for v in state["places"]["exposure"])
    window.do("mousemove", x, y, "mousedown", 1)
    window.do("mousemove", x + 40, y)
    window.do("mouseup", 1)
    window.until(lambda s: s["exposure"] > 1)

    window.do("mousemove", 640, 260, "click", 1)
    window.until(lambda s: any(call[0] == "pick" for call in s["calls"]))

    (tmp_path / "drop").write_text(str(tmp_path / "box.glb"))
    window.until(lambda s: ["open", str(tmp_path / "box.glb")] in s["calls"])

    window.do("key", "space")
    window.until(lambda s: s["running"])

    window.do("key", "F12")
    shot = tmp_path / "glowtree-0001.png"
    window.until(lambda s: shot.exists())
    image = np.asarray(Image.open(shot))
    assert image.shape == (SIZE[1], SIZE[0], 3)
    assert np.abs(image[260, 500].astype(int) - np.array([51, 76, 102])).max() <= 1  # the fake session's view
    assert image[:, :280].std() > 10  # panels with text on the left

    subprocess.run(["xdotool", "key", "Escape"], env=environment(window._environment["DISPLAY"]), check=True)
    output, _ = window.process.communicate(timeout=PATIENCE)
    assert window.process.returncode == 0, output
    assert output.strip() == "closed"


def test_without_a_screen_there_is_one_clear_line(tmp_path: Path) -> None:
    program = """
import sys
from app.errors import UserError
from app.window import run_window
try:
    run_window(lambda gpu: None)
except UserError as error:
    print(error)
    sys.exit(2)
"""
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment(None),
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert done.returncode == 2, done.stderr
    assert done.stderr == ""
    (line,) = done.stdout.splitlines()
    assert line.startswith("no window with OpenGL 4.1: ") and "glowtree shot" in line
