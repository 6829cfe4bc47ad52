"""Error against time: the clock that stands while it is looked, what is compared, what is refused, and a small run as a whole."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Generator, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from solver_scenes import grey, quads_scene, room

from app.atlas.options import AtlasOptions
from app.atlas.points import random_points
from app.bench.accuracy import curve, error
from app.bench.accuracy.error import TITLE
from app.bench.accuracy.methods import DEFAULT_METHODS, METHODS, method_names
from app.bench.papers.measure import warm_up
from app.bench.peers.peers import PEERS
from app.cli import ERROR_SCENES, build_parser, run
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.options import specs
from app.reference import truth
from app.reference.truth import Truth
from app.scene.load import load_scene
from app.scene.model import Scene
from app.session.batch import opened
from app.solvers import Progress, ShootingOptions
from app.util.console import Console
from app.util.tables import FLIP, missing

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(tmp_path / "cache"))
    return tmp_path / "cache"


def silent(text: str, share: float) -> None:
    pass


class FakeClock:
    """Seconds that pass only when somebody says so."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def furnace(albedo: float = 0.5, **changes: Any) -> Scene:
    return quads_scene(room(), [grey(albedo, 1.0, **changes)])


# -- the clock ---------------------------------------------------------------------------------------------------------


def test_a_held_stopwatch_stands() -> None:
    clock = FakeClock()
    watch = curve.Stopwatch(clock)
    clock.now = 3.0
    with watch.held():
        clock.now = 100.0
        assert watch.seconds == 3.0
    clock.now = 102.0
    assert watch.seconds == 5.0


class OneSecondSteps:
    """A solver whose every step takes a second, and halves the residual."""

    options = ShootingOptions(residual=2.0**-20)

    def __init__(self, clock: FakeClock) -> None:
        self._clock, self.residual = clock, 1.0

    def warm_up(self) -> Iterator[None]:
        return iter(())

    def reset(self) -> None:
        self.residual = 1.0

    def work(self, amount: int, bands: int = 1) -> Generator[None, None, int]:
        self._clock.now += 1.0
        self.residual /= 2
        yield
        return amount

    def poll(self, *, wait: bool = False) -> Progress:
        return Progress(0, self.residual, np.zeros(3), self.residual <= self.options.residual)


@pytest.mark.parametrize(("limit", "last"), [(100.0, 20.0), (7.5, 8.0)])
def test_looking_stops_the_clock(gpu: Gpu, limit: float, last: float) -> None:
    clock, cpu = FakeClock(), FakeClock()
    solver: Any = OneSecondSteps(clock)

    def look() -> dict[str, Any]:
        clock.now += 1000.0
        cpu.now += 500.0
        return {"residual": solver.residual}

    rows = curve.solve_curve(gpu, solver, limit, look, clock=clock, cpu_clock=cpu)
    seconds = [row["seconds"] for row in rows]
    assert seconds[0] == 1.0 and seconds[-1] == last
    assert [row["residual"] for row in rows] == [2.0**-s for s in seconds], "seconds are those of the steps alone"
    assert {row["cpu_seconds"] for row in rows} == {0.0}
    steps = np.diff(seconds[:-1])
    assert (steps <= np.maximum(1.0, (curve.GROWTH - 1) * np.array(seconds[:-2]) + 1.0)).all()


