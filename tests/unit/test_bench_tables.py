"""The papers' tables: how they are written, what is refused, rooms of exact size, and one small row that is really measured."""

from __future__ import annotations

import csv
import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.atlas.options import AtlasOptions
from app.atlas.points import random_points
from app.bench.papers import convergence, coombe_subdivision, equal_error, published, scaling, tables
from app.bench.papers.sphere_rooms import FEWEST, room_of
from app.bench.papers.table import Measure, Table
from app.bench.solves import timed_solve
from app.bench.timing import BATCH
from app.cli import run
from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.at_points import irradiance_of
from app.lightmap.options import LightmapOptions
from app.session.batch import opened
from app.solvers import ShootingOptions
from app.util.parts import run_to_end
from app.util.tables import Column, csv_text, markdown_table

COLUMNS = (Column("scene", "scene"), Column("n", "texels", ","), Column("ms", "ms", ".2f"))
ROWS = [{"scene": "a", "n": 31_000, "ms": 0.123456}, {"scene": "long name", "n": None, "other": 1}]


def table(name: str, *jobs: Measure) -> Table:
    return Table(name, name, "nobody", ("note",), COLUMNS, tuple((f"job {k}", job) for k, job in enumerate(jobs)))


def test_markdown_is_aligned_and_empty_where_nothing_is() -> None:
    assert markdown_table(COLUMNS, ROWS).splitlines() == [
        "|     scene | texels |   ms |",
        "|      ---: |   ---: | ---: |",
        "|         a | 31,000 | 0.12 |",
        "| long name |        |      |",
    ]


def test_csv_keeps_all_digits() -> None:
    assert list(csv.reader(csv_text(COLUMNS, ROWS).splitlines())) == [
        ["scene", "n", "ms"],
        ["a", "31000", "0.123456"],
        ["long name", "", ""],
    ]


@pytest.mark.parametrize("triangles", [FEWEST, 37, 258, 1_000, 15_872, 21_704, 38_147])
def test_room_has_exactly_so_many_triangles(triangles: int) -> None:
    scene = room_of(triangles)
    _, areas = scene.normals_areas
    low, high = scene.bounds
    assert len(scene.triangles) == triangles
    assert areas.min() > 0
    assert np.allclose((low, high), ((-4, -2, -4), (4, 2, 4))), "something sticks out of the room"
    assert scene.emits


def test_room_too_small() -> None:
    with pytest.raises(UserError, match=f"at least {FEWEST}"):
        room_of(FEWEST - 1)


def test_exponents_within_a_sweep_only() -> None:
    rows: list[dict[str, Any]] = [
        {"sweep": "triangles", "n": 10, "shot_ms": 1.0, "receive_ms": 5.0},
        {"sweep": "triangles", "n": 100, "shot_ms": 10.0, "receive_ms": 5.0},
        {"sweep": "texels", "n": 1000, "shot_ms": 1.0, "receive_ms": 1.0},
    ]
    scaling.add_exponents(rows)
    assert rows[1]["shot_power"] == pytest.approx(1.0) and rows[1]["receive_power"] == pytest.approx(0.0)
    assert "shot_power" not in rows[0] and "shot_power" not in rows[2]


def test_first_below() -> None:
    curve = [(0, 1.0), (8, 0.4), (16, 0.1)]
    assert [convergence.first_below(curve, level) for level in (0.5, 0.1, 0.05)] == [8, 16, None]


def test_columns_of_all_tables_differ() -> None:
    for t in tables.all_tables():
        keys = [c.key for c in t.columns]
        assert len(set(keys)) == len(keys) and t.jobs, t.name


