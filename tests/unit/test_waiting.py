"""Frames while a scene is on its way: only those that show something new."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from app.viewer import waiting
from app.viewer.ui_frame import WARM_UP
from app.viewer.waiting import PROGRESS_SECONDS, Waiting


def test_a_frame_is_drawn_where_it_shows_something_new(monkeypatch: pytest.MonkeyPatch) -> None:
    now = 100.0
    monkeypatch.setattr(waiting, "time", SimpleNamespace(perf_counter=lambda: now))
    task = SimpleNamespace(ended=False, stage="reading", fraction=0.1, flat=None)
    compared = SimpleNamespace(fetching=None, measuring=False)
    session = SimpleNamespace(on_its_way=task, loading=task, compared=compared, coarse=False)
    session.solving = session.uploading = session.flickers = False
    frames = Waiting(session)  # type: ignore[arg-type]

    def drawn() -> int:
        """Frames that are drawn before it is idle."""
        return next(count for count in range(100) if frames.idle())

    assert frames.only and drawn() == WARM_UP
    task.fraction = 0.2
    assert drawn() == 0, "how far it is, is shown now and then"
    now += PROGRESS_SECONDS
    assert drawn() == 1 and drawn() == 0
    now += PROGRESS_SECONDS
    assert drawn() == 0, "nothing is new"
    task.flat = object()
    assert drawn() == WARM_UP, "the scene is there, flat: at once"
    session.uploading = True
    assert not frames.only and not frames.idle() and not frames.idle(), "every frame uploads a part"
    session.uploading, session.coarse = False, True
    assert drawn() == WARM_UP
    session.on_its_way = session.loading = None
    assert not frames.idle()
