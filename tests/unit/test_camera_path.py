"""Walks of the camera: the format and its errors, what runs through the keys, and the walks that come along."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scene_files import written

from app.errors import UserError
from app.render.camera_path import CameraPath, load_path
from app.scene.library import path_names, scene_names, scenes_folder
from app.scene.load import load_scene
from app.scene.village import Village

KEY = "[[key]]\nposition = [0, 1, 0]\ntarget = [0, 1, -5]\n"
NEXT = "[[key]]\nposition = [4, 1, 0]\ntarget = [4, 3, -5]\n"
LAST = "[[key]]\nposition = [4, 1, -4]\ntarget = [0, 3, -5]\n"
CLEAR = 0.25  # m between an eye and what is solid: a door is 1 m wide and 2 m high
EYE = 1.7  # m


def load(folder: Path, text: str, head: str = "seconds = 2\nframes_per_second = 10\n") -> CameraPath:
    return load_path(str(written(folder, "walk.toml", head + text)))


def eyes(path: CameraPath) -> np.ndarray:
    return np.array([camera.eye for camera in path.cameras])


def at(key: str, seconds: float) -> str:
    return key + f"time = {seconds}\n"


def test_frames_are_seconds_times_rate_and_show_both_ends(tmp_path: Path) -> None:
    path = load(tmp_path, KEY + NEXT)
    assert len(path.cameras) == 20 and path.frames_per_second == 10
    assert eyes(path)[0] == pytest.approx([0, 1, 0]) and eyes(path)[-1] == pytest.approx([4, 1, 0])
    assert path.cameras[-1].forward == pytest.approx(np.array([0, 2, -5]) / np.sqrt(29))
    assert path.cameras[-1].target == pytest.approx([4, 3, -5])
    assert len(load(tmp_path, KEY + NEXT, "seconds = 2\n").cameras) == 60
    assert len(load(tmp_path, KEY + NEXT, "seconds = 0.001\n").cameras) == 1


def test_keys_are_passed_evenly_or_at_their_times(tmp_path: Path) -> None:
    even = load(tmp_path, KEY + NEXT + LAST, "seconds = 4\nframes_per_second = 5.25\n")  # 21 frames, each 0.2 s
    assert eyes(even)[10] == pytest.approx([4, 1, 0])
    timed = load(tmp_path, at(KEY, 1) + at(NEXT, 3) + at(LAST, 3.6), "seconds = 4\nframes_per_second = 5.25\n")
    assert (eyes(timed)[:6] == [0, 1, 0]).all(), "it stands until its first key"
    assert eyes(timed)[15] == pytest.approx([4, 1, 0])
    assert eyes(timed)[18:] == pytest.approx(np.tile([4, 1, -4], (3, 1)))


def test_the_eye_stays_between_neighbouring_keys(tmp_path: Path) -> None:
    """A corner and a key that is held twice: a spline that swings out would leave the box of two keys."""
    again = NEXT.replace("[[key]]", "[[key]] # again")
    path = load(tmp_path, KEY + NEXT + again + LAST, "seconds = 3\nframes_per_second = 101\n")
    found = eyes(path)
    third = len(found) // 3
    assert (found[:, 0] <= 4 + 1e-12).all() and (found[:, 2] <= 1e-12).all()
    assert found[third + 1 : 2 * third - 1] == pytest.approx(np.tile([4, 1, 0], (third - 2, 1)))


def test_the_way_is_smooth(tmp_path: Path) -> None:
    """Through a key the velocity does not jump: along straight lines it would, from 4 to 12 m/s."""
    far = LAST.replace("position = [4, 1, -4]", "position = [16, 1, 0]").replace("target = [0", "target = [16")
    x = eyes(load(tmp_path, KEY + NEXT + far, "seconds = 2\nframes_per_second = 200\n"))[:, 0]
    assert (np.diff(x) > 0).all()
    assert np.abs(np.diff(x, 2)).max() * 200 < 0.5


def test_one_key_stands_still(tmp_path: Path) -> None:
    path = load(tmp_path, KEY)
    assert len(path.cameras) == 20 and (eyes(path) == [0, 1, 0]).all()
    assert path.cameras[7].yfov == pytest.approx(np.radians(45))


def test_an_angle_holds_until_another_is_given(tmp_path: Path) -> None:
    path = load(
        tmp_path, KEY + "yfov_deg = 60\n" + NEXT + LAST + "yfov_deg = 30\n", "seconds = 4\nframes_per_second = 5.25\n"
    )
    angles = np.degrees([camera.yfov for camera in path.cameras])
    assert angles[[0, 10, 20]] == pytest.approx([60, 60, 30]) and 30 < angles[15] < 60


@pytest.mark.parametrize("down", [True, False])
def test_straight_up_and_down_keep_the_heading(tmp_path: Path, down: bool) -> None:
    """From ahead, which is +x, to the pole: the picture does not turn on the way, and the horizon stays level."""
    y = -3 if down else 3
    keys = f"[[key]]\nposition = [0, 0, 0]\ntarget = [3, 0, 0]\n[[key]]\nposition = [0, 0, 0]\ntarget = [0, {y}, 0]\n"
    for camera in load(tmp_path, keys).cameras:
        rotation = camera.world_from_camera[:3, :3]
        assert rotation[:, 0] == pytest.approx([0, 0, 1], abs=1e-12)
        assert rotation @ rotation.T == pytest.approx(np.eye(3), abs=1e-12) and np.linalg.det(rotation) > 0
    assert camera.forward == pytest.approx([0, -1 if down else 1, 0], abs=1e-12)
    only = load(tmp_path, "[[key]]\nposition = [0, 0, 0]\ntarget = [0, 1, 0]\n").cameras[0]
    assert only.forward == pytest.approx([0, 1, 0]) and only.world_from_camera[:3, 0] == pytest.approx([1, 0, 0])


HEAD = "seconds = 2\n"
BAD = {
    "syntax": ("[[key", "not TOML"),
    "nothing": ("", "seconds: Field required"),
    "no key": ("seconds = 1\n", "key: Field required"),
    "empty keys": ("seconds = 1\nkey = []\n", "key: List should have at least 1 item"),
    "no seconds": (KEY, "seconds: Field required"),
    "zero": ("seconds = 0\n" + KEY, "seconds: Input should be greater than or equal to 0.001"),
    "endless": ("seconds = inf\n" + KEY, "seconds: Input should be a finite number"),
    "rate": (HEAD + "frames_per_second = -1\n" + KEY, "frames_per_second: Input should be greater than 0"),
    "too many": ("seconds = 400\n" + KEY, "400 s at 30 frames a second: at most 10,000 frames"),
    "far too many": ("seconds = 1e308\nframes_per_second = 1e308\n" + KEY, "at most 10,000 frames"),
    "field": (HEAD + KEY + "roll = 3\n", "key.0.roll: Extra inputs are not permitted"),
    "top field": ("speed = 3\n" + HEAD + KEY, "speed: Extra inputs are not permitted"),
    "nan": (HEAD + KEY.replace("1, 0]", "nan, 0]"), "key.0.position.1: Input should be a finite number"),
    "far": (
        HEAD + KEY.replace("1, 0]", "1e300, 0]"),
        "key.0.position.1: Input should be less than or equal to 1000000",
    ),
    "two numbers": (HEAD + KEY.replace("[0, 1, 0]", "[0, 1]"), "key.0.position"),
    "words": (HEAD + KEY.replace("[0, 1, 0]", "'here'"), "key.0.position"),
    "same": (HEAD + KEY + NEXT.replace("[4, 3, -5]", "[4, 1, 0]"), "key.1: position and target must differ"),
    "meeting": (
        "seconds = 1\nframes_per_second = 11\n[[key]]\nposition = [0, 0, 0]\ntarget = [2, 0, 0]\n"
        "[[key]]\nposition = [2, 0, 0]\ntarget = [0, 0, 0]\n",
        "key.1: the eye meets its target on the way there, at 0.50 s",
    ),
    "flat": (HEAD + KEY + "yfov_deg = 180\n", "key.0.yfov_deg: Input should be less than 180"),
    "some times": (HEAD + at(KEY, 0) + NEXT, "give the time of all keys or of none"),
    "same time": (HEAD + at(KEY, 1) + at(NEXT, 1), "key.1.time: 1 s must come after 1 s"),
    "back": (HEAD + at(KEY, 0) + at(NEXT, 1) + at(LAST, 0.5), "key.2.time: 0.5 s must come after 1 s"),
    "late": (HEAD + at(KEY, 0) + at(NEXT, 3), "key.1.time: 3 s is after the end, 2 s"),
    "negative": (HEAD + at(KEY, -1), "key.0.time: Input should be greater than or equal to 0"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_is_one_line_that_names_file_and_key(tmp_path: Path, name: str) -> None:
    text, reason = BAD[name]
    with pytest.raises(UserError) as caught:
        load(tmp_path, text, "")
    message = str(caught.value)
    assert "walk.toml: " in message and reason in message and "\n" not in message


@pytest.mark.parametrize("name", ["nowhere.toml", ".", "vilage", ""])
def test_no_such_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match=r"cannot be read: .*; allowed are \.toml files and the paths .*village"):
        load_path(name)


def test_no_text(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="not TOML"):
        load_path(str(written(tmp_path, "walk.toml", b"\xff")))


# -- what comes along --------------------------------------------------------------------------------------------------


def test_walks_are_no_scenes_and_a_file_goes_before_a_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert "village" in path_names()
    assert len(scene_names()) == len(list(scenes_folder().glob("*.toml")))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "village").write_text(HEAD + KEY)
    assert len(load_path("village").cameras) == 60


def test_the_walk_through_the_village_begins_at_its_square_and_goes_through_nothing() -> None:
    path = load_path("village")
    found = eyes(path)
    scene = load_scene("village")
    square = next(camera for camera in scene.cameras if camera.name == "square")
    assert path.cameras[0].world_from_camera == pytest.approx(square.world_from_camera)
    assert path.cameras[0].yfov == pytest.approx(square.yfov)
    assert (np.abs(found[len(found) // 4 :, 1] - EYE) < 0.15).all(), "the height of an eye above the ground, y = 0"
    speed = np.linalg.norm(np.diff(found, axis=0), axis=1) * path.frames_per_second
    assert 1.5 < np.median(speed) < 2.5 and speed.max() < 3
    world = Village(kind="village", blocks=140).world()
    solid = np.argwhere(world.material) + world.lowest
    for eye in found:
        beside = solid[(np.abs(solid + 0.5 - eye) < 2).all(1)]
        apart = np.maximum(np.maximum(beside - eye, eye - beside - 1), 0)
        assert (np.linalg.norm(apart, axis=1) > CLEAR).all(), eye
