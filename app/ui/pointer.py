"""What lies under the pointer in the 3-D view: its light in the status bar, and beside the pointer where colours are a scale."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui

from app.render.false_colour import LIGHT, measured
from app.render.units import QUANTITIES, measure
from app.ui import widgets
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.picking import Picked
    from app.session.view import View

SECONDS = 0.15  # between two looks: one takes a few ms
DIGITS = 3


def follow(view: View, state: State, seconds: float) -> None:
    """Look at what is under the pointer, now and then and not while the eye moves; nothing is there beside the view."""
    state.pointed_age += seconds
    io = imgui.get_io()
    left, top, width, height = state.view_px
    x, y = io.mouse_pos.x - left, io.mouse_pos.y - top
    inside = 0 <= x < width and 0 <= y < height and not io.want_capture_mouse
    if not inside or state.drag_button >= 0 or state.flying or state.flight is not None:
        state.pointed, state.pointed_at = None, None
        return
    place, still = (int(x * state.ratio), int(y * state.ratio)), view.still
    known = None if still is None else (place, still)
    if state.pointed_age < SECONDS or (known is not None and known == state.pointed_at):
        return
    state.pointed_age, state.pointed_at = 0.0, known

    def look() -> None:
        state.pointed = view.under(*place)

    state.act(look)


def beside(view: View, state: State) -> None:
    """The value of the false colour under the pointer."""
    kind = measured(view.shown)
    if state.pointed is not None and kind in LIGHT:
        imgui.set_tooltip(amount(LIGHT[kind], state.pointed, view.display.quantities))


def in_words(view: View, state: State) -> tuple[str, ...]:
    """Light that arrives and light that is seen, and of which material."""
    pointed, materials = state.pointed, view.session.materials
    if pointed is None:
        return ()
    name = materials[pointed.material].name if pointed.material < len(materials) else ""
    amounts = [amount(what, pointed, view.display.quantities) for what in ("arrives", "seen")]
    return *amounts, name or f"material {pointed.material}"


def amount(what: str, picked: Picked, quantities: str) -> str:
    """Light that arrives at a point or is seen of it, with its unit."""
    light = picked.H if what == "arrives" else tuple(np.array(picked.B) / np.pi)
    return f"{widgets.number(measure(light, quantities), DIGITS)} {QUANTITIES[quantities][what].unit}"
