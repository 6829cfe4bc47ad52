"""A solve from the first shot to the last, without a window: until converged, stopped, interrupted, or the light breaks."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from app.errors import UserError
from app.session.stats import Stats, Stop

if TYPE_CHECKING:
    from app.session.session import Session

TELL_SECONDS = 0.2  # between two calls of progress
NEARLY = 0.99  # done, by what is unshot: the finest patches still shoot
NO_LIMIT = 1 << 30  # shots: a step stops at its solver's own batch


class NotFiniteError(UserError):
    """The light has become infinite or no number."""


def not_finite(session: Session) -> NotFiniteError:
    """What to raise then."""
    shots, parameters = session.solver.report.shots, session.parameters
    return NotFiniteError(f"{session.name}: the light is not finite after {shots} shots; parameters {parameters}")


def solve(session: Session, stop: Stop, progress: Callable[[Stats], None] | None = None) -> None:
    """Shoot until ``stop``, or until converged; ``progress`` hears of it a few times a second. Ctrl-C ends it early and is
    noted as ``session.interrupted``. Raises NotFiniteError; report and book are those of the last shot then, too."""
    start = time.perf_counter()
    session.interrupted, failure = False, None
    try:
        _shoot(session, stop, start, progress)
    except KeyboardInterrupt:
        session.interrupted = True
    except NotFiniteError as error:
        failure = error
    session.gpu.ctx.finish()
    session.seconds = time.perf_counter() - start
    session.settle()
    if failure is not None:
        raise failure


def share_done(session: Session, stop: Stop) -> float:
    """Of a solve: of the shots or seconds asked for, or of the decades of residual down to the threshold, 0 to 1."""
    residual = max(session.solver.report.residual, 1e-12)
    decades = np.log(min(residual, 1.0)) / np.log(min(session.shooting.residual, 0.999999))
    shares = [1.0 if session.converged else min(decades, NEARLY)]
    if stop.shots is not None:
        shares.append(session.solver.shots / stop.shots)
    if stop.seconds is not None:
        shares.append(session.seconds / stop.seconds)
    return float(min(max(shares), 1.0))


def _shoot(session: Session, stop: Stop, start: float, progress: Callable[[Stats], None] | None) -> None:
    solver, told = session.solver, start
    while not session.converged:
        left = NO_LIMIT if stop.shots is None else stop.shots - solver.shots
        if left <= 0 and stop.shots is not None:
            session.hear(books=False, wait=True)  # some of the issued ones were too weak
            left = stop.shots - solver.shots
        spent = time.perf_counter() - start
        if left <= 0 or (stop.seconds is not None and spent >= stop.seconds):
            break
        session.shoot(left)
        session.seconds = time.perf_counter() - start
        session.hear(books=False)
        if progress and time.perf_counter() - told > TELL_SECONDS:
            told = time.perf_counter()
            progress(session.stats)
