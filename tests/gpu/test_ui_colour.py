"""Colours in widgets: as the screen shows them, linear underneath."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from desks import Desk, desk, session, where
from fake_session import FakeScene
from imgui_bundle import imgui

from app.scene.lights import Light
from app.scene.model import MOST_ALBEDO, Texture
from app.ui import colour, slider, widgets

__all__ = ["desk", "session", "where"]

# hex code, and the linear Rec.709 that it means [IEC 61966-2-1]
KNOWN = (
    ("000000", (0.0, 0.0, 0.0)),
    ("808080", (0.215861, 0.215861, 0.215861)),
    ("FF8000", (0.99, 0.215861, 0.0)),  # the whitest that there is
    ("BC8F8F", (0.502886, 0.274677, 0.274677)),
    ("0A0B0C", (0.003035, 0.003347, 0.003677)),
)


def shown(code: str) -> tuple[float, float, float]:
    return colour.rgb(int(code[i : i + 2], 16) / 255 for i in (0, 2, 4))


@pytest.mark.parametrize(("code", "linear"), KNOWN)
def test_a_code_is_what_it_is_everywhere(code: str, linear: tuple[float, float, float]) -> None:
    there = colour.linear_from_screen(shown(code))
    assert [min(c, 0.99) for c in there] == pytest.approx(linear, abs=2e-6)
    assert colour.screen_from_linear(there) == pytest.approx(shown(code), abs=1e-6)


@pytest.mark.parametrize(("code", "linear"), KNOWN)
def test_a_code_that_is_typed_is_the_albedo(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, code: str, linear: tuple[float, float, float]
) -> None:
    places: list[tuple[float, float]] = []
    real = imgui.color_edit3

    def noting(label: str, *args: Any) -> Any:
        result = real(label, *args)
        if label == "##albedo":
            low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            places.append((high.x - 10, (low.y + high.y) / 2))
        return result

    monkeypatch.setattr(imgui, "color_edit3", noting)
    desk.front("Materials")
    desk.click(*places[-1])
    desk.key(imgui.Key.a, control=True)
    desk.ui.io.add_input_characters_utf8(f"#{code}")
    desk.frames(2)
    desk.key(imgui.Key.enter)
    albedo = desk.session.scene.materials[0].albedo
    assert albedo == pytest.approx(linear, abs=2e-6)


def test_list_picker_and_picture_show_the_same(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """The albedo layer shows sRGB of the albedo; so do the swatch in the list and the picker."""
    told: dict[str, list[list[float]]] = {"swatch": [], "picker": []}

    def edit(label: str, value: list[float], flags: int) -> tuple[bool, list[float]]:
        told["picker"] += [value] if label == "##albedo" else []
        return False, value

    def button(label: str, value: Any, *_: object) -> bool:
        told["swatch"].append([value.x, value.y, value.z])
        return False

    monkeypatch.setattr(imgui, "color_edit3", edit)
    monkeypatch.setattr(imgui, "color_button", button)
    desk.ui.state.material = 1
    desk.front("Materials")
    red = [0.815, 0.272, 0.247]  # sRGB of (0.63, 0.06, 0.05)
    assert told["picker"][-1] == pytest.approx(red, abs=2e-3)
    assert told["swatch"][1] == pytest.approx(told["picker"][-1], abs=1e-6)


def test_what_was_not_edited_keeps_all_its_digits(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    odd = (0.123456789, 0.7, 0.3)

    def edited(values: list[float]) -> tuple[float, float, float]:
        with monkeypatch.context() as hand:
            hand.setattr(imgui, "color_edit3", lambda *_: (True, values))
            return colour.edit_colour("x", odd)

    exact = colour.screen_from_linear(odd)
    rounded = [round(255 * c) / 255 for c in exact]
    assert edited([rounded[0], 0.0, rounded[2]]) == (odd[0], 0.0, odd[2]), "a code rounds what it does not change"
    assert edited([exact[0], exact[1], exact[2] + 0.001])[:2] == odd[:2]
    assert edited([exact[0], exact[1], exact[2] + 0.001])[2] == pytest.approx(0.3012, abs=1e-4)
    assert edited([float("nan"), 0.0, 0.0]) == odd


def test_a_lamp_has_the_colour_that_was_picked_and_its_strength(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    desk.ui.state.material = 3
    desk.session.scene.lights = (Light("a", intensity=(4.0, 4.0, 4.0)),)
    told: list[tuple[Light, ...]] = []
    desk.session.set_lights = told.append  # type: ignore[attr-defined]
    picked = list(shown("808000"))  # half as bright as the screen can: a lamp's colour is as bright as it can be

    monkeypatch.setattr(imgui, "color_edit3", lambda label, value, _: (True, picked if label != "##albedo" else value))
    desk.front("Materials")
    np.testing.assert_allclose(desk.session.scene.materials[3].emission, (17.0, 17.0, 0.0), rtol=1e-6)
    desk.front("Lights")
    np.testing.assert_allclose(told[-1][0].intensity, (4.0, 4.0, 0.0), rtol=1e-6)


def test_every_code_comes_back_as_it_was_typed() -> None:
    for step in range(256):
        there = colour.linear_from_screen((step / 255,) * 3)
        back = colour.screen_from_linear(there)
        assert [int(c * 255 + 0.5) for c in back] == [step] * 3, "as Dear ImGui rounds"


def test_what_is_more_than_a_surface_reflects_is_held_and_said(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """The code stays as it was typed; a line says that the albedo is held."""
    told: list[str] = []
    codes: list[list[float]] = []
    typed = shown("2040FF")
    monkeypatch.setattr(widgets, "dim", told.append)
    desk.front("Materials")
    told.clear()
    with monkeypatch.context() as hand:
        hand.setattr(imgui, "color_edit3", lambda label, now, _: (label == "##albedo", list(typed)))
        desk.frames(1)

    def noting(label: str, now: list[float], _: int) -> tuple[bool, list[float]]:
        codes.append(now)
        return False, now

    monkeypatch.setattr(imgui, "color_edit3", noting)
    desk.frames(2)
    assert desk.session.materials[0].albedo[2] == MOST_ALBEDO
    assert codes[0] == pytest.approx(typed) and any("no surface reflects more" in text for text in told)


def test_a_textured_material_shows_the_mean_of_its_picture(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    swatches: list[Any] = []
    pixels = np.zeros((4, 4, 3), np.float32)
    pixels[::2] = (0.4, 0.2, 0.0)
    material = replace(desk.session.materials[0], albedo=(0.5, 0.5, 0.5), albedo_texture=Texture("wood", pixels))
    session = desk.session
    session.unedited = FakeScene(**vars(session.unedited) | {"materials": (material, *session.materials[1:])})
    session.scene.materials = session.unedited.materials
    monkeypatch.setattr(colour, "swatch", lambda label, linear, side: swatches.append(linear))
    desk.front("Materials")
    assert swatches[0] == pytest.approx((0.1, 0.05, 0.0))


def test_materials_that_are_nowhere_are_not_listed(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """As those of a lamp that was removed."""
    rows: list[str] = []
    real = imgui.selectable
    monkeypatch.setattr(imgui, "selectable", lambda text, *more: (rows.append(text), real(text, *more))[1])
    session = desk.session
    session.unedited = FakeScene(**vars(session.unedited) | {"material_ids": np.array([0, 0, 2, 3])})
    desk.ui.state.material = 1
    desk.front("Materials")
    assert "red wall" not in rows and {"white wall", "green wall", "lamp"} <= set(rows)
    assert desk.ui.state.material == 0


def test_what_gives_no_light_has_no_temperature(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: dict[str, str] = {}
    told: list[str] = []
    real = slider.slide

    def slide(label: str, value: float, ends: Any, text: str) -> float:
        shown[label] = text
        return real(label, value, ends, text)

    monkeypatch.setattr(slider, "slide", slide)
    monkeypatch.setattr(widgets, "tooltip", told.append)
    desk.front("Materials")
    assert shown["##kelvin"] == "none" and any("it gives no light" in text for text in told)
    told.clear()
    desk.ui.state.material = 3
    desk.frames(2)
    assert shown["##kelvin"].endswith(" K") and not any("it gives no light" in text for text in told)
