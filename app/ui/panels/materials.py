"""Materials: a list, and the albedo and emission of the one that is selected, which can be edited while light moves."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from app.scene.model import MOST_ALBEDO
from app.ui import colour, theme, widgets
from app.ui.state import RGB, State

if TYPE_CHECKING:
    from app.session.view import View

ROWS_SHOWN = 12  # of the list before it scrolls
WHITE = (1.0, 1.0, 1.0)
STRONGEST = 1e5  # W/(sr m²), end of the slider: the sun's disc is brighter, lamps are not


def draw(view: View, state: State) -> None:
    """The whole panel."""
    _list(view, state)
    if state.material < len(view.session.materials):
        _editor(view, state, view.session.materials[state.material])


def _list(view: View, state: State) -> None:
    materials = view.session.materials
    height = min(len(materials), ROWS_SHOWN) * imgui.get_text_line_height_with_spacing()
    imgui.begin_child("materials", imgui.ImVec2(0, height))
    clipper = imgui.ListClipper()
    clipper.begin(len(materials))
    while clipper.step():
        for index in range(clipper.display_start, clipper.display_end):
            _row(state, index, materials[index])
    imgui.end_child()


def _row(state: State, index: int, material: Any) -> None:
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


def _editor(view: View, state: State, material: Any) -> None:
    index = state.material
    imgui.push_id("material")
    edited = dataclasses.replace(material, albedo=_albedo(material), emission=_emission(state, material))
    imgui.pop_id()
    if (edited.albedo, edited.emission) != (material.albedo, material.emission):
        state.act(lambda: view.session.set_material(index, edited))
    notes = [f"{word} texture" for word in ("albedo", "emission") if getattr(material, f"{word}_texture") is not None]
    if material.double_sided:
        notes.append("both sides")
    if notes:
        widgets.dim(", ".join(notes))


def _albedo(material: Any) -> RGB:
    widgets.labelled("Albedo ρ")
    imgui.set_next_item_width(-1)
    edited = colour.edit_colour("##albedo", material.albedo, code=True, most=MOST_ALBEDO)
    widgets.tooltip(
        f"The share of light that it reflects: ρ {widgets.triple(material.albedo, 3)} of red, green, blue. The code is of what "
        "the screen shows (sRGB), as everywhere"
    )
    return edited


def _emission(state: State, material: Any) -> RGB:
    """Colour × strength. A lamp that is dimmed to nothing keeps its colour in the state."""
    tint, strength = colour.tint_and_strength(material.emission, state.emission_colours.get(state.material, WHITE))
    widgets.labelled("Emission L")
    new_tint = state.emission_colours[state.material] = colour.edit_tint("##emission", tint)
    imgui.same_line()
    imgui.set_next_item_width(-1)
    flags = widgets.SLIDER | widgets.LOGARITHMIC
    scaled, new_strength = imgui.slider_float("##strength", strength, 0.0, STRONGEST, "%.4g W/(sr m²)", flags)
    widgets.tooltip("Radiance: colour times strength. Exitance is π times this. Right-click: off")
    if imgui.is_item_hovered() and imgui.is_mouse_clicked(1):
        scaled, new_strength = True, 0.0
    if (new_tint == tint and not scaled) or new_strength != new_strength:
        return material.emission
    return colour.rgb(v * new_strength for v in new_tint)
