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
import psutil
import pytest
from PIL import Image

from app.render.layers import layers_with
from app.solvers import SOLVERS

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

    def __init__(self, display: str, folder: Path, *arguments: str) -> None:
        self.folder, self._environment = folder, environment(display)
        command = [sys.executable, str(HERE / "drive_window.py"), str(folder), *arguments]
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
    driven = Driven(display, tmp_path, "1e6")  # no solve takes so long that quitting asks
    yield driven
    if driven.process.poll() is None:
        driven.process.kill()
    driven.process.wait()


def test_a_user_at_the_window(window: Driven, tmp_path: Path) -> None:
    state = window.until(lambda s: s["shots"] > 20 and "exposure" in s["places"])
    assert state["name"] == "Cornell box" and state["running"]
    assert state["exposure"] != 0, "a scene that opens is exposed"

    x, y = (round(v) for v in state["places"]["run"])
    window.do("mousemove", x, y, "click", 1)
    shots = window.until(lambda s: not s["running"])["shots"]

    before = state["exposure"]
    x, y = (round(v) for v in state["places"]["exposure"])
    window.do("mousemove", x, y, "mousedown", 1)
    window.do("mousemove", x + 100, y)
    window.do("mouseup", 1)
    dragged = window.until(lambda s: s["exposure"] > before + 4)["exposure"]
    x, y = (round(v) for v in state["places"]["Auto"])
    window.do("mousemove", x, y, "click", 1)
    window.until(lambda s: s["exposure"] < dragged - 2)

    window.do("mousemove", 640, 330, "click", 1)
    window.until(lambda s: s["picked"])

    window.do("key", "period")
    window.until(lambda s: s["shots"] == shots + 1)

    window.do("key", "F12")
    shot = tmp_path / "glowtree-0001.png"
    window.until(lambda s: shot.exists())
    image = np.asarray(Image.open(shot))
    assert image.shape == (SIZE[1], SIZE[0], 3)
    assert image[:, :280].std() > 10  # panels with text on the left
    view = image[60:480, 420:860]  # walls in red, green and white
    assert view.std() > 20 and view.max() > 150
    red, green = view[:, :60].mean((0, 1)), view[:, -40:].mean((0, 1))
    assert red[0] > 1.2 * red[1] and green[1] > 1.2 * green[0]  # agx takes much of the colour; grey would be 1

    (tmp_path / "drop").write_text("no-such-scene")
    state = window.until(lambda s: s["message"])
    assert "no-such-scene" in state["message"] and state["name"] == "Cornell box", "a failed load keeps the scene"
    (tmp_path / "drop").write_text("furnace")
    window.until(lambda s: s["name"].lower() != "cornell box" and s["message"] is None)

    window.do("key", "space")
    window.until(lambda s: s["running"] and s["shots"] > 0)

    window.do("mousemove", 640, 330, "click", 1)
    window.until(lambda s: s["has_picked"])
    window.do("key", "Escape")
    window.until(lambda s: not s["has_picked"])
    window.do("key", "Escape")  # nothing is left to close, and the window stays open

    subprocess.run(["xdotool", "key", "ctrl+q"], env=environment(window._environment["DISPLAY"]), check=True)
    output, _ = window.process.communicate(timeout=PATIENCE)
    assert window.process.returncode == 0, output
    assert output.strip() == "closed"


def test_an_edit_is_undone_and_done_again(window: Driven) -> None:
    state = window.until(lambda s: s["shots"] > 5 and "exposure" in s["places"])
    before = state["exposure"]
    x, y = (round(v) for v in state["places"]["exposure"])
    window.do("mousemove", x, y, "mousedown", 1)
    for step in (10, 20, 30):
        window.do("mousemove", x + step, y)
    window.do("mouseup", 1)
    after = window.until(lambda s: s["exposure"] > before + 0.1)["exposure"]
    window.do("key", "ctrl+z")
    window.until(lambda s: s["exposure"] == before)
    window.do("key", "ctrl+shift+z")
    window.until(lambda s: s["exposure"] == after)


def test_a_session_is_saved_and_opened_with_its_light(window: Driven, tmp_path: Path) -> None:
    window.until(lambda s: s["shots"] > 20)
    window.do("key", "space")
    shots = window.until(lambda s: not s["running"])["shots"]
    window.do("key", "ctrl+s")
    window.do("key", "ctrl+a")
    window.do("type", "--delay", "40", str(tmp_path / "mine"))
    window.do("key", "Return")
    file = tmp_path / "mine.glow"
    window.until(lambda s: file.exists())
    window.do("key", "r")
    window.until(lambda s: s["shots"] == 0)
    (tmp_path / "drop").write_text(str(file))
    window.until(lambda s: s["shots"] == shots)


def test_the_windows_own_button_asks_where_a_long_solve_would_be_lost(display: str, tmp_path: Path) -> None:
    window = Driven(display, tmp_path, "0")
    try:
        window.until(lambda s: s["shots"] > 5)
        for answer in ("Cancel", "Quit"):
            (tmp_path / "close").touch()
            window.frames(12)
            x, y = (round(v) for v in window.until(lambda s: "Quit" in s["places"])["places"][answer])
            subprocess.run(["xdotool", "mousemove", str(x), str(y), "click", "1"], env=window._environment, check=True)
            if answer == "Cancel":
                window.frames(12)  # it goes on
        output, _ = window.process.communicate(timeout=PATIENCE)
        assert (window.process.returncode, output.strip()) == (0, "closed")
    finally:
        window.process.kill()


