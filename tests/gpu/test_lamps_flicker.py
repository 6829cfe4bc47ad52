"""Lamps that flicker: the light follows in the same frame, no history is made of it, and what was edited comes back exactly."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pytest

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.session import energy
from app.session.run import Stop
from app.session.session import Session
from app.solvers import SOLVERS
from app.solvers.local.options import LocalOptions


@pytest.fixture
def session(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> Iterator[Session]:
    """A box that is lit, on a machine of which no frame is so slow that an edit seems long ago."""
    monkeypatch.setattr(energy, "EDIT_SECONDS", 600.0)
    session = Session(gpu, solver="local", options=LocalOptions(patches=128), atlas=AtlasOptions(texels=1500))
    session.open_now("cornell-box")
    session.solve(Stop())
    yield session
    session.release()


def frame(session: Session, *, interactive: bool = False) -> None:
    time.sleep(0.01)
    session.poll(interactive=interactive)
    session.advance(interactive=interactive)


def lamp(session: Session) -> int:
    return next(nth for nth, m in enumerate(session.materials) if m.emits)


@pytest.mark.parametrize("interactive", [False, True])
def test_light_follows_in_the_same_frame(session: Session, interactive: bool) -> None:
    which, before = lamp(session), session.lightmap.irradiance()
    rows = len(session.run.history.column("work"))
    session.set_flicker(True)
    factors = []
    for _ in range(6):
        frame(session, interactive=interactive)
        factor = np.array(session.scene.materials[which].emission) / session.materials[which].emission
        np.testing.assert_allclose(session.lightmap.irradiance(), before * factor, rtol=2e-3, atol=1e-4 * before.max())
        factors.append(factor[0])
    assert np.ptp(factors) > 0.005, "it flickers"
    assert len(session.run.history.column("work")) == rows and session.run.effort.edited_at is None
    assert not session.at_rest, "the window goes on"


def test_what_was_edited_comes_back_exactly(session: Session) -> None:
    before, materials = session.lightmap.irradiance(), session.materials
    session.set_flicker(True)
    for _ in range(3):
        frame(session)
    assert session.scene.materials != materials and session.materials == materials
    session.set_flicker(False)
    frame(session)
    assert session.scene.materials == session.materials == materials
    np.testing.assert_allclose(session.lightmap.irradiance(), before, rtol=1e-4, atol=1e-5 * before.max())


def test_an_edit_meanwhile_is_one_of_the_steady_lamp(session: Session) -> None:
    which = lamp(session)
    session.set_flicker(True)
    frame(session)
    brighter = tuple(2.0 * e for e in session.materials[which].emission)
    session.set_material(which, type(session.materials[which])("lamp", (0.5, 0.5, 0.5), emission=brighter))
    frame(session)
    assert session.materials[which].emission == brighter
    assert 1.4 < session.scene.materials[which].emission[0] / brighter[0] * 2 < 2.6
    session.set_flicker(False)
    assert session.scene.materials[which].emission == brighter


def test_it_pauses_with_the_solve(session: Session) -> None:
    session.set_flicker(True)
    frame(session)
    session.run.running = False
    still = session.scene
    frame(session)
    assert session.scene is still


def test_a_solver_that_takes_many_frames_ends_it(session: Session) -> None:
    materials = session.materials
    session.set_flicker(True)
    frame(session)
    session.set_solver("shooting")
    assert not SOLVERS["shooting"].relights and not session.flickers
    assert session.scene.materials == materials
    session.set_flicker(True)
    assert not session.flickers, "not offered"


def test_another_scene_is_steady(session: Session) -> None:
    session.set_flicker(True)
    frame(session)
    session.open_now("furnace")
    assert not session.flickers and session.scene is session.unedited
