"""What a session expects its error to be: once its light is at rest, and where a solve ends by it."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest
from gl_objects import forgotten, held

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.session.run import Stop
from app.session.session import Session
from app.solvers import ShootingOptions

__all__ = ["forgotten"]


@pytest.fixture
def session(gpu: Gpu) -> Session:
    return Session(gpu, options=ShootingOptions(resolution=64, residual=0.1), atlas=AtlasOptions(texels=800))


def begin_estimate(session: Session) -> None:
    """Frames until the first part of an estimate is done: the tree that rays walk is built beside them."""
    for _ in range(1000):
        session.poll()
        if session.estimate.share > 0.0:
            return
        time.sleep(0.01)


def test_a_session_at_rest_says_what_it_expects(gpu: Gpu, session: Session) -> None:
    """A part per frame, once light is at rest; another light is judged anew."""
    session.open_now("cornell-box")
    session.solve(Stop())
    assert session.expected is None and not session.at_rest
    frames, shares = 0, [0.0]
    while not session.at_rest:
        session.poll()
        shares.append(session.estimate.share)
        frames += 1
    assert frames > 64 and np.diff(shares).min() >= 0
    first = session.expected
    assert first is not None and 0.005 < first.rms < 0.5
    session.set_material(1, session.scene.materials[1])
    session.work(1)
    assert session.expected is None
    session.solve(Stop())
    session.estimate_now(lambda share: None)
    second = session.expected
    assert second is not None and second != first and second.rms == pytest.approx(first.rms, rel=0.5)
    session.release()


def test_as_many_other_shots_are_other_light(gpu: Gpu, session: Session) -> None:
    session.open_now("cornell-box")
    session.solve(Stop(work=8))
    session.estimate_now(lambda share: None)
    assert session.expected is not None
    session.restart()
    session.set_options(session.options.replace(visibility="depth"))
    session.solve(Stop(work=8))
    assert session.expected is None
    session.release()


def test_a_hand_comes_first(gpu: Gpu, session: Session) -> None:
    session.open_now("cornell-box")
    session.solve(Stop(work=8))
    session.run.running = False
    for _ in range(3):
        session.poll(interactive=True)
    assert session.estimate.share == 0.0 and not session.at_rest
    begin_estimate(session)
    assert session.estimate.share > 0.0
    session.release()


def test_nothing_of_it_stays(gpu: Gpu, session: Session, forgotten: Callable[[], list[object]]) -> None:
    session.open_now("cornell-box")
    session.solve(Stop(work=8))
    session.estimate_now(lambda share: None)
    session.open_now("cornell-box")
    before = held(gpu)
    for _ in range(2):
        session.solve(Stop(work=8))
        session.run.running = False
        begin_estimate(session)
        assert session.estimate.share > 0.0, "on its way"
        session.run.running = True
        session.open_now("cornell-box")
    assert held(gpu) == before and not forgotten()
    session.release()


def test_a_solve_ends_at_a_stated_error(gpu: Gpu) -> None:
    """Once the error that it expects is as little as asked for, and well before it would converge."""
    session = Session(gpu, solver="gathering", atlas=AtlasOptions(texels=2000))
    session.open_now("cornell-box")
    session.solve(Stop(error=0.05))
    assert session.expected is not None and session.expected.median <= 0.05
    assert not session.run.converged
    done = session.solver.issued
    session.solve(Stop(rms=1e-4, work=done + 16))
    assert session.solver.issued == done + 16, "what is never reached does not end it"
    session.release()
