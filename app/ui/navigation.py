"""Mouse and keys in the 3-D view: orbit, pan, dolly, fly, pick. Movement is per second, never per frame."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from imgui_bundle import imgui

from app.session.picking import read_again
from app.ui import theme
from app.ui.divider import divider
from app.ui.state import State

if TYPE_CHECKING:
    from app.render.camera import CameraView
    from app.scene.model import Camera
    from app.session.session import Session

CLICK_PX = 4.0  # a press that moved less is a click
TURN_PER_VIEW = math.pi  # orbit angle for a drag over the view's height [rad]
DOLLY_PER_NOTCH = 0.88  # factor on the distance for one notch of the wheel
FLY_SPEED = 0.4  # scene radii per second
FAST, SLOW = 4.0, 0.25  # with Shift, with Ctrl
FOCUS_SHARE = 0.15  # of the scene's radius fills the view after a focus on a point
FOCUS_SECONDS = 0.35
REFRESH_SECONDS = 0.25  # between two looks at the picked texel while light is being shot
MARKER_PX = 5.0

Key = imgui.Key
FLY = ((Key.d, Key.a), (Key.e, Key.q), (Key.w, Key.s))  # right, up, forward: plus and minus


@dataclass
class Flight:
    """The eye on its way to a focus: from one place and distance to another."""

    start: tuple[Any, float]  # eye (3,) [m], distance [m]
    end: tuple[Any, float]
    seconds: float = 0.0


def navigate(session: Session, state: State, seconds: float) -> None:
    """Move the camera and pick, from this frame's events."""
    io = imgui.get_io()
    left, top, width, height = state.view_px
    x, y = io.mouse_pos.x - left, io.mouse_pos.y - top
    inside = 0 <= x < width and 0 <= y < height and not io.want_capture_mouse
    taken = divider(session, state)
    for button in range(3):
        if inside and not (taken and button == 0) and imgui.is_mouse_clicked(button) and state.drag_button < 0:
            state.drag_button, state.flight = button, None
    if state.drag_button >= 0:
        _drag(session, state, x, y, height)
    if inside and io.mouse_wheel:
        session.view.dolly(DOLLY_PER_NOTCH**io.mouse_wheel)
    state.flying = not io.want_text_input and _fly(session, state, io, seconds)
    _advance_flight(session, state, seconds)
    _refresh(session, state, seconds)
    _marker(session, state)


def _drag(session: Session, state: State, x: float, y: float, height: float) -> None:
    io, button = imgui.get_io(), state.drag_button
    moved = io.mouse_drag_max_distance_sqr[button] > CLICK_PX**2
    if not imgui.is_mouse_down(button):
        state.drag_button = -1
        if button == 0 and not moved:
            _pick(session, state, x, y)
    elif moved and button == 0:
        turn = TURN_PER_VIEW / height
        session.view.orbit(-io.mouse_delta.x * turn, io.mouse_delta.y * turn)
    elif moved:
        session.view.pan(-io.mouse_delta.x / height, io.mouse_delta.y / height)


def _fly(session: Session, state: State, io: Any, seconds: float) -> bool:
    """Whether a key of flight is held."""
    step = [float(imgui.is_key_down(plus)) - float(imgui.is_key_down(minus)) for plus, minus in FLY]
    if any(step):
        state.flight = None
        pace = FLY_SPEED * session.lightmap.space.scale * (FAST if io.key_shift else SLOW if io.key_ctrl else 1.0)
        session.view.fly(*(s * pace * seconds for s in step))
    return any(step)


def focus(session: Session, state: State) -> None:
    """Travel to what was picked, or to where the whole scene fits."""
    frame = session.lightmap.space
    goal = session.view.copy()
    if state.picked is not None:
        goal.focus(np.asarray(state.picked.position), FOCUS_SHARE * frame.scale)
    else:
        goal.focus(frame.centre, frame.scale)
    state.flight = Flight((session.view.eye.copy(), session.view.distance), (goal.eye.copy(), goal.distance))


def look_through(session: Session, state: State, camera: Camera) -> None:
    """Stand where a camera of the scene stands."""
    state.flight = None
    session.look_through(camera)


def _advance_flight(session: Session, state: State, seconds: float) -> None:
    flight = state.flight
    if flight is None:
        return
    flight.seconds += seconds
    t = min(flight.seconds / FOCUS_SECONDS, 1.0)
    ease = t * t * (3 - 2 * t)
    (eye, distance), (end_eye, end_distance) = flight.start, flight.end
    view: CameraView = session.view
    view.world_from_camera[:3, 3] = eye + (end_eye - eye) * ease
    view.distance = distance + (end_distance - distance) * ease
    if t >= 1.0:
        state.flight = None


def _pick(session: Session, state: State, x: float, y: float) -> None:
    """Inspect what is seen at (x, y) [display units from the view's top left]."""
    pixel = int(x * state.ratio), int(y * state.ratio)
    state.picked_age = 0.0

    def look() -> None:
        state.picked = session.pick(*pixel)

    state.act(look)


def _refresh(session: Session, state: State, seconds: float) -> None:
    """While light is being shot, the point that was picked is read again now and then: the point and not the pixel, which shows
    another one when the eye moves or the view gets another size."""
    state.picked_age += seconds
    picked = state.picked
    if picked is None or not session.running or state.picked_age < REFRESH_SECONDS:
        return
    state.picked_age = 0.0

    def look() -> None:
        state.picked = read_again(session, picked)

    state.act(look)


def _marker(session: Session, state: State) -> None:
    """A ring around the picked point."""
    if state.picked is None:
        return
    left, top, width, height = state.view_px
    frame = session.lightmap.space
    local = np.append(frame.local_from_world(np.asarray(state.picked.position, np.float64)), 1.0)
    x, y, _, w = session.view.clip_from_local(width / height, frame) @ local
    if w <= 0 or abs(x) > w or abs(y) > w:
        return
    at = imgui.ImVec2(left + (x / w + 1) / 2 * width, top + (1 - y / w) / 2 * height)
    draw_list = imgui.get_background_draw_list()
    draw_list.add_circle(at, MARKER_PX + 1, theme.colour_u32((0, 0, 0, 0.6)), 0, 3.0)
    draw_list.add_circle(at, MARKER_PX + 1, theme.colour_u32(theme.AMBER), 0, 1.5)
