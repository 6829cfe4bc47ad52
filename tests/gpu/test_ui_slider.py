"""Sliders: how far a hand moves them, finely with Shift, by factors where a quantity spans decades, and typed."""

from __future__ import annotations

from typing import Any

import pytest
from desks import Desk, desk, session, where
from imgui_bundle import imgui

from app.render.options import DisplayOptions
from app.scene.lights import Light
from app.ui import slider
from app.ui.slider import DECADE_PX, SPAN_PX, STEP_PX, Range

__all__ = ["desk", "session", "where"]


def dragged(desk: Desk, place: tuple[float, float], px: float, steps: int = 4) -> None:
    x, y = place
    desk.frames(1, seconds=1.0)  # else it is a double click
    desk.point(x, y)
    desk.press(0, True)
    for step in range(1, steps + 1):
        desk.point(x + px * step / steps, y)
    desk.press(0, False)


@pytest.fixture
def strength(monkeypatch: pytest.MonkeyPatch) -> dict[str, tuple[float, float]]:
    """Where sliders of that label are."""
    places: dict[str, tuple[float, float]] = {}
    real = slider.slide

    def noting(label: str, *args: Any) -> float:
        result = real(label, *args)
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        places[label] = (low.x + high.x) / 2, (low.y + high.y) / 2
        return result

    monkeypatch.setattr(slider, "slide", noting)
    return places


def test_the_exposure_moves_by_steps_that_an_eye_sees(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.frames()
    dragged(desk, where["exposure"], 22)
    assert desk.session.display.exposure == pytest.approx(22 * 16 / SPAN_PX, rel=1e-5), "a bit more than a stop"
    dragged(desk, where["exposure"], 2000)
    assert desk.session.display.exposure == 24, "all that is legal can be reached"


def test_a_texel_density_is_cut_once_when_it_is_let_go(desk: Desk, strength: dict[str, tuple[float, float]]) -> None:
    session = desk.session
    desk.front("Materials")
    dragged(desk, strength["##density"], DECADE_PX * 0.30103)
    desk.frames(2)
    assert [call[0] for call in session.calls].count("change_surfaces") == 1
    assert dict(session.surfaces.scales)["white wall", 0] == 2.0, "as it is shown: three digits"
    assert desk.ui.state.edits.undoable == "texel density of white wall"
    desk.click(*strength["##density"], button=1)
    assert session.surfaces.scales == (), "as in the file"


def test_shift_is_fine(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.frames()
    desk.ui.io.add_key_event(imgui.Key.mod_shift, True)
    dragged(desk, where["exposure"], 22)
    desk.ui.io.add_key_event(imgui.Key.mod_shift, False)
    assert desk.session.display.exposure == pytest.approx(2.2 * 16 / SPAN_PX, rel=1e-5)


def test_a_press_alone_moves_nothing(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.frames()
    before = desk.session.display
    desk.click(where["exposure"][0] + 40, where["exposure"][1])
    assert desk.session.display is before


@pytest.mark.parametrize("how", ["double click", "ctrl+click"])
def test_a_value_is_typed(desk: Desk, where: dict[str, tuple[float, float]], how: str) -> None:
    desk.frames()
    x, y = where["exposure"]
    if how == "double click":
        desk.click(x, y)
        desk.click(x, y)  # within Dear ImGui's time
    else:
        desk.ask_to_type(x, y)
    desk.frames(2)
    assert desk.ui.io.want_text_input
    desk.ui.io.add_input_characters_utf8("-3.25")
    desk.key(imgui.Key.enter)
    assert desk.session.display.exposure == -3.25


def test_a_typed_value_is_a_legal_one(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    desk.frames()
    x, y = where["exposure"]
    desk.click(x, y)
    desk.click(x, y)
    desk.frames(2)
    desk.ui.io.add_input_characters_utf8("99")
    desk.key(imgui.Key.enter)
    assert desk.session.display.exposure == 24


def test_a_lamp_is_dimmed_by_factors(desk: Desk, strength: dict[str, tuple[float, float]]) -> None:
    desk.ui.state.material = 3
    desk.session.display = DisplayOptions(quantities="radiometric")
    imgui.set_window_focus("Materials")
    desk.frames(4)
    dragged(desk, strength["##strength"], 40)
    assert max(desk.session.scene.materials[3].emission) == pytest.approx(17 * 10 ** (40 / DECADE_PX), rel=1e-4)
    dragged(desk, strength["##strength"], -3000)
    assert max(desk.session.scene.materials[3].emission) == 0.0, "off"
    dragged(desk, strength["##strength"], 8)
    emission = desk.session.scene.materials[3].emission
    assert emission == pytest.approx([c / 17 * 10 ** (8 / DECADE_PX) for c in (17, 12, 4)], rel=1e-4), (
        "from 1, same colour"
    )


def test_the_top_of_false_colour_is_dragged_from_what_it_is(desk: Desk, where: dict[str, tuple[float, float]]) -> None:
    """Automatic it is 400 lx; a tenth of a decade more is 504."""
    desk.session.display = DisplayOptions(false_colour="illuminance")
    desk.session.scale = (0.4, 400.0)
    desk.frames(2)
    dragged(desk, where["false_colour_max"], DECADE_PX / 10)
    assert desk.session.display.false_colour_max == pytest.approx(400 * 10**0.1, rel=1e-3)


def test_a_light_is_as_strong_as_it_is_dragged(desk: Desk, strength: dict[str, tuple[float, float]]) -> None:
    desk.session.scene.lights = (Light("a", intensity=(4.0, 2.0, 1.0)),)
    desk.session.set_lights = lambda lights: setattr(desk.session.scene, "lights", lights)  # type: ignore[attr-defined]
    imgui.set_window_focus("Lights")
    desk.frames(4)
    dragged(desk, strength["##strength"], DECADE_PX / 2)
    dragged(desk, strength["##Radius"], 30)
    (light,) = desk.session.scene.lights
    assert light.intensity == pytest.approx([c * 10**0.5 for c in (4, 2, 1)], rel=1e-4)
    assert light.radius == pytest.approx(30 / SPAN_PX * 0.1 * 3**0.5, rel=1e-4)


@pytest.mark.parametrize(
    ("ends", "start", "px", "expected"),
    [
        (Range(0, 4, multiple=1), 1, STEP_PX, 2),
        (Range(0, 4, multiple=1), 1, 0.4 * STEP_PX, 1),
        (Range(64, 2048, multiple=64, logarithmic=True), 256, DECADE_PX * 0.301, 512),
        (Range(64, 2048, multiple=64, logarithmic=True), 256, 9999, 2048),
        (Range(0, 65536, multiple=1, logarithmic=True), 1024, DECADE_PX, 10240),
        (Range(0, 1e9, logarithmic=True, start=400.0), 0, DECADE_PX, 4000),
        (Range(0, 1e9, logarithmic=True), 1e-3, -2 * DECADE_PX, 0),
        (Range(1e-9, 1, logarithmic=True), 1e-3, -DECADE_PX, 1e-4),
        (Range(0, 360), 90, SPAN_PX / 4, 180),
    ],
)
def test_places_on_a_slider(ends: Range, start: float, px: float, expected: float) -> None:
    assert ends.value(ends.position(start) + px) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("low", [0.0, 1e-9])
def test_what_is_at_its_end_comes_back_at_once(low: float) -> None:
    """However far a hand went beyond."""
    ends = Range(low, 1.0, logarithmic=True)
    lowest, highest = ends.reach
    assert ends.value(lowest) == low and ends.value(highest) == 1.0
    assert ends.value(lowest + 2) > low and ends.value(highest - 2) < 1.0
