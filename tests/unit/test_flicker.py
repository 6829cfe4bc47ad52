"""How lamps flicker: around what they were edited to, smoothly, and each in its own time."""

from __future__ import annotations

import numpy as np
import pytest

from app.scene.model import Material
from app.session.flicker import flicker, flickering

FRAME = 1 / 30


def over_time(lamp: int, seconds: float = 60.0) -> np.ndarray:
    return np.array([flicker(t, lamp) for t in np.arange(0.0, seconds, FRAME)])


@pytest.mark.parametrize("lamp", [0, 1, 7])
def test_a_lamp_gives_on_average_what_it_was_edited_to(lamp: int) -> None:
    factors = over_time(lamp)
    assert factors.mean() == pytest.approx(1.0, abs=0.01)
    assert 0.75 <= factors.min() < 0.8 and 1.2 < factors.max() <= 1.25


def test_it_is_smooth_and_a_few_times_a_second() -> None:
    factors = over_time(3)
    assert np.abs(np.diff(factors)).max() < 0.15, "from one frame to the next"
    through = np.count_nonzero(np.diff(np.sign(factors - 1.0))) / 2 / 60.0
    assert 1.0 < through < 5.0, "Hz"


def test_lamps_are_not_in_step_and_runs_are_alike() -> None:
    both = np.corrcoef(over_time(2), over_time(3))[0, 1]
    assert abs(both) < 0.9
    np.testing.assert_array_equal(over_time(2), over_time(2))


def test_only_what_emits_changes_and_keeps_its_colour() -> None:
    wall, lamp = Material("wall", (0.5, 0.5, 0.5)), Material("lamp", (0.1, 0.1, 0.1), emission=(4.0, 2.0, 1.0))
    now = flickering((wall, lamp), 0.4)
    assert now[0] is wall
    assert now[1].emission != lamp.emission
    np.testing.assert_allclose(now[1].emission, np.array(lamp.emission) * flicker(0.4, 1))
    assert now[1].albedo == lamp.albedo
