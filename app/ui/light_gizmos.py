"""Lamps without area in the view: each a handle that can be picked and dragged, a spot with its cone, and what shines from afar
as an arrow to the middle of the scene, whose end turns it."""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui

from app.scene.lights import Light
from app.ui import theme
from app.ui.on_screen import on_screen
from app.ui.state import State

if TYPE_CHECKING:
    from app.scene.model import F64
    from app.session.view import View

GRAB_EM = 0.7  # from a handle, that takes hold of it
HANDLE_EM = 0.4
REACH = 0.2  # of the scene's radius, that a cone is drawn long
AWAY = 1.1  # scene radii from the middle, where the handle of a directional light is
SIDES = 24  # of the circle that ends a cone


def light_gizmos(view: View, state: State) -> bool:
    """Draw the handles, and move a light with the mouse; whether the mouse is at one."""
    state.light_held = state.light_held and imgui.is_mouse_down(0)
    lights = view.session.edited_scene.lights
    if not (lights and state.draw_lights and state.show_ui):
        state.light_held = False
        return False
    io = imgui.get_io()
    near, least = -1, GRAB_EM * imgui.get_font_size()
    for index, light in enumerate(lights):
        at = on_screen(view, state, handle(view, light))
        if at is None:
            continue
        distance = math.hypot(at.x - io.mouse_pos.x, at.y - io.mouse_pos.y)
        if distance < least:
            near, least = index, distance
        _draw(view, state, light, at, chosen=index == state.light)
    free = not io.want_capture_mouse and state.drag_button < 0 and near >= 0
    if free and imgui.is_mouse_clicked(0):
        state.light, state.light_held = near, True
    if state.light_held and (io.mouse_delta.x or io.mouse_delta.y):
        _move(view, state, lights)
    if free or state.light_held:
        imgui.set_mouse_cursor(imgui.MouseCursor_.resize_all)
    return free or state.light_held


def handle(view: View, light: Light) -> F64:
    """Where its handle is (3,) [m]."""
    space = view.session.lightmap.space
    if not light.from_afar:
        return np.array(light.position)
    return np.asarray(space.centre - AWAY * space.scale * np.array(light.direction))


def _move(view: View, state: State, lights: tuple[Light, ...]) -> None:
    """The light whose handle is held, as the mouse has moved: in the plane that faces the eye."""
    index = min(state.light, len(lights) - 1)
    light = lights[index]
    place = moved_by_mouse(view, state, handle(view, light))
    if light.from_afar:
        way = view.session.lightmap.space.centre - place
        x, y, z = (way / max(float(np.linalg.norm(way)), 1e-30)).tolist()
        moved = dataclasses.replace(light, direction=(x, y, z))
    else:
        x, y, z = place.tolist()
        moved = dataclasses.replace(light, position=(x, y, z))
    state.act(lambda: view.session.set_lights((*lights[:index], moved, *lights[index + 1 :])))


def moved_by_mouse(view: View, state: State, place: F64) -> F64:
    """A place (3,) [m] after what the mouse has moved since the last frame, in the plane that faces the eye."""
    io, camera = imgui.get_io(), view.camera
    metres = 2 * math.tan(camera.yfov / 2) * float((place - camera.eye) @ camera.forward) / state.view_px[3]
    right, up = camera.world_from_camera[:3, 0], camera.world_from_camera[:3, 1]
    return np.asarray(place + metres * (io.mouse_delta.x * right - io.mouse_delta.y * up))


def _draw(view: View, state: State, light: Light, at: imgui.ImVec2, *, chosen: bool) -> None:
    em, lines = imgui.get_font_size(), imgui.get_background_draw_list()
    dark = theme.colour_u32((0, 0, 0, 0.6))
    colour = theme.colour_u32(theme.AMBER if chosen else theme.TEXT if light.emits else theme.DIM)
    space, place = view.session.lightmap.space, handle(view, light)
    if light.from_afar:
        end = on_screen(view, state, space.centre, outside=True)
        if end is not None:
            lines.add_line(at, end, dark, theme.px(3.0))
            lines.add_line(at, end, colour, theme.px(1.0))
    elif light.kind == "spot" and chosen:
        rim = [on_screen(view, state, p, outside=True) for p in cone(place, light, REACH * space.scale)]
        for one, other in zip(rim, rim[1:] + rim[:1], strict=True):
            if one is not None and other is not None:
                lines.add_line(one, other, colour, theme.px(1.0))
        for one in rim[:: SIDES // 4]:
            if one is not None:
                lines.add_line(at, one, colour, theme.px(1.0))
    lines.add_circle_filled(at, HANDLE_EM * em + theme.px(2.0), dark)
    lines.add_circle_filled(at, HANDLE_EM * em, colour)


def cone(place: F64, light: Light, length: float) -> F64:
    """(SIDES, 3) the circle at which a spot's outer cone is so far from it, measured along the cone."""
    axis = np.array(light.direction)
    aside = np.cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0))
    aside /= np.linalg.norm(aside)
    turn = 2 * np.pi * np.arange(SIDES) / SIDES
    around = np.cos(turn)[:, None] * aside + np.sin(turn)[:, None] * np.cross(axis, aside)
    return np.asarray(place + length * (math.cos(light.outer) * axis + math.sin(light.outer) * around))


__all__ = ["GRAB_EM", "HANDLE_EM", "light_gizmos", "moved_by_mouse"]