REST_SHARE = 0.35  # of a core: two looks around per second cost a few ms; 30 frames/s would cost more than one core


def test_a_window_at_rest_leaves_the_processor_alone(window: Driven) -> None:
    window.until(lambda s: s["shots"] > 5)
    window.do("key", "space")
    window.until(lambda s: not s["running"] and s["at_rest"])  # all that is expected of the light is worked out
    time.sleep(2.5)  # s: frames go on for a while after the last event
    process = psutil.Process(window.process.pid)
    before, frame = sum(process.cpu_times()[:2]), window.state()["frame"]
    time.sleep(2.0)
    assert window.state()["frame"] == frame
    assert sum(process.cpu_times()[:2]) - before < REST_SHARE * 2.0
    window.do("mousemove", 600, 300)  # and an event wakes it


def test_no_display_renders_headless_and_says_where(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "app", "view", "cornell-box", "--texels", "4000", "--residual", "0.5"]
    done = subprocess.run(
        command, env=environment(None), cwd=tmp_path, capture_output=True, text=True, timeout=2 * PATIENCE
    )
    assert done.returncode == 0, done.stderr
    assert "cornell-box.png" in done.stdout + done.stderr and "there is no display" in done.stderr
    image = np.asarray(Image.open(tmp_path / "cornell-box.png"))
    assert image.shape == (SIZE[1], SIZE[0], 3)
    assert image[:, :280].std() > 10 and image[60:480, 420:860].std() > 20  # panels and a lit box


def test_a_bake_from_the_panel_is_stopped_and_goes_on(window: Driven, tmp_path: Path) -> None:
    """The window runs in that folder, and bakes into one there."""
    state = window.until(lambda s: s["shots"] > 5 and s["places"].get("tab Bake", (0, 0))[0] > 0)
    click(window, state, "tab Bake")
    click(window, window.until(lambda s: "bake" in s["places"]), "bake")
    click(window, window.until(lambda s: "stop" in s["places"]), "stop")
    window.until(lambda s: not s["running"] and "go on" in s["places"])
    folder = tmp_path / "Cornell box baked"
    assert [path.name for path in folder.iterdir()] == ["bake.checkpoint"]
    time.sleep(0.5)  # the panel has other buttons now
    click(window, window.state(), "go on")
    window.until(lambda s: s["running"])
    (tmp_path / "enough").touch()  # of the light: it need not be good
    window.until(lambda s: "show" in s["places"])
    assert sorted(path.name for path in folder.iterdir()) == ["irradiance.exr", "report.json", "scene.glb"]
    report = json.loads((folder / "report.json").read_text())
    assert report["converged"] and report["resumed"]


def test_a_layer_is_chosen_a_lamp_dragged_and_a_material_cut_more_finely(window: Driven) -> None:
    state = window.until(lambda s: s["shots"] > 5 and "layer" in s["places"])
    click(window, state, "layer")
    (x, y), row = state["places"]["layer"], state["places"]["row"][1]
    choices = layers_with(SOLVERS["shooting"].layers)
    window.do("mousemove", round(x), round(y + (choices.index("density") + 1.3) * row))
    window.do("click", 1)
    window.until(lambda s: s["layer"] == "density")

    click(window, window.state(), "tab Lights")
    click(window, window.until(lambda s: "add Point" in s["places"]), "add Point")
    state = window.until(lambda s: s["lights"] and "handle" in s["places"])
    (before,) = state["lights"]
    dragged(window, state["places"]["handle"], 60)
    window.until(lambda s: s["lights"] and s["lights"][0] != before)
    window.do("key", "ctrl+z")
    window.until(lambda s: s["lights"] == [before])

    click(window, window.state(), "tab Materials")
    dragged(window, window.until(lambda s: "##density" in s["places"])["places"]["##density"], 30)
    window.until(lambda s: max(s["scales"]) > 1.9 and s["running"])


def dragged(window: Driven, place: tuple[float, float], by: int) -> None:
    x, y = (round(v) for v in place)
    window.do("mousemove", x, y, "mousedown", 1)
    for step in (by // 3, 2 * by // 3, by):
        window.do("mousemove", x + step, y)
    window.do("mouseup", 1)


def click(window: Driven, state: dict[str, Any], place: str) -> None:
    x, y = (round(v) for v in state["places"][place])
    window.do("mousemove", x, y)
    window.do("mousedown", 1)
    window.do("mouseup", 1)


def test_frames_of_a_window_are_not_counted_without_one(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "app", "view", "furnace", "--frames", "3"]
    done = subprocess.run(
        command, env=environment(None), cwd=tmp_path, capture_output=True, text=True, timeout=PATIENCE
    )
    (line,) = done.stderr.splitlines()
    assert done.returncode == 2 and "--frames 3" in line and "there is no display" in line
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("scene", ["no-such-scene", "no/such/file.glb"])
def test_a_wrong_scene_ends_before_a_window_opens(scene: str, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "app", "view", scene],
        env=environment(None),
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=PATIENCE,
    )
    assert (done.returncode, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    assert scene in line
    assert not list(tmp_path.iterdir())


def test_without_a_screen_there_is_one_clear_line(tmp_path: Path) -> None:
    program = """
import sys
from app.errors import UserError
from app.viewer.window import run_window
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
