"""A solver that needs a tree for its rays is waited for in the background: frames go on, and the waiting can be ended."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from constant_solver import FAMILY

import app.visibility.bvh_cache as bvh_cache
import app.visibility.rays as rays
from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.scene.model import F64
from app.session.loading import LOADED, UPLOADING
from app.session.ray_tree import SORTING
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View
from app.solvers import SOLVERS, ShootingOptions
from app.ui.app import Ui
from app.viewer.ui_frame import UiFrame
from app.visibility.bvh import Bvh, build_bvh

PATIENCE = 20.0  # s
SIZE = 320, 200


class SlowBuild:
    """In place of build_bvh: takes until ``go_on`` is set. threads: that built a tree, each once for every tree."""

    def __init__(self) -> None:
        self.go_on, self.threads = threading.Event(), []

    def __call__(self, corners: F64, tell: Callable[[float], None]) -> Bvh:
        self.threads.append(threading.current_thread())
        share, end = 0.0, time.monotonic() + PATIENCE
        while not self.go_on.wait(0.01):
            assert time.monotonic() < end, "a frame waits for it"
            share = min(share + 0.05, 0.5)
            tell(share)
        return build_bvh(corners, tell)

    def ended(self) -> None:
        """Wait until nobody builds."""
        for thread in self.threads:
            thread.join(PATIENCE / 2)
            assert not thread.is_alive()


@pytest.fixture
def build(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[SlowBuild]:
    """Any scene has so many triangles that it is waited for and cached."""
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda name: str(tmp_path))
    monkeypatch.setattr(rays, "FEWEST", 1)
    monkeypatch.setattr(bvh_cache, "FEWEST", 1)
    slow = SlowBuild()
    monkeypatch.setattr(bvh_cache, "build_bvh", slow)
    yield slow
    slow.go_on.set()


@pytest.fixture
def session(gpu: Gpu, build: SlowBuild) -> Iterator[Session]:
    session = Session(gpu, options=ShootingOptions(resolution=64), atlas=AtlasOptions(texels=900))
    yield session
    session.release()


def lit(session: Session) -> np.ndarray:
    """Open a scene, light it a little and pause."""
    session.open_now("cornell-box")
    session.solve(Stop(work=8))
    session.run.running = False
    return session.lightmap.irradiance()


def poll(session: Session, until: Callable[[], bool]) -> int:
    """How many frames it took."""
    end, count = time.monotonic() + PATIENCE, 0
    while not until():
        assert time.monotonic() < end
        session.poll()
        session.advance()
        count += 1
        time.sleep(0.002)
    return count


def trees(folder: Path) -> list[Path]:
    return list((folder / "bvh").glob("*"))


def test_frames_are_drawn_while_the_tree_is_built(gpu: Gpu, session: Session, build: SlowBuild) -> None:
    view = View(session)
    light = lit(session)
    texture = gpu.texture(SIZE, 4, "f1")
    target, ui = gpu.target(texture), Ui()
    frame = UiFrame(gpu, ui)
    session.set_solver("gathering")
    shares: list[float] = []
    while len(shares) < 20:
        session.poll()
        frame.draw(view, target, size=SIZE)
        assert session.on_its_way is not None and session.solver_name == "shooting"
        shares.append(session.on_its_way.fraction)
    assert session.on_its_way.stage == SORTING and 0 < shares[-1] == max(shares)
    assert session.chosen_solver == "gathering" and not session.at_rest
    np.testing.assert_array_equal(session.lightmap.irradiance(), light)
    session.run.running = True
    assert poll(session, lambda: session.solver.issued > 16) > 0, "the solver that is there goes on"
    build.go_on.set()
    poll(session, lambda: session.on_its_way is None)
    assert session.solver_name == session.chosen_solver == "gathering"
    assert threading.main_thread() not in build.threads and len(build.threads) == 1
    poll(session, lambda: bool(session.lightmap.irradiance().any()))
    frame.release()
    ui.release()
    view.release()
    gpu.release_all(target, texture)


def test_it_can_be_stopped_and_leaves_nothing(session: Session, build: SlowBuild, tmp_path: Path) -> None:
    light = lit(session)
    session.set_solver("gathering")
    poll(session, lambda: session.on_its_way.fraction > 0)
    session.on_its_way.cancel()
    session.poll()
    assert session.on_its_way is None and session.solver_name == session.chosen_solver == "shooting"
    assert session.message == "Gathering: stopped; Shooting goes on"
    build.ended()
    assert not trees(tmp_path) and not rays.tree_is_near(session.lightmap.pool)
    np.testing.assert_array_equal(session.lightmap.irradiance(), light)
    session.run.running = True
    poll(session, lambda: session.solver.issued > 8)
    build.go_on.set()
    session.set_solver("gathering")
    poll(session, lambda: session.solver_name == "gathering")
    assert len(build.threads) == 2 and len(trees(tmp_path)) == 1


@pytest.mark.parametrize("other", ["shooting", "constant", "pairs"])
def test_another_choice_takes_its_place(
    session: Session, build: SlowBuild, other: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(SOLVERS, "constant", FAMILY)
    session._choice.options["constant"] = FAMILY.options()
    lit(session)
    session.set_solver("gathering")
    first = session.on_its_way
    poll(session, lambda: first.fraction > 0)
    session.set_solver(other)
    assert first.cancelled and session.chosen_solver == other
    assert (session.on_its_way is None) == (other != "pairs"), "only pairs has rays, too"
    build.go_on.set()
    poll(session, lambda: session.on_its_way is None)
    assert session.solver_name == other
    for _ in range(5):
        session.poll()
    assert session.solver_name == other and session.message is None


def test_another_scene_takes_its_place(session: Session, build: SlowBuild) -> None:
    """It opens with the solver that was chosen, and its own tree is built while it loads."""
    lit(session)
    session.set_solver("gathering")
    first, stages = session.on_its_way, set()
    session.open("furnace")

    def sorting() -> bool:
        stages.add(session.loading.stage)
        return SORTING in stages

    poll(session, sorting)
    assert session.scene.name == "Cornell box" and 0.8 <= session.loading.fraction < 1
    build.go_on.set()
    poll(session, lambda: session.loading is None)
    assert session.scene.name == "Furnace" and session.solver_name == "gathering"
    build.ended()
    assert first.ended and len(build.threads) == 2 and threading.main_thread() not in build.threads
    assert "rays" in session.load_seconds


def test_a_scene_that_opens_first_drops_the_other_ones_tree(session: Session, build: SlowBuild) -> None:
    """The solver was chosen after the other scene had begun to load: it now waits for the tree of that one."""
    lit(session)
    session.open("furnace")
    session.set_solver("gathering")
    first = session.on_its_way
    poll(session, lambda: session.loading is None)
    assert session.scene.name == "Furnace" and session.solver_name == "shooting"
    assert session._choice.switching is session.on_its_way is not first and session.chosen_solver == "gathering"
    build.go_on.set()
    poll(session, lambda: session.on_its_way is None)
    assert session.solver_name == "gathering" and threading.main_thread() not in build.threads


def test_a_solver_that_is_chosen_while_the_first_scene_loads(session: Session, build: SlowBuild) -> None:
    session.open("furnace")
    session.set_solver("gathering")
    poll(session, lambda: session.opened)
    assert session.solver_name == "shooting" and session.chosen_solver == "gathering"
    build.go_on.set()
    poll(session, lambda: session.solver_name == "gathering")
    assert threading.main_thread() not in build.threads


def test_closing_ends_the_build(session: Session, build: SlowBuild, tmp_path: Path) -> None:
    lit(session)
    session.set_solver("gathering")
    poll(session, lambda: session.on_its_way.fraction > 0)
    session.release()
    build.ended()
    assert session.on_its_way is None and not trees(tmp_path)


def test_the_error_estimate_and_a_solver_share_one_build(session: Session, build: SlowBuild) -> None:
    lit(session)
    poll(session, lambda: bool(build.threads))  # of the estimate: all is at rest
    session.set_solver("gathering")
    poll(session, lambda: session.on_its_way.fraction > 0)
    build.go_on.set()
    poll(session, lambda: session.solver_name == "gathering")
    assert len(build.threads) == 1


def test_who_opens_and_waits_hears_of_it(gpu: Gpu, build: SlowBuild) -> None:
    build.go_on.set()
    told: list[tuple[str, float]] = []
    for name in ("shooting", "gathering"):
        session = Session(gpu, solver=name, atlas=AtlasOptions(texels=900))
        session.open_now("furnace", lambda stage, share: told.append((stage, share)))
        assert (SORTING in dict(told)) == (name == "gathering") == ("rays" in session.load_seconds)
        assert told[-1] == (UPLOADING, LOADED)
        session.release()
    shares = [share for _, share in told[-5:]]
    assert shares == sorted(shares)
