"""Frames while all there is to do is to wait for a scene, a solver or a reference: what makes it gets the processor."""

from __future__ import annotations

import time
from typing import Any

from app.session.session import Session
from app.util.background import BackgroundTask
from app.viewer.ui_frame import WARM_UP

LOOK_PAUSE = 0.1  # s between two looks whether there is anything to show
PROGRESS_SECONDS = 0.5  # between two frames that show no more than how far it is


class Waiting:
    """Whether a frame would show nothing new, since the session waits for what other threads make."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._shown: object = None  # what is waited for, and what can be seen of it,
        self._told: object = None  # and how far it is
        self._due, self._frames_left = 0.0, 0

    @property
    def only(self) -> bool:
        """Whether the session has nothing else to do."""
        session = self._session
        working = session.solving or session.uploading or session.compared.measuring or session.flickers
        return self._task is not None and not working

    def idle(self) -> bool:
        """Whether the next frame can be left out; whoever asks draws it if not."""
        if not self.only:
            self._shown = None
            return False
        task, loading = self._task, self._session.loading
        shown = (task, task is not None and task.ended, None if loading is None else loading.flat, self._session.coarse)
        told = None if task is None else (task.stage, int(100 * task.fraction))
        now = time.perf_counter()
        if shown != self._shown:
            self._frames_left = WARM_UP
        elif self._frames_left <= 0 and (told == self._told or now < self._due):
            return True
        self._shown, self._told, self._due = shown, told, now + PROGRESS_SECONDS
        self._frames_left -= 1
        return False

    @property
    def _task(self) -> BackgroundTask[Any] | None:
        return self._session.on_its_way or self._session.compared.fetching
