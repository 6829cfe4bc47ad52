"""A checkpoint is a file with the light of a solve that goes on: every so many seconds, and when it is stopped.

Whatever ends the program, the last checkpoint is whole, and no more is lost than what was done since.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.errors import UserError
from app.options import Options, option
from app.session.light_state import light_state, restore_light
from app.session.session import Session
from app.util.background import BackgroundTask
from app.util.state_file import read_state, remove_state, write_state

CHECKPOINT_NAME = "bake.checkpoint"


@dataclass(frozen=True)
class CheckpointOptions(Options):
    """How often."""

    checkpoint: float = option(
        60.0,
        "write the light so far every so many seconds, to resume from",
        unit="s",
        minimum=0,
        maximum=86_400,
        usual=(0, 600),
        zero="never",
        label="Checkpoint every",
        tip="The light so far is written into the folder so often, and a bake that was stopped, or a crash, goes on from there. "
        "It is written beside the solve, which hardly waits",
    )


class Checkpoint:
    """Of one session's solve, in one file. say: is told once why it cannot be written, if so; the solve goes on."""

    def __init__(
        self,
        session: Session,
        path: Path,
        seconds: float,
        say: Callable[[str], None],
        *,
        aside: bool = False,
        beside: Mapping[str, Any] | None = None,
    ) -> None:
        """seconds: between two, 0 for never. aside: written in a thread of its own, which nothing waits for. beside: plain values
        that are kept with the light."""
        self._session, self.path, self._seconds, self._say, self._aside = session, path, seconds, say, aside
        self.beside = dict(beside or {})
        self._works = seconds > 0
        self._writing: BackgroundTask[None] | None = None
        self.begin()

    def begin(self) -> None:
        """The solve goes on from now."""
        self._due = time.perf_counter() + self._seconds

    def resume(self) -> bool:
        """Let the session, which has the same scene open, go on from the file; False where there is none. Raises UserError."""
        if not self.path.exists():
            return False
        state = read_state(self.path)
        try:
            restore_light(self._session, state)
        except UserError as error:
            raise UserError(f"{self.path}: {error}") from None
        return True

    def between(self) -> None:
        """Between two pieces of work: write it if it is time."""
        if self._writing is not None and self._writing.ended:
            self._end_writing()
        if self._writing is None and time.perf_counter() >= self._due:
            self.write()

    def write(self) -> None:
        """Write it now, in place of the one before."""
        self._end_writing()
        if self._works:
            state = light_state(self._session)
            state.values |= self.beside
            self._writing = BackgroundTask(str(self.path), lambda tell: write_state(self.path, state))
            if not self._aside:
                self._end_writing()
            self.begin()

    def _end_writing(self) -> None:
        """Wait for what is being written, if anything."""
        writing, self._writing = self._writing, None
        try:
            if writing is not None:
                _ = writing.result
        except UserError as error:
            self._works = False
            self._say(f"{error}: the bake goes on without checkpoints")

    def remove(self) -> None:
        """Remove what was kept: what it was kept for is done."""
        self._end_writing()
        remove_state(self.path)

    def close(self) -> None:
        """The last one is to stay."""
        self._end_writing()


__all__ = ["CHECKPOINT_NAME", "Checkpoint", "CheckpointOptions"]
