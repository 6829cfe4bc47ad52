"""Error numbers on cases that can be worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from app.reference import metrics

R = np.array([1.0, 2.0, 3.0, 2.0])


@pytest.mark.parametrize(
    ("measure", "value", "expected"),
    [
        (metrics.relative_rms, R, 0.0),
        (metrics.relative_rms, R + np.array([2, 0, 0, 0]), 0.5),  # sqrt(4/4) / 2
        (metrics.relative_rms, 1.1 * R, 0.1 * math.sqrt(4.5) / 2),
        (metrics.bias, R, 0.0),
        (metrics.bias, 1.1 * R, 0.1),
        (metrics.bias, R + np.array([1, -1, 0, 0]), 0.0),
        (metrics.median_local, 0.9 * R, 0.1),
        (metrics.median_local, R + np.array([1, 0, 0, 0]), 0.0),
        (lambda v, r: metrics.quantile_local(v, r, 1.0), R + np.array([1, 1, 0, 0]), 1.0),
        (lambda v, r: metrics.quantile_local(v, r, 0.5), R + np.array([4, 2, 0, 0]), 1.0),  # of 0, 0, 1, 4 the third
    ],
)
def test_by_hand(measure, value, expected):
    assert measure(value, R) == pytest.approx(expected, abs=1e-12)  # rounding only


def test_colours_are_one_point():
    value, reference = np.array([[3.0, 4.0, 0.0], [1.0, 1.0, 1.0]]), np.array([[0.0, 0.0, 5.0], [1.0, 1.0, 1.0]])
    np.testing.assert_allclose(metrics.local_errors(value, reference), [math.sqrt(2), 0.0])
    assert metrics.relative_rms(value, reference) == pytest.approx(math.sqrt(50 / 6) / (8 / 6))


def test_black_references():
    np.testing.assert_array_equal(metrics.local_errors([0.0, 1.0], [0.0, 0.0]), [0.0, np.inf])
    assert math.isnan(metrics.relative_rms([1.0], [0.0]))


def test_shapes_must_agree():
    with pytest.raises(AssertionError):
        metrics.relative_rms(np.ones(3), np.ones((3, 1)))
