"""Materials: a list of those on surfaces, and albedo and emission of the one that is selected, edited while light moves."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui

from app.scene.area_lamps import keys_of
from app.scene.mean_colour import mean_factor
from app.scene.model import MOST_ALBEDO, SCALES, Material
from app.ui import area_edits, colour, lamp, slider, theme, widgets
from app.ui.state import RGB, State

if TYPE_CHECKING:
    from app.session.view import View

ROWS_SHOWN = 12  # of the list before it scrolls
DENSITY = slider.Range(*SCALES, usual=(0.25, 4.0), logarithmic=True)
SCALED = (
    "So many times as many texels along a metre of it as of others (lightmap_scale), for light that needs more of them, or less: "
    "all surfaces are cut anew in the background once it is let go. Where a number of texels is asked for, others have the rest; "
    f'the layer "density" shows it. {widgets.AS_READ}'
)


def draw(view: View, state: State) -> None:
    """The whole panel."""
    used = area_edits.used_materials(view, state)
    if state.material not in used:
        state.material = used[0]
    _list(view, state, used)
    _editor(view, state, view.session.materials[state.material])


def _list(view: View, state: State, used: tuple[int, ...]) -> None:
    height = min(len(used), ROWS_SHOWN) * imgui.get_text_line_height_with_spacing()
    imgui.begin_child("materials", imgui.ImVec2(0, height))
    if state.reveal_material:
        state.reveal_material = False
        row = used.index(state.material)
        imgui.set_scroll_y((row + 0.5) * imgui.get_text_line_height_with_spacing() - height / 2)
    clipper = imgui.ListClipper()
    clipper.begin(len(used))
    while clipper.step():
        for row in range(clipper.display_start, clipper.display_end):
            _row(view, state, used[row])
    imgui.end_child()


def _row(view: View, state: State, index: int) -> None:
    material, side = view.session.materials[index], imgui.get_text_line_height()
    imgui.push_id(index)
    factor = _mean_factor(view, state, index)
    colour.swatch("##albedo", colour.rgb(a * f for a, f in zip(material.albedo, factor, strict=True)), side)
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
    albedo, light = _albedo(state, material, came), emission(view, state, material, came, index)
    edited = dataclasses.replace(material, albedo=albedo, emission=light)
    _density(view, state, index)
    imgui.pop_id()
    if (edited.albedo, edited.emission) != (material.albedo, material.emission):
        state.act(lambda: view.session.set_material(index, edited))
    notes = [f"{word} texture" for word in ("albedo", "emission") if getattr(material, f"{word}_texture") is not None]
    if material.double_sided:
        notes.append("both sides")
    if max(material.albedo) >= MOST_ALBEDO:
        notes.append(f"held at {MOST_ALBEDO:.0%}: no surface reflects more")
    if notes:
        widgets.dim(", ".join(notes))


def _density(view: View, state: State, index: int) -> None:
    """How finely it is cut into texels. The draft stays while a hand is at it: surfaces are cut once, when it is let go."""
    session, draft = view.session, state.scale
    key, surfaces = keys_of(session.unedited.materials)[index], session.asked_surfaces
    came = _came(view, index)
    asked = dict(surfaces.scales).get(key, came)
    shown = asked if draft is None or draft[0] != index else draft[1]
    widgets.labelled("Texel density", changed=shown != came)
    imgui.set_next_item_width(-1)
    imgui.begin_disabled(session.fixed is not None)
    slid = slider.slide("##density", shown, DENSITY, "× %.3g")
    edited = widgets.put_back(slid if slid == shown else float(f"{slid:.3g}"), came)  # it is what it shows
    held = imgui.is_item_active()
    imgui.end_disabled()
    widgets.tooltip(SCALED if session.fixed is None else f"{SCALED}\nNot now: {session.fixed}")
    state.scale = (index, edited) if held and session.fixed is None else None
    if not held and edited != asked and session.fixed is None:
        state.act(lambda: session.change_surfaces(surfaces.with_scale(key, edited, came)))


def _came(view: View, index: int) -> float:
    """The texel density of a material in the file; of the copy of a lamp, that of the lamp."""
    read, added = view.session.read.materials, area_edits.added_lamp(view, index)
    if added is None:
        return read[index].lightmap_scale
    return 1.0 if added.of is None else read[keys_of(read).index(added.of)].lightmap_scale


def _albedo(state: State, material: Material, came: Material) -> RGB:
    """came: the material as it was read."""
    widgets.labelled("Albedo ρ", changed=material.albedo != came.albedo)
    imgui.set_next_item_width(-1)
    edited = colour.edit_colour("##albedo", material.albedo, code=True, most=MOST_ALBEDO, typed=state.typed_colours)
    pictured = " It multiplies the picture: the list shows the mean of both." if material.albedo_texture else ""
    widgets.tooltip(
        f"The share of light that it reflects: ρ {widgets.triple(material.albedo, 3)} of red, green, blue. The code is of what "
        f"the screen shows (sRGB), as everywhere.{pictured} {widgets.AS_READ}"
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


def _mean_factor(view: View, state: State, index: int) -> RGB:
    """The mean of what multiplies its albedo, looked up once."""
    scene = view.session.unedited
    if state.mean_factors[0] is not scene:
        state.mean_factors = scene, {}
    known = state.mean_factors[1]
    if index not in known:
        known[index] = mean_factor(scene, index)
    return known[index]


def _emitting_area(view: View, state: State, index: int) -> float:
    """Of both sides, where both emit [m²]."""
    scene = view.session.scene
    known = view.session.unedited, index
    if state.emitting_area[0] != known:
        area = float(scene.normals_areas[1][scene.material_ids == index].sum())
        state.emitting_area = known, area * (1 + scene.materials[index].double_sided)
    return state.emitting_area[1]
