"""A session that is small and quick: the furnace of a few texels."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.session.session import Session
from app.session.view import View
from app.solvers import ShootingOptions

ATLAS = AtlasOptions(texels=900)
SHOOTING = ShootingOptions(resolution=64, residual=0.05)


@pytest.fixture
def view(gpu: Gpu) -> Iterator[View]:
    session = Session(gpu, options=SHOOTING, atlas=ATLAS)
    view = View(session)
    session.open_now("furnace")
    yield view
    view.release()
    session.release()


@pytest.fixture
def session(view: View) -> Session:
    return view.session


def irradiance(session: Session) -> float:
    return float(session.lightmap.irradiance().sum())


def wait_for(session: Session) -> None:
    until = time.monotonic() + 60
    while session.loading is not None:
        assert time.monotonic() < until, "did not load"
        session.poll()
        time.sleep(0.001)
