"""Lights: lamps without area, their strength, colour, cone, place and softness, and the sky. Light follows."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.render.false_colour import WHITE_EFFICACY
from app.scene.lights import Light
from app.ui import colour, theme, widgets
from app.ui.panels import sky
from app.ui.state import RGB, State

if TYPE_CHECKING:
    from app.session.view import View

ROWS_SHOWN = 4  # of the list before it scrolls
WEAKEST, STRONGEST = 1e-4, 1e6  # W/sr or W/m², ends of the slider
STEP = 0.005  # of the scene's diagonal, for a pixel that a place is dragged by
WIDEST = 10.0  # degrees across a directional light


def draw(view: View, state: State) -> None:
    """The whole panel."""
    if view.session.family.relights:
        _flicker(view, state)
    _lamps(view, state)
    sky.draw(view, state)


def _lamps(view: View, state: State) -> None:
    """The section of lamps without area, for a scene that has any."""
    lights = view.session.edited_scene.lights
    if not lights or not widgets.fold("Without area"):
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
    edited = _editor(lights[index], float(math.dist(low, high)))
    imgui.pop_id()
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


def _editor(light: Light, size: float) -> Light:
    """The light as it was edited. size: diagonal of the scene [m]."""
    widgets.labelled("Shines")
    on = imgui.checkbox("##on", light.on)[1]
    light = dataclasses.replace(light, on=on, intensity=_intensity(light))
    if not light.from_afar:
        light = dataclasses.replace(light, position=_vector("Position [m]", light.position, STEP * size, "%.2f"))
        radius = _slider("Radius", light.radius, 0.1 * size, "%.3g m", "Of the lamp: above 0, shadows have soft edges")
        light = dataclasses.replace(light, radius=radius)
    if light.kind != "point":
        aim = _vector("Direction", light.direction, STEP, "%.3f")
        length = math.hypot(*aim)
        if aim != light.direction and length > 0:
            x, y, z = (c / length for c in aim)
            light = dataclasses.replace(light, direction=(x, y, z))
    if light.kind == "spot":
        outer = _angle("Cone", light.outer, 90.0, "Angle from the axis, at which the light ends")
        inner = _angle("Full within", light.inner, 90.0, "Angle from the axis, up to which it is even")
        light = dataclasses.replace(light, outer=outer, inner=min(inner, outer))
    if light.from_afar:
        wide = _angle(
            "Angle", light.angle, WIDEST, "That it is seen under: above 0, shadows have soft edges; the sun 0.53°"
        )
        light = dataclasses.replace(light, angle=wide)
    return light


def _intensity(light: Light) -> RGB:
    """Colour × strength, in W/sr or W/m²."""
    tint, strength = colour.tint_and_strength(light.intensity)
    widgets.labelled("Strength")
    new_tint = colour.edit_tint("##colour", tint)
    imgui.same_line()
    imgui.set_next_item_width(-1)
    unit, flags = "W/m²" if light.from_afar else "W/sr", widgets.SLIDER | widgets.LOGARITHMIC
    scaled, now = imgui.slider_float("##strength", strength, WEAKEST, STRONGEST, f"%.4g {unit}", flags)
    lumens = WHITE_EFFICACY * strength
    if light.from_afar:
        widgets.tooltip(f"Irradiance of what faces it; about {widgets.number(lumens, 3)} lx")
    else:
        power = widgets.number(light.solid_angle * strength, 3)
        widgets.tooltip(
            f"Radiant intensity; in all {power} W. About {widgets.number(lumens, 3)} cd, "
            f"{widgets.number(light.solid_angle * lumens, 3)} lm"
        )
    if (new_tint == tint and not scaled) or now != now:
        return light.intensity
    return colour.rgb(now * c for c in new_tint)


def _vector(label: str, value: RGB, step: float, text: str) -> RGB:
    widgets.labelled(label)
    imgui.set_next_item_width(-1)
    shown = [component + 0.0 for component in value]  # -0 is 0
    changed, moved = imgui.drag_float3(f"##{label}", shown, step, 0.0, 0.0, text)
    widgets.tooltip("Drag, or click twice to type")
    if not changed or not all(map(math.isfinite, moved)):
        return value
    x, y, z = (float(c) for c in moved)
    return (x, y, z)


def _angle(label: str, value: float, most: float, help: str) -> float:
    """In radians; shown in degrees."""
    degrees = _slider(label, math.degrees(value), most, "%.2f°", help)
    return value if degrees == math.degrees(value) else math.radians(degrees)


def _slider(label: str, value: float, most: float, text: str, help: str) -> float:
    widgets.labelled(label)
    imgui.set_next_item_width(-1)
    changed, moved = imgui.slider_float(f"##{label}", value, 0.0, most, text, widgets.SLIDER)
    widgets.tooltip(help)
    return float(moved) if changed and moved == moved else value


__all__ = ["draw"]
