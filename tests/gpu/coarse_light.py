"""A session that opens scenes in coarse texels first, and in better ones once a test says so."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from app.atlas import charts_cache
from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.session import loading
from app.session import session as session_module
from app.session.session import Session
from app.session.view import View
from app.solvers import ShootingOptions
from app.util import cache

TEXELS = 3000
PATIENCE = 60.0  # s


@pytest.fixture
def better(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[threading.Event]:
    """Better charts wait for this, but for a second at most once the test is over; coarse ones are made for any scene."""
    go_on, made = threading.Event(), charts_cache._made

    def waiting(scene: Any, atlas: Any, roots: Any, progress: Any, *more: Any) -> Any:
        while not go_on.wait(0.01):
            progress("waiting", 0.1)
        return made(scene, atlas, roots, progress, *more)

    monkeypatch.setattr(charts_cache, "_made", waiting)
    monkeypatch.setattr(charts_cache, "FEWEST", 0)
    monkeypatch.setattr(loading, "COARSE_FROM", 0)
    monkeypatch.setattr(session_module, "COARSE_SECONDS", PATIENCE)
    monkeypatch.setattr(session_module, "COARSE_LONGEST", PATIENCE)
    monkeypatch.setattr(session_module, "COARSE_LEFT", 0.0)
    monkeypatch.setattr(loading, "default_texels", lambda sides, roots: TEXELS // 16)
    with cache.elsewhere(tmp_path):
        yield go_on
        go_on.set()


@pytest.fixture
def view(gpu: Gpu, better: threading.Event, request: pytest.FixtureRequest) -> Iterator[View]:
    """Light is there with a tenth unshot, or as much as a test says."""
    options = ShootingOptions(resolution=64, residual=getattr(request, "param", 0.1))
    session = Session(gpu, options=options, atlas=AtlasOptions(texels=TEXELS), expose_on_open=True)
    view = View(session)
    yield view
    view.release()
    session.release()


def frames(session: Session, until: Callable[[], bool]) -> None:
    """Poll and advance as the window does."""
    end = time.monotonic() + PATIENCE
    while not until():
        assert time.monotonic() < end
        session.poll()
        session.advance()
