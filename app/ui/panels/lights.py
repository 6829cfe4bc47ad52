"""Lights: all lamps, those without area with their strength, colour, cone, place and softness. Light follows."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.scene.lights import Light
from app.ui import lamp, new_lamps, slider, theme, widgets
from app.ui.panels import area_lamps, sky
from app.ui.state import State
from app.ui.vector import STEP, edit_vector

if TYPE_CHECKING:
    from app.session.view import View

ROWS_SHOWN = 4  # of the list before it scrolls
WEAKEST = 1e-4  # W/sr or W/m²
WIDEST = 10.0  # degrees across a directional light


def draw(view: View, state: State) -> None:
    """The whole panel."""
    state.lights_shown = True
    widgets.section("Add a lamp")
    new_lamps.buttons(view, state)
    area_lamps.draw(view, state)
    _lamps(view, state)
    sky.draw(view, state)
    if view.session.family.relights:
        _flicker(view, state)


def _lamps(view: View, state: State) -> None:
    """The section of lamps without area, for a scene that has any."""
    lights = view.session.edited_scene.lights
    if not lights or not widgets.fold("Lamps without area"):
        return
    state.draw_lights = imgui.checkbox("In the view", state.draw_lights)[1]
    widgets.tooltip("Handles of all lights, to be dragged")
    height = min(len(lights), ROWS_SHOWN) * imgui.get_text_line_height_with_spacing()
    imgui.begin_child("lights", imgui.ImVec2(0, height))
    for index, light in enumerate(lights):
        _row(state, index, light)
    imgui.end_child()
    index = min(state.light, len(lights) - 1)
    low, high = view.session.scene.bounds
    imgui.push_id("light")
    size, came = float(math.dist(low, high)), _as_read(view, index, lights[index])
    edited = _editor(lights[index], came, view.display.quantities, size)
    duplicate, remove = new_lamps.pair_of_buttons()
    imgui.pop_id()
    if duplicate:
        copy = new_lamps.light_beside(view, lights[index], size)
        state.act(lambda: new_lamps.add_light(view, copy, state))
    if remove:
        state.act(lambda: view.session.set_lights((*lights[:index], *lights[index + 1 :])))
    if edited != lights[index]:
        state.act(lambda: view.session.set_lights((*lights[:index], edited, *lights[index + 1 :])))


def _flicker(view: View, state: State) -> None:
    """Whether all lamps change from frame to frame."""
    widgets.labelled("Lamps flicker")
    changed, on = imgui.checkbox("##flicker", view.session.flickers)
    widgets.tooltip("Each lamp gives a quarter more or less, a few times a second; off, all are as they were edited")
    if changed:
        state.act(lambda: view.session.set_flicker(on))


def _row(state: State, index: int, light: Light) -> None:
    imgui.push_id(index)
    icon = theme.ICONS.ICON_FA_SUN if light.from_afar else theme.ICONS.ICON_FA_LIGHTBULB
    imgui.text_colored(imgui.ImVec4(*(theme.AMBER if light.emits else theme.DIM)), icon)
    imgui.same_line()
    if imgui.selectable(f"{light.name or light.kind} ({light.kind})", state.light == index)[0]:
        state.light = index
    imgui.pop_id()


def _as_read(view: View, index: int, light: Light) -> Light:
    """That light as the file has it, or as it is where it was added since."""
    came = view.session.read.lights
    same = index < len(came) and (came[index].name, came[index].kind) == (light.name, light.kind)
    return came[index] if same else light


def _editor(light: Light, came: Light, quantities: str, size: float) -> Light:
    """The light as it was edited. came: as it was read. quantities: that it is counted in. size: diagonal of the scene [m]."""
    widgets.labelled("Shines", changed=light.on != came.on)
    on = widgets.put_back(imgui.checkbox("##on", light.on)[1], came.on)
    kind, spread = ("arrives", None) if light.from_afar else ("directed", light.solid_angle)
    intensity, _ = lamp.edit_light(
        light.intensity, kind, quantities, came=came.intensity, weakest=WEAKEST, spread=spread
    )
    light = dataclasses.replace(light, on=on, intensity=intensity)
    if not light.from_afar:
        place = edit_vector("Position [m]", light.position, came.position, STEP * size, "%.2f")
        help = "Of the lamp: above 0, shadows have soft edges"
        radius = _slider("Radius", light.radius, came.radius, 0.1 * size, "%.3g m", help)
        light = dataclasses.replace(light, position=place, radius=radius)
    if light.kind != "point":
        aim = edit_vector("Direction", light.direction, came.direction, STEP, "%.3f")
        length = math.hypot(*aim)
        if aim != light.direction and length > 0:
            x, y, z = (c / length for c in aim)
            light = dataclasses.replace(light, direction=(x, y, z))
    if light.kind == "spot":
        outer = _angle("Cone", light.outer, came.outer, 90.0, "Angle from the axis, at which the light ends")
        inner = _angle("Full within", light.inner, came.inner, 90.0, "Angle from the axis, up to which it is even")
        light = dataclasses.replace(light, outer=outer, inner=min(inner, outer))
    if light.from_afar:
        help = "That it is seen under: above 0, shadows have soft edges; the sun 0.53°"
        wide = _angle("Angle", light.angle, came.angle, WIDEST, help)
        light = dataclasses.replace(light, angle=wide)
    return light


def _angle(label: str, value: float, came: float, most: float, help: str) -> float:
    """In radians; shown in degrees."""
    degrees = _slider(label, math.degrees(value), math.degrees(came), most, "%.2f°", help)
    if degrees == math.degrees(came):
        return came
    return value if degrees == math.degrees(value) else math.radians(degrees)


def _slider(label: str, value: float, came: float, most: float, text: str, help: str) -> float:
    widgets.labelled(label, changed=value != came)
    imgui.set_next_item_width(-1)
    moved = slider.slide(f"##{label}", value, slider.Range(0.0, most), text)
    widgets.tooltip(f"{help}. {widgets.SLIDES}")
    return float(widgets.put_back(moved, came))


__all__ = ["draw"]
