"""When light is good enough: what is asked of it, and about how long that still takes."""

from __future__ import annotations

import math

import numpy as np

from app.options import Options, specs
from app.session.history import History
from app.session.stats import Stats
from app.solvers import Family

KNOWN_SECONDS = 0.5  # of solving, from which on more is foreseen


def options_for_error(family: Family, options: Options, error: float) -> Options:
    """The options with which no more remains than an expected error of so much [-] allows, but not more than by default; the same
    where what remains says nothing of the error."""
    if family.per_error is None:
        return options
    spec = next(spec for spec in specs(type(options)) if spec.name == family.threshold)
    assert spec.minimum is not None
    return options.replace(**{family.threshold: max(min(family.per_error * error, spec.default), spec.minimum)})


def seconds_left(family: Family, goal: float, stats: Stats, history: History) -> float | None:
    """About how long it takes until no more than ``goal`` remains; None as long as that is not known.

    Noise falls with the square root of the time. Of light that is still to be distributed, the same share goes in the same time:
    that of the last half of it."""
    now = stats.remaining
    if stats.converged or now <= goal:
        return 0.0
    if stats.seconds < KNOWN_SECONDS or not 0 < now < 1:
        return None
    if not family.distributes:
        return stats.seconds * ((now / goal) ** 2 - 1)
    before = float(np.interp(stats.seconds / 2, history.column("seconds"), history.column("remaining")))
    if not now < before <= 1:
        return None
    return math.log(now / goal) / math.log(before / now) * stats.seconds / 2


__all__ = ["options_for_error", "seconds_left"]
