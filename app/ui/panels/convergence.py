"""Convergence: what is unshot, error and energy over shots or seconds, and the time of each pass."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui, implot

from app.ui import theme, widgets
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

MOST_POINTS = 400  # per curve: more cannot be told apart in a panel
SMALLEST = 1e-6  # of the power emitted, for the logarithmic axis
PLOT_EM = 20.0  # width of a plot with its legend
TIMINGS_EM = 19.0  # width of the table of passes: the longest name and its bar
Curve = tuple[np.ndarray, np.ndarray, theme.RGBA]  # x, y, colour
AXES = ("work", "seconds")  # columns of the history
AXIS = int(implot.AxisFlags_.auto_fit | implot.AxisFlags_.no_highlight)
LEGEND = int(implot.LegendFlags_.no_menus | implot.LegendFlags_.outside | implot.LegendFlags_.horizontal)
PLOT = int(implot.Flags_.no_mouse_text | implot.Flags_.no_menus | implot.Flags_.no_box_select)


def draw(view: View, state: State) -> None:
    """The whole panel: what is shown, two plots side by side, and where there is room the passes to the right."""
    em, gap = imgui.get_font_size(), imgui.get_style().item_spacing.x
    passes = bool(view.session.timings) and state.measured
    beside = passes and imgui.get_content_region_avail().x > (2 * PLOT_EM + TIMINGS_EM) * em
    choices = (*AXES, "passes") if passes and not beside else AXES
    shown = state.plot if state.measured and state.plot in choices else "work"
    if state.measured:
        _choice(state, shown, choices)
    area = imgui.get_content_region_avail()
    if shown == "passes":
        _passes(view, imgui.ImVec2(area.x, area.y))
        return
    table = TIMINGS_EM * em if beside else 0.0
    _plots(
        view,
        imgui.ImVec2((area.x - (table + gap if table else 0.0) - gap) / 2, area.y),
        shown,
        None if state.measured else _axis(state, shown),
    )
    if table:
        imgui.same_line()
        _passes(view, imgui.ImVec2(table, area.y))


def _choice(state: State, shown: str, choices: tuple[str, ...]) -> None:
    """One line: what is plotted over, or the passes; and how fast it goes."""
    assert state.stats is not None
    for choice in choices:
        if imgui.radio_button(_axis(state, choice), shown == choice):
            state.plot = choice
        imgui.same_line()
    widgets.dim(f"{widgets.number(state.stats.per_second, 3)} {state.stats.unit}/s")


def _axis(state: State, column: str) -> str:
    """What a column of the history is called."""
    assert state.stats is not None
    return state.stats.unit if column == "work" else column


def _plots(view: View, size: imgui.ImVec2, column: str, label: str | None) -> None:
    """Over a column of the history; label: written below."""
    history = view.session.run.history
    rows = np.flatnonzero(np.isfinite(history.column("remaining")) & np.isfinite(history.column("absorbed")))
    chosen = _thinned(rows)
    x = history.column(column)[chosen]
    curves = {n: history.column(n)[chosen] for n in ("remaining", "absorbed", "escaped")}
    balanced = view.session.family.distributes
    alone = imgui.ImVec2(2 * size.x + imgui.get_style().item_spacing.x, size.y)
    _shares(size if balanced else alone, view, column, x, curves["remaining"], label)
    if balanced:
        imgui.same_line()
        _energy(size, x, curves, label)


def _thinned(rows: np.ndarray) -> np.ndarray:
    """MOST_POINTS of these at most, evenly, with the first and the last."""
    return np.asarray(rows[np.unique(np.linspace(0, max(len(rows) - 1, 0), min(len(rows), MOST_POINTS)).astype(int))])


def _begin(name: str, size: imgui.ImVec2, label: str | None) -> bool:
    """The legend stands above the plot, in place of a title."""
    if not implot.begin_plot(f"##{name}", size, PLOT):
        return False
    implot.setup_axis(implot.ImAxis_.x1, label, AXIS)
    implot.setup_legend(implot.Location_.north, LEGEND)
    return True


def _shares(
    size: imgui.ImVec2, view: View, column: str, x: np.ndarray, residual: np.ndarray, label: str | None
) -> None:
    """What remains, and beside it the error where there is a reference, in logarithms [fraction]."""
    if not _begin("residual", size, label):
        return
    family = view.session.family
    name, of = family.remains, "emitted" if family.distributes else family.part_of
    curves: dict[str, Curve] = {f"{name} / {of}": (x, residual, theme.AMBER)}
    if view.session.compared.comparison is not None:
        curves = {name: (x, residual, theme.AMBER)}  # all three names fit above the plot
        rows = view.session.compared.comparison.errors
        chosen = _thinned(np.flatnonzero(np.isfinite(rows.column("rms"))))
        for name, error, colour in (("RMS error", "rms", theme.RMS), ("median error", "median", theme.MEDIAN)):
            curves[name] = rows.column(column)[chosen], rows.column(error)[chosen], colour
    lowest = min(float(values.min(initial=1.0)) for _, values, _ in curves.values())
    highest = max(float(values.max(initial=1.0)) for _, values, _ in curves.values())
    decade = 10.0 ** min(np.floor(np.log10(max(lowest, SMALLEST))), -1.0)  # whole decades, at least one
    implot.setup_axis(implot.ImAxis_.y1, None, int(implot.AxisFlags_.no_highlight))
    implot.setup_axis_scale(implot.ImAxis_.y1, implot.Scale_.log10)
    implot.setup_axis_limits(implot.ImAxis_.y1, decade, highest, implot.Cond_.always)
    for name, (over, values, colour) in curves.items():
        if len(over):
            alone = implot.Marker_.circle if len(over) == 1 else implot.Marker_.none
            line = implot.Spec(line_color=imgui.ImVec4(*colour), line_weight=2.0, marker=alone)
            implot.plot_line(name, over, np.maximum(values, SMALLEST), line)
    implot.end_plot()


def _energy(size: imgui.ImVec2, x: np.ndarray, curves: dict[str, np.ndarray], label: str | None) -> None:
    """Where the emitted power is, stacked: absorbed, escaped, unshot [fraction]."""
    if _begin("energy", size, label):
        implot.setup_axis(implot.ImAxis_.y1, None, int(implot.AxisFlags_.no_highlight))
        implot.setup_axis_limits(implot.ImAxis_.y1, 0.0, 1.0, implot.Cond_.always)
        names = (("absorbed", theme.ABSORBED), ("escaped", theme.ESCAPED), ("unshot", theme.UNSHOT))
        lower = np.zeros_like(x)
        for name, colour in names:
            upper = lower + curves["remaining" if name == "unshot" else name]
            if len(x):
                implot.plot_shaded(name, x, lower, upper, implot.Spec(fill_color=imgui.ImVec4(*colour), fill_alpha=0.7))
            lower = upper
        implot.end_plot()


def _passes(view: View, size: imgui.ImVec2) -> None:
    """Milliseconds of each pass, in as many columns as there is room for; whole rows only."""
    timings = list(view.session.timings.items())
    columns = max(int(size.x // (TIMINGS_EM * imgui.get_font_size())), 1)
    row = imgui.get_text_line_height() + 2 * imgui.get_style().cell_padding.y
    height = max(size.y // row, 1) * row
    flags = imgui.TableFlags_.sizing_stretch_prop | imgui.TableFlags_.row_bg | imgui.TableFlags_.scroll_y
    if not imgui.begin_table("timings", 2 * columns, flags, imgui.ImVec2(size.x, height)):
        return
    imgui.push_style_var(imgui.StyleVar_.frame_padding, imgui.ImVec2(0, 0))  # a bar would push the next label down
    for column in range(columns):
        imgui.table_setup_column(f"pass {column}", imgui.TableColumnFlags_.width_fixed)
        imgui.table_setup_column(f"ms {column}", imgui.TableColumnFlags_.width_stretch)
    longest = max(view.session.timings.values())
    for label, ms in timings:
        imgui.table_next_column()
        imgui.text_unformatted(label)
        imgui.table_next_column()
        line = imgui.ImVec2(-1, imgui.get_text_line_height())
        imgui.progress_bar(ms / longest if longest > 0 else 0.0, line, f"{ms:.2f} ms")
    imgui.pop_style_var()
    imgui.end_table()
