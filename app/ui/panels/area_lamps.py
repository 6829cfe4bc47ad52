"""Lamps with area, a section of the Lights panel: materials that emit, how bright they are, once more or away."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.ui import new_lamps, theme, widgets
from app.ui.panels import materials
from app.ui.state import State
from app.ui.vector import STEP, edit_vector

if TYPE_CHECKING:
    from app.session.view import View

ROWS_SHOWN = 4  # of the list before it scrolls
ALONE = "nothing else would be left"


def draw(view: View, state: State) -> None:
    """The section, for a scene that has any."""
    indices = lamps(view, state)
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
    _place(view, state, index)
    duplicate, remove = new_lamps.pair_of_buttons(_why_not(view, index))
    imgui.pop_id()
    if duplicate:
        state.act(lambda: new_lamps.duplicate_surfaces(view, index))
    if remove:
        state.act(lambda: new_lamps.remove_surfaces(view, index))
    if edited.emission != material.emission:
        state.act(lambda: session.set_material(index, edited))


def _place(view: View, state: State, index: int) -> None:
    """Where an added lamp is: surfaces are cut once it is let go."""
    lamp = new_lamps.added_lamp(view, index)
    if lamp is None:
        return
    held = state.lamp_place is not None and state.lamp_place[0] == lamp.name
    shown = state.lamp_place[1] if held and state.lamp_place is not None else lamp.position
    low, high = view.session.scene.bounds
    imgui.begin_disabled(new_lamps.why_fixed(view) is not None)
    place = edit_vector("Position [m]", shown, lamp.position, STEP * math.dist(low, high), "%.2f")
    imgui.end_disabled()
    if place != shown:
        state.lamp_place = lamp.name, place


def lamps(view: View, state: State) -> list[int]:
    """Materials that are somewhere and emit, or came so, or were dimmed to nothing here."""
    came, now = view.session.unedited.materials, view.session.materials
    return [index for index in new_lamps.used_materials(view, state) if now[index].emits or came[index].emits]


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
    why = new_lamps.why_fixed(view)
    if why is not None:
        return why
    return ALONE if (session.unedited.material_ids == index).all() else None


__all__ = ["draw"]
