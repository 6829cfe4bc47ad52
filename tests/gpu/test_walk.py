"""``shot --path``: what a walk writes, what it says, and that light goes on between its pictures."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageSequence

import app.commands.walk
from app.cli import run
from app.gpu import Gpu
from app.render.camera import CameraView
from app.render.camera_path import load_path
from app.session.run import NotFiniteError
from app.session.session import Session
from app.session.view import View
from app.viewer.animation import FrameFolder, check_animation, save_animation

WALK = """
seconds = 0.3
frames_per_second = 10
[[key]]
position = [0.278, 0.273, -0.8]
target = [0.278, 0.273, 0]
[[key]]
position = [0.15, 0.273, -0.5]
target = [0.278, 0.273, 0]
"""
SIZE = (32, 24)
FEW = ["--size", "32x24", "--texels", "2000", "--shots", "8"]


@pytest.fixture
def folder(gpu: Gpu, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory with a walk of three pictures in it."""
    (tmp_path / "walk.toml").write_text(WALK)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def shot(output: str, *more: str) -> int:
    return run(["shot", "cornell-box", "--path", "walk.toml", "-o", output, *FEW, *more])


def json_of(capfd: pytest.CaptureFixture[str], output: str, *more: str) -> dict[str, Any]:
    assert shot(output, "--json", *more) == 0
    values: dict[str, Any] = json.loads(capfd.readouterr().out)
    return values


def frames(path: Path) -> list[np.ndarray]:
    """(height, width, 3) u8 of all pictures."""
    if path.is_dir():
        return [np.asarray(Image.open(file).convert("RGB")) for file in sorted(path.iterdir())]
    return [np.asarray(frame.convert("RGB")) for frame in ImageSequence.Iterator(Image.open(path))]


