"""Convergence: what is unshot, error and energy over shots or seconds, and the time of each pass."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui, implot

from app.ui import new_lamps, plots, theme, widgets
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

MOST_POINTS = 400  # per curve: more cannot be told apart in a panel
LEAST_WORK, LEAST_SECONDS = 10.0, 1.0  # ends of an axis, while there is hardly anything yet
SMALLEST = 1e-6  # of the power emitted, for the logarithmic axis
PLOT_EM = 20.0  # width of a plot with its legend
LEAST_EM = (
    18.0,
    22.0,
)  # width of one beside another: its legend just fits above it, and where it is low ticks are legible
TIMINGS_EM = 19.0  # width of the table of passes: the longest name and its bar
AXES = ("work", "seconds")  # columns of the history
PLOTS, BOTH = ("remaining", "energy"), "both"


def draw(view: View, state: State) -> None:
    """The whole panel: what is shown, two plots side by side or one, and where there is room the passes to the right."""
    if not new_lamps.is_lit(view, state):
        widgets.dim(f"{new_lamps.DARK}: there is nothing to plot")
        return
    em, gap = imgui.get_font_size(), imgui.get_style().item_spacing.x
    passes = bool(view.session.timings) and state.measured
    beside = passes and imgui.get_content_region_avail().x > (2 * PLOT_EM + TIMINGS_EM) * em
    choices = (*AXES, "passes") if passes and not beside else AXES
    shown = state.plot if state.measured and state.plot in choices else "work"
    which = _which(view, state, imgui.get_content_region_avail().x - (TIMINGS_EM * em + gap if beside else 0.0))
    if state.measured:
        _choice(state, shown, choices, one=which != BOTH and view.session.family.distributes)
    area = imgui.get_content_region_avail()
    if shown == "passes":
        _passes(view, imgui.ImVec2(area.x, area.y))
        return
    table = TIMINGS_EM * em if beside else 0.0
    size = imgui.ImVec2(area.x - (table + gap if table else 0.0), area.y)
    _plots(view, state, size, shown, None if state.measured else _axis(state, shown), which)
    if table:
        imgui.same_line()
        _passes(view, imgui.ImVec2(table, area.y))


def _which(view: View, state: State, width: float) -> str:
    """Both plots where there is room for their legends."""
    if not view.session.family.distributes:
        return "remaining"
    low = plots.is_low(imgui.get_content_region_avail().y - imgui.get_frame_height_with_spacing())
    return BOTH if width >= 2 * LEAST_EM[low] * imgui.get_font_size() else state.plot_alone


def _choice(state: State, shown: str, choices: tuple[str, ...], *, one: bool) -> None:
    """One line: what is plotted over, or the passes; how fast it goes, or which of the plots is shown."""
    assert state.stats is not None
    for choice in choices:
        if imgui.radio_button(_axis(state, choice), shown == choice):
            state.plot = choice
        imgui.same_line()
    if not one:
        widgets.dim(f"{widgets.number(state.stats.per_second, 3)}/s")
    elif imgui.small_button("Energy" if state.plot_alone == "remaining" else state.stats.remains.capitalize()):
        state.plot_alone = next(plot for plot in PLOTS if plot != state.plot_alone)


def _axis(state: State, column: str) -> str:
    """What a column of the history is called."""
    assert state.stats is not None
    return state.stats.unit if column == "work" else column


def _plots(view: View, state: State, size: imgui.ImVec2, column: str, label: str | None, which: str) -> None:
    """Over a column of the history; label: written below; which: one of PLOTS, or both side by side."""
    history = view.session.run.history
    rows = np.flatnonzero(np.isfinite(history.column("remaining")) & np.isfinite(history.column("absorbed")))
    chosen = _thinned(rows)
    x = history.column(column)[chosen]
    curves = {n: history.column(n)[chosen] for n in ("remaining", "absorbed", "escaped")}
    unit = _axis(state, column)
    half = imgui.ImVec2((size.x - imgui.get_style().item_spacing.x) / 2, size.y) if which == BOTH else size
    if which != "energy":
        _shares(view, state, half, column, x, curves["remaining"], label, unit)
    if which == BOTH:
        imgui.same_line()
    if which != "remaining":
        _energy(state, half, x, curves, label, unit)


def _thinned(rows: np.ndarray) -> np.ndarray:
    """MOST_POINTS of these at most, evenly, with the first and the last."""
    return np.asarray(rows[np.unique(np.linspace(0, max(len(rows) - 1, 0), min(len(rows), MOST_POINTS)).astype(int))])


def _ends(x: np.ndarray, unit: str) -> tuple[float, float]:
    """Of an axis: work is counted in whole numbers."""
    low, high = (float(x.min()), float(x.max())) if len(x) else (0.0, 0.0)
    return low, max(high, low + (LEAST_WORK if unit != "seconds" else LEAST_SECONDS))


def _shares(
    view: View,
    state: State,
    size: imgui.ImVec2,
    column: str,
    x: np.ndarray,
    residual: np.ndarray,
    label: str | None,
    unit: str,
) -> None:
    """What remains, and beside it the error where there is a reference, in logarithms [fraction]."""
    family = view.session.family
    name, of = family.remains, "emitted" if family.distributes else family.part_of
    curves: dict[str, plots.Curve] = {f"{name} / {of}": (x, residual, theme.AMBER)}
    if view.session.compared.comparison is not None:
        curves = {name: (x, residual, theme.AMBER)}  # all three names fit above the plot
        rows = view.session.compared.comparison.errors
        chosen = _thinned(np.flatnonzero(np.isfinite(rows.column("rms"))))
        for name, error, colour in (("RMS error", "rms", theme.RMS), ("median error", "median", theme.MEDIAN)):
            curves[name] = rows.column(column)[chosen], rows.column(error)[chosen], colour
    lowest = min(float(values.min(initial=1.0)) for _, values, _ in curves.values())
    highest = max(float(values.max(initial=1.0)) for _, values, _ in curves.values())
    decade = 10.0 ** min(np.floor(np.log10(max(lowest, SMALLEST))), -1.0)  # whole decades, at least one
    over = np.concatenate([curve[0] for curve in curves.values()])
    if not plots.begin(state.zooms, "remaining", size, label, _ends(over, unit), (decade, highest), logarithmic=True):
        return
    for name, (over, values, colour) in curves.items():
        if len(over):
            alone = implot.Marker_.circle if len(over) == 1 else implot.Marker_.none
            line = implot.Spec(line_color=imgui.ImVec4(*colour), line_weight=theme.px(2.0), marker=alone)
            implot.plot_line(name, over, np.maximum(values, SMALLEST), line)
    plots.end(state.zooms, "remaining", unit, curves, widgets.percent)


def _energy(
    state: State, size: imgui.ImVec2, x: np.ndarray, shares: dict[str, np.ndarray], label: str | None, unit: str
) -> None:
    """Where the emitted power is, stacked: absorbed, escaped, unshot [fraction]."""
    if not plots.begin(state.zooms, "energy", size, label, _ends(x, unit), (0.0, 1.0)):
        return
    names = (("absorbed", theme.ABSORBED), ("escaped", theme.ESCAPED), ("unshot", theme.UNSHOT))
    shares = shares | {"unshot": shares["remaining"]}
    lower = np.zeros_like(x)
    for name, colour in names:
        upper = lower + shares[name]
        if len(x):
            implot.plot_shaded(name, x, lower, upper, implot.Spec(fill_color=imgui.ImVec4(*colour), fill_alpha=0.7))
        lower = upper
    plots.end(state.zooms, "energy", unit, {n: (x, shares[n], colour) for n, colour in names}, widgets.percent)


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
