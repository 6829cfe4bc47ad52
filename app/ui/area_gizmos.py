"""Added lamps with area in the view: each a handle in its middle that can be dragged; its surfaces follow once it is let go."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui

from app.scene.area_lamps import AreaLamp
from app.ui import new_lamps, theme
from app.ui.light_gizmos import GRAB_EM, HANDLE_EM, moved_by_mouse
from app.ui.on_screen import on_screen
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View


def area_gizmos(view: View, state: State) -> bool:
    """Draw the handles, move a lamp with the mouse, and put the one that was let go in its place; whether the mouse is at one."""
    _let_go(view, state)
    if not (state.draw_lights and state.show_ui) or new_lamps.why_fixed(view) is not None:
        state.area_held = False
        return False
    state.area_held = state.area_held and imgui.is_mouse_down(0)
    io, near, least = imgui.get_io(), None, GRAB_EM * imgui.get_font_size()
    for lamp in view.session.surfaces.lamps:
        at = on_screen(view, state, np.array(_place(state, lamp)))
        if at is None:
            continue
        distance = math.hypot(at.x - io.mouse_pos.x, at.y - io.mouse_pos.y)
        if distance < least:
            near, least = lamp, distance
        _draw(view, state, lamp, at)
    free = not io.want_capture_mouse and state.drag_button < 0 and not state.area_held
    if near is not None and free and imgui.is_mouse_clicked(0):
        state.lamp_place, state.area_held = (near.name, near.position), True
        state.area_lamp = [material.name for material in view.session.materials].index(near.name)
    if state.area_held and state.lamp_place is not None and (io.mouse_delta.x or io.mouse_delta.y):
        name, place = state.lamp_place
        x, y, z = moved_by_mouse(view, state, np.array(place)).tolist()
        state.lamp_place = name, (x, y, z)
    at_one = state.area_held or (near is not None and free)
    if at_one:
        imgui.set_mouse_cursor(imgui.MouseCursor_.resize_all)
    return at_one


def _let_go(view: View, state: State) -> None:
    """Where no hand moves it any more, the lamp is there."""
    if state.lamp_place is None or imgui.is_any_item_active() or (state.area_held and imgui.is_mouse_down(0)):
        return
    name, place = state.lamp_place
    state.lamp_place = None
    state.act(lambda: new_lamps.move_surfaces(view, name, place))


def _place(state: State, lamp: AreaLamp) -> tuple[float, float, float]:
    held = state.lamp_place
    return held[1] if held is not None and held[0] == lamp.name else lamp.position


def _draw(view: View, state: State, lamp: AreaLamp, at: imgui.ImVec2) -> None:
    """Its handle, and while it moves its outline there."""
    em, lines = imgui.get_font_size(), imgui.get_background_draw_list()
    dark, colour = theme.colour_u32((0, 0, 0, 0.6)), theme.colour_u32(theme.AMBER)
    place = _place(state, lamp)
    if lamp.of is None and place != lamp.position:
        corners = lamp.corners + np.subtract(place, lamp.position)
        rim = [on_screen(view, state, corner, outside=True) for corner in corners]
        for one, other in zip(rim, rim[1:] + rim[:1], strict=True):
            if one is not None and other is not None:
                lines.add_line(one, other, colour, theme.px(1.0))
    lines.add_circle_filled(at, HANDLE_EM * em + theme.px(2.0), dark)
    lines.add_circle_filled(at, HANDLE_EM * em, colour)


__all__ = ["area_gizmos"]
