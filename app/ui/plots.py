"""A plot that follows its curves until it is zoomed or dragged, says the values under the pointer, and goes back by a
double click."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from imgui_bundle import imgui, implot

from app.ui import theme

Curve = tuple[np.ndarray, np.ndarray, theme.RGBA]  # x, y, colour
Ends = tuple[float, float]

AXIS = int(implot.AxisFlags_.no_highlight)
LEGEND = int(implot.LegendFlags_.no_menus | implot.LegendFlags_.horizontal | implot.LegendFlags_.outside)
PLOT = int(implot.Flags_.no_mouse_text | implot.Flags_.no_menus | implot.Flags_.no_box_select)
LOW_EM = 8.0  # height of a plot, below which its legend takes no more room than its words
TICK_EM = 1.6  # between two ticks of an axis that has few, at least
FEW_TICKS = (6, 3, 2)  # from 0 to 1


@dataclass
class Zooms:
    """Of all plots by name: which were zoomed or moved by hand, and which was under the pointer in the last frame."""

    zoomed: set[str] = field(default_factory=set)
    hovered: set[str] = field(default_factory=set)


def begin(
    zooms: Zooms, name: str, size: imgui.ImVec2, label: str | None, x: Ends, y: Ends, *, logarithmic: bool = False
) -> bool:
    """Whether anything is to be drawn, and then ``end`` to be called. label: below; x, y: ends of the axes."""
    io, em = imgui.get_io(), imgui.get_font_size()
    if name in zooms.hovered and (io.mouse_wheel or imgui.is_mouse_dragging(0)):
        zooms.zoomed.add(name)
    low, style = is_low(size.y), implot.get_style()
    for variable, usual in (
        (implot.StyleVar_.legend_padding, style.legend_padding),
        (implot.StyleVar_.legend_inner_padding, style.legend_inner_padding),
    ):
        implot.push_style_var(variable, imgui.ImVec2(usual.x, 0 if low else usual.y))
    if not implot.begin_plot(f"##{name}", size, PLOT):
        implot.pop_style_var(2)
        return False
    implot.setup_axis(implot.ImAxis_.x1, label, AXIS)
    implot.setup_axis(implot.ImAxis_.y1, None, AXIS)
    implot.setup_legend(implot.Location_.north, LEGEND)
    if logarithmic:
        implot.setup_axis_scale(implot.ImAxis_.y1, implot.Scale_.log10)
    if name not in zooms.zoomed:
        implot.setup_axis_limits(implot.ImAxis_.x1, *x, implot.Cond_.always)
        implot.setup_axis_limits(implot.ImAxis_.y1, *y, implot.Cond_.always)
        room = size.y / em - (3.0 if low else 4.0)
        if not logarithmic:
            count = next((n for n in FEW_TICKS if (n - 1) * TICK_EM <= room), FEW_TICKS[-1])
            implot.setup_axis_ticks(implot.ImAxis_.y1, *y, count)
    return True


def is_low(height: float) -> bool:
    """Whether a plot has little room for a legend above it."""
    return height < LOW_EM * imgui.get_font_size()


def end(zooms: Zooms, name: str, unit: str, curves: Mapping[str, Curve], shown: Callable[[float], str]) -> None:
    """Say what the curves have under the pointer; unit: of x; shown: a value as text."""
    if not implot.is_plot_hovered():
        zooms.hovered.discard(name)
    else:
        zooms.hovered.add(name)
        if imgui.is_mouse_double_clicked(0):
            zooms.zoomed.discard(name)
        lines, at = read(curves, implot.get_plot_mouse_pos().x, unit, shown)
        if lines:
            implot.plot_inf_lines("##at", np.array([at]), implot.Spec(line_color=imgui.ImVec4(*theme.DIM)))
            imgui.set_tooltip("\n".join(lines))
    implot.end_plot()
    implot.pop_style_var(2)


def read(curves: Mapping[str, Curve], at: float, unit: str, shown: Callable[[float], str]) -> tuple[list[str], float]:
    """The value of each curve at the point that is nearest to x, below that x, and that x; nothing where there is no curve."""
    curves = {name: curve for name, curve in curves.items() if len(curve[0])}
    if not curves:
        return [], at
    rows = {name: int(np.abs(x - at).argmin()) for name, (x, _, _) in curves.items()}
    first = next(iter(curves))
    place = float(curves[first][0][rows[first]])
    values = [f"{name}: {shown(float(curves[name][1][row]))}" for name, row in rows.items()]
    return [f"{place:,.4g} {unit}", *values], place
