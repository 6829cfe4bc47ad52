"""A bake that is killed, or stopped, goes on to the same files as one that never was."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from processes import started

from app.bake.read import read_irradiance
from app.cli import run
from app.session.checkpoint import CHECKPOINT_NAME

ROOT = Path(__file__).parents[2]
PATIENCE = 120.0  # s
OTHER_DRIVERS = 1e-3  # of the mean light; the software rasteriser repeats itself bit for bit
# Flags, and of which work how much for each kill. No round number of batches, and before it has converged: the batch that is cut
# short there is the same one only if all that decided about batches was kept, reports on their way, too.
BAKES = {
    "gathering": (["--texels", "1500", "--noise", "1e-4"], "--rays", 300),
    "shooting": (["--solver", "shooting", "--texels", "1500", "--residual", "1e-6"], "--shots", 501),
    "shooting on quadtrees": (
        ["--solver", "shooting", "--texels", "300", "--adaptive", "--residual", "1e-6"],
        "--shots",
        501,
    ),
}
GATHERING = BAKES["gathering"][0]
pytestmark = pytest.mark.usefixtures("few_points")
posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL and no SIGINT for one process")


def bake(output: Path, *flags: str) -> list[str]:
    return ["bake", "cornell-box", "-o", str(output), *flags]


def begun(line: list[str]) -> contextlib.AbstractContextManager[subprocess.Popen[str]]:
    return started([sys.executable, "-m", "app", *line], os.environ | {"PYTHONPATH": str(ROOT)})


def killed(line: list[str], checkpoint: Path, seconds: float) -> bool:
    """Start a bake and kill it so long after its first checkpoint; False where it was done by then."""
    before = checkpoint.stat().st_mtime_ns if checkpoint.exists() else None
    end = time.monotonic() + PATIENCE
    with begun(line) as worker:
        while worker.poll() is None:
            assert time.monotonic() < end
            if checkpoint.exists() and checkpoint.stat().st_mtime_ns != before:
                time.sleep(seconds)
                break
            time.sleep(0.01)
    assert worker.returncode in (0, -signal.SIGKILL)
    return worker.returncode != 0


def same_light(one: Path, other: Path) -> bool:
    """Bit for bit where the driver repeats itself."""
    reports = [json.loads((folder / "report.json").read_text()) for folder in (one, other)]
    if "llvmpipe" in reports[0]["renderer"]:
        return (one / "irradiance.exr").read_bytes() == (other / "irradiance.exr").read_bytes()
    light = [read_irradiance(folder / "irradiance.exr") for folder in (one, other)]
    return float(np.abs(light[0] - light[1]).mean()) <= OTHER_DRIVERS * float(light[0].mean())


@posix
@pytest.mark.parametrize("name", BAKES)
def test_killed_at_any_moment_it_goes_on_to_the_same_light(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], request: pytest.FixtureRequest
) -> None:
    at_once, stopped, most = tmp_path / "at once", tmp_path / "stopped", request.config.getoption("--kills")
    settings, unit, each = BAKES[name]
    flags = [*settings, unit, str(most * each)]
    assert run(bake(at_once, *flags, "--checkpoint", "0")) == 0
    seed = int(time.time())
    rng = np.random.default_rng(seed)
    print(f"seed {seed}")
    line = bake(stopped, *flags, "--checkpoint", "0.1", "--resume")
    kills = sum(
        killed(line, stopped / CHECKPOINT_NAME, rng.uniform(0, 0.4)) for _ in range(request.config.getoption("--kills"))
    )
    assert kills > 0, "it was never killed"
    print(f"{name}: killed {kills} times")
    assert run(line) == 0
    assert same_light(stopped, at_once)
    assert most > 1 or not json.loads((at_once / "report.json").read_text())["converged"]
    names = sorted(path.name for path in stopped.iterdir())
    assert names == ["irradiance.exr", "report.json", "scene.glb"]


@posix
def test_after_ctrl_c_it_goes_on(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    at_once, stopped, flags = tmp_path / "at once", tmp_path / "stopped", [*GATHERING, "--rays", "600"]
    assert run(bake(at_once, *flags)) == 0
    line = bake(stopped, *flags, "--checkpoint", "0.1")
    end = time.monotonic() + PATIENCE
    with begun(line) as worker:
        while not (stopped / CHECKPOINT_NAME).exists():
            assert worker.poll() is None and time.monotonic() < end
            time.sleep(0.01)
        worker.send_signal(signal.SIGINT)
        out, err = worker.communicate(timeout=PATIENCE)
    assert worker.returncode == 130 and "stopped early" in out
    assert err.splitlines()[-1] == "glowtree: note: stopped: the same line with --resume goes on from here"
    report = json.loads((stopped / "report.json").read_text())
    assert report["interrupted"] and not report["resumed"]
    capsys.readouterr()
    assert run([*line, "--resume"]) == 0
    assert "goes on after" in capsys.readouterr().err
    assert same_light(stopped, at_once)
    after = json.loads((stopped / "report.json").read_text())
    assert after["resumed"] and not after["interrupted"] and after["seconds"]["solve"] > report["seconds"]["solve"]
    assert not (stopped / CHECKPOINT_NAME).exists()


@pytest.fixture
def unfinished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Path:
    """A folder with the checkpoint of a bake that did not get far."""
    with monkeypatch.context() as patch:
        patch.setattr("app.session.checkpoint.Checkpoint.remove", lambda self: self.write())
        assert run(bake(tmp_path / "out", *GATHERING, "--rays", "24")) == 0
    capsys.readouterr()
    return tmp_path / "out"


def refused(line: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """The one line that says why."""
    assert run(line) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.count("\n") == 1
    return err


def test_another_scene_or_other_settings_are_refused(unfinished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    flags = GATHERING
    kept = (unfinished / CHECKPOINT_NAME).read_bytes()
    other = ["bake", "cornell-box", "-o", str(unfinished), "--resume"]
    assert "is of --texels 1500, not 1600" in refused([*other, *flags[2:], "--texels", "1600"], capsys)
    assert "is of --solver gathering, not shooting" in refused(
        [*other, "--solver", "shooting", "--texels", "1500"], capsys
    )
    furnace = ["bake", "furnace", "-o", str(unfinished), "--resume", *flags]
    assert "is of another scene" in refused(furnace, capsys)
    assert (unfinished / CHECKPOINT_NAME).read_bytes() == kept
    assert run(bake(unfinished, *flags, "--resume", "--rays", "32")) == 0  # another stop is none of these


@pytest.mark.parametrize("stop", [["--noise", "0.5"], ["--error", "50"]])
def test_another_stop_is_no_other_light(unfinished: Path, stop: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert run(bake(unfinished, *GATHERING[:2], "--resume", *stop)) == 0
    assert "goes on after" in capsys.readouterr().err
    assert not (unfinished / CHECKPOINT_NAME).exists()


def test_a_damaged_checkpoint_is_refused(unfinished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = unfinished / CHECKPOINT_NAME
    path.write_bytes(path.read_bytes()[:-1000])
    line = refused(bake(unfinished, *GATHERING, "--resume"), capsys)
    assert f"{path}: is damaged" in line


def test_without_resume_it_says_that_it_begins_anew(unfinished: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(bake(unfinished, *GATHERING, "--rays", "8")) == 0
    assert "has a bake that was not finished: this one begins anew" in capsys.readouterr().err
    assert not (unfinished / CHECKPOINT_NAME).exists()


def test_of_several_scenes_those_that_are_done_are_not_baked_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "room.toml"
    scene.write_text((ROOT / "scenes" / "cornell-box.toml").read_text())
    line = ["bake", "furnace", str(scene), "-o", str(tmp_path / "out"), "--rays", "8", "--json", "--texels", "1500"]
    light = [tmp_path / "out" / name / "irradiance.exr" for name in ("furnace", "room")]

    def written() -> list[int]:
        return [path.stat().st_mtime_ns for path in light]

    assert run(line) == 0
    first = written()
    (tmp_path / "out" / "room" / "report.json").unlink()
    capsys.readouterr()
    assert run([*line, "--resume"]) == 0
    bakes = json.loads(capsys.readouterr().out)["bakes"]
    assert [bake.get("done_before", False) for bake in bakes] == [True, False]
    second = written()
    assert second[0] == first[0] and second[1] > first[1]
    os.utime(scene, (time.time(), time.time()))
    assert run([*line, "--resume"]) == 0  # the scene is another by now
    third = written()
    assert third[0] == second[0] and third[1] > second[1]
    assert run([*line, "--resume", "--texels", "900"]) == 0
    fourth = written()
    assert fourth[0] > third[0]  # other settings
    line += ["--texels", "900", "--resume"]
    light[0].with_name("scene.glb").unlink()
    assert run(line) == 0
    fifth = written()
    assert fifth[0] > fourth[0]  # a file was lost
    for other in (["--padding", "4"], ["--sun", "90,30"], ["--unwrap"]):
        before = written()
        assert run([*line, *other]) == 0
        assert written()[0] > before[0], other
    before = written()
    assert run([*line, "--unwrap"]) == 0
    assert written() == before


def test_a_bake_that_is_finished_is_not_baked_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line, light = bake(tmp_path, *GATHERING, "--rays", "8"), tmp_path / "irradiance.exr"
    assert run(line) == 0
    first = light.stat().st_mtime_ns
    capsys.readouterr()
    assert run([*line, "--resume"]) == 0
    out, err = capsys.readouterr()
    assert "finished already" in out and err == "" and light.stat().st_mtime_ns == first
    assert run(line) == 0
    assert light.stat().st_mtime_ns > first, "without --resume it is"


def test_nothing_to_resume_begins(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """So that a script need not know whether it was stopped."""
    assert run(bake(tmp_path / "out", *GATHERING, "--rays", "8", "--resume")) == 0
    assert "no bake to go on with" in capsys.readouterr().err


def test_a_checkpoint_that_cannot_be_written_is_said_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def full(path: Path, state: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("app.util.state_file.dump_state", full)
    assert run(bake(tmp_path / "out", *GATHERING, "--rays", "64", "--checkpoint", "1e-3")) == 0
    said = capsys.readouterr().err
    assert said.count("No space left on device") == 1 and "goes on without checkpoints" in said
