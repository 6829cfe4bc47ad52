"""``glowtree bench edits``: what is edited, what of an edit is timed, and what is printed of it."""

from __future__ import annotations

import json
from collections.abc import Generator
from pathlib import Path

import pytest

from app.atlas.options import AtlasOptions
from app.bench.speed.edits import _Bench, edits_of
from app.cli import run
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.scene.load import load_scene
from app.session.batch import opened
from app.solvers import SOLVERS
from app.solvers.gathering.options import GatheringOptions
from app.solvers.gathering.solver import BATCH, Gathering

TEXELS = 1000


def test_the_strongest_lamp_and_the_brightest_wall_are_edited() -> None:
    scene = load_scene("cornell-box")
    edits = edits_of(scene)
    changed = {
        what: [(old, new) for old, new in zip(scene.materials, materials, strict=True) if old != new]
        for what, materials in edits.items()
    }
    [(lamp, brighter)], [(wall, darker)] = changed["emission"], changed["albedo"]
    assert lamp.emits and brighter.emission == tuple(2 * e for e in lamp.emission) and brighter.albedo == lamp.albedo
    assert not wall.emits and darker.albedo == tuple(a / 2 for a in wall.albedo) and not darker.emits


def test_where_everything_glows_a_lamp_turns_darker() -> None:
    scene = load_scene("furnace")
    assert all(m.emits for m in scene.materials)
    assert [m.albedo for m in edits_of(scene)["albedo"]] != [m.albedo for m in scene.materials]


def test_the_first_picture_comes_before_the_whole_solution_and_neither_costs_a_ray(gpu: Gpu) -> None:
    with opened(
        gpu, "cornell-box", AtlasOptions(texels=TEXELS), LightmapOptions(), GatheringOptions(), "gathering"
    ) as (lightmap, solver):
        assert isinstance(solver, Gathering)
        bench = _Bench(gpu, lightmap, solver, SOLVERS["gathering"], 2 * BATCH)
        for row in bench.rows(repeats=2):
            assert row["before"] == 2 * BATCH
            assert 0 < row["first_ms"] < row["whole_ms"] and row["first_cpu_ms"] < row["whole_cpu_ms"]
            assert 0 < row["longest_ms"] and row["work"] == row["traced"] == 0
            assert row["rms"] < 2e-3 and row["median"] < 2e-3


def test_light_that_is_off_and_rays_that_it_cost_are_seen(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    with opened(
        gpu, "cornell-box", AtlasOptions(texels=TEXELS), LightmapOptions(), GatheringOptions(), "gathering"
    ) as (lightmap, solver):
        assert isinstance(solver, Gathering)
        bench = _Bench(gpu, lightmap, solver, SOLVERS["gathering"], BATCH)
        follow = solver._follow_edit

        def slipshod() -> Generator[None, None, int]:
            solver.hits.traced += 7
            return (yield from follow())

        light = bench._light
        twice = iter([2.0, 1.0])
        monkeypatch.setattr(solver, "_follow_edit", slipshod)
        monkeypatch.setattr(bench, "_light", lambda: light() * next(twice))
        row = bench._row("nothing", lightmap.scene.materials, lightmap.scene.materials, repeats=3)
        assert row["traced"] == 3 * 7
        assert row["median"] == pytest.approx(1.0, abs=1e-2), "twice the light"


@pytest.mark.parametrize("solver", ["shooting", "pairs"])
def test_solvers_that_distribute_light_work_until_as_little_remains(
    capfd: pytest.CaptureFixture[str], solver: str
) -> None:
    command = ["bench", "edits", "furnace", "--solver", solver, "--texels", "600", "--repeats", "1", "--json"]
    threshold = "--" + SOLVERS[solver].threshold
    assert run([*command, threshold, "0.01"]) == 0
    values = json.loads(capfd.readouterr().out)
    assert values["unit"] == SOLVERS[solver].unit and [row["edit"] for row in values["edits"]] == ["emission", "albedo"]
    for row in values["edits"]:
        assert row["before"] > 0 and row["whole_ms"] > 0 and row["first_ms"] is None and row["traced"] is None
        assert row["rms"] < 0.05
    assert values["edits"][1]["work"] > 0, "an albedo costs work"


def test_what_is_printed(capfd: pytest.CaptureFixture[str]) -> None:
    assert run(["bench", "edits", "cornell-box", "--texels", "600", "--rays", "16", "--repeats", "1"]) == 0
    text = capfd.readouterr().out
    assert "gathering" in text and "rays traced" in text and text.count("| cornell-box |") == 2


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["no-such-scene"], "no-such-scene"),
        (["--repeats", "0"], "--repeats"),
        (["--shots", "9"], "--shots"),
        (["--solver", "none"], "--solver"),
    ],
)
def test_bad_input_is_one_line(words: list[str], says: str, capfd: pytest.CaptureFixture[str]) -> None:
    try:
        code: object = run(["bench", "edits", *words])
    except SystemExit as end:
        code = end.code
    assert code == 2
    assert says in capfd.readouterr().err.strip().splitlines()[-1]


def test_a_scene_without_any_lamp_is_bad_input(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "dark.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n")
    assert run(["bench", "edits", str(path)]) == 2
    assert "nothing in the scene emits light" in capfd.readouterr().err
