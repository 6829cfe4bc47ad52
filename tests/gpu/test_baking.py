"""A bake from the window: frame by frame to files, stopped, gone on with, and what it says."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import solver_scenes
from solver_scenes import grey, quads_scene, room

from app.atlas.options import AtlasOptions
from app.bake.options import BakeOptions
from app.bake.read import read_bake
from app.errors import UserError
from app.gpu import Gpu
from app.scene.model import Camera, Scene
from app.session import baking as baking_module
from app.session.baking import DONE, SOLVING, STOPPED, WRITING, Baking, Goal, Order
from app.session.checkpoint import CHECKPOINT_NAME
from app.session.goal import options_for_error, seconds_left
from app.session.history import History
from app.session.report import look_of
from app.session.session import Session
from app.session.view import View
from app.solvers import SOLVERS, ShootingOptions

PATIENCE = 120.0  # s
NAMES = ["irradiance.exr", "report.json", "scene.glb"]


def table_room() -> Scene:
    """With a camera before it."""
    pose = np.eye(4)
    pose[:3, 3] = 2.0, 1.5, 3.5
    return replace(solver_scenes.table_room(), cameras=(Camera("front", pose, 1.0),))


def opened(gpu: Gpu, scene: Scene, *, texels: int = 1500, residual: float = 1e-2) -> Session:
    session = Session(gpu, options=ShootingOptions(residual=residual), atlas=AtlasOptions(texels=texels))
    session.open_now(scene)
    return session


def frames(session: Session, baking: Baking, until: Callable[[], bool]) -> None:
    """As the window makes them."""
    end = time.monotonic() + PATIENCE
    while not until():
        assert time.monotonic() < end, (baking.stage, baking.note)
        session.poll()
        session.advance(fast=True)
        baking.poll()
        time.sleep(0.001)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_the_scene_as_edited_is_written_with_its_light(gpu: Gpu, tmp_path: Path) -> None:
    session = opened(gpu, table_room())
    session.set_material(0, grey(0.25))
    view = View(session)
    view.look_through(session.scene.cameras[0])
    view.camera.orbit(0.3, 0.1)
    view.display = view.display.replace(exposure=1.5)
    baking = Baking(session, Order(tmp_path / "out", look=look_of(view)))
    frames(session, baking, lambda: not baking.active)
    assert baking.stage == DONE, baking.note
    assert names(tmp_path / "out") == NAMES
    bake = read_bake(tmp_path / "out")
    assert bake.report["converged"] and not bake.report["interrupted"]
    assert bake.report["expected_error"]["median"] > 0
    assert any(np.allclose(material.albedo, 0.25, atol=1e-3) for material in bake.scene.materials)
    assert bake.irradiance.max() > 0
    assert bake.report["exposure"] == 1.5, "to be shown as it was seen"
    assert np.allclose(bake.report["camera"]["world_from_camera"], view.camera.world_from_camera)
    view.release()
    session.release()


def test_stopped_it_keeps_its_light_and_goes_on(gpu: Gpu, tmp_path: Path) -> None:
    """In another session, which has other settings: it takes those of the bake, and writes the files that were asked for."""
    session = opened(gpu, table_room(), residual=1e-4)
    baking = Baking(session, Order(tmp_path, files=BakeOptions(hdr=True)))
    frames(session, baking, lambda: session.run.progress.done > 50)
    baking.stop()
    done = session.solver.poll(wait=True).done
    assert baking.stage == STOPPED and not session.run.running
    assert session.lightmap.irradiance().max() > 0, "the light is still there"
    assert names(tmp_path) == [CHECKPOINT_NAME]
    session.release()

    session = opened(gpu, table_room(), texels=900)
    baking = Baking(session, Order(tmp_path), resume=True)
    frames(session, baking, lambda: baking.stage == SOLVING)
    assert session.solver.issued >= done - 8 and session.options.residual == 1e-4
    assert session.atlas.texels == 1500
    frames(session, baking, lambda: not baking.active)
    assert baking.stage == DONE, baking.note
    assert names(tmp_path) == sorted([*NAMES, "irradiance.hdr"])
    assert json.loads((tmp_path / "report.json").read_text())["resumed"]
    session.release()


def test_written_now_it_can_still_go_on(gpu: Gpu, tmp_path: Path) -> None:
    session = opened(gpu, table_room(), residual=1e-5)
    baking = Baking(session, Order(tmp_path))
    frames(session, baking, lambda: session.run.progress.done > 20)
    baking.write_now()
    assert baking.stage == WRITING
    frames(session, baking, lambda: not baking.active)
    assert baking.stage == DONE
    assert names(tmp_path) == sorted([CHECKPOINT_NAME, *NAMES])
    report = json.loads((tmp_path / "report.json").read_text())
    assert report["interrupted"] and not report["converged"]
    session.release()


def test_surfaces_are_cut_first_where_that_is_asked_for(gpu: Gpu, tmp_path: Path) -> None:
    session = opened(gpu, table_room())
    baking = Baking(session, Order(tmp_path, atlas=AtlasOptions(texels=600)))
    frames(session, baking, lambda: not baking.active)
    assert baking.stage == DONE, baking.note
    assert json.loads((tmp_path / "report.json").read_text())["texels"] < 1000
    session.release()


def test_until_an_error_and_what_is_said_where_it_is_not_reached(
    gpu: Gpu, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(baking_module, "FIRST_LOOK", 0.05)
    session = opened(gpu, table_room(), residual=1e-6)
    baking = Baking(session, Order(tmp_path / "rough", goal=Goal(error=50.0)))
    frames(session, baking, lambda: not baking.active)
    assert baking.stage == DONE and not session.run.converged, "half is soon reached"
    session.set_options(session.options.replace(residual=2e-2))
    baking = Baking(session, Order(tmp_path / "fine", goal=Goal(error=0.05)))
    frames(session, baking, lambda: not baking.active)
    assert baking.stage == DONE
    assert baking.note is not None and "0.05 % was not reached" in baking.note
    session.release()


def test_what_cannot_be_baked_says_why(gpu: Gpu, tmp_path: Path) -> None:
    session = opened(gpu, quads_scene(room(), [grey(0.5)]))
    with pytest.raises(UserError, match="nothing emits light"):
        Baking(session, Order(tmp_path))
    session.release()
    session = Session(gpu, solver="local", atlas=AtlasOptions(texels=900))
    session.open_now(table_room())
    with pytest.raises(UserError, match="a bake is seen from everywhere"):
        Baking(session, Order(tmp_path))
    session.release()


def test_another_scene_ends_it(gpu: Gpu, tmp_path: Path) -> None:
    session = opened(gpu, table_room(), residual=1e-6)
    baking = Baking(session, Order(tmp_path))
    frames(session, baking, lambda: session.run.progress.done > 8)
    session.open_now(table_room())
    baking.poll()
    assert baking.stage == STOPPED and baking.note == "another scene was opened"
    session.release()


def test_a_checkpoint_of_another_scene_is_refused(gpu: Gpu, tmp_path: Path) -> None:
    session = opened(gpu, table_room(), residual=1e-4)
    baking = Baking(session, Order(tmp_path))
    frames(session, baking, lambda: session.run.progress.done > 8)
    baking.stop()
    session.set_material(0, grey(0.25))
    baking = Baking(session, Order(tmp_path), resume=True)
    frames(session, baking, lambda: not baking.active)
    assert baking.stage == STOPPED
    assert baking.note is not None and "is of another scene" in baking.note
    assert (tmp_path / CHECKPOINT_NAME).exists()
    session.release()


def history_of(remaining: Callable[[float], float]) -> History:
    history = History()
    for second in np.linspace(0, 10, 101).tolist():
        history.add(0, second, remaining(second), 0.0)
    return history


class Ten:
    """A solve after ten seconds."""

    converged, seconds = False, 10.0

    def __init__(self, remaining: float) -> None:
        self.remaining = remaining


def test_time_left() -> None:
    """A tenth in ten seconds: shooting has another hundredth after twenty more; noise after a hundred times as long."""
    shooting, gathering = SOLVERS["shooting"], SOLVERS["gathering"]
    history = history_of(lambda t: 10 ** (-t / 10))
    left = seconds_left(shooting, 1e-3, Ten(0.1), history)  # type: ignore[arg-type]
    assert left == pytest.approx(20.0, rel=0.02)
    assert seconds_left(gathering, 1e-2, Ten(0.1), history) == pytest.approx(990.0)  # type: ignore[arg-type]
    assert seconds_left(gathering, 0.2, Ten(0.1), history) == 0.0  # type: ignore[arg-type]
    assert seconds_left(shooting, 1e-3, Ten(1.0), history) is None  # type: ignore[arg-type]


def test_noise_follows_from_an_error() -> None:
    gathering = SOLVERS["gathering"]
    assert gathering.per_error is not None
    assert options_for_error(gathering, gathering.options(), 0.02).as_dict()["noise"] == pytest.approx(
        0.02 * gathering.per_error
    )
    assert options_for_error(gathering, gathering.options(), 0.9) == gathering.options()
    assert options_for_error(SOLVERS["shooting"], ShootingOptions(), 0.02) == ShootingOptions()
