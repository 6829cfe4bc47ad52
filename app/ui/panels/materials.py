"""Materials: a list, and the albedo and emission of the one that is selected, which can be edited while light moves."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui

from app.scene.model import MOST_ALBEDO, Material
from app.ui import colour, lamp, theme, widgets
from app.ui.state import RGB, State

if TYPE_CHECKING:
    from app.session.view import View

ROWS_SHOWN = 12  # of the list before it scrolls


def draw(view: View, state: State) -> None:
    """The whole panel."""
    _list(view, state)
    if state.material < len(view.session.materials):
        _editor(view, state, view.session.materials[state.material])


def _list(view: View, state: State) -> None:
    materials = view.session.materials
    height = min(len(materials), ROWS_SHOWN) * imgui.get_text_line_height_with_spacing()
    imgui.begin_child("materials", imgui.ImVec2(0, height))
    if state.reveal_material:
        state.reveal_material = False
        imgui.set_scroll_y((state.material + 0.5) * imgui.get_text_line_height_with_spacing() - height / 2)
    clipper = imgui.ListClipper()
    clipper.begin(len(materials))
    while clipper.step():
        for index in range(clipper.display_start, clipper.display_end):
            _row(state, index, materials[index])
    imgui.end_child()


def _row(state: State, index: int, material: Material) -> None:
    imgui.push_id(index)
    side = imgui.get_text_line_height()
    colour.swatch("##albedo", material.albedo, side)
    imgui.same_line()
    if imgui.selectable(material.name or f"material {index}", state.material == index)[0]:
        state.material = index
    if material.emits:
        imgui.same_line(imgui.get_content_region_avail().x - side)
        imgui.text_colored(imgui.ImVec4(*theme.AMBER), theme.ICONS.ICON_FA_LIGHTBULB)
        widgets.tooltip("emits light")
    imgui.pop_id()


def _editor(view: View, state: State, material: Material) -> None:
    index = state.material
    came = view.session.unedited.materials[index]
    imgui.push_id("material")
    albedo, light = _albedo(material, came), emission(view, state, material, came, index)
    edited = dataclasses.replace(material, albedo=albedo, emission=light)
    imgui.pop_id()
    if (edited.albedo, edited.emission) != (material.albedo, material.emission):
        state.act(lambda: view.session.set_material(index, edited))
    notes = [f"{word} texture" for word in ("albedo", "emission") if getattr(material, f"{word}_texture") is not None]
    if material.double_sided:
        notes.append("both sides")
    if notes:
        widgets.dim(", ".join(notes))


def _albedo(material: Material, came: Material) -> RGB:
    """came: the material as it was read."""
    widgets.labelled("Albedo ρ", changed=material.albedo != came.albedo)
    imgui.set_next_item_width(-1)
    edited = colour.edit_colour("##albedo", material.albedo, code=True, most=MOST_ALBEDO)
    widgets.tooltip(
        f"The share of light that it reflects: ρ {widgets.triple(material.albedo, 3)} of red, green, blue. The code is of what "
        f"the screen shows (sRGB), as everywhere. {widgets.AS_READ}"
    )
    return widgets.put_back(edited, came.albedo)


def emission(view: View, state: State, material: Material, came: Material, index: int) -> RGB:
    """Widgets of a material's emission. A lamp that is dimmed to nothing keeps its colour in the state. came: the
    material as it was read."""
    edited, state.emission_colours[index] = lamp.edit_light(
        material.emission,
        "seen",
        view.display.quantities,
        came=came.emission,
        tint=state.emission_colours.get(index, lamp.WHITE),
        spread=None if material.emission_texture is not None else np.pi * _emitting_area(view, state, index),
    )
    return edited


def _emitting_area(view: View, state: State, index: int) -> float:
    """Of both sides, where both emit [m²]."""
    scene = view.session.scene
    known = view.session.unedited, index
    if state.emitting_area[0] != known:
        area = float(scene.normals_areas[1][scene.material_ids == index].sum())
        state.emitting_area = known, area * (1 + scene.materials[index].double_sided)
    return state.emitting_area[1]