def test_nothing_changes_by_looking(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same solve, looked at once and after every step: as much light after as many shots."""
    known = truth.truth_of(furnace(), "closed-form", 1, silent)
    with opened(gpu, furnace(), AtlasOptions(texels=600), LightmapOptions(), ShootingOptions(residual=0.2)) as (
        lightmap,
        solver,
    ):
        looks = []
        for growth in (1e9, 1.0):
            monkeypatch.setattr(curve, "GROWTH", growth)
            looks.append(curve.solve_curve(gpu, solver, 60.0, lambda: curve.look_at(lightmap, solver, known)))
    few, many = looks
    assert len(few) == 2 and len(many) > 10
    same = next(row for row in many if row["shots"] == few[0]["shots"])
    assert same["rms"] == pytest.approx(few[0]["rms"], rel=1e-5)  # sums of 32-bit floats
    # who waits for reports hears of convergence at once, and else two batches of 8 later
    assert 0 <= few[1]["shots"] - many[-1]["shots"] <= 3 * 8


@pytest.mark.parametrize("adaptive", [False, True])
def test_warming_up_leaves_no_trace(gpu: Gpu, adaptive: bool) -> None:
    light = LightmapOptions(adaptive=adaptive)
    with opened(gpu, "cornell-box", AtlasOptions(texels=2_000), light, ShootingOptions()) as (
        lightmap,
        solver,
    ):
        tiles = set(lightmap.pool.leaves.only(lightmap.pool.used).keys.tolist())
        warm_up(gpu, solver)
        assert set(lightmap.pool.leaves.only(lightmap.pool.used).keys.tolist()) == tiles
        assert solver.poll(wait=True).done == 0 and solver.settle().remaining == pytest.approx(1.0, rel=1e-5)
        assert not lightmap.irradiance().any()


def test_seconds_to_a_level_are_read_between_looks() -> None:
    rows = [
        {"seconds": 1.0, "rms": 0.08},
        {"seconds": 2.0},
        {"seconds": 4.0, "rms": 0.02},
        {"seconds": 5.0, "rms": 0.03},
    ]
    assert curve.first_at(0.04, rows) == pytest.approx(2.0)  # halfway in both logarithms
    assert curve.first_at(0.02, rows) == pytest.approx(4.0)
    assert curve.first_at(0.5, rows) == 1.0
    assert curve.first_at(0.01, rows) is None


def test_errors_are_those_at_lit_points() -> None:
    points = random_points(furnace(), 4, 1)
    E = np.array([[1.0] * 3, [2.0] * 3, [3.0] * 3, [0.0] * 3])
    row = curve.errors(E * 1.1 + [[0.0], [0.0], [0.0], [0.2]], Truth("", points, E, None, "", 0.0))
    assert row["bias"] == pytest.approx(0.1) and row["median"] == pytest.approx(0.1)
    assert row["rms"] == pytest.approx(0.1 * np.sqrt(14 / 3) / 2) and row["leak"] == pytest.approx(0.1)
    assert curve.errors(E * np.nan, Truth("", points, E, None, "", 0.0)) == {}


# -- methods -----------------------------------------------------------------------------------------------------------


def test_each_method_differs_in_its_axis_alone() -> None:
    base, light = ShootingOptions(), LightmapOptions()
    every = {name: method.options(16_000, light, base) for name, method in METHODS.items()}
    assert every["uniform"] == (AtlasOptions(texels=16_000), light, base)
    assert every["adaptive"] == (AtlasOptions(texels=1_000), light.replace(adaptive=True), base)
    assert len({repr(options) for options in every.values()}) == len(METHODS), "two methods are the same"
    for name, method in METHODS.items():
        pairs = zip(every[name][1:], (light, base), strict=True)
        changed = [
            k for own, usual in pairs for k, v in own.as_dict().items() if v != usual.as_dict()[k] and k != "adaptive"
        ]
        assert len(changed) == (method.axis != "solver"), name
    assert set(DEFAULT_METHODS) <= set(METHODS)


def test_every_choice_of_a_solver_is_a_method() -> None:
    for name in ("form_factor", "visibility", "projection", "storage"):
        spec = next(s for s in (*specs(ShootingOptions), *specs(LightmapOptions)) if s.name == name)
        chosen = [method.options(None, LightmapOptions(), ShootingOptions()) for method in METHODS.values()]
        tried = {(light.as_dict() | shooting.as_dict())[name] for _, light, shooting in chosen}
        assert tried == set(spec.choices)


def test_help_names_all_methods_and_peers(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        run(["bench", "error", "--help"])
    text = " ".join(capfd.readouterr().out.split())
    assert (
        ", ".join(METHODS) in text and ", ".join(PEERS) in text and "|".join(truth.REFERENCES) in text.replace(",", "|")
    )
    assert build_parser().parse_args(["bench", "error", "-o", "out"]).methods == DEFAULT_METHODS


def test_all_and_some_methods() -> None:
    assert method_names("all") == tuple(METHODS)
    assert method_names("disc,uniform,disc") == ("disc", "uniform")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ("furnace", "-o/--output"),
        ("furnace -o out --methods bogus", "bogus: must be all, or some of uniform, adaptive, disc"),
        ("furnace -o out --methods uniform,", "must be all, or some of"),
        ("furnace -o out --peers bogus", "bogus: must be all, or some of mitsuba"),
        ("furnace -o out --seconds 0", "0: must be a number above 0"),
        ("furnace -o out --paths 1.5", "1.5: must be a whole number above 0"),
        ("furnace -o out --texels 99999999", "--texels 99999999: must be 1 to"),
        ("furnace -o out --form-factor bogus", "bogus: must be one of polygon"),
        ("nowhere -o out", "there is no such file or scene"),
        ("furnace nowhere -o out", "there is no such file or scene"),
        ("dark.obj -o out", "dark.obj: nothing in the scene emits light"),
        ("furnace -o file", "file: cannot write here"),
        ("furnace -o out --reference bogus", "invalid choice: 'bogus'"),
        ("cornell-box -o out --reference closed-form", "closed-form: not all surfaces are alike"),
        ("museum -o out", "path-traced: needs mitsuba: pip install 'glowtree[peers]'; dense: 7,380 triangles"),
    ],
)
def test_bad_input_is_one_line(
    arguments: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    Path("file").touch()
    Path("dark.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 3\n")
    try:
        code = run(["bench", "error", *arguments.split()])
    except SystemExit as error:
        code = int(error.code or 0)
    out, err = capfd.readouterr()
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert says in err
    assert not Path("out").exists(), "nothing is made before all is checked"


# -- as a whole --------------------------------------------------------------------------------------------------------


def test_a_furnace_from_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(PEERS, "mitsuba", PEERS["mitsuba"].__class__(lambda: "not installed", PEERS["mitsuba"].curve))
    arguments = "furnace --methods uniform,level-3 --peers mitsuba --texels 1000 --seconds 20 --residual 0.02 -o"
    assert run(["bench", "error", *arguments.split(), str(tmp_path / "out")]) == 0
    out, err = capfd.readouterr()
    assert "mitsuba is left out: not installed" in err
    assert (tmp_path / "out/error.md").read_text() == out and out.startswith(f"# {TITLE}\n")
    values = json.loads((tmp_path / "out/error.json").read_text())
    (scene,) = values["scenes"]
    assert values["renderer"] and values["machine"] and values["glowtree"] and not values["interrupted"]
    assert scene["truth"]["reference"] == "closed-form" and set(scene["curves"]) == {"uniform", "level-3"}
    assert scene["curves"]["level-3"]["shooting"]["level"] == 3
    with (tmp_path / "out/error.csv").open() as file:
        rows = list(csv.DictReader(file))
    for name, saved in scene["curves"].items():
        last = saved["samples"][-1]
        assert [float(r["rms"]) for r in rows if r["method"] == name] == [s["rms"] for s in saved["samples"]]
        assert last["residual"] <= 0.02 and last["shots"] > 0 and last["texels"] > 0
        # what is unshot is missing or was shot ahead, all of it at ρ = 1/2 twice; the books close within a few per mille
        assert abs(last["bias"]) < 0.06 and abs(last["imbalance"]) < 0.01
        assert last["rms"] < 0.1 * saved["samples"][0]["rms"]
        # of all looks the last alone; a few per cent too dark is hardly seen
        assert [k for k, row in enumerate(saved["samples"]) if "flip" in row] == (
            [] if missing(FLIP) else [len(saved["samples"]) - 1]
        )
        assert missing(FLIP) or 0 < last["flip"] < 0.15
    drawn = (tmp_path / "out/furnace.png").exists()
    assert drawn != ("no plots: pip install" in err)


def test_a_plot_has_a_line_for_each_curve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plots = pytest.importorskip("app.bench.papers.plots", reason="of the extra bench", exc_type=ImportError)
    figures = []
    monkeypatch.setattr(plots, "_save", lambda figure, path: figures.append(figure))
    rows = [
        {"seconds": 1.0, "shots": 8, "rms": 0.5},
        {"seconds": 2.0, "shots": 16},
        {"seconds": 3.0, "shots": 24, "rms": 0.1},
    ]
    paths = [{"seconds": 1.0, "paths": 1, "rms": 0.4}]
    plots.draw_curves(
        tmp_path / "a.png", "title", {"uniform": rows, "disc": rows, "mitsuba": paths}, ("mitsuba",), 0.01
    )
    by_time, by_shots = figures[0].axes
    floor = 1
    assert len(by_time.lines) == 3 + floor and len(by_shots.lines) == 2 + floor
    assert list(by_shots.lines[0].get_xdata()) == [8, 24], "what is not finite is left out"
    assert by_time.get_xscale() == by_time.get_yscale() == by_shots.get_xscale() == "log"


def test_looks_that_were_foretold_are_counted() -> None:
    """Within a factor of two of what is left of the RMS without the reference's noise; what hardly shows above that is not."""
    one: Any = error.SceneCurves("a", "a", quads_scene(room(), (grey(0.5, 1.0),)), "closed-form")
    one.truth = SimpleNamespace(noise=0.03)
    looks = [(0.05, 0.021), (0.05, 0.079), (0.05, 0.019), (0.05, 0.081), (0.04, 0.04), (0.05, None)]
    one.curves = {"uniform": [{"rms": rms, "expected": said} for rms, said in looks], "cycles": [{"rms": 0.1}]}
    assert one.foretold == (2, 4)


def test_a_peer_with_texels_of_its_own_is_drawn_as_a_peer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plots = pytest.importorskip("app.bench.papers.plots", reason="of the extra bench", exc_type=ImportError)
    drawn: list[Any] = []
    monkeypatch.setattr(plots, "draw_curves", lambda *values: drawn.append(values))
    one: Any = error.SceneCurves("a", "a", quads_scene(room(), (grey(0.5, 1.0),)), "closed-form")
    one.truth = SimpleNamespace(noise=None)
    one.curves = {"uniform": [{"texels": 10}], "adaptive": [{"texels": 7}], "cycles": [{"texels": 9}], "mitsuba": [{}]}
    error._plot(tmp_path, {"renderer": "r"}, [one], Console())
    ((_, _, curves, peers, _),) = drawn
    assert list(curves) == ["uniform", "adaptive, 7 texels", "cycles, 9 texels", "mitsuba"]
    assert peers == ("cycles, 9 texels", "mitsuba")


def test_mitsuba_beside_us(tmp_path: Path) -> None:
    if (reason := truth.no_tracer()) is not None:
        pytest.skip(reason)
    arguments = "furnace --methods uniform --peers mitsuba --texels 600 --seconds 2 --residual 0.05 -o".split()
    assert run(["bench", "error", *arguments, str(tmp_path)]) == 0
    (scene,) = json.loads((tmp_path / "error.json").read_text())["scenes"]
    samples = scene["curves"]["mitsuba"]["samples"]
    assert [row["paths"] for row in samples][:3] == [1, 2, 4]
    assert samples[-1]["rms"] < 0.5 * samples[0]["rms"]


def test_ctrl_c_keeps_finished_curves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:

    measured = error.solve_curve

    def stop(*given: Any) -> Any:
        monkeypatch.setattr(error, "solve_curve", lambda *given: (_ for _ in ()).throw(KeyboardInterrupt))
        return measured(*given)

    monkeypatch.setattr(error, "solve_curve", stop)
    arguments = f"furnace furnace --methods uniform,disc --texels 600 --seconds 0.2 -o {tmp_path / 'out'} --json"
    assert run(["bench", "error", *arguments.split()]) == 130
    values = json.loads(capfd.readouterr().out)
    assert values["interrupted"] and [list(scene["curves"]) for scene in values["scenes"]] == [["uniform"]]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGINT for one process")
def test_a_real_ctrl_c_in_the_second_curve_keeps_the_first(tmp_path: Path) -> None:
    """The second solve runs until it is stopped, and says when it begins."""
    code = """
        from app.bench.accuracy import error
        solve_curve, limits = error.solve_curve, [0.2, 600.0]
        def begun(gpu, solver, limit, look):
            print("begun", flush=True)
            return solve_curve(gpu, solver, limits.pop(0), look)
        error.solve_curve = begun
        from app.cli import run
        line = "bench error furnace -o out --methods uniform,disc --texels 600 --residual 1e-9 --level 1 --no-coarsen"
        raise SystemExit(run(line.split()))
    """
    home = {"PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    worker = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(code)],
        cwd=tmp_path,
        env={**os.environ, **home},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert worker.stdout is not None
    assert [worker.stdout.readline() for _ in range(2)] == ["begun\n", "begun\n"]
    time.sleep(1)  # it warms up and shoots
    worker.send_signal(signal.SIGINT)
    out, err = worker.communicate(timeout=60)
    assert worker.returncode == 130, err
    assert "glowtree: note: stopped: only finished curves are written\n" in err and "Traceback" not in err
    values = json.loads((tmp_path / "out/error.json").read_text())
    assert values["interrupted"] and [list(scene["curves"]) for scene in values["scenes"]] == [["uniform"]]
    assert (tmp_path / "out/error.md").read_text() == out and (tmp_path / "out/error.csv").exists()


def test_default_scenes_can_be_judged_without_extras(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert [truth.choose(load_scene(name)) for name in ERROR_SCENES] == ["closed-form", "dense"]