def test_published_numbers_give_the_speeds_of_the_text() -> None:
    """[Coombe03, 5]: adaptive slower in all but the smallest. [Wallner10, 4]: the hemisphere takes less than the hemicube."""
    slower = [row.adaptive_s > row.uniform_s for row in published.COOMBE_TABLE_1]
    assert slower == [False, True, True]
    assert all(row.sphere_s < row.cube_s for row in published.WALLNER_TABLE_1)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ("", "-o/--output"),
        ("-o out --only bogus", "bogus: must be one of coombe1, equal, wallner1"),
        ("-o out --only coombe1,,scaling", "must be one of"),
        ("-o out --seconds 0", "0: must be a number above 0"),
        ("-o out --seconds nan", "nan: must be a number above 0"),
        ("-o file --only coombe1", "file: cannot write here"),
        ("-o out --only coombe1 --plots", "--plots needs matplotlib: pip install 'glowtree[bench]'"),
        ("-o out --only wallner2", "table wallner2 needs flip-evaluator: pip install 'glowtree[bench]'"),
    ],
)
def test_bad_input_is_one_line(
    arguments: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    Path("file").touch()
    try:
        code = run(["bench", "tables", *arguments.split()])
    except SystemExit as error:
        code = int(error.code or 0)
    out, err = capfd.readouterr()
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert says in err
    assert not Path("out").exists(), "nothing is made before all is checked"


def test_help_names_all_tables(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        run(["bench", "tables", "--help"])
    text = " ".join(capfd.readouterr().out.split())
    assert ", ".join(t.name for t in tables.all_tables()) in text


def test_ctrl_c_keeps_finished_rows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def stop(gpu: Gpu, seconds: float) -> dict[str, Any]:
        raise KeyboardInterrupt

    def too_large(gpu: Gpu, seconds: float) -> dict[str, Any]:
        raise UserError("too many texels")

    done = table("coombe1", lambda gpu, seconds: {"scene": "a", "n": 7, "ms": seconds}, too_large, stop)
    monkeypatch.setattr(tables, "all_tables", lambda: (done, table("wallner1", stop)))
    assert run(["bench", "tables", "-o", str(tmp_path / "out"), "--seconds", "0.5"]) == 130
    out, err = capfd.readouterr()
    assert "job 1: left out: too many texels" in err and "only finished rows" in err
    assert (tmp_path / "out/coombe1.csv").read_text() == "scene,n,ms\na,7,0.5\n"
    assert (tmp_path / "out/wallner1.csv").read_text() == "scene,n,ms\n"
    assert (tmp_path / "out/tables.md").read_text() == out
    assert "Nothing was measured." in out
    values = json.loads((tmp_path / "out/tables.json").read_text())
    assert len(values["warnings"]) == 2 and "job 1: left out" in values["warnings"][0]
    assert values["interrupted"] and values["renderer"] and values["machine"]
    assert values["tables"] == {"coombe1": [{"scene": "a", "n": 7, "ms": 0.5}], "wallner1": []}


def test_only_the_tables_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    named = tuple(table(name, lambda gpu, seconds: {"n": 1}) for name in ("a", "b", "c"))
    monkeypatch.setattr(tables, "all_tables", lambda: named)
    assert run(["bench", "tables", "-o", str(tmp_path), "--only", "a,c", "--json"]) == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.csv", "c.csv", "tables.json", "tables.md"]


def test_without_an_extra_all_but_its_columns_is_measured(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    two = (table("plain", lambda gpu, seconds: {"n": 1}), table("wallner2", lambda gpu, seconds: {"n": 2}))
    flip = tuple(c for t in tables.all_tables() for c in t.columns if c.needs)
    assert [c.head for c in flip] == ["stereographic FLIP", "nonlinear FLIP"]
    known = two[0], dataclasses.replace(two[1], columns=(*COLUMNS, *flip))
    monkeypatch.setattr(tables, "all_tables", lambda: known)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert run(["bench", "tables", "-o", str(tmp_path)]) == 0
    out, err = capfd.readouterr()
    assert err == (
        "glowtree: note: table wallner2: left out: stereographic FLIP, nonlinear FLIP: needs flip-evaluator: "
        "pip install 'glowtree[bench]'\n"
    )
    assert "FLIP" not in out
    assert (tmp_path / "wallner2.csv").read_text() == "scene,n,ms\n,2,\n"
    values = json.loads((tmp_path / "tables.json").read_text())
    assert values["tables"]["plain"] == [{"n": 1}] and values["warnings"] == [
        err.removeprefix("glowtree: note: ").strip()
    ]


def test_flip_sees_what_has_changed(rng: np.random.Generator) -> None:
    flip = pytest.importorskip("app.bench.flip", reason="of the extra bench", exc_type=ImportError).flip
    picture = rng.uniform(0.2, 0.8, (24, 32, 3))
    assert flip(picture, picture) == 0.0
    slightly, clearly = picture.copy(), picture.copy()
    slightly[8:16, 8:16] *= 0.9
    clearly[8:16, 8:16] = 1.0
    assert 0.0 < flip(picture, slightly) < flip(picture, clearly) < 1.0


def test_curve_is_of_the_state_after_its_shots(gpu: Gpu) -> None:
    """The first point again with exactly so many shots: an off-by-one batch is 10 % and more at the start."""
    options = ShootingOptions(residual=0.5)
    with opened(gpu, room_of(37), AtlasOptions(texels=1_500), LightmapOptions(), options) as (_, solver):
        solve = timed_solve(gpu, solver, BATCH, 60.0)
        shots, residual = solve.curve[1]
        solver.reset()
        while solver.poll(wait=True).done < shots:
            run_to_end(solver.work(BATCH))
        again = solver.settle()
        assert again.done == shots
        assert again.remaining == pytest.approx(residual, rel=1e-4)  # sums of 32-bit floats
        assert [s for s, _ in solve.curve] == sorted({s for s, _ in solve.curve}) and solve.converged
        assert solve.curve[-1] == (solve.done, solve.remaining)


def test_a_row_is_measured(gpu: Gpu) -> None:
    """Small and short: that numbers come out, not which."""
    row = scaling.measure_row(gpu, 0.1, "triangles", 100, 2_000)
    assert row["triangles"] == row["n"] == 100
    assert 1_500 < row["texels"] < 2_500, "a number of texels is met roughly"
    assert 0 < row["see_ms"] and 0 < row["receive_ms"] and 0 < row["shot_ms"] < 1e3


def test_uniform_and_adaptive_are_measured(gpu: Gpu) -> None:
    row = coombe_subdivision.measure_row(gpu, 0.1, published.COOMBE_TABLE_1[0], texels=4_000)
    assert 3_000 < row["uniform_texels"] < 5_000 and 0 < row["adaptive_texels"] < 2 * row["uniform_texels"]
    assert row["uniform_shots"] > 0 and row["uniform_s"] > 0 and row["adaptive_s"] > 0
    assert row["their_uniform_s"] == 0.25


def test_equal_error_is_read_between_uniform_rows() -> None:
    """Halfway in the logarithm of the error is halfway in those of texels and seconds; beyond the uniform errors is nothing."""
    uniform = [(1e3, 1.0, 0.04), (1e5, 100.0, 0.01)]
    rows: list[dict[str, Any]] = [
        {"subdivision": "uniform", "texels": texels, "seconds": s, "rms": rms} for texels, s, rms in uniform
    ]
    rows += [{"subdivision": "adaptive", "texels": 2e3, "seconds": 2.0, "rms": rms} for rms in (0.02, 0.005)]
    equal_error.add_equal_uniform(rows)
    assert rows[2]["equal_texels"] == pytest.approx(1e4) and rows[2]["texels_share"] == pytest.approx(0.2)
    assert rows[2]["equal_seconds"] == pytest.approx(10) and rows[2]["seconds_share"] == pytest.approx(0.2)
    assert "equal_texels" not in rows[3] and "equal_texels" not in rows[0]


@pytest.mark.parametrize("adaptive", [False, True])
def test_a_lightmap_is_read_where_its_points_are(gpu: Gpu, adaptive: bool) -> None:
    """E = a position's height above the floor, exact where bilinear: inside of faces; texels at their edges hold the mean of
    what they cover, half a texel in."""
    light = LightmapOptions(adaptive=adaptive)
    with opened(gpu, "furnace", AtlasOptions(texels=4_000), light, ShootingOptions()) as (
        lightmap,
        _,
    ):
        scene, pool = lightmap.scene, lightmap.pool
        height = pool.image_from_tiles(pool.surfaces.position[..., 1:2].astype(np.float32))
        lightmap.texture("t_irradiance").write(np.ascontiguousarray(height.repeat(4, -1) / lightmap.unit).tobytes())
        points = random_points(scene, 300, 3)
        read, position = irradiance_of(lightmap, points)[:, 0], points.positions_normals(scene)[0][:, 1]
        texel = 1 / lightmap.charts.density
    assert np.abs(read - position).max() < 0.51 * texel
    assert np.median(np.abs(read - position)) < 1e-4
