"""Display: what the picture shows and how it is developed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.render.false_colour import measured, quantity
from app.render.layers import LAYER_SHADERS
from app.render.options import FALSE_COLOURS, DisplayOptions
from app.render.units import per_watt
from app.ui import widgets
from app.ui.panels import compare
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

SCALED, DEVELOPED = ("false_colour_log", "false_colour_max"), ("tone_map", "exposure")
MOST = 1e9  # of a top
COMPARED = ("show", "split")  # the Compare panel has them


def draw(view: View, state: State) -> None:
    """The whole panel: DisplayOptions, one widget each; exposure and curve, or where colours show values, their scale."""
    kind = measured(view.shown)
    skip = SCALED if kind == "off" else DEVELOPED if kind in FALSE_COLOURS else (*SCALED, *DEVELOPED)
    off = _off(view, kind)
    unit = {} if kind == "off" else {"false_colour_max": quantity(kind, view.display.quantities).unit}
    names = {
        "false_colour": {each: quantity(each, view.display.quantities).name for each in FALSE_COLOURS if each != "off"}
    }
    display = view.display if view.display.layer in view.layers else view.shown
    top = {} if state.legend is None else {"false_colour_max": state.legend.maximum}
    edited = widgets.edit_options(
        display, skip=(*skip, *COMPARED), off=off, starts=top, units=unit, choices={"layer": view.layers}, names=names
    )
    edited = counted(edited, edited.quantities, before=display.quantities)
    if edited.layer == "error" and view.display.layer != "error":
        state.act(lambda: compare.show(view, state, "error"))  # which says so where there is no reference
    else:
        view.display = edited
    if kind == "off":
        _auto(view, state, off)


def _auto(view: View, state: State, off: Mapping[str, str]) -> None:
    """A button that finds the exposure."""
    widgets.labelled("Set exposure")
    reason = off.get("exposure")
    imgui.begin_disabled(reason is not None)
    if imgui.button("Auto", imgui.ImVec2(-1, 0)):
        state.act(view.expose)
    imgui.end_disabled()
    text = "Set the exposure from the light of the scene: what surfaces reflect becomes mid grey on average."
    widgets.tooltip(text if reason is None else f"{text}\nNo effect now: {reason}.")


def _off(view: View, kind: str) -> dict[str, str]:
    """Options without effect on what is shown now, and why. kind: of what is measured in colours, or "off"."""
    off = {}
    if kind == "off" and LAYER_SHADERS[view.shown.layer].light is None:
        off = dict.fromkeys(("exposure", "tone_map"), "this layer is no light")
    elif kind not in ("off", *FALSE_COLOURS):
        off = {"false_colour": "this layer has a scale of its own"}
    if not view.session.family.distributes:
        off["last_shooter"] = f"with {view.session.family.title} no patches shoot"
    return off


def counted(display: DisplayOptions, quantities: str, *, before: str | None = None) -> DisplayOptions:
    """The same display with light counted in lumen or in watts; a top that the scale was given stays where it is."""
    ratio = per_watt(quantities) / per_watt(before or display.quantities)
    top = min(display.false_colour_max * ratio, MOST)
    return (
        display
        if ratio == 1 and display.quantities == quantities
        else display.replace(quantities=quantities, false_colour_max=top)
    )
