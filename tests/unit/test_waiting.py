"""Frames while a scene is on its way: only those that show something new."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from app.viewer import waiting, window
from app.viewer.ui_frame import WARM_UP
from app.viewer.waiting import LOOK_PAUSE, PROGRESS_SECONDS, Waiting
from app.viewer.window import AWAKE_SECONDS, REST_SECONDS, ViewerWindow


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


class Desk(ViewerWindow):
    """The window's loop without a window, on a clock of its own: ``run`` says what it did, frames and waits for events."""

    FRAME = 0.1  # s

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now, self._left, self._did = 100.0, 0, list[object]()
        clock = SimpleNamespace(perf_counter=lambda: self.now)
        monkeypatch.setattr(waiting, "time", clock)
        monkeypatch.setattr(window, "time", clock)
        stands = SimpleNamespace(on_its_way=None, loading=None, coarse=False, solving=False, uploading=False)
        stands.compared, stands.flickers = SimpleNamespace(fetching=None, measuring=False), False
        self.task = SimpleNamespace(ended=False, stage="reading", fraction=0.1, flat=None)
        self.session: Any = stands
        self.session.at_rest = False
        self.picture = SimpleNamespace(unfinished=False, frames_to_show=lambda view: WARM_UP)
        rest: dict[str, Any] = {"_view": None, "_frame": self.picture, "_session": stands, "_waiting": Waiting(stands)}
        rest |= {"_ui": SimpleNamespace(moving=False), "_pictures": SimpleNamespace(busy=False, end=lambda: None)}
        rest |= {"timer": SimpleNamespace(start=lambda: None), "wnd": SimpleNamespace(is_closing=False)}
        rest |= {"_frames_left": None, "_awake_until": 0.0, "_touched_until": 0.0, "_frames_due": 0}
        vars(self).update(rest)

    def load(self, task: object) -> None:
        """This is what is on its way; the session is at rest where nothing is."""
        self.session.on_its_way = self.session.loading = task
        self.session.at_rest = task is None

    def run(self, turns: int) -> list[object]:
        self._did, self._left, self.wnd.is_closing = [], turns, False
        self.main_loop()
        return self._did

    def _did_one(self, what: object, seconds: float) -> None:
        self.now += seconds
        self._did.append(what)
        self._left -= 1
        self.wnd.is_closing = self._left == 0

    def _next_frame(self) -> None:
        self._frames_due -= 1
        self._did_one("frame", self.FRAME)

    def _wait(self, seconds: float) -> None:
        self._did_one(seconds, seconds)


def test_the_window_draws_while_there_is_something_to_see_and_then_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    desk, awake = Desk(monkeypatch), round(AWAKE_SECONDS / Desk.FRAME)
    desk.load(desk.task)
    assert desk.run(WARM_UP + 3) == ["frame"] * WARM_UP + [LOOK_PAUSE] * 3, "a scene is on its way, and nothing is new"
    desk._on_event()
    assert desk.run(awake + 3)[:awake] == ["frame"] * awake, "somebody is there"
    assert desk.run(3) == [LOOK_PAUSE] * 3
    desk.picture.unfinished = True
    assert desk.run(20) == ["frame"] * 20
    desk.picture.unfinished, desk.session.solving = False, True
    assert desk.run(20) == ["frame"] * 20, "coarse light grows"
    desk.session.solving = False
    assert desk.run(WARM_UP + 1) == ["frame"] * WARM_UP + [LOOK_PAUSE], "the last of it is shown, too"
    desk.load(None)
    last = desk.run(awake + WARM_UP + 3)
    assert last[0] == "frame" and last[-2:] == [REST_SECONDS] * 2, "what came instead is shown, and stays"
    desk.picture.unfinished = True
    assert desk.run(5) == ["frame"] * 5
    desk.picture.unfinished, desk._frames_due, desk._awake_until = False, 3, 0.0
    assert desk.run(4) == ["frame"] * 3 + [REST_SECONDS], "large textures are brought up to date over frames"
