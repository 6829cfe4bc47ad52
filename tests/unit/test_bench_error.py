"""``bench error``: which methods are compared, what is refused, and a small run as a whole."""

from __future__ import annotations

import argparse
import csv
import json
import os
import signal
import sys
import textwrap
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from constant_solver import FAMILY, SWEEPS, Constant
from processes import started
from solver_scenes import grey, quads_scene, room

from app.atlas.options import AtlasOptions
from app.bench.accuracy import error, error_report
from app.bench.accuracy.error_report import TITLE
from app.bench.accuracy.methods import METHODS, Method, Setup, method_names
from app.bench.commands import ERROR_SCENES
from app.bench.peers.peers import PEERS
from app.cli import build_parser, run
from app.errors import UserError
from app.lightmap.options import LightmapOptions
from app.options import Options, specs
from app.reference import irradiance
from app.scene.load import load_scene
from app.scene.model import Scene
from app.session.loading import read_and_unfold
from app.solvers import DEFAULT_SOLVER, SOLVERS, ShootingOptions
from app.util.console import Console
from app.util.tables import FLIP, missing

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(tmp_path / "cache"))
    return tmp_path / "cache"


def silent(text: str, share: float) -> None:
    pass


def furnace(albedo: float = 0.5, **changes: Any) -> Scene:
    return quads_scene(room(), [grey(albedo, 1.0, **changes)])


NO_FLAGS = argparse.Namespace()


def differ(own: Options, other: Options, name: str) -> bool:
    return bool(getattr(own, name) != getattr(other, name))


# -- methods -----------------------------------------------------------------------------------------------------------


def test_each_method_differs_in_its_axis_alone() -> None:
    every = {name: method.setup(16_000, NO_FLAGS) for name, method in METHODS.items()}
    base = every["uniform"]
    assert base == Setup(AtlasOptions(texels=16_000), LightmapOptions(), DEFAULT_SOLVER, ShootingOptions())
    assert every["adaptive"] == replace(base, atlas=AtlasOptions(texels=1_000), light=LightmapOptions(adaptive=True))
    assert len({repr(setup) for setup in every.values()}) == len(METHODS), "two methods are the same"
    for name, setup in every.items():
        own_base = base if setup.solver == DEFAULT_SOLVER else every[setup.solver]
        pairs = ((setup.options, own_base.options), (setup.light, own_base.light))
        changed = [s.name for own, other in pairs for s in specs(type(own)) if differ(own, other, s.name)]
        assert len(changed) == (setup != own_base), name
        assert setup.solver == DEFAULT_SOLVER or METHODS[name].axis == "solver"


def test_every_choice_of_a_solver_is_a_method() -> None:
    for kind, names in (
        (ShootingOptions, ("form_factor", "visibility", "projection")),
        (LightmapOptions, ("storage",)),
    ):
        for name in names:
            spec = next(s for s in specs(kind) if s.name == name)
            setups = [method.setup(None, NO_FLAGS) for method in METHODS.values()]
            held = [setup.light if kind is LightmapOptions else setup.options for setup in setups]
            tried = {getattr(options, name) for options in held if isinstance(options, kind)}
            assert tried == set(spec.choices)


