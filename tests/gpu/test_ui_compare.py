"""The Compare panel, the line of a split view, the keys without a reference, and files that are dropped."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from desks import PICKED, VIEW, Desk, desk, session, where
from imgui_bundle import imgui

from app.compare.options import ReferenceOptions
from app.options import Options
from app.ui import divider, theme, widgets
from app.ui.panels import compare

__all__ = ["desk", "session", "where"]


@pytest.fixture
def panel(desk: Desk) -> Desk:
    """The panel is in front."""
    imgui.set_window_focus("Compare")
    desk.frames(4)
    return desk


@pytest.fixture
def compared(panel: Desk) -> Desk:
    panel.session.compare()
    panel.frames(2)
    return panel


def test_views_are_a_button_each(compared: Desk, where: dict[str, tuple[float, float]]) -> None:
    compared.session.display = compared.session.display.replace(layer="irradiance")
    compared.frames()
    for view in ("Reference", "Split", "Error", "Solution"):
        compared.click(*where[view])
        assert compare.shown(compared.session) == view.lower()  # type: ignore[arg-type]
    assert compared.session.display.layer == "irradiance", "what was shown before the error"


def test_the_error_is_shown_as_it_was_measured(compared: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[tuple[str, str]] = []
    monkeypatch.setattr("app.ui.widgets.facts", lambda name, rows: told.extend(rows))
    compared.frames()
    assert {("RMS", "4.12 %"), ("Median", "0.93 %"), ("90 % below", "7.14 %"), ("Bias", "-0.31 %")} <= set(told)
    assert {("From", "bake reference"), ("Texels", "124,816"), ("Unshot", "0.010 %")} <= set(told)


def test_a_reference_brings_its_panel_to_the_front(desk: Desk) -> None:
    window = imgui.internal.find_window_by_name("Compare")
    assert window.hidden
    desk.session.compare()
    desk.frames(3)
    assert not window.hidden
    imgui.set_window_focus("Inspect")
    desk.frames(3)
    assert window.hidden, "only when it comes"


def test_a_picked_texel_has_its_reference(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    desk.ui.state.picked = PICKED  # type: ignore[assignment]
    desk.session.display = desk.session.display.replace(quantities="radiometric")
    told: list[float] = []
    real = widgets.number
    monkeypatch.setattr(widgets, "number", lambda value, *more: told.append(value) or real(value, *more))
    desk.frames()
    assert 16.125 not in told
    desk.session.compare()
    desk.frames(3)
    imgui.set_window_focus("Inspect")
    desk.frames(3)
    assert 16.125 in told


def test_references_are_asked_for(panel: Desk, where: dict[str, tuple[float, float]]) -> None:
    panel.frames()
    panel.click(*where["background"])
    assert panel.session.calls == [("solve_reference", ReferenceOptions())]
    panel.session.compared.fetching = SimpleNamespace(stage="12 shots", fraction=0.3)
    panel.frames()
    panel.click(*where["Stop"])
    assert panel.session.calls[-1] == ("stop_fetching",)
    panel.click(*where["Forget"])
    assert panel.session.calls[-1] == ("stop_fetching",), "there is nothing to forget"
    panel.session.compare()
    panel.frames()
    panel.click(*where["Forget"])
    assert panel.session.calls[-1] == ("drop_reference",)
    panel.click(*where["..."])
    assert imgui.is_popup_open("", imgui.PopupFlags_.any_popup_id | imgui.PopupFlags_.any_popup_level)


@pytest.mark.parametrize("key", [imgui.Key.c, imgui.Key.v, imgui.Key.x], ids=lambda key: key.name)
def test_keys_without_a_reference_say_so(desk: Desk, key: imgui.Key) -> None:
    before = desk.session.display
    desk.key(key)
    assert desk.session.display == before
    assert any("no reference yet" in toast.text for toast in desk.ui.state.toasts)


def test_the_line_is_dragged_and_nothing_else(compared: Desk) -> None:
    session = compared.session
    session.display = session.display.replace(show="split", split=0.5)
    compared.frames()
    left, top, width, height = compared.ui.state.view_px
    eye = session.camera.eye.copy()
    compared.drag((left + width / 2, top + height / 3), (left + 0.8 * width, top + height / 3))
    assert session.display.split == pytest.approx(0.8, abs=1 / width)
    assert (session.camera.eye == eye).all() and ("pick",) not in [call[:1] for call in session.calls]
    compared.drag((left + 0.8 * width, top + height / 3), (left + 2 * width, top + height / 3))
    assert session.display.split == 1.0
    compared.drag(VIEW, (VIEW[0] + 60, VIEW[1]))  # away from the line
    assert session.display.split == 1.0 and (session.camera.eye != eye).any()


def test_a_hand_holds_the_line(compared: Desk) -> None:
    compared.session.display = compared.session.display.replace(show="split")
    left, top, width, height = compared.ui.state.view_px
    compared.point(left + width / 2, top + height / 3)
    assert not compared.ui.held
    compared.press(0, True)
    assert compared.ui.held
    compared.press(0, False)
    assert not compared.ui.held


@pytest.mark.parametrize(("split", "named"), [(0.02, ["reference"]), (0.5, ["solution", "reference"])])
def test_both_sides_are_named_where_there_is_room(
    compared: Desk, split: float, named: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    texts: list[str] = []
    real = divider.imgui.get_background_draw_list

    def noting():
        lines = real()
        return SimpleNamespace(
            add_line=lines.add_line,
            add_circle_filled=lines.add_circle_filled,
            add_text=lambda place, colour, text: texts.append(text),
        )

    monkeypatch.setattr(divider, "imgui", SimpleNamespace(**vars(imgui) | {"get_background_draw_list": noting}))
    compared.session.display = compared.session.display.replace(show="split", split=split)
    compared.frames()
    assert list(dict.fromkeys(texts)) == named


def test_the_error_curve_is_in_the_plot(desk: Desk) -> None:
    def colours(rgba: theme.RGBA) -> int:
        """Pixels of a line's colour in the lower dock."""
        left, top, width, height = (int(v) for v in desk.ui.state.view_px)
        dock = desk.image()[top + height :, left : left + width].astype(int)
        return int((np.abs(dock - 255 * np.array(rgba[:3])).max(axis=-1) < 8).sum())

    assert colours(theme.RMS) == 0
    desk.session.compare()
    desk.frames(2)
    assert colours(theme.RMS) > 50  # some are in the legend


@pytest.mark.parametrize(
    ("name", "opened", "call"),
    [
        ("a.exr", True, "open_reference"),
        ("a.EXR", True, "open_reference"),
        ("a.glb", True, "open"),
        ("a.exr", False, "open"),
    ],
)
def test_dropped_files_are_opened(desk: Desk, name: str, opened: bool, call: str) -> None:
    desk.session.opened = opened
    desk.ui.drop(desk.session, Path(name))  # type: ignore[arg-type]
    desk.frames()
    assert desk.session.calls == [(call, name)]


def test_the_error_layer_needs_a_reference(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    real, session = widgets.edit_options, desk.session

    def chosen(options: Options, **more: Any) -> Options:
        """The user chooses it in the Display panel."""
        return options.replace(layer="error") if options is session.display else real(options, **more)

    monkeypatch.setattr(widgets, "edit_options", chosen)
    desk.frames()
    assert session.display.layer == "combined" and desk.ui.state.toasts
    session.compare()
    desk.frames()
    assert session.display.layer == "error"
