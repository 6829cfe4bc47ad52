"""Plots: zoomed, moved, put back, and read under the pointer; in small windows one at a time."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from desks import Desk, desk, session, where
from fake_session import FakeSession
from imgui_bundle import imgui, implot

from app.gpu import Gpu
from app.ui import layout, plots, theme

__all__ = ["desk", "session", "where"]


@pytest.fixture
def ends(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Of the plots that were drawn last: where each lies, and between what its axes reach."""
    known: dict[str, Any] = {}
    names: list[str] = []
    begin, end = implot.begin_plot, implot.end_plot

    def begun(name: str, *more: Any) -> bool:
        names.append(name.strip("#"))
        return bool(begin(name, *more))

    def ended() -> None:
        low, size, limits = implot.get_plot_pos(), implot.get_plot_size(), implot.get_plot_limits()
        known[names[-1]] = (
            (low.x + size.x / 2, low.y + size.y / 2),
            (limits.x.min, limits.x.max, limits.y.min, limits.y.max),
            size.x,
        )
        end()

    monkeypatch.setattr(implot, "begin_plot", begun)
    monkeypatch.setattr(implot, "end_plot", ended)
    return known


@pytest.mark.parametrize("name", ["remaining", "energy"])
def test_a_plot_is_zoomed_and_put_back(desk: Desk, ends: dict[str, Any], name: str) -> None:
    desk.frames(2)
    place, first, _ = ends[name]
    desk.point(*place)
    desk.frames(2)
    for _ in range(4):
        desk.ui.io.add_mouse_wheel_event(0, 1)
        desk.frames(2)
    zoomed = ends[name][1]
    assert zoomed[1] - zoomed[0] < 0.8 * (first[1] - first[0]) and zoomed[3] - zoomed[2] < 0.9 * (first[3] - first[2])
    desk.frames(10)
    assert ends[name][1] == zoomed, "it stays, whatever the curves do"
    other = "energy" if name == "remaining" else "remaining"
    assert other not in desk.ui.state.zooms.zoomed
    desk.drag(place, (place[0] + 40, place[1]))
    desk.frames(2)
    assert ends[name][1][0] < zoomed[0], "dragged"
    desk.frames(1, seconds=1.0)
    desk.click(*place)
    desk.click(*place)
    desk.frames(2)
    assert ends[name][1] == pytest.approx(first), "a double click"


def test_values_are_read_under_the_pointer(desk: Desk, ends: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    monkeypatch.setattr(imgui, "set_tooltip", told.append)
    desk.frames(2)
    x, y = ends["energy"][0]
    desk.point(x, y)
    desk.frames(2)
    shots = int(told[-1].split()[0])
    assert abs(shots - 29.5) < 2, "in the middle of sixty"
    left = 0.93**shots
    assert told[-1].splitlines()[1:] == [
        f"absorbed: {90 * (1 - left):.1f} %",
        f"escaped: {10 * (1 - left):.2f} %",
        f"unshot: {100 * left:.1f} %",
    ]


def test_a_reading_without_curves_is_none() -> None:
    empty = np.zeros(0)
    assert plots.read({"a": (empty, empty, theme.TEXT)}, 3.0, "shots", str) == ([], 3.0)


@pytest.mark.parametrize(
    ("size", "shown"), [((900, 600), 1), ((640, 480), 1), ((1280, 720), 2), ((2560, 1440), 2)], ids=str
)
def test_in_a_small_window_there_is_one_plot(
    gpu: Gpu,
    ends: dict[str, Any],
    where: dict[str, Any],
    monkeypatch: pytest.MonkeyPatch,
    size: tuple[int, int],
    shown: int,
) -> None:
    """A legend does not fit above or in one of half the width; the other is a click away."""
    small: list[tuple[float, float]] = []
    real = imgui.small_button

    def noting(label: str) -> bool:
        result = real(label)
        if label in ("Energy", "Unshot"):
            low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            small.append(((low.x + high.x) / 2, (low.y + high.y) / 2))
        return bool(result)

    monkeypatch.setattr(imgui, "small_button", noting)
    desk = Desk(gpu, FakeSession(), size)
    ends.clear()
    desk.frames(2)
    assert len(ends) == shown
    if shown == 1:
        assert set(ends) == {"remaining"}
        desk.click(*small[-1])
        ends.clear()
        desk.frames(2)
        assert set(ends) == {"energy"}
    desk.release()


@pytest.mark.parametrize("size", [(640, 480), (900, 600), (1280, 720), (1280, 1000)], ids=str)
def test_a_legend_lies_beside_its_curves(gpu: Gpu, monkeypatch: pytest.MonkeyPatch, size: tuple[int, int]) -> None:
    """However low the plot is, and the plot still has most of its height."""
    found: list[tuple[float, float, float]] = []
    real = implot.end_plot

    def ended() -> None:
        plot, legend = (
            implot.internal.get_current_plot().plot_rect,
            implot.internal.get_current_plot().items.legend.rect,
        )
        found.append((legend.max.y, plot.min.y, plot.max.y - plot.min.y))
        real()

    monkeypatch.setattr(implot, "end_plot", ended)
    desk = Desk(gpu, FakeSession(), size)
    for compared in (False, True):
        if compared:
            desk.session.compare()
        desk.front("Convergence")
        found.clear()
        desk.frames(2)
        assert found and all(legend <= plot + 1 and height > 40 for legend, plot, height in found)
    desk.release()


@pytest.mark.parametrize(("size", "share"), [((900, 600), 0.6), ((640, 480), 0.55), ((1280, 720), 0.5)], ids=str)
def test_the_view_has_most_of_a_small_window(gpu: Gpu, size: tuple[int, int], share: float) -> None:
    """Its width; below, all panels are in one column beside it, and each can be reached."""
    desk = Desk(gpu, FakeSession(), size)
    assert desk.ui.state.view_px[2] >= share * size[0]
    for panel in layout.PANELS:
        imgui.set_window_focus(panel.title)
        desk.frames(2)
        window = imgui.internal.find_window_by_name(panel.title)
        assert not window.hidden and window.dock_id, panel.title
        assert window.pos.x >= 0 and window.pos.x + window.size.x <= size[0] and window.size.x >= 250
    desk.release()


def test_ticks_do_not_collide(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """A low plot has few."""
    counts: dict[int, int] = {}
    real = implot.setup_axis_ticks
    for height in (600, 720, 1440):
        monkeypatch.setattr(
            implot, "setup_axis_ticks", lambda *args, h=height: (counts.__setitem__(h, args[3]), real(*args))[1]
        )
        desk = Desk(gpu, FakeSession(), (1400, height))
        desk.release()
    assert counts[1440] == 6 and counts[600] <= counts[720] <= 3


def test_a_curve_of_one_point_has_an_axis_of_whole_numbers(desk: Desk, ends: dict[str, Any]) -> None:
    column = desk.session.history.column
    desk.session.history.column = lambda name: column(name)[:1]  # type: ignore[method-assign]
    desk.frames(2)
    assert ends["energy"][1][:2] == (0.0, 10.0)
