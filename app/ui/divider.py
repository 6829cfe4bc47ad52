"""The line between solution and reference in a split view: drawn, named on both sides, and dragged."""

from __future__ import annotations

from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.ui import theme
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

NEAR_EM = 0.35  # from the line, that takes hold of it
NAME_EM = 0.6  # between the line and its names
GRIP_EM = 0.35


def divider(view: View, state: State) -> bool:
    """Draw the line, and move it with the mouse; whether the mouse is at it."""
    state.split_held = state.split_held and imgui.is_mouse_down(0)
    if view.shown.show != "split" or view.shown.layer == "error":
        state.split_held = False
        return False
    io, em = imgui.get_io(), imgui.get_font_size()
    left, top, width, height = state.view_px
    x = left + view.display.split * width
    over = abs(io.mouse_pos.x - x) <= NEAR_EM * em and top <= io.mouse_pos.y < top + height
    near = over and not io.want_capture_mouse and state.drag_button < 0
    if near and imgui.is_mouse_clicked(0):
        state.split_held = True
    if state.split_held:
        share = min(max((io.mouse_pos.x - left) / max(width, 1.0), 0.0), 1.0)
        view.display = view.display.replace(split=share)
        x = left + share * width
    if near or state.split_held:
        imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew)
    _draw(state, x)
    return near or state.split_held


def _draw(state: State, x: float) -> None:
    em, names = imgui.get_font_size(), ("solution", "reference")
    left, top, width, height = state.view_px
    lines, dark, light = (
        imgui.get_background_draw_list(),
        theme.colour_u32((0, 0, 0, 0.6)),
        theme.colour_u32(theme.TEXT),
    )
    lines.add_line(imgui.ImVec2(x, top), imgui.ImVec2(x, top + height), dark, theme.px(3.0))
    lines.add_line(imgui.ImVec2(x, top), imgui.ImVec2(x, top + height), light, theme.px(1.0))
    lines.add_circle_filled(imgui.ImVec2(x, top + height / 2), GRIP_EM * em, light)
    widths = [imgui.calc_text_size(name).x for name in names]
    room = (x - left - 2 * NAME_EM * em, left + width - x - 2 * NAME_EM * em)
    places = (x - NAME_EM * em - widths[0], x + NAME_EM * em)
    for name, place, needed, there in zip(names, places, widths, room, strict=True):
        if needed <= there:
            y = top + height - 2 * em
            lines.add_text(imgui.ImVec2(place + 1, y + 1), dark, name)
            lines.add_text(imgui.ImVec2(place, y), light, name)
