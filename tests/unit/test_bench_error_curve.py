"""Error curves: the clock that stands while it is looked, that looking changes nothing, and what is read from a curve."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from solver_scenes import grey, quads_scene, room

from app.atlas.options import AtlasOptions
from app.atlas.points import random_points
from app.bench.accuracy import error_curve
from app.bench.solves import warm_up
from app.bench.stopwatch import Stopwatch
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.reference import irradiance
from app.reference.irradiance import ReferenceIrradiance
from app.scene.model import Scene
from app.session.batch import opened
from app.solvers import DEFAULT_SOLVER, SOLVERS, Progress, ShootingOptions


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


def test_a_held_stopwatch_stands() -> None:
    clock = FakeClock()
    watch = Stopwatch(clock)
    clock.now = 3.0
    with watch.held():
        clock.now = 100.0
        assert watch.seconds == 3.0
    clock.now = 102.0
    assert watch.seconds == 5.0


class OneSecondWork:
    """A solver whose every piece of work takes a second, and halves what remains until 2^-20."""

    def __init__(self, clock: FakeClock) -> None:
        self._clock = clock
        self.reset()

    def warm_up(self) -> Iterator[None]:
        return iter(())

    def reset(self) -> None:
        self.issued, self.remaining = 0, 1.0

    def work(self, amount: int) -> Generator[None, None, int]:
        yield
        self._clock.now += 1.0
        self.issued += amount
        self.remaining /= 2
        return amount

    def poll(self, *, wait: bool = False) -> Progress:
        return Progress(self.issued, self.remaining, np.zeros(3), converged=self.remaining <= 2.0**-20)


@pytest.mark.parametrize(("limit", "last"), [(100.0, 20.0), (7.5, 8.0)])
def test_looking_stops_the_clock(gpu: Gpu, limit: float, last: float) -> None:
    clock, cpu = FakeClock(), FakeClock()
    solver: Any = OneSecondWork(clock)

    def look() -> dict[str, Any]:
        clock.now += 1000.0
        cpu.now += 500.0
        return {"residual": solver.remaining}

    rows = error_curve.solve_curve(gpu, solver, 8, limit, look, clock=clock, cpu_clock=cpu)
    seconds = [row["seconds"] for row in rows]
    assert seconds[0] == 1.0 and seconds[-1] == last
    assert [row["residual"] for row in rows] == [2.0**-s for s in seconds], "seconds are those of the steps alone"
    assert {row["cpu_seconds"] for row in rows} == {0.0}
    steps = np.diff(seconds[:-1])
    assert (steps <= np.maximum(1.0, (error_curve.GROWTH - 1) * np.array(seconds[:-2]) + 1.0)).all()


def test_nothing_changes_by_looking(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same solve, looked at once and after every step: as much light after as many shots."""
    known = irradiance.reference_irradiance(furnace(), "closed-form", 1, silent)
    atlas, family = AtlasOptions(texels=600), SOLVERS[DEFAULT_SOLVER]
    with opened(gpu, furnace(), atlas, LightmapOptions(), ShootingOptions(residual=0.2)) as (lightmap, solver):
        looks = []
        for growth in (1e9, 1.0):
            monkeypatch.setattr(error_curve, "GROWTH", growth)
            look = partial(error_curve.look_at, lightmap, solver, family, known)
            looks.append(error_curve.solve_curve(gpu, solver, family.batch, 60.0, look))
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
        warm_up(gpu, solver, SOLVERS[DEFAULT_SOLVER].batch)
        assert set(lightmap.pool.leaves.only(lightmap.pool.used).keys.tolist()) == tiles
        now = solver.settle()
        assert now.done == 0 and now.remaining == pytest.approx(1.0, rel=1e-5)
        assert not lightmap.irradiance().any()


def test_seconds_to_a_level_are_read_between_looks() -> None:
    rows = [
        {"seconds": 1.0, "rms": 0.08},
        {"seconds": 2.0},
        {"seconds": 4.0, "rms": 0.02},
        {"seconds": 5.0, "rms": 0.03},
    ]
    assert error_curve.first_at(0.04, rows) == pytest.approx(2.0)  # halfway in both logarithms
    assert error_curve.first_at(0.02, rows) == pytest.approx(4.0)
    assert error_curve.first_at(0.5, rows) == 1.0
    assert error_curve.first_at(0.01, rows) is None


def test_errors_are_those_at_lit_points() -> None:
    points = random_points(furnace(), 4, 1)
    E = np.array([[1.0] * 3, [2.0] * 3, [3.0] * 3, [0.0] * 3])
    row = error_curve.errors(E * 1.1 + [[0.0], [0.0], [0.0], [0.2]], ReferenceIrradiance("", points, E, None, "", 0.0))
    assert row["bias"] == pytest.approx(0.1) and row["median"] == pytest.approx(0.1)
    assert row["rms"] == pytest.approx(0.1 * np.sqrt(14 / 3) / 2) and row["leak"] == pytest.approx(0.1)
    assert error_curve.errors(E * np.nan, ReferenceIrradiance("", points, E, None, "", 0.0)) == {}