def test_every_form_has_the_same_pictures(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Light stands still, so that they are the same in each run; WebP and GIF lose something."""
    still = ["--work-per-frame", "0"]
    assert shot("walk", *still) == 0
    out, err = capfd.readouterr()
    assert out.startswith("walk: 3 frames, in the median ") and out.count("\n") == 1 and err == ""
    assert [file.name for file in sorted((folder / "walk").iterdir())] == ["0001.png", "0002.png", "0003.png"]
    pictures = frames(folder / "walk")
    assert all(picture.shape == (24, 32, 3) for picture in pictures)
    assert all(np.abs(a.astype(int) - b).mean() > 2 for a, b in itertools.pairwise(pictures)), "it moves"
    for name, lost in (("walk.png", 0), ("walk.webp", 6), ("walk.gif", 6)):
        assert shot(name, *still) == 0
        assert capfd.readouterr().out.startswith(f"{name}: 3 frames, ")
        found = frames(folder / name)
        assert len(found) == 3
        for one, other in zip(found, pictures, strict=True):
            assert np.abs(one.astype(int) - other).mean() <= lost, name
        with Image.open(folder / name) as image:
            image.load()
            assert image.info["duration"] == pytest.approx(100) and image.info["loop"] == 0
    assert sorted(path.name for path in folder.iterdir()) == ["walk", "walk.gif", "walk.png", "walk.toml", "walk.webp"]


def test_work_goes_on_between_pictures_and_times_are_told(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    values = json_of(capfd, "out", "--work-per-frame", "3")
    assert values["frames"] == 3 and values["shots"] == 8 + 2 * 3
    for part in ("solving", "drawing"):
        assert 0 < values["frame_ms"][part]["median"] <= values["frame_ms"][part]["p99"]
    assert json_of(capfd, "out")["shots"] == 8 + 2
    assert json_of(capfd, "out", "--work-per-frame", "0")["shots"] == 8


def test_nothing_is_done_once_converged(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    values = json_of(capfd, "out", "--residual", "0.9", "--work-per-frame", "50")
    assert values["converged"]
    few = json_of(capfd, "out", "--residual", "0.9", "--work-per-frame", "0")
    assert values["shots"] == few["shots"]


def test_one_exposure_for_all(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Although there is ever more light."""
    seen, draw = [], View.draw

    def drawn(view: View, *arguments: Any, **named: Any) -> None:
        seen.append((view.display.exposure, *view.camera.eye))
        draw(view, *arguments, **named)

    monkeypatch.setattr(View, "draw", drawn)
    assert shot("out", "--work-per-frame", "20", "--shots", "1") == 0
    assert len({exposure for exposure, *_ in seen}) == 1
    eyes = dict.fromkeys(tuple(eye) for _, *eye in seen)  # of each, all samples of its picture
    assert list(eyes) == [pytest.approx(camera.eye) for camera in load_path("walk.toml").cameras]


def test_the_solver_is_told_where_the_eye_is(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[list[float]] = []
    monkeypatch.setattr(Session, "observe", lambda session, position: told.append(position.tolist()))
    assert shot("out") == 0
    assert told == [camera.eye.tolist() for camera in load_path("walk.toml").cameras]


def test_panels_are_drawn_over_a_walk(folder: Path) -> None:
    assert shot("plain", "--work-per-frame", "0", "--size", "320x240") == 0
    assert shot("panels", "--work-per-frame", "0", "--size", "320x240", "--ui") == 0
    plain, panels = frames(folder / "plain"), frames(folder / "panels")
    assert len(panels) == 3 and np.abs(plain[2].astype(int) - panels[2]).mean() > 5


def test_what_an_earlier_walk_left_is_told(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (folder / "out").mkdir()
    (folder / "out" / "0004.png").write_bytes(b"")
    assert shot("out") == 0
    assert capfd.readouterr().err == "glowtree: note: out/0004.png is of an earlier walk: this one has 3 frames\n"


# -- walks that end early ----------------------------------------------------------------------------------------------


def ends_in_the_third(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    solve: Callable[[View, int], float] = app.commands.walk._solve
    calls = []

    def broken(view: View, work: int) -> float:
        calls.append(work)
        if len(calls) == 2:
            raise error
        return solve(view, work)

    monkeypatch.setattr(app.commands.walk, "_solve", broken)


@pytest.mark.parametrize("output", ["out", "out.webp", "out.gif", "out.png"])
def test_ctrl_c_keeps_the_pictures_so_far(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], output: str
) -> None:
    ends_in_the_third(monkeypatch, KeyboardInterrupt())
    assert shot(output) == 130
    out, err = capfd.readouterr()
    assert out.startswith(f"{output}: 2 frames") and "stopped early" in out and err == ""
    assert len(frames(folder / output)) == 2


def test_ctrl_c_before_the_first_picture_leaves_nothing(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def stopped(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("app.commands.shot._draw", stopped)
    for output in ("out", "out.webp"):
        assert shot(output) == 130
        assert capfd.readouterr() == ("", "glowtree: stopped, nothing was written\n")
    assert [path.name for path in folder.iterdir()] == ["walk.toml"]


def test_ctrl_c_in_the_first_solve_keeps_one_picture(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def stopped(session: Session, *_: Any) -> None:
        session.run.interrupted = True

    monkeypatch.setattr("app.commands.shot.solve", stopped)
    assert shot("out.webp") == 130
    assert capfd.readouterr().out.startswith("out.webp: 1 frame; ")
    assert len(frames(folder / "out.webp")) == 1


def test_light_that_breaks_ends_the_walk(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    ends_in_the_third(monkeypatch, NotFiniteError("the light is not finite"))
    assert shot("out.webp") == 2
    assert capfd.readouterr() == ("", "glowtree: the light is not finite; out.webp shows it as it is\n")
    assert len(frames(folder / "out.webp")) == 2


# -- files -------------------------------------------------------------------------------------------------------------


def test_a_gif_keeps_time_in_hundredths(tmp_path: Path) -> None:
    """30 frames a second are 3.33 of them each: 3, 3 and 4."""
    pictures = FrameFolder(tmp_path / "pictures")
    for k in range(6):
        pictures.add(np.full((24, 32, 3), 40 * k, np.uint8))
    told: list[int] = []
    save_animation(tmp_path / "a.gif", pictures, 30.0, told.append)
    with Image.open(tmp_path / "a.gif") as image:
        durations = [frame.info["duration"] for frame in ImageSequence.Iterator(image)]
    assert sum(durations) == 200 and set(durations) == {30, 40}
    assert told == sorted(told) and told[-1] == 6


@pytest.mark.parametrize(
    ("output", "frames", "rate", "size", "says"),
    [
        ("a.jpg", 3, 30, SIZE, r"must be a \.webp, \.gif or \.png file, or a folder, for a walk"),
        ("a.gif", 3, 60, SIZE, r"60 frames a second: a \.gif file has at most 50"),
        ("a.webp", 3, 30, (16384, 16), r"at most 16383 pixels along a side"),
        ("a.png", 5000, 30, (1920, 1080), r"5000 frames of 1920x1080 are too many for one \.png file: take \.webp, or"),
    ],
)
def test_what_a_format_cannot_hold(
    tmp_path: Path, output: str, frames: int, rate: float, size: tuple[int, int], says: str
) -> None:
    from app.errors import UserError

    with pytest.raises(UserError, match=says):
        check_animation(tmp_path / output, frames, rate, size)


def test_a_walk_of_a_camera_is_its_own(folder: Path) -> None:
    """No two pictures share a matrix: a camera is edited where it is."""
    first, second, _ = load_path("walk.toml").cameras
    assert isinstance(first, CameraView) and not np.shares_memory(first.eye, second.eye)
    first.fly(1.0, 0.0, 0.0)
    assert second.eye == pytest.approx(load_path("walk.toml").cameras[1].eye)
