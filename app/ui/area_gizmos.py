"""Lamps with area in the view: those that were added, and while the Lights panel is in front others that can be moved, have a
handle in their middle; surfaces follow once it is let go."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui

from app.scene.area_lamps import AreaLamp
from app.ui import area_edits, theme
from app.ui.light_gizmos import GRAB_EM, HANDLE_EM, moved_by_mouse
from app.ui.on_screen import on_screen
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View


def area_gizmos(view: View, state: State) -> bool:
    """Draw the handles, move a lamp with the mouse, and put the one that was let go in its place; whether the mouse is at one."""
    _let_go(view, state)
    if not (state.draw_lights and state.show_ui) or area_edits.why_fixed(view) is not None:
        state.area_held = False
        return False
    state.area_held = state.area_held and imgui.is_mouse_down(0)
    io, near, least = imgui.get_io(), None, GRAB_EM * imgui.get_font_size()
    for index in area_edits.lamps(view, state):
        own = area_edits.added_lamp(view, index) is None
        if (own and not state.lights_shown) or area_edits.why_not_moved(view, state, index) is not None:
            continue
        lamp = area_edits.lamp_of(view, state, index)
        at = on_screen(view, state, np.array(_held(state, index, lamp).position))
        if at is None:
            continue
        distance = math.hypot(at.x - io.mouse_pos.x, at.y - io.mouse_pos.y)
        if distance < least:
            near, least = index, distance
        _draw(view, state, lamp, _held(state, index, lamp), at, chosen=index == state.area_lamp)
    free = not io.want_capture_mouse and state.drag_button < 0 and not state.area_held
    if near is not None and free and imgui.is_mouse_clicked(0):
        state.held_lamp, state.area_held = (near, area_edits.lamp_of(view, state, near)), True
        state.area_lamp = near
    if state.area_held and state.held_lamp is not None and (io.mouse_delta.x or io.mouse_delta.y):
        index, lamp = state.held_lamp
        x, y, z = moved_by_mouse(view, state, np.array(lamp.position)).tolist()
        state.held_lamp = index, replace(lamp, position=(x, y, z))
    at_one = state.area_held or (near is not None and free)
    if at_one:
        imgui.set_mouse_cursor(imgui.MouseCursor_.resize_all)
    return at_one


def _let_go(view: View, state: State) -> None:
    """Where no hand holds it any more, the lamp is as it was left."""
    if state.held_lamp is None or imgui.is_any_item_active() or (state.area_held and imgui.is_mouse_down(0)):
        return
    index, lamp = state.held_lamp
    state.held_lamp = None
    state.act(lambda: area_edits.put(view, index, lamp))


def _held(state: State, index: int, lamp: AreaLamp) -> AreaLamp:
    """The lamp as a hand holds it, if one does."""
    held = state.held_lamp
    return held[1] if held is not None and held[0] == index else lamp


def _draw(view: View, state: State, lamp: AreaLamp, held: AreaLamp, at: imgui.ImVec2, *, chosen: bool) -> None:
    """Its handle, and while it changes its outline as it will be."""
    em, lines = imgui.get_font_size(), imgui.get_background_draw_list()
    dark, colour = theme.colour_u32((0, 0, 0, 0.6)), theme.colour_u32(theme.AMBER if chosen else theme.TEXT)
    if held.of is None and held != lamp:
        rim = [on_screen(view, state, corner, outside=True) for corner in held.corners]
        for one, other in zip(rim, rim[1:] + rim[:1], strict=True):
            if one is not None and other is not None:
                lines.add_line(one, other, colour, theme.px(1.0))
    lines.add_circle_filled(at, HANDLE_EM * em + theme.px(2.0), dark)
    lines.add_circle_filled(at, HANDLE_EM * em, colour)


__all__ = ["area_gizmos"]