def test_help_names_all_methods_and_peers(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        run(["bench", "error", "--help"])
    text = " ".join(capfd.readouterr().out.split())
    assert (
        ", ".join(METHODS) in text
        and ", ".join(PEERS) in text
        and "|".join(irradiance.REFERENCES) in text.replace(",", "|")
    )
    assert set(build_parser().parse_args(["bench", "error", "-o", "out"]).methods) < set(METHODS)


def test_all_and_some_methods() -> None:
    assert method_names("all") == tuple(METHODS)
    assert method_names("disc,uniform,disc") == ("disc", "uniform")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ("furnace", "-o/--output"),
        ("furnace -o out --methods bogus", "bogus: must be all, or some of uniform, adaptive, gathering"),
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


def test_points_lie_on_the_triangles_that_methods_see(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A wall on a floor cuts it: a triangle's number means another one then."""
    material = "[[material]]\nname = 'paint'\nexitance = 1\n"
    floor = "[[quad]]\nmaterial = 'paint'\norigin = [0, 0, 0]\nedge_u = [0, 0, 2]\nedge_v = [2, 0, 0]\n"
    wall = "[[quad]]\nmaterial = 'paint'\norigin = [0.5, 0, 0.5]\nedge_u = [0, 1, 0]\nedge_v = [1, 0, 0]\n"
    file = tmp_path / "wall.toml"
    file.write_text(material + floor + wall)
    given: list[Scene] = []

    def judged(scene: Scene, *_: object) -> None:
        given.append(scene)
        raise UserError("enough")

    monkeypatch.setattr(error, "reference_irradiance", judged)
    run(["bench", "error", str(file), "--methods", "uniform", "--reference", "dense", "-o", str(tmp_path / "out")])
    _, seen, _, _ = read_and_unfold(str(file), AtlasOptions(texels=500), False, silent)
    assert len(given[0].corners) == len(seen.corners) > 4 and (given[0].corners == seen.corners).all()


def test_any_family_of_solvers_is_a_method(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Its work and what remains by its own names, beside those of another family; its observer is the first camera."""
    observers: list[Any] = []
    monkeypatch.setattr(Constant, "set_observer", lambda _, position: observers.append(position))
    monkeypatch.setitem(SOLVERS, "constant", FAMILY)
    monkeypatch.setitem(METHODS, "constant", Method("solver", solver="constant", options={"irradiance": 3.0}))
    arguments = "furnace --methods constant,uniform --texels 600 --seconds 5 --residual 0.1 -o".split()
    assert run(["bench", "error", *arguments, str(tmp_path)]) == 0
    head = next(line for line in capfd.readouterr().out.splitlines() if line.startswith("|"))
    columns = [cell.strip() for cell in head.strip("|").split("|")]
    assert columns[:8] == ["method", "texels", "shots", "sweeps", "s", "CPU s", "unshot", "unswept"]
    (scene,) = json.loads((tmp_path / "error.json").read_text())["scenes"]
    found = scene["curves"]["constant"]
    assert found["axis"] == "solver" and found["constant"]["irradiance"] == 3.0 and "shots" not in found["samples"][0]
    first, last = found["samples"][0], found["samples"][-1]
    assert (first["sweeps"], first["rest"]) == (1, 0.5) and (last["sweeps"], last["rest"]) == (SWEEPS, 0.5**SWEEPS)
    assert first["bias"] == last["bias"], "as bright as it says from the first sweep on"
    assert observers[0] == pytest.approx(load_scene("furnace").cameras[0].world_from_camera[:3, 3])


def test_a_plot_has_a_line_for_each_curve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plots = pytest.importorskip("app.bench.accuracy.error_plot", reason="of the extra bench", exc_type=ImportError)
    figures = []
    monkeypatch.setattr(plots, "save", lambda figure, path: figures.append(figure))
    rows = [
        {"seconds": 1.0, "shots": 8, "rms": 0.5},
        {"seconds": 2.0, "shots": 16},
        {"seconds": 3.0, "shots": 24, "rms": 0.1},
    ]
    paths = [{"seconds": 1.0, "paths": 1, "rms": 0.4}]
    plots.draw_curves(
        tmp_path / "a.png", "title", {"uniform": rows, "disc": rows, "mitsuba": paths}, ("mitsuba",), 0.01, ("shots",)
    )
    by_time, by_shots = figures[0].axes
    floor = 1
    assert len(by_time.lines) == 3 + floor and len(by_shots.lines) == 2 + floor
    assert list(by_shots.lines[0].get_xdata()) == [8, 24], "what is not finite is left out"
    assert by_time.get_xscale() == by_time.get_yscale() == by_shots.get_xscale() == "log"


@pytest.mark.parametrize(("kind", "said"), [("rms", "expected"), ("median", "expected_median")])
def test_looks_that_were_well_estimated_are_counted(kind: str, said: str) -> None:
    """Within a factor of two of what is left of it without the reference's noise; what hardly shows above that is not."""
    one: Any = error_report.SceneCurves("a", "a", quads_scene(room(), (grey(0.5, 1.0),)), "closed-form")
    one.reference = SimpleNamespace(
        noise=0.03 if kind == "rms" else 0.5, median_noise=0.03 if kind == "median" else 0.5
    )
    looks = [(0.05, 0.021), (0.05, 0.079), (0.05, 0.019), (0.05, 0.081), (0.04, 0.04), (0.05, None)]
    one.curves = {"uniform": [{kind: true, said: value} for true, value in looks], "cycles": [{kind: 0.1}]}
    assert one.well_estimated(kind) == (2, 4)


def test_a_peer_with_texels_of_its_own_is_drawn_as_a_peer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plots = pytest.importorskip("app.bench.accuracy.error_plot", reason="of the extra bench", exc_type=ImportError)
    drawn: list[Any] = []
    monkeypatch.setattr(plots, "draw_curves", lambda *values: drawn.append(values))
    one: Any = error_report.SceneCurves("a", "a", quads_scene(room(), (grey(0.5, 1.0),)), "closed-form")
    one.reference = SimpleNamespace(noise=None)
    one.curves = {"uniform": [{"texels": 10}], "adaptive": [{"texels": 7}], "cycles": [{"texels": 9}], "mitsuba": [{}]}
    error_report.plot(tmp_path, {"renderer": "r"}, [one], Console())
    ((_, _, curves, peers, _, _),) = drawn
    assert list(curves) == ["uniform", "adaptive, 7 texels", "cycles, 9 texels", "mitsuba"]
    assert peers == ("cycles, 9 texels", "mitsuba")


def test_mitsuba_beside_us(tmp_path: Path) -> None:
    if (reason := irradiance.no_tracer()) is not None:
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
        def begun(gpu, solver, batch, limit, look):
            print("begun", flush=True)
            return solve_curve(gpu, solver, batch, limits.pop(0), look)
        error.solve_curve = begun
        from app.cli import run
        line = "bench error furnace -o out --methods uniform,disc --texels 600 --residual 1e-9 --level 1 --no-coarsen"
        raise SystemExit(run(line.split()))
    """
    home = {"PYTHONPATH": str(ROOT), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    with started([sys.executable, "-c", textwrap.dedent(code)], {**os.environ, **home}, tmp_path) as worker:
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
    assert [irradiance.choose_reference(load_scene(name)) for name in ERROR_SCENES] == ["closed-form", "dense"]
