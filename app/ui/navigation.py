"""Mouse and keys in the 3-D view: orbit, pan, dolly, fly, pick. Movement is per second, never per frame."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from imgui_bundle import imgui

from app.ui import pointer, theme
from app.ui.area_gizmos import area_gizmos
from app.ui.divider import divider
from app.ui.light_gizmos import light_gizmos
from app.ui.on_screen import on_screen
from app.ui.state import Flight, State

if TYPE_CHECKING:
    from app.scene.model import Camera
    from app.session.view import View

CLICK_PX = 4.0  # a press that moved less is a click
TURN_PER_VIEW = math.pi  # orbit angle for a drag over the view's height [rad]
DOLLY_PER_NOTCH = 0.88  # factor on the distance for one notch of the wheel
FLY_SPEED = 0.4  # scene radii per second, but
FASTEST = 5.0  # m/s at most: one walks through a large world
FAST, SLOW = 4.0, 0.25  # with Shift, with Alt
FOCUS_SHARE = 0.15  # of the scene's radius fills the view after a focus on a point
FOCUS_SECONDS = 0.35
REFRESH_SECONDS = 0.25  # between two looks at the picked texel while light is being shot
MARKER_PX = 6.0

Key = imgui.Key
FLY = ((Key.d, Key.a), (Key.e, Key.q), (Key.w, Key.s))  # right, up, forward: plus and minus


def navigate(view: View, state: State, seconds: float) -> None:
    """Move the camera and pick, from this frame's events."""
    io = imgui.get_io()
    left, top, width, height = state.view_px
    x, y = io.mouse_pos.x - left, io.mouse_pos.y - top
    inside = 0 <= x < width and 0 <= y < height and not io.want_capture_mouse
    taken = divider(view, state) or light_gizmos(view, state) or area_gizmos(view, state)
    for button in range(3):
        if inside and not (taken and button == 0) and imgui.is_mouse_clicked(button) and state.drag_button < 0:
            state.drag_button, state.flight = button, None
    if state.drag_button >= 0:
        _drag(view, state, x, y, height)
    if inside and io.mouse_wheel:
        view.camera.dolly(DOLLY_PER_NOTCH**io.mouse_wheel)
    state.flying = not io.want_text_input and _fly(view, state, io, seconds)
    _advance_flight(view, state, seconds)
    _refresh(view, state, seconds)
    pointer.follow(view, state, seconds)
    pointer.beside(view, state)
    _marker(view, state)


def _drag(view: View, state: State, x: float, y: float, height: float) -> None:
    io, button = imgui.get_io(), state.drag_button
    moved = io.mouse_drag_max_distance_sqr[button] > theme.px(CLICK_PX) ** 2
    if not imgui.is_mouse_down(button):
        state.drag_button = -1
        if button == 0 and not moved:
            _pick(view, state, x, y)
    elif moved and button == 0:
        turn = TURN_PER_VIEW / height
        view.camera.orbit(-io.mouse_delta.x * turn, io.mouse_delta.y * turn)
    elif moved:
        view.camera.pan(-io.mouse_delta.x / height, io.mouse_delta.y / height)


def _fly(view: View, state: State, io: Any, seconds: float) -> bool:
    """Whether a key of flight is held; with Ctrl it is a command."""
    if io.key_ctrl or io.key_super:
        return False
    step = [float(imgui.is_key_down(plus)) - float(imgui.is_key_down(minus)) for plus, minus in FLY]
    if any(step):
        state.flight = None
        pace = min(FLY_SPEED * view.session.lightmap.space.scale, FASTEST)
        pace *= FAST if io.key_shift else SLOW if io.key_alt else 1.0
        view.camera.fly(*(s * pace * seconds for s in step))
    return any(step)


def focus(view: View, state: State) -> None:
    """Travel to what was picked, or to where the whole scene fits."""
    space = view.session.lightmap.space
    goal = view.camera.copy()
    if state.picked is not None:
        goal.focus(np.asarray(state.picked.position), FOCUS_SHARE * space.scale)
    else:
        goal.focus(space.centre, space.scale)
    state.flight = Flight((view.camera.eye.copy(), view.camera.distance), (goal.eye.copy(), goal.distance))


def look_through(view: View, state: State, camera: Camera) -> None:
    """Stand where a camera of the scene stands."""
    state.flight = None
    view.look_through(camera)


def _advance_flight(view: View, state: State, seconds: float) -> None:
    flight = state.flight
    if flight is None:
        return
    flight.seconds += seconds
    t = min(flight.seconds / FOCUS_SECONDS, 1.0)
    ease = t * t * (3 - 2 * t)
    (eye, distance), (end_eye, end_distance) = flight.start, flight.end
    view.camera.world_from_camera[:3, 3] = eye + (end_eye - eye) * ease
    view.camera.distance = distance + (end_distance - distance) * ease
    if t >= 1.0:
        state.flight = None


def _pick(view: View, state: State, x: float, y: float) -> None:
    """Inspect what is seen at (x, y) [display units from the view's top left], and select its material."""
    pixel = int(x * state.ratio), int(y * state.ratio)
    state.picked_age = 0.0

    def look() -> None:
        state.picked = view.pick(*pixel)
        if state.picked is not None:
            state.material, state.reveal_material = state.picked.material, True

    state.act(look)


def _refresh(view: View, state: State, seconds: float) -> None:
    """While light is being shot, the point that was picked is read again now and then: the point and not the pixel, which shows
    another one when the eye moves or the view gets another size."""
    state.picked_age += seconds
    picked = state.picked
    if picked is None or not view.session.run.running or state.picked_age < REFRESH_SECONDS:
        return
    state.picked_age = 0.0

    def look() -> None:
        state.picked = view.read_again(picked)

    state.act(look)


def _marker(view: View, state: State) -> None:
    """A ring around the picked point, and the rays of its texel."""
    drawn = state.draw_rays and state.picked is not None and state.picked.area > 0
    view.marked = state.picked.texel if drawn and state.picked is not None else None
    if state.picked is None:
        return
    at = on_screen(view, state, np.asarray(state.picked.position))
    if at is None:
        return
    draw_list = imgui.get_background_draw_list()
    for colour, thick in (((0, 0, 0, 0.6), 3.0), (theme.AMBER, 1.5)):
        draw_list.add_circle(at, theme.px(MARKER_PX), theme.colour_u32(colour), 0, theme.px(thick))
