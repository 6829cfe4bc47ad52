"""The command line: every bad input is one line on stderr and exit code 2; stdout holds the result and nothing else."""

from __future__ import annotations

import json
import re
import time
from pathlib import Path

import pytest
from cli_folder import folder, json_of
from PIL import Image

from app.cli import run

__all__ = ["folder"]

FEW = ["--texels", "2000", "--shots", "8"]  # enough to have run through everything
SHOT = "shot cornell-box -o a.png "


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
    (SHOT + "--noise 0.1", "shot: --noise needs --solver gathering ("),
    ("info cornell-box --level 2", "unknown argument --level"),
]


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
