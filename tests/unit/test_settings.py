"""Settings: one file for window and terminal, whose slips are named; flags come before it."""

from __future__ import annotations

import argparse
import re
import tomllib
from pathlib import Path

import pytest

from app import cli
from app.atlas.options import AtlasOptions
from app.bench import commands
from app.bench.accuracy.methods import METHODS
from app.bench.choices import CURVES_END
from app.errors import UserError
from app.render.options import DisplayOptions
from app.session.settings import PRESETS, TABLES, Settings, checked, settings_of, settings_text, write_settings
from app.solvers import SOLVERS, GatheringOptions
from app.ui.state import Pace

GIVEN = """
solver = "gathering"
[texels]
density = 40
[lightmap]
adaptive = true
[gathering]
noise = 0.005
[shooting]
level = 1
[pace]
pace = "fast"
[stop]
time = 12
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "mine.toml"
    path.write_text(GIVEN)
    return path


def test_what_is_given_is_read_and_the_rest_stays(file: Path) -> None:
    settings = settings_of(file, {"pace": Pace})
    assert settings.solver == "gathering"
    assert settings.of("gathering", GatheringOptions(smooth=False)) == GatheringOptions(noise=0.005, smooth=False)
    assert settings.of("texels", AtlasOptions()).density == 40.0
    assert settings.of("display", DisplayOptions()) == DisplayOptions()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("[gathering]\nnoize = 1", r"gathering: unknown key noize; did you mean noise\?"),
        ("[gatherin]\nnoise = 1", r"unknown table gatherin; did you mean gathering\?"),
        ("slover = 'local'", r"unknown key slover; did you mean solver\?"),
        ("solver = 'magic'", r'solver = "magic": must be one of shooting, '),
        ("solver = 3", r"solver = 3: must be one of"),
        ("[shooting]\nlevel = 9", r"shooting.level = 9: must be 0 to 4"),
        ("[shooting]\nlevel = true", r"shooting.level = true: must be 0 to 4"),
        ("[lightmap]\nadaptive = 'yes'", r'lightmap.adaptive = "yes": must be'),
        ("[gathering]\nnoise = nan", r"gathering.noise = NaN: must be"),
        ("[display]\ntone_map = [1, 2]", r"display.tone_map = \[1, 2\]: must be one of"),
        ("texels = 3", r"texels must be a table \[texels\]"),
        ("zzz = 1", r"unknown key zzz; there are solver, texels, "),
        ('"a\\nb" = 1', r'unknown key "a\\nb"'),
        ("this is no toml", r"is no TOML: "),
        ("a = " + 5000 * "[", r"is no TOML: "),
    ],
)
def test_a_slip_is_one_line_that_names_it(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    with pytest.raises(UserError) as caught:
        settings_of(path)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{path}: ") and re.search(says, line), line
    assert len(line) < 500


def test_files_that_are_none(tmp_path: Path) -> None:
    for content in (b"\xff\xfe\x00", b"x" * (2 << 20)):
        (tmp_path / "bad.toml").write_bytes(content)
        with pytest.raises(UserError, match=r"is no TOML|are no settings"):
            settings_of(tmp_path / "bad.toml")
    with pytest.raises(UserError, match="neither a file nor one of draft, good, final"):
        settings_of(tmp_path / "none.toml")
    with pytest.raises(UserError, match="cannot be read"):
        settings_of(tmp_path)


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    tables = {name: options() for name, options in TABLES.items()}
    tables["gathering"] = GatheringOptions(noise=1e-5, smooth=False)
    tables["texels"] = AtlasOptions(texels=12345)
    path = tmp_path / "kept.toml"
    write_settings(path, settings_text("local", tables))
    settings = settings_of(path)
    assert settings.solver == "local"
    assert {name: settings.of(name, options()) for name, options in TABLES.items()} == tables
    for name in SOLVERS:
        assert re.search(rf"^\[{name}\]$", path.read_text(), re.MULTILINE)
    assert [p.name for p in tmp_path.iterdir()] == ["kept.toml"]
    with pytest.raises(UserError, match="cannot be written"):
        write_settings(tmp_path / "no" / "x.toml", "")


def test_what_is_of_one_scene_is_no_setting() -> None:
    text = settings_text("shooting", {"display": DisplayOptions(exposure=7.0, layer="error", tone_map="aces")})
    assert tomllib.loads(text)["display"].keys() & {"exposure", "layer", "show"} == set()
    assert tomllib.loads(text)["display"]["tone_map"] == "aces"


@pytest.mark.parametrize("preset", PRESETS)
def test_presets_are_settings(preset: str) -> None:
    assert settings_of(preset) == checked(PRESETS[preset], preset) != Settings()


# -- in the terminal ---------------------------------------------------------------------------------------------------


def parsed(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> argparse.Namespace:
    seen: list[argparse.Namespace] = []
    for command in ("_bake", "_shot", "_info", "_view"):
        monkeypatch.setattr(cli, command, lambda flags: seen.append(flags) or 0)
    for command in ("_bench_error", "_bench_shots", "_bench_presets", "_bench_hard"):
        monkeypatch.setattr(commands, command, lambda flags: seen.append(flags) or 0)
    assert cli.run(list(arguments)) == 0
    return seen[-1]


def test_flags_come_before_settings(monkeypatch: pytest.MonkeyPatch, file: Path) -> None:
    flags = parsed(monkeypatch, "shot", "x", "-o", "y", "--settings", str(file), "--time", "3", "--no-adaptive")
    assert (flags.solver, flags.noise, flags.time, flags.adaptive) == ("gathering", 0.005, 3.0, False)
    assert flags.density == 40.0


def test_a_named_solver_has_its_own_table(monkeypatch: pytest.MonkeyPatch, file: Path) -> None:
    flags = parsed(monkeypatch, "bake", "x", "-o", "y", f"--settings={file}", "--solver", "shooting")
    assert flags.solver == "shooting" and flags.level == 1 and not hasattr(flags, "noise")


def test_benches_take_what_they_have_of_settings(monkeypatch: pytest.MonkeyPatch, file: Path) -> None:
    """Of all solvers at once; what they have defaults of their own for, too."""
    settings = f"--settings={file}"
    error = parsed(monkeypatch, "bench", "error", "x", "-o", "y", settings)
    assert (error.noise, error.level) == (0.005, 1)
    assert METHODS["gathering"].setup(None, error).options.noise == 0.005
    unset = parsed(monkeypatch, "bench", "error", "x", "-o", "y")
    assert METHODS["gathering"].setup(None, unset).options.noise == CURVES_END["noise"]
    assert parsed(monkeypatch, "bench", "shots", settings).level == 1
    assert parsed(monkeypatch, "bench", "hard", settings).solver == "gathering"
    assert parsed(monkeypatch, "bench", "hard", settings, "--solver", "local").solver == "local"
    assert parsed(monkeypatch, "bench", "hard").solver is None, "all of them"
    assert parsed(monkeypatch, "bench", "presets", settings).given.solver == "gathering"


def test_without_settings_all_is_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    assert parsed(monkeypatch, "bake", "x", "-o", "y").solver == "gathering"
    assert parsed(monkeypatch, "shot", "x", "-o", "y").solver == "shooting"
    assert parsed(monkeypatch, "info", "x", "--settings", "draft").command


def test_wrong_settings_are_one_line_and_exit_code_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bad.toml").write_text("[gathering]\nnoize = 1")
    assert cli.run(["shot", "cornell-box", "-o", "x.png", "--settings", str(tmp_path / "bad.toml")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "noize" in line and "noise" in line
