"""Convergence: residual and energy over shots or seconds, and the time of each pass."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui, implot

from app.ui import theme, widgets
from app.ui.state import State

if TYPE_CHECKING:
    from app.session import Session

MOST_POINTS = 400  # per curve: more cannot be told apart in a panel
SMALLEST = 1e-6  # of the power emitted, for the logarithmic axis
LEGEND_EM = 20.0  # a narrower plot has no legend: the colours are those of the Solver panel
TIMINGS_EM = 19.0  # width of the table of passes: the longest name and its bar
AXIS = int(implot.AxisFlags_.auto_fit | implot.AxisFlags_.no_highlight)
NO_LEGEND = int(implot.Flags_.no_legend)
PLOT = int(implot.Flags_.no_mouse_text | implot.Flags_.no_menus | implot.Flags_.no_box_select)


def draw(session: Session, state: State) -> None:
    """The whole panel: two plots side by side, and the passes to the right."""
    history = session.history
    rows = np.flatnonzero(np.isfinite(history.column("residual")) & np.isfinite(history.column("absorbed")))
    chosen = rows[np.unique(np.linspace(0, max(len(rows) - 1, 0), min(len(rows), MOST_POINTS)).astype(int))]
    over_seconds = state.plot_over_seconds and state.measured
    x = history.column("seconds" if over_seconds else "shots")[chosen]
    curves = {n: history.column(n)[chosen] for n in ("residual", "absorbed", "escaped")}
    area = imgui.get_content_region_avail()
    table = imgui.get_font_size() * TIMINGS_EM if session.timings and state.measured else 0.0
    gap = imgui.get_style().item_spacing.x
    size = imgui.ImVec2((area.x - (table + gap if table else 0.0) - gap) / 2, area.y)
    label = "seconds" if over_seconds else "shots"
    _residual(size, x, curves["residual"], label)
    imgui.same_line()
    _energy(size, x, curves, label)
    if table:
        imgui.same_line()
        imgui.begin_child("passes", imgui.ImVec2(table, area.y))
        _passes(session, state)
        imgui.end_child()


def _begin(name: str, size: imgui.ImVec2, label: str) -> bool:
    flags = PLOT if size.x > LEGEND_EM * imgui.get_font_size() else PLOT | NO_LEGEND
    if not implot.begin_plot(name, size, flags):
        return False
    implot.setup_axis(implot.ImAxis_.x1, label, AXIS)
    implot.setup_legend(implot.Location_.south_east, int(implot.LegendFlags_.no_menus))
    return True


def _residual(size: imgui.ImVec2, x: np.ndarray, residual: np.ndarray, label: str) -> None:
    if _begin("Residual / emitted", size, label):
        lowest = max(float(residual.min(initial=1.0)), SMALLEST)
        decade = 10.0 ** min(np.floor(np.log10(lowest)), -1.0)  # whole decades, at least one
        implot.setup_axis(implot.ImAxis_.y1, None, int(implot.AxisFlags_.no_highlight))
        implot.setup_axis_scale(implot.ImAxis_.y1, implot.Scale_.log10)
        implot.setup_axis_limits(implot.ImAxis_.y1, decade, 1.0, implot.Cond_.always)
        if len(x):
            line = implot.Spec(line_color=imgui.ImVec4(*theme.AMBER), line_weight=2.0)
            implot.plot_line("residual", x, np.maximum(residual, SMALLEST), line)
        implot.end_plot()


def _energy(size: imgui.ImVec2, x: np.ndarray, curves: dict[str, np.ndarray], label: str) -> None:
    """Where the emitted power is, stacked: absorbed, escaped, residual [fraction]."""
    if _begin("Energy / emitted", size, label):
        implot.setup_axis(implot.ImAxis_.y1, None, int(implot.AxisFlags_.no_highlight))
        implot.setup_axis_limits(implot.ImAxis_.y1, 0.0, 1.0, implot.Cond_.always)
        names = (("absorbed", theme.ABSORBED), ("escaped", theme.ESCAPED), ("residual", theme.UNSHOT))
        lower = np.zeros_like(x)
        for name, colour in names:
            upper = lower + curves[name]
            if len(x):
                implot.plot_shaded(name, x, lower, upper, implot.Spec(fill_color=imgui.ImVec4(*colour), fill_alpha=0.7))
            lower = upper
        implot.end_plot()


def _passes(session: Session, state: State) -> None:
    over = state.plot_over_seconds
    if imgui.radio_button("shots", not over):
        state.plot_over_seconds = False
    imgui.same_line()
    if imgui.radio_button("seconds", over):
        state.plot_over_seconds = True
    imgui.same_line()
    widgets.dim(f"{widgets.number(session.history.shots_per_second, 3)} shots/s")
    if not imgui.begin_table("timings", 2, imgui.TableFlags_.sizing_stretch_prop | imgui.TableFlags_.row_bg):
        return
    imgui.table_setup_column("pass", imgui.TableColumnFlags_.width_fixed)
    imgui.table_setup_column("ms", imgui.TableColumnFlags_.width_stretch)
    longest = max(session.timings.values())
    for label, ms in session.timings.items():
        imgui.table_next_row()
        imgui.table_next_column()
        imgui.text_unformatted(label)
        imgui.table_next_column()
        height = imgui.get_text_line_height()
        imgui.progress_bar(ms / longest if longest > 0 else 0.0, imgui.ImVec2(-1, height), f"{ms:.2f} ms")
    imgui.end_table()
