"""Work in a thread of its own, that says how far it is and can be cancelled: the window never waits for it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from app.errors import UserError

Progress = Callable[[str, float], None]  # stage, share done
Report = Callable[[float], None]  # share done; like a Progress, it may raise to cancel
ResultT = TypeVar("ResultT")


def unheard(share: float) -> None:
    """A Report that nobody hears."""


def share_of(report: Report, first: float, last: float) -> Report:
    """That of a part of the work, from one share to another."""
    return lambda share: report(first + (last - first) * share)


class CancelledError(Exception):
    """The user stopped it."""


class BackgroundTask(Generic[ResultT]):
    """A function that runs in a thread. It is given a Progress to call now and then, which raises CancelledError once the task is
    cancelled. ``ended`` says whether it is over; ``result`` gives what it returned, or raises what went wrong.

    what: names what it makes, for messages. stage, fraction: how far it is. cancelled: by the user.
    """

    def __init__(self, what: str, work: Callable[[Progress], ResultT]) -> None:
        self.what = what
        self.stage, self.fraction = "starting", 0.0
        self.cancelled = False
        self._results: list[ResultT] = []
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, args=(work,), daemon=True)
        self._thread.start()

    @property
    def ended(self) -> bool:
        return not self._thread.is_alive()

    @property
    def result(self) -> ResultT:
        """Waits for it. Raises UserError, or CancelledError."""
        self._thread.join()
        if self._error is not None:
            raise self._error
        return self._results[0]

    def cancel(self) -> None:
        """Let it end at its next stage. Whoever waits for the result gives up."""
        self.cancelled = True

    def _run(self, work: Callable[[Progress], ResultT]) -> None:
        try:
            self._results.append(work(self._progress))
        except MemoryError:
            self._error = UserError(f"not enough memory for {self.what}")
        except OSError as error:
            self._error = UserError(f"{self.what}: {error.strerror or error}")
        except BaseException as error:  # raised again by the main thread, with its traceback
            self._error = error

    def _progress(self, stage: str, share: float) -> None:
        if self.cancelled:
            raise CancelledError
        self.stage, self.fraction = stage, share
