"""Tone curves, sRGB, the colour map and the scale of false colour, against published numbers."""

from __future__ import annotations

import numpy as np
import pytest
from pictures import CURVES, tone_map

from app.render.false_colour import Scale, _nice_above, colour_map, value_per_radiance
from app.render.options import LAYERS, TONE_MAPS, DisplayOptions
from app.render.tone_mapping import encode_srgb
from app.render.units import LUMINANCE

GREYS = np.concatenate([[0.0], np.geomspace(1e-4, 1e3, 400)])[:, None] * np.ones(3)


@pytest.mark.parametrize("name", TONE_MAPS)
def test_a_grey_ramp_stays_grey_and_rises_from_black_to_white(name: str) -> None:
    shown = tone_map(name, GREYS)
    # the published matrices are rounded to 4 or 5 digits, so that greys differ by up to 1e-3 between channels
    assert np.ptp(shown, axis=1).max() < 1e-3
    assert (np.diff(shown[:, 1]) >= -1e-9).all()
    assert shown[0].max() < 1e-3
    assert shown[-1].min() > 0.995


@pytest.mark.parametrize("name", TONE_MAPS)
def test_any_colour_stays_on_the_screen(name: str, rng: np.random.Generator) -> None:
    colours = 10 ** rng.uniform(-6, 6, (2000, 3)) * rng.integers(0, 2, (2000, 3))
    shown = tone_map(name, colours)
    assert np.isfinite(shown).all()
    assert shown.min() >= 0.0
    assert shown.max() <= 1.0


# grey in, grey out, tolerance: from each curve's definition
KNOWN = [
    ("clamp", 0.25, 0.25, 1e-12),
    ("clamp", 1.5, 1.0, 1e-12),
    ("reinhard", 1.0, 0.5, 1e-6),
    ("reinhard", 0.25, 0.2, 1e-6),
    # below 0.08 the offset is x - 6.25x², above it 0.04
    ("neutral", 0.04, 6.25 * 0.04**2, 1e-12),
    ("neutral", 0.5, 0.46, 1e-12),
    # peak 1.24 becomes 1 - 0.24² / (1.24 + 0.24 - 0.76) = 0.92
    ("neutral", 1.28, 0.92, 1e-12),
    # AgX puts mid grey at half of its power curve; the polynomial is off by 2e-3 (mean square 3.7e-6)
    ("agx", 0.18, 0.5**2.2, 4e-3),
    # x = 1: (1.0245786 - 0.000090537) / (1.416679 + 0.238081), input 0.6 because of the factor 1/0.6; 5-digit matrices
    ("aces", 0.6, 0.619116, 2e-4),
]


@pytest.mark.parametrize(("name", "grey", "expected", "tolerance"), KNOWN)
def test_known_values(name: str, grey: float, expected: float, tolerance: float) -> None:
    assert tone_map(name, np.full((1, 3), grey)) == pytest.approx(expected, abs=tolerance)


def test_reinhard_keeps_hue_while_it_fits_the_screen() -> None:
    colour = np.array([[0.4, 0.2, 0.1]])
    shown = tone_map("reinhard", colour)
    assert shown / shown[0, 0] == pytest.approx(colour / colour[0, 0])


def test_srgb_known_values() -> None:
    """IEC 61966-2-1: the line up to 0.0031308, then the curve, that meet there."""
    linear = np.array([0.0, 0.0031308, 0.0031309, 0.18, 0.5, 1.0])
    assert encode_srgb(linear) == pytest.approx([0.0, 0.040450, 0.040451, 0.461356, 0.735357, 1.0], abs=2e-6)


def test_colour_map_is_viridis() -> None:
    """matplotlib's viridis at 0, ¼, ½, ¾ and 1; the published fit is within 2 % of it."""
    viridis = np.array([[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]])
    assert colour_map(5) * 255 == pytest.approx(viridis, abs=0.02 * 255)


def test_colour_map_gets_lighter_all_the_way() -> None:
    luminance = (colour_map(64) ** 2.2) @ LUMINANCE
    assert (np.diff(luminance) > 0).all()


@pytest.mark.parametrize(
    ("value", "top"), [(0.0, 1.0), (1.0, 1.0), (1.01, 1.2), (730.0, 800.0), (8.1, 10.0), (0.0021, 0.0025), (1e6, 1e6)]
)
def test_top_of_an_automatic_scale(value: float, top: float) -> None:
    assert _nice_above(value) == pytest.approx(top)


def test_white_of_one_watt_per_steradian() -> None:
    """683 lm/W: radiance 1 is 683 cd/m²; a white surface that shows it receives π W/m², 2146 lx."""
    assert value_per_radiance("luminance") == pytest.approx(683.0)
    assert value_per_radiance("illuminance") == pytest.approx(2145.708, abs=1e-3)


def test_every_option_of_the_display_has_its_table_entry() -> None:
    from app.render.layers import LAYER_SHADERS

    assert set(LAYER_SHADERS) == set(LAYERS)
    assert tuple(CURVES) == TONE_MAPS
    assert DisplayOptions().tone_map in CURVES
    assert Scale(1.0, 10.0, "lx").unit == "lx"
