"""Shadow rays are given to the tiles whose noise they bring down most."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from app.direct_light.allocate import LEAST, MOST, allocate
from app.scene.model import F64


def spent(more: NDArray[np.int64], texels: NDArray[np.int64]) -> float:
    return float(more @ texels) / float(texels.sum())


def test_without_knowledge_all_tiles_get_as_many() -> None:
    passes, texels = np.array([3, 3, 3]), np.array([64, 10, 0])
    assert allocate(passes, np.zeros(3), texels, 5).tolist() == [5, 5, 0]
    assert allocate(np.zeros(3, np.int64), np.ones(3), texels, 5).tolist() == [5, 5, 0], "nothing is known yet"


def test_tiles_that_are_as_noisy_get_as_many() -> None:
    passes, texels = np.full(9, 3), np.full(9, 64)
    assert allocate(passes, np.full(9, 2.0), texels, 7).tolist() == [7] * 9


def test_noisy_tiles_get_more_of_the_same_number() -> None:
    random = np.random.default_rng(1)
    texels = random.integers(1, 65, 500)
    passes, gain = np.full(500, 40), random.exponential(1.0, 500) ** 2 * texels
    more = allocate(passes, gain, texels, 20)
    assert spent(more, texels) == pytest.approx(20, rel=0.02)  # whole passes
    order = np.argsort(gain / texels)
    assert more[order[-50:]].mean() > 3 * more[order[:250]].mean()
    assert more.max() <= MOST * 20 and (passes + more).min() >= LEAST * 60


def test_the_noise_is_least() -> None:
    """Of standard deviations s/√n: beside even passes, and beside those that are moved from any tile to any other."""
    texels, s = np.full(6, 64), np.array([1.0, 2.0, 3.0, 5.0, 8.0, 4.0])
    passes = np.full(6, 100)

    def deviation(n: F64) -> float:
        return float((s / np.sqrt(n)).sum())

    more = allocate(passes, 64 * s / np.sqrt(passes), texels, 100)
    best = deviation(passes + more)
    assert best < deviation(passes + 100.0)
    for giver in range(6):
        for taker in range(6):
            moved = (passes + more).astype(np.float64)
            moved[giver] -= 20
            moved[taker] += 20
            assert more[giver] < 20 or deviation(moved) >= best - 1e-3


def test_dark_tiles_are_looked_at_again_now_and_then() -> None:
    """Few shadow rays may all have missed a gap."""
    passes, gain, texels = np.array([10, 10]), np.array([0.0, 1.0]), np.array([64, 64])
    for _ in range(20):
        passes = passes + allocate(passes, gain, texels, 10)
    assert passes[0] >= LEAST * passes.mean() - 1
