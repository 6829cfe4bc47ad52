"""Colour temperatures, against the CIE's illuminants."""

from __future__ import annotations

import numpy as np
import pytest

from app.scene.colorimetry import COOLEST, HOTTEST, REC709_FROM_XYZ, colour_of_kelvin, kelvin_of_colour


def rec709(x: float, y: float) -> tuple[float, float, float]:
    red, green, blue = (REC709_FROM_XYZ @ [x / y, 1.0, (1 - x - y) / y]).tolist()
    return red, green, blue


@pytest.mark.parametrize(
    ("x", "y", "kelvin"),
    [(0.44757, 0.40745, 2856), (0.34567, 0.35850, 5003), (0.31271, 0.32902, 6504), (0.37208, 0.37529, 4230)],
    ids=["A", "D50", "D65", "F2"],
)
def test_temperatures_of_the_illuminants(x: float, y: float, kelvin: float) -> None:
    """Within 1 %, by which the matching functions are off that are fitted by lobes."""
    assert kelvin_of_colour(rec709(x, y)) == pytest.approx(kelvin, rel=0.01)


@pytest.mark.parametrize("kelvin", [COOLEST, 2700.0, 4000.0, 6504.0, 9300.0, HOTTEST])
def test_there_and_back(kelvin: float) -> None:
    assert kelvin_of_colour(colour_of_kelvin(kelvin)) == pytest.approx(kelvin, rel=2e-3)
    assert max(colour_of_kelvin(kelvin)) == 1.0 and min(colour_of_kelvin(kelvin)) >= 0.0


def test_warm_is_red_and_cold_is_blue() -> None:
    reds = [colour_of_kelvin(k)[0] / colour_of_kelvin(k)[2] for k in np.linspace(2700, 12000, 20)]
    assert reds == sorted(reds, reverse=True)


@pytest.mark.parametrize("colour", [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)], ids=str)
def test_what_has_no_temperature(colour: tuple[float, float, float]) -> None:
    assert kelvin_of_colour(colour) is None
