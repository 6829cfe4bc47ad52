"""Long work on quadtrees says how far it is, and can be stopped: what is there is kept."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.lightmap.refinement import HELD
from app.session.run import Stop
from app.session.session import Session
from app.solvers import SOLVERS

FINE = {"depth": 5, "gradient": 1e-3, "budget": 65_536}


@pytest.fixture(params=["shooting", "gathering"])
def session(gpu: Gpu, request: pytest.FixtureRequest) -> Iterator[Session]:
    """Leaves that have just been asked to be much finer."""
    light = LightmapOptions(adaptive=True, depth=2)
    session = Session(gpu, solver=request.param, light=light, atlas=AtlasOptions(texels=1500))
    session.open_now("cornell-box")
    session.solve(Stop(work=40))
    session.set_light(session.light.replace(**FINE))
    yield session
    session.release()


def pieces(session: Session, count: int) -> list[str]:
    """What was said of the leaves after each of so many pieces of work."""
    said = []
    for _ in range(count):
        session.work(SOLVERS[session.solver_name].batch)
        session.poll()
        said.append(session.stats.leaves)
    return said


def leaves(session: Session) -> np.ndarray:
    pool = session.lightmap.pool
    return np.sort(pool.leaves.keys[pool.used])


def test_it_says_how_many_leaves_are_to_split_and_stops_when_asked(session: Session) -> None:
    before = session.lightmap.tiles
    said = pieces(session, 4)
    assert session.stats.refining and session.lightmap.tiles > before
    assert any(text.endswith("more to split") and text != "0 more to split" for text in said)
    session.hold_leaves()
    held = leaves(session)
    said = pieces(session, 12)
    assert (leaves(session) == held).all(), "they stay"
    assert session.stats.note == HELD
    if session.solver_name == "shooting":
        shares = [int(text.split(": ")[1].rstrip("%")) for text in said if text.startswith("light of")]
        assert len(set(shares)) > 2 and shares == sorted(shares), "earlier shots are made again, and counted"
    done = session.stats.done
    while session.stats.refining:
        pieces(session, 1)
    pieces(session, 4)
    assert session.stats.done > done and session.stats.leaves == "", "then it goes on"
    session.set_light(session.light.replace(depth=1))
    assert session.stats.note is None
    pieces(session, 6)
    assert len(leaves(session)) < len(held), "others were asked for"


def test_pressed_again_new_leaves_keep_the_light_that_they_have(session: Session) -> None:
    pieces(session, 4)
    before = session.run.energy.emitted.sum()
    session.hold_leaves()
    pieces(session, 3)
    session.hold_leaves()
    pieces(session, 2)
    assert not session.stats.refining
    session.run.settle()
    balance = session.run.energy
    assert balance.emitted.sum() == pytest.approx(before)
    assert abs(balance.imbalance_share) < 0.1 and np.isfinite(session.lightmap.irradiance()).all()


def test_an_edit_lets_them_go_on(session: Session) -> None:
    pieces(session, 6)
    session.hold_leaves()
    session.restart()
    assert not session.lightmap.refinement.held and session.stats.note is None
    session.solve(Stop(work=48))
    assert session.lightmap.refinement.looked_at > 0 and session.stats.note != HELD


def test_no_quadtrees_nothing_to_hold(gpu: Gpu) -> None:
    session = Session(gpu, atlas=AtlasOptions(texels=1500))
    session.hold_leaves()
    session.open_now("cornell-box")
    session.hold_leaves()
    assert session.stats.note is None
    session.release()
