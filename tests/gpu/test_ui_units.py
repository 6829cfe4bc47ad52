"""One choice of what light is counted in, for every number that is shown or edited."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from desks import Desk, desk, session
from fake_session import MATERIALS
from imgui_bundle import imgui

from app.scene.lights import Light
from app.ui import slider
from app.ui.panels.display import counted

__all__ = ["desk", "session"]

LAMP = np.array([17.0, 12.0, 4.0])
Y = float(LAMP @ [0.2126, 0.7152, 0.0722])


@pytest.fixture
def sliders(monkeypatch: pytest.MonkeyPatch) -> dict[str, tuple[float, str]]:
    """Value and text of each slider by label; none is moved."""
    told: dict[str, tuple[float, str]] = {}

    def slide(label: str, value: float, ends: Any, text: str) -> float:
        told[label] = value, text
        return value

    monkeypatch.setattr(slider, "slide", slide)
    return told


def lamp_of(desk: Desk, quantities: str) -> None:
    desk.session.display = desk.session.display.replace(quantities=quantities)
    desk.ui.state.material = 3
    imgui.set_window_focus("Materials")
    desk.frames(4)


def test_a_lamp_is_edited_in_candela_and_lumen(desk: Desk, sliders: dict[str, tuple[float, str]]) -> None:
    """Its surface has 1 m²; a diffuse one gives off π times its luminance per m²."""
    lamp_of(desk, "photometric")
    assert sliders["##strength"] == (pytest.approx(683 * Y), "8,528 cd/m²")
    assert sliders["##flux"] == (pytest.approx(np.pi * 683 * Y), "26,790 lm")
    lamp_of(desk, "radiometric")
    assert sliders["##strength"] == (pytest.approx(17.0), "17.00 W/(sr m²)")
    assert sliders["##flux"] == (pytest.approx(np.pi * LAMP.sum()), "103.7 W"), "as the energy of a solve"


@pytest.mark.parametrize(
    ("label", "value", "quantities", "emission"),
    [
        ("##strength", 683.0, "photometric", LAMP / Y),
        ("##flux", 683.0, "photometric", LAMP / Y / np.pi),
        ("##strength", 34.0, "radiometric", 2 * LAMP),
        ("##flux", 33.0, "radiometric", LAMP / np.pi),
    ],
)
def test_what_is_edited_is_what_it_says(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, label: str, value: float, quantities: str, emission: np.ndarray
) -> None:
    with monkeypatch.context() as hand:
        hand.setattr(slider, "slide", lambda name, now, *_: value if name == label else now)
        lamp_of(desk, quantities)
    np.testing.assert_allclose(desk.session.scene.materials[3].emission, emission, rtol=1e-9)


def test_a_lamp_has_the_colour_of_its_temperature(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 6504 K it is nearly the white of the screen, D65; of 2856 K it is CIE's illuminant A, in Rec.709 (1, 0.446, 0.125)."""
    for kelvin, colour, off in ((6504.0, (1.0, 0.945, 0.994), 0.01), (2856.0, (1.0, 0.446, 0.125), 0.012)):
        with monkeypatch.context() as hand:
            hand.setattr(slider, "slide", lambda name, now, *_, k=kelvin: k if name == "##kelvin" else now)
            lamp_of(desk, "radiometric")
        emission = np.array(desk.session.scene.materials[3].emission)
        np.testing.assert_allclose(emission / 17, colour, atol=off)


def test_a_right_click_puts_a_lamp_back(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    materials = desk.session.scene.materials
    desk.session.scene = type(desk.session.scene)(**vars(desk.session.scene))  # edits leave the one that was read alone
    dimmed = replace(materials[3], emission=(1.0, 0.0, 0.0))
    desk.session.scene.materials = (*materials[:3], dimmed)
    lamp_of(desk, "radiometric")
    places: list[tuple[float, float]] = []
    real = slider.slide

    def noting(label: str, *more: Any) -> float:
        result = real(label, *more)
        if label == "##flux":
            low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            places.append(((low.x + high.x) / 2, (low.y + high.y) / 2))
        return result

    monkeypatch.setattr(slider, "slide", noting)
    desk.frames(2)
    desk.click(*places[-1], button=1)
    assert desk.session.scene.materials[3].emission == (17.0, 12.0, 4.0)


@pytest.mark.parametrize(
    ("light", "texts"),
    [
        (Light("a", intensity=(1.0, 1.0, 1.0)), ("683.0 cd", "8,583 lm", "1.000 W/sr", "37.70 W")),
        (Light("a", "directional", intensity=(2.0, 2.0, 2.0)), ("1,366 lx", None, "2.000 W/m²", None)),
    ],
    ids=["point", "directional"],
)
def test_lights_are_in_candela_lumen_and_lux(
    desk: Desk, sliders: dict[str, tuple[float, str]], light: Light, texts: tuple[str | None, ...]
) -> None:
    scene = desk.session.scene
    scene.lights, scene.materials = (light,), (MATERIALS[0],) * len(MATERIALS)
    desk.session.unedited.materials = scene.materials
    imgui.set_window_focus("Lights")
    for quantities, strength, flux in (("photometric", *texts[:2]), ("radiometric", *texts[2:])):
        desk.session.display = desk.session.display.replace(quantities=quantities)
        sliders.clear()
        desk.frames(4)
        assert sliders["##strength"][1] == strength
        assert (sliders["##flux"][1] if "##flux" in sliders else None) == flux


def test_a_top_that_was_given_stays_where_it_is(desk: Desk) -> None:
    display = desk.session.display.replace(false_colour="illuminance", false_colour_max=1366.0)
    watts = counted(display, "radiometric")
    assert watts.false_colour_max == pytest.approx(2.0)
    assert counted(watts, "photometric").false_colour_max == pytest.approx(1366.0)
    assert counted(watts, "radiometric") is watts


@pytest.mark.parametrize(
    ("quantities", "names"),
    [("photometric", ["illuminance", "luminance"]), ("radiometric", ["irradiance", "radiance"])],
)
def test_false_colours_are_called_what_they_show(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, quantities: str, names: list[str]
) -> None:
    offered: list[list[str]] = []

    def combo(label: str, now: int, items: list[str], shown: int = -1) -> tuple[bool, int]:
        offered.append(items)
        return False, now

    monkeypatch.setattr(imgui, "combo", combo)
    desk.session.display = desk.session.display.replace(quantities=quantities)
    desk.frames(2)
    assert ["off", *names] in offered
