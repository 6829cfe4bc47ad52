"""The command line: every bad input is one line on stderr and exit code 2; stdout holds the result and nothing else."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from processes import started
from scene_files import Gltf

import app.commands.info as info_module
from app.cli import run
from app.scene import shapes
from app.scene.gltf import outline_gltf
from app.scene.load import load_scene

ROOT = Path(__file__).parent.parent.parent
FEW = ["--texels", "2000", "--shots", "8"]  # enough to have run through everything
SHOT = "shot cornell-box -o a.png "

FILES = {
    "empty.glb": "",
    "short.glb": "glTF garbage",
    "noise.stl": "solid nothing",
    "a.xyz": "1 2 3",
    "points.obj": "v 0 0 0\nv 1 0 0\nv 0 1 0\n",
    "nan.obj": "v 0 0 0\nv 1 0 nan\nv 0 0 1\nf 1 2 3\n",
    "dark.obj": "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n",
    "room.obj": "".join(f"v {i & 1} {i >> 1 & 1} {i >> 2}\n" for i in range(8))
    + "f 1 2 4 3\nf 5 7 8 6\nf 1 5 6 2\nf 3 4 8 7\nf 1 3 7 5\nf 2 6 8 4\n",
    "nothing.toml": "[scene]\n",
    "syntax.toml": "[[quad]\n",
    "file": "",
    "walk.toml": "seconds = 1\n[[key]]\nposition = [0, 0, 0]\ntarget = [0, 0, 1]\n",
    "turned.toml": "seconds = 1\n[[key]]\nposition = [0, 0, 0]\ntarget = [0, 0, 0]\n",
    "typo.toml": "[[material]]\nname = 'a'\nalbedoo = 1\n",
}

# arguments, and what the one line must say
BAD = [
    ("bogus", "invalid choice: 'bogus'"),
    ("--bogus", "command"),
    ("shot", "scene, -o/--output"),
    ("shot cornell-box", "-o/--output"),
    ("bake cornell-box", "-o/--output"),
    ("info", "scene"),
    ("bench", "what"),
    ("bench bogus", "invalid choice: 'bogus'"),
    ("bench frames nowhere", "the scenes cornell-box, furnace"),
    ("bench frames --drag", "--drag: only --adaptive has the sliders that it moves"),
    ("doctor extra", "unknown argument extra"),
    ("view nothing.glb", "no such file or scene"),
    ("view --size 640", "640: must be WIDTHxHEIGHT"),
    ("view --frames 0", "0: must be a whole number above 0"),
    ("view --json", "unknown argument --json"),
    # scenes
    ("info nowhere", "the scenes cornell-box, furnace"),
    ("info cornel-bx", "did you mean cornell-box?"),
    ("info .", "is a folder"),
    ("info a.xyz", "unknown format '.xyz'"),
    ("info empty.glb", "the file is empty"),
    ("info short.glb", "truncated"),
    ("info noise.stl", "noise.stl"),
    ("info points.obj", "no triangles"),
    ("info nan.obj", "not a finite number"),
    ("info nothing.toml", "no triangles"),
    ("info syntax.toml", "not TOML"),
    ("info typo.toml", "albedoo"),
    ("shot nowhere -o a.png", "no such file or scene"),
    ("bake nowhere -o out/deep", "no such file or scene"),
    ("shot dark.obj -o a.png", "--light adds a ceiling light"),
    ("bake dark.obj -o out/deep", "--light adds a ceiling light"),
    # outputs
    ("shot cornell-box -o a.jpg", "must be a .png or .exr file"),
    ("shot cornell-box -o .", "must be a .png or .exr file"),
    ("shot cornell-box --ui -o a.exr", "is a .png file"),
    ("shot cornell-box -o folder.png", "must be a .png or .exr file"),
    ("shot cornell-box -o nowhere/a.png", "the folder nowhere does not exist"),
    ("shot cornell-box -o /proc/a.png", "cannot be written"),
    ("shot cornell-box -o", "expected one argument"),
    ("bake cornell-box -o dark.obj", "dark.obj: cannot write here"),
    ("bake cornell-box -o dark.obj/out", "cannot write here"),
    # walks
    (SHOT + "--path", "expected one argument"),
    (
        SHOT + "--path nowhere.toml",
        "--path nowhere.toml: cannot be read: No such file or directory; allowed are .toml files",
    ),
    (SHOT + "--path syntax.toml", "--path syntax.toml: not TOML"),
    (SHOT + "--path typo.toml", "--path typo.toml: seconds: Field required"),
    (SHOT + "--path turned.toml", "--path turned.toml: key.0: position and target must differ"),
    (SHOT + "--path walk.toml --camera main", "--camera main: not with --path"),
    (SHOT + "--path walk.toml --work-per-frame -1", "-1: must be 0 to 100000"),
    (SHOT + "--path walk.toml --work-per-frame 1.5", "1.5: must be 0 to 100000"),
    (SHOT + "--work-per-frame 3", "--work-per-frame 3: needs a --path"),
    ("shot cornell-box --path walk.toml -o a.jpg", "must be a .webp, .gif or .png file, or a folder"),
    ("shot cornell-box --path walk.toml -o file", "-o file: is no folder"),
    ("shot cornell-box --path walk.toml -o nowhere/a", "the folder nowhere does not exist"),
    ("shot cornell-box --path walk.toml -o /proc/a", "cannot be written"),
    ("shot nowhere --path walk.toml -o a", "no such file or scene"),
    # pictures
    (SHOT + "--size 0x0", "0x0: must be WIDTHxHEIGHT, each 16 to 16384"),
    (SHOT + "--size 100", "must be WIDTHxHEIGHT"),
    (SHOT + "--size 99999x100", "must be WIDTHxHEIGHT"),
    (SHOT + "--size 100x²0", "must be WIDTHxHEIGHT"),
    (SHOT + "--size 16384x16384", "do not fit the memory of this driver"),
    (SHOT + "--camera bogus", "--camera bogus: must be one of main"),
    (SHOT + "--layer bogus", "bogus: must be one of combined, irradiance"),
    (SHOT + "--tone-map bogus", "bogus: must be one of clamp"),
    (SHOT + "--false-colour bogus", "bogus: must be one of off"),
    (SHOT + "--exposure nan", "nan: must be -24 to 24"),
    (SHOT + "--exposure 25", "25: must be -24 to 24"),
    (SHOT + "--false-colour-max -1", "must be 0 to"),
    # references
    (SHOT + "--layer error", "--layer error: needs a --reference"),
    (SHOT + "--show split", "--show split: needs a --reference"),
    (SHOT + "--show bogus", "bogus: must be one of solution"),
    (SHOT + "--split 2", "2: must be 0 to 1"),
    (SHOT + "--reference nowhere", "nowhere: is no bake, irradiance.exr and scene.glb missing"),
    (SHOT + "--reference dark.obj", "is no bake"),
    # the solver
    (SHOT + "--shots 0", "0: must be a whole number above 0"),
    (SHOT + "--shots -1", "-1: must be a whole number above 0"),
    (SHOT + "--shots 1.5", "1.5: must be a whole number above 0"),
    (SHOT + "--time nan", "nan: must be a number above 0"),
    (SHOT + "--time inf", "inf: must be a number above 0"),
    (SHOT + "--residual 0", "0: must be 1e-09 to 1"),
    (SHOT + "--residual nan", "nan: must be 1e-09 to 1"),
    (SHOT + "--level 9", "9: must be 0 to 4"),
    (SHOT + "--level two", "two: must be 0 to 4"),
    (SHOT + "--resolution 100", "100: must be 64 to 2048 in steps of 64"),
    (SHOT + "--visibility bogus", "bogus: must be one of item-id"),
    (SHOT + "--storage bogus", "bogus: must be one of rgba32f"),
    ("info cornell-box --storage bogus", "bogus: must be one of rgba32f"),
    # texels
    (SHOT + "--texels 0", "0: must be 1 to"),
    (SHOT + "--texels 10000001.5", "must be 1 to"),
    (SHOT + "--texels 10000000000", "10000000000: must be 1 to"),
    (SHOT + "--density nan", "nan: must be"),
    (SHOT + "--density 1e8", "the limit is"),
    (SHOT + "--density 10 --texels 100", "only one of the two"),
    # flags that do not exist
    (SHOT + "--bogus", "unknown argument --bogus"),
    (SHOT + "--nonsense", "unknown argument --nonsense (see"),
    (SHOT + "--shot 3", "did you mean --shots?"),
    (SHOT + "--resolutoin=256", "did you mean --resolution?"),
    (SHOT + "extra", "unknown argument extra"),
    ("info cornell-box --level 2", "unknown argument --level"),
]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A working directory with the files of FILES, and without a screen."""
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "folder.png").mkdir()
    monkeypatch.chdir(tmp_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    return tmp_path


def code_of(line: str) -> int:
    try:
        return run(line.split())
    except SystemExit as end:  # argparse
        assert isinstance(end.code, int)
        return end.code


@pytest.mark.parametrize(("line", "says"), BAD, ids=[line.replace("/", "|") for line, _ in BAD])
def test_bad_input_is_one_line_and_leaves_nothing(
    folder: Path, line: str, says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(folder.rglob("*"))
    start = time.perf_counter()
    code = code_of(line)
    seconds = time.perf_counter() - start
    out, err = capsys.readouterr()
    assert code == 2
    assert out == ""
    assert says in err
    assert err.startswith("glowtree") and err.count("\n") == 1 and err.endswith("\n")
    assert sorted(folder.rglob("*")) == before
    assert seconds < 10, "refused only after the work"  # a solve of the Cornell box is longer; imports are not


def test_every_command_explains_itself(capsys: pytest.CaptureFixture[str]) -> None:
    for line in ("", "view", "shot", "bake", "info", "doctor", "bench", "bench shots", "bench rays", "bench frames"):
        assert code_of(f"{line} --help") == 0
        assert "usage: glowtree" in capsys.readouterr().out


def test_shot_prints_one_line(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["shot", "cornell-box", "-o", "a.png", "--size", "64x48", *FEW]) == 0
    out, err = capfd.readouterr()  # of the process: what a library or a child prints is seen too
    assert out.startswith("a.png: 8 shots") and out.count("\n") == 1
    assert err == ""
    assert Image.open(folder / "a.png").size == (64, 48)


def test_json_is_the_whole_stdout(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["shot", "dark.obj", "--light", "-o", "a.png", "--json", "--size", "64x48", *FEW]) == 0
    out, err = capfd.readouterr()
    values = json.loads(out)
    assert values["shots"] == 8 and not values["interrupted"]
    assert values["parameters"]["shooting"]["level"] == 2
    assert values["warnings"] == ["1 material is not defined: grey with albedo 0.5"]
    assert err == ""


def test_warnings_are_told_on_stderr(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["shot", "dark.obj", "--light", "-o", "a.png", "--size", "64x48", *FEW]) == 0
    assert capfd.readouterr().err == "glowtree: note: 1 material is not defined: grey with albedo 0.5\n"


def test_layers_that_show_no_light_need_none(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["shot", "dark.obj", "-o", "a.png", "--size", "64x48", "--layer", "charts", *FEW]) == 0
    assert (folder / "a.png").is_file()


def test_a_shot_says_how_far_it_is_from_its_reference(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert (
        run(["bake", "cornell-box", "-o", "right", "--texels", "2000", "--solver", "shooting", "--residual", "0.2"])
        == 0
    )
    said = json.loads((folder / "right" / "report.json").read_text())["expected_error"]
    assert 0.01 < said["rms"] < 1 and 0 < said["median"] < 1 and 64 <= said["points"] <= 768
    (folder / "right" / "report.json").unlink()  # as another program leaves it
    capfd.readouterr()
    line = ["shot", "cornell-box", "-o", "a.png", "--size", "64x48", "--reference", "right"]
    errors = []
    for residual in ("0.5", "0.2"):
        assert run([*line, "--layer", "error", "--texels", "2000", "--residual", residual, "--json"]) == 0
        out, err = capfd.readouterr()
        errors.append(json.loads(out)["error"])
        assert err == "" and errors[-1]["reference"] == "bake right" and errors[-1]["reference_texels"] is None
    assert errors[0]["rms"] > 2 * errors[1]["rms"] and errors[0]["bias"] < errors[1]["bias"] < 0.01
    assert run([*line, "--show", "split", *FEW]) == 0
    out = capfd.readouterr().out
    assert re.search(r", off by \d+\.\d\d% RMS and \d+\.\d\d% in the median, ", out) and out.count("\n") == 1


def test_view_without_a_screen_draws_headless_and_says_where(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    line = ["view", "cornell-box", "--size", "640x360", "--residual", "0.5", "--texels", "2000"]
    assert run(line) == 0
    out, err = capfd.readouterr()
    assert out.startswith("cornell-box.png: ")
    assert "rendering to cornell-box.png instead" in err and err.count("\n") == 1
    assert Image.open(folder / "cornell-box.png").size == (640, 360)


def test_the_exposure_is_found_unless_given(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for name, more in (("auto", []), ("given", ["--exposure", "-6"])):
        assert run(["shot", "cornell-box", "-o", f"{name}.png", "--size", "64x64", *FEW, *more]) == 0
    light = {name: sum(Image.open(folder / f"{name}.png").convert("L").tobytes()) for name in ("auto", "given")}
    assert light["auto"] > 2 * light["given"]


@pytest.mark.parametrize("storage", ["rgba32f", "rgba16f", "fixed8"])
@pytest.mark.parametrize("scene", ["cornell-box", "textured-room"])
def test_info_foretells_the_solve(folder: Path, scene: str, storage: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Texels, tiles and atlas exactly; memory within 1 %: the tables of materials are left out."""
    told = json_of(capsys, ["info", scene, "--json", "--texels", "9000", "--storage", storage])
    line = ["shot", scene, "-o", "a.png", "--size", "64x48", "--json", "--texels", "9000", "--shots", "1"]
    came = json_of(capsys, [*line, "--storage", storage])
    assert told["texels"] == came["texels"]
    assert told["atlas"] == came["atlas"]
    assert told["charts"] == came["charts"]["count"]
    assert told["memory_mib"] == pytest.approx(came["memory_mib"], rel=0.01)


def test_info_of_a_large_scene_neither_unfolds_nor_places(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A box 40 times, turned, scaled and mirrored; counts, area and density as of the whole scene, marked as estimates."""
    gltf, rng = Gltf(), np.random.default_rng(3)
    box = shapes.box((1.0, 2.0, 0.5))
    primitive = {"attributes": {"POSITION": gltf.accessor(box.positions.astype(np.float32))}, "material": 0}
    primitive["indices"] = gltf.accessor(box.triangles.astype(np.uint16).reshape(-1))
    turns = rng.normal(size=(40, 4))
    places = {
        "TRANSLATION": gltf.accessor((10 * rng.random((40, 3))).astype(np.float32)),
        "ROTATION": gltf.accessor((turns / np.linalg.norm(turns, axis=1)[:, None]).astype(np.float32)),
        "SCALE": gltf.accessor(np.repeat(rng.choice([-1.0, 0.5, 2.0], (40, 1)), 3, axis=1).astype(np.float32)),
    }
    gltf.json |= {
        "meshes": [{"primitives": [primitive]}],
        "nodes": [{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": places}}}],
        "materials": [
            {
                "doubleSided": True,
                "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]},
                "extras": {"lightmap_scale": 3},
            }
        ],
    }
    Path("boxes.glb").write_bytes(gltf.glb())
    whole = load_scene("boxes.glb")
    exact = json_of(capsys, ["info", "boxes.glb", "--json"])
    assert exact["estimated"] == ["seconds_to_open"]

    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("unfolds")

    monkeypatch.setattr(info_module, "COUNTED", 100)
    monkeypatch.setattr(info_module, "read_and_unfold", refuse)
    told = json_of(capsys, ["info", "boxes.glb", "--json"])
    area = 2 * whole.normals_areas[1].sum()
    assert told["texels"] == pytest.approx((3 * told["texels_per_metre"]) ** 2 * area)
    assert told["texels"] == pytest.approx(exact["texels"], rel=0.1)  # texels on the outlines of small rectangles
    monkeypatch.setitem(info_module.OUTLINES, ".glb", (outline_gltf, 100))
    monkeypatch.setattr(info_module, "load_scene", refuse)
    estimated = ["lit_sides", "texels_per_metre", "texels", "tiles", "memory_mib", "seconds_to_open"]
    assert told.pop("estimated") == estimated
    outlined = json_of(capsys, ["info", "boxes.glb", "--json"])
    assert outlined.pop("estimated") == ["triangles", "size_m", *estimated]
    size = whole.bounds[1] - whole.bounds[0]
    assert (outlined["size_m"] >= size - 1e-9).all() and outlined.pop("size_m") == pytest.approx(size, rel=0.2)
    assert told.pop("size_m") == pytest.approx(size)
    told["cameras"] = []  # that which a scene gets if it has none
    assert outlined.pop("texels_per_metre") == pytest.approx(told.pop("texels_per_metre"))
    assert outlined == told


def test_info_foretells_how_quadtrees_begin(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Before anything has split. Memory without the tables of leaves and materials: within 2 %."""
    told = json_of(capsys, ["info", "cornell-box", "--json", "--adaptive"])
    line = ["shot", "cornell-box", "-o", "a.png", "--size", "64x48", "--json", "--adaptive", "--shots", "1"]
    came = json_of(capsys, line)
    assert told["texels"] == came["texels"]
    assert told["memory_mib"] == pytest.approx(came["memory_mib"], rel=0.02)
    # the finest level is three below the roots. A fifth of the roots' texels lie across an outline, 82 % inside of it, and count
    # whole: 4 % more
    finest = ["info", "cornell-box", "--json", "--density", str(2**3 * told["texels_per_metre"])]
    assert told["texels_if_uniform"] == pytest.approx(json_of(capsys, finest)["texels"], rel=0.04)


def test_a_budget_that_is_reached_is_said(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = [
        "shot",
        "cornell-box",
        "-o",
        "a.png",
        "--size",
        "64x48",
        "--adaptive",
        "--budget",
        "65536",
        "--gradient",
        "1e-3",
    ]
    assert run([*line, "--texels", "16000", "--shots", "200"]) == 0
    assert "the budget of 65,536 texels is reached" in capsys.readouterr().err


def test_info_as_text(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["info", "two-rooms"]) == 0
    rows = dict(line.strip().split("  ", 1) for line in capsys.readouterr().out.splitlines())
    assert rows["cameras"] == "main, lit room"
    assert rows["emitting materials"] == "1"


def test_doctor_lists_what_is_there(capsys: pytest.CaptureFixture[str]) -> None:
    values = json_of(capsys, ["doctor", "--json"])
    assert values["missing"] == []
    assert values["renderer"] and values["numpy"]


def test_doctor_names_packages_that_are_missing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("app.commands.doctor.PACKAGES", ("numpy", "no-such-package"))
    assert run(["doctor"]) == 2
    assert "missing package no-such-package: " in (out := capsys.readouterr().out)
    assert out.rstrip().endswith("-m pip install no-such-package")


# -- processes of their own --------------------------------------------------------------------------------------------


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
import app.commands.info as info_module
from app.cli import run
from app.scene import shapes
from app.scene.gltf import outline_gltf
from app.scene.load import load_scene
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


def json_of(capsys: pytest.CaptureFixture[str], line: list[str]) -> dict[str, Any]:
    assert run(line) == 0
    values = json.loads(capsys.readouterr().out)
    assert isinstance(values, dict)
    return values


@pytest.mark.usefixtures("few_points")
def test_many_bakes_have_a_folder_each_and_one_table(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    line = ["--texels", "600", "--rays", "8"]
    assert run(["bake", "cornell-box", "nowhere", "furnace", "-o", "many", *line]) == 2
    out, err = capsys.readouterr()
    table = out.splitlines()
    assert [row.split()[0] for row in table] == ["scene", "cornell-box", "nowhere", "furnace"]
    assert table[2].endswith("failed") and "nowhere" in err
    for scene in ("cornell-box", "furnace"):
        assert (folder / "many" / scene / "scene.glb").is_file()
    assert not (folder / "many" / "nowhere").exists()
    values = json_of(capsys, ["bake", "cornell-box", "furnace", "-o", "many", "--json", *line])
    assert [result["rays"] for result in values["bakes"]] == [8, 8]
    assert run(["bake", "furnace", "furnace", "-o", "many", *line]) == 2
    assert "two of the scenes would have this folder" in capsys.readouterr().err
