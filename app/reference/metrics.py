"""Metrics of error, how far values lie from a reference: one number each, with its formula.

Values v and references r are arrays of one shape: (n,), or (n, 3) for linear Rec.709. The mean runs over all their
numbers, channels included. ``local`` errors are one per point: |v - r| / |r| with |·| the length of the colour.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

DARK = 1e-3  # share of the mean below which a point counts as dark


class PointErrors(NamedTuple):
    """Over lit points: relative RMS, bias of the mean, median and 90 % quantile of local errors [-]."""

    rms: float
    bias: float
    median: float
    q90: float


def lit_points(reference: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(n,) where colours (n, 3) are not dark."""
    mean = reference.mean(axis=1)
    return np.asarray(mean > DARK * mean.mean())


def relative_rms(value: ArrayLike, reference: ArrayLike) -> float:
    """√(mean (v - r)²) / mean r. NaN where the reference is black."""
    v, r = _pair(value, reference)
    return _ratio(float(np.sqrt(np.mean((v - r) ** 2))), float(np.mean(r)))


def bias(value: ArrayLike, reference: ArrayLike) -> float:
    """(mean v - mean r) / mean r: light gained (> 0) or lost (< 0) overall. NaN where the reference is black."""
    v, r = _pair(value, reference)
    return _ratio(float(np.mean(v - r)), float(np.mean(r)))


def local_errors(value: ArrayLike, reference: ArrayLike) -> NDArray[np.float64]:
    """(n,) |v - r| / |r| of each point; 0 where both are black, infinite where only the reference is."""
    v, r = _pair(value, reference)
    if v.ndim == 1:
        v, r = v[:, None], r[:, None]
    error, scale = np.linalg.norm(v - r, axis=1), np.linalg.norm(r, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        relative: NDArray[np.float64] = np.where(error == 0.0, 0.0, error / scale)
    return relative


def quantile_local(value: ArrayLike, reference: ArrayLike, q: float) -> float:
    """The local error that a share ``q`` in [0, 1] of the points does not exceed: one that occurs, no mean of two."""
    return float(np.quantile(local_errors(value, reference), q, method="higher"))


def median_local(value: ArrayLike, reference: ArrayLike) -> float:
    """``quantile_local`` at q = 0.5."""
    return quantile_local(value, reference, 0.5)


def point_errors(value: NDArray[np.float64], reference: NDArray[np.float64]) -> PointErrors:
    """Of colours (n, 3) at lit points; NaN where there are none, or where they are not finite."""
    if not len(reference) or not np.isfinite(value).all():
        return PointErrors(*[float("nan")] * 4)
    return PointErrors(
        relative_rms(value, reference),
        bias(value, reference),
        median_local(value, reference),
        quantile_local(value, reference, 0.9),
    )


def _pair(value: ArrayLike, reference: ArrayLike) -> tuple[NDArray[Any], NDArray[Any]]:
    v, r = np.asarray(value, np.float64), np.asarray(reference, np.float64)
    assert v.shape == r.shape, f"{v.shape} values for {r.shape} references"
    assert v.size and v.ndim in (1, 2)
    return v, r


def _ratio(numerator: float, denominator: float) -> float:
    return numerator / denominator if denominator else float("nan")
