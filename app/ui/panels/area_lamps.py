"""Lamps with area, a section of the Lights panel: materials that emit, how bright they are, where, once more or away."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.scene.area_lamps import AreaLamp, turned
from app.ui import area_edits, new_lamps, slider, theme, widgets
from app.ui.panels import materials
from app.ui.state import State
from app.ui.vector import STEP, edit_vector
from app.ui.words import BY_HAND

if TYPE_CHECKING:
    from app.session.view import View

ROWS_SHOWN = 4  # of the list before it scrolls
ALONE = "nothing else would be left"
SMALLEST, LARGEST = 1e-3, 1.0  # edges of a rectangle, of the scene's diagonal
CUT = "Surfaces are cut anew once it is let go"


def draw(view: View, state: State) -> None:
    """The section, for a scene that has any."""
    indices = area_edits.lamps(view, state)
    if not indices or not widgets.fold("Lamps with area"):
        return
    if state.area_lamp not in indices:
        state.area_lamp = indices[0]
    height = min(len(indices), ROWS_SHOWN) * imgui.get_text_line_height_with_spacing()
    imgui.begin_child("area lamps", imgui.ImVec2(0, height))
    for index in indices:
        _row(view, state, index)
    imgui.end_child()
    index, session = state.area_lamp, view.session
    material = session.materials[index]
    imgui.push_id("area lamp")
    edited = dataclasses.replace(
        material, emission=materials.emission(view, state, material, session.unedited.materials[index], index)
    )
    _shape(view, state, index)
    duplicate, remove = new_lamps.pair_of_buttons(_why_not(view, index))
    imgui.pop_id()
    if duplicate:
        state.act(lambda: area_edits.duplicate(view, state, index))
    if remove:
        state.act(lambda: area_edits.remove(view, index))
    if edited.emission != material.emission:
        state.act(lambda: session.set_material(index, edited))


def _shape(view: View, state: State, index: int) -> None:
    """Where the lamp is, and of a rectangle that was added how large and which way: surfaces are cut once it is let go."""
    lamp = area_edits.lamp_of(view, state, index)
    held = state.held_lamp
    shown = held[1] if held is not None and held[0] == index else lamp
    low, high = view.session.scene.bounds
    size = float(math.dist(low, high))
    off = area_edits.why_not_moved(view, state, index)
    imgui.begin_disabled(off is not None)
    came = area_edits.came_from(view, state, index)
    place = edit_vector("Position [m]", shown.position, came, STEP * size, "%.2f", off=off or "", more=CUT)
    edited = dataclasses.replace(shown, position=place)
    if lamp.of is None:
        edited = _rectangle(edited, lamp, size)
    imgui.end_disabled()
    if edited != shown:
        state.held_lamp = index, edited


def _rectangle(shown: AreaLamp, lamp: AreaLamp, size: float) -> AreaLamp:
    """Its edges, where it shines to, and how it is turned around that. lamp: as it is; size: diagonal of the scene [m]."""
    width, height = (
        _slider(label, edge, now, slider.Range(SMALLEST * size, LARGEST * size, logarithmic=True), "%.3g m", help)
        for label, edge, now, help in (
            ("Width", shown.size[0], lamp.size[0], "Of the rectangle"),
            ("Height", shown.size[1], lamp.size[1], "Of the rectangle"),
        )
    )
    aim = edit_vector("Direction", shown.direction, lamp.direction, STEP, "%.3f", more=f"Where its front shines. {CUT}")
    help = "By which the rectangle is turned around the direction that it shines in"
    angle = _slider("Turned", shown.turn, lamp.turn, slider.Range(-180.0, 180.0), "%.1f°", help)
    if (aim, angle) != (shown.direction, shown.turn):
        shown = turned(shown, aim, angle)
    return dataclasses.replace(shown, size=(width, height))


def _slider(label: str, value: float, now: float, ends: slider.Range, text: str, help: str) -> float:
    widgets.labelled(label, changed=value != now)
    imgui.set_next_item_width(-1)
    moved = slider.slide(f"##{label}", value, ends, text)
    widgets.tooltip(f"{help}. {CUT}. {BY_HAND}")
    return float(moved)


def _row(view: View, state: State, index: int) -> None:
    material = view.session.materials[index]
    imgui.push_id(index)
    colour = theme.AMBER if material.emits else theme.DIM
    imgui.text_colored(imgui.ImVec4(*colour), theme.ICONS.ICON_FA_SQUARE)
    imgui.same_line()
    if imgui.selectable(material.name or f"material {index}", state.area_lamp == index)[0]:
        state.area_lamp = index
    imgui.pop_id()


def _why_not(view: View, index: int) -> str | None:
    """Why its surfaces cannot be changed now."""
    session = view.session
    why = area_edits.why_fixed(view)
    if why is not None:
        return why
    return ALONE if (session.unedited.material_ids == index).all() else None


__all__ = ["draw"]
