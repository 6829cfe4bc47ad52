"""Values that are read: in one unit everywhere, under the pointer, and copied by a click."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from desks import PICKED, VIEW, Desk, desk, session
from imgui_bundle import imgui

from app.ui import pointer, widgets
from app.ui.panels import energy

__all__ = ["desk", "session"]

H = 683 * (16 * 0.2126 + 11 * 0.7152 + 3 * 0.0722)  # lx, of PICKED
B = 683 * (12 * 0.2126 + 8 * 0.7152 + 2 * 0.0722)  # lm/m²


@pytest.fixture
def copies(monkeypatch: pytest.MonkeyPatch) -> dict[str, tuple[float, float]]:
    """Where texts are that a click copies."""
    places: dict[str, tuple[float, float]] = {}
    real = widgets.copied_by_click

    def noting(text: str) -> None:
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        places[text] = (low.x + high.x) / 2, (low.y + high.y) / 2
        real(text)

    monkeypatch.setattr(widgets, "copied_by_click", noting)
    return places


def picked(desk: Desk) -> None:
    desk.ui.state.picked = PICKED  # type: ignore[assignment]
    imgui.set_window_focus("Inspect")
    desk.frames(4)


def test_what_is_inspected_is_in_lux_or_in_watts(desk: Desk, copies: dict[str, tuple[float, float]]) -> None:
    picked(desk)
    assert {f"{H:,.0f} lx", f"{B:,.0f} lm/m²", f"{B / np.pi:,.0f} cd/m²", "70.0 %"} <= set(copies)
    desk.session.display = desk.session.display.replace(quantities="radiometric")
    copies.clear()
    desk.frames(2)
    assert {"16.00", "11.00", "3.000", "0.7000"} <= set(copies) and not any("lx" in text for text in copies)


@pytest.mark.parametrize("where", ["energy", "inspect", "status", "statistics"])
def test_values_are_copied_by_a_click(desk: Desk, copies: dict[str, tuple[float, float]], where: str) -> None:
    """Numbers without what groups their digits, for other programs to read."""
    picked(desk)
    tab = {"statistics": "Scene", "energy": "Solver"}
    if where in tab:
        imgui.set_window_focus(tab[where])
        desk.frames(4)
    energy = widgets.number(683 * desk.session.stats.emitted / 3)
    shown, copied = {
        "energy": (energy, energy.replace(",", "")),
        "inspect": (f"{B:,.0f} lm/m²", f"{B:.0f} lm/m²"),
        "status": ("60 shots", "60 shots"),
        "statistics": ("31,204", "31204"),
    }[where]
    desk.click(*copies[shown])
    assert imgui.get_clipboard_text() == copied


def test_a_click_beside_a_value_copies_nothing(desk: Desk, copies: dict[str, tuple[float, float]]) -> None:
    picked(desk)
    imgui.set_clipboard_text("before")
    x, y = copies["60 shots"]
    desk.click(x, y - 40)
    assert imgui.get_clipboard_text() == "before"


def test_the_light_under_the_pointer_is_in_the_status_bar(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    desk.session.picked = PICKED
    desk.point(*VIEW)
    desk.frames(15)
    assert pointer.in_words(desk.session, desk.ui.state) == (f"{H:,.0f} lx", f"{B / np.pi:,.0f} cd/m²", "white wall")
    desk.session.display = desk.session.display.replace(quantities="radiometric")
    assert pointer.in_words(desk.session, desk.ui.state)[0] == f"{H / 683:.1f} W/m²"
    assert ("pick",) not in [call[:1] for call in desk.session.calls] and desk.ui.state.picked is None
    desk.point(5, 300)
    desk.frames()
    assert pointer.in_words(desk.session, desk.ui.state) == (), "it is over a panel"


def test_the_scale_is_read_beside_the_pointer(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    monkeypatch.setattr(imgui, "set_tooltip", told.append)
    desk.session.picked, desk.session.scale = PICKED, (1.0, 3000.0)
    desk.point(*VIEW)
    desk.frames(15)
    assert told == []
    desk.session.display = desk.session.display.replace(false_colour="illuminance")
    desk.frames(2)
    assert told[-1] == f"{H:,.0f} lx"


def test_looking_is_cheap(desk: Desk) -> None:
    """At rest it is looked once at each place; while light moves, a few times a second; while the eye moves, never."""
    looks: list[tuple[int, int]] = []
    desk.session.under = lambda x, y: looks.append((x, y))  # type: ignore[method-assign]
    desk.session.running = False
    desk.point(*VIEW)
    desk.frames(120)
    assert len(looks) == 1
    desk.session.running = True
    desk.frames(120)
    assert 8 <= len(looks) <= 16, "in two seconds"
    desk.press(1, True)
    before = len(looks)
    for step in range(20):
        desk.point(VIEW[0] + step, VIEW[1])
    assert len(looks) == before


def test_the_last_shooter_is_drawn_anew_only_where_light_moved(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    session, made, inspect = desk.session, list[object](), desk.session.inspect
    monkeypatch.setattr(type(session), "solver", session.solver)  # another each time it is asked for
    monkeypatch.setattr(session, "inspect", lambda texel=None: made.append(texel) or inspect(texel))
    desk.frames(60)
    made.clear()
    desk.frames(60)
    assert not made
    session.state = "of other light"
    desk.frames(60)
    assert len(made) == 1


def test_a_pick_selects_the_material(desk: Desk) -> None:
    desk.session.picked = type(PICKED)(**vars(PICKED) | {"material": 2})
    desk.click(*VIEW)
    assert desk.ui.state.material == 2 and desk.ui.state.reveal_material
    imgui.set_window_focus("Materials")
    desk.frames(3)
    assert not desk.ui.state.reveal_material, "the list has scrolled to it"


def test_energy_is_in_the_same_units(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    sections: list[str] = []
    real: Callable[..., Any] = widgets.section
    monkeypatch.setattr(widgets, "section", lambda text: sections.append(text) or real(text))
    imgui.set_window_focus("Solver")
    desk.frames(3)
    assert "Energy [lm]" in sections
    power = np.array([3.0, 2.0, 1.0])
    assert energy._flux(power, desk.session) == pytest.approx(683 * power @ [0.2126, 0.7152, 0.0722])
    desk.session.display = desk.session.display.replace(quantities="radiometric")
    assert energy._flux(power, desk.session) == 6.0


def test_what_was_under_the_pointer_in_another_picture_is_not_said(desk: Desk) -> None:
    """Paused, with the pointer at rest: another scene or layer is looked at anew."""
    looks: list[object] = []
    desk.session.running = False
    desk.session.under = lambda x, y: looks.append((x, y))  # type: ignore[method-assign]
    desk.point(*VIEW)
    desk.frames(20)
    assert len(looks) == 1
    desk.session.reading = object()
    desk.frames(20)
    assert len(looks) == 2
    desk.ui.state.pointed = PICKED  # type: ignore[assignment]
    desk.session.lightmap = SimpleNamespace(space=desk.session.lightmap.space)
    desk.frames(1)
    assert desk.ui.state.pointed is None
