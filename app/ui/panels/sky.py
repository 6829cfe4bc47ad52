"""Sky, a section of the Lights panel: its kind, strength and colour, and where the sun stands. Light follows live."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from imgui_bundle import imgui

from app.scene.sky import DEFAULT_SUN, LEAST_TURBIDITY, MOST_TURBIDITY, Sky, Sun
from app.ui import colour, widgets
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

NONE = "none"
STRONGEST = 100.0  # end of the slider of strength
LOWEST = 0.1  # degrees above the horizon


def draw(view: View, state: State) -> None:
    """The section, for a scene that came with a sky."""
    came = view.session.unedited.sky
    if came is None or not widgets.fold("Sky"):
        return
    sky = view.session.edited_scene.sky
    imgui.push_id("sky")
    edited = _kind(sky, came)
    if edited is not None:
        edited = _sun(_colour(edited))
    imgui.pop_id()
    if edited is not sky:
        state.act(lambda: view.session.set_sky(edited))


def _kind(sky: Sky | None, came: Sky) -> Sky | None:
    """Pictures are only there for a scene that came with one."""
    kinds = (NONE, "uniform", "clear", *(("image",) if came.image is not None else ()))
    now = NONE if sky is None else sky.kind
    widgets.labelled("Kind")
    imgui.set_next_item_width(-1)
    changed, index = imgui.combo("##kind", kinds.index(now), list(kinds))
    widgets.tooltip(
        "Where light comes from that meets no surface: nowhere, everywhere alike, a clear sky, or a picture of one"
    )
    kind = kinds[index]
    if not changed or kind == now:
        return sky
    before = sky or came
    if kind == "uniform":
        return dataclasses.replace(before, kind="uniform", image=None)
    if kind == "clear":
        return dataclasses.replace(before, kind="clear", image=None, sun=before.sun or DEFAULT_SUN)
    return None if kind == NONE else dataclasses.replace(before, kind="image", image=came.image)


def _colour(sky: Sky) -> Sky:
    widgets.labelled("Strength")
    tint = colour.edit_colour("##sky colour", sky.colour)
    imgui.same_line()
    imgui.set_next_item_width(-1)
    flags = widgets.SLIDER | widgets.LOGARITHMIC
    strength = _changed(imgui.slider_float, "##sky strength", sky.strength, 0.0, STRONGEST, "%.3g", flags)
    widgets.tooltip("Multiplies all light of the sky, and of its sun")
    if tint != sky.colour:
        sky = dataclasses.replace(sky, colour=tint)
    return sky if strength is None else dataclasses.replace(sky, strength=strength)


def _sun(sky: Sky) -> Sky:
    sun = sky.sun
    if sky.kind != "clear":
        widgets.labelled("Sun")
        changed, on = imgui.checkbox("##sun", sun is not None)
        if changed:
            return dataclasses.replace(sky, sun=DEFAULT_SUN if on else None)
    if sun is None:
        return sky
    azimuth = _slider("Sun azimuth", "of the sun, from north, -z, over east", sun.azimuth, 0.0, 360.0, "%.1f°")
    height = _slider("Sun height", "above the horizon", sun.height, LOWEST, 90.0, "%.1f°")
    turbidity = _slider("Haze", "turbidity of the air", sky.turbidity, LEAST_TURBIDITY, MOST_TURBIDITY, "%.2g")
    if azimuth is not None or height is not None:
        sky = dataclasses.replace(
            sky, sun=Sun(sun.azimuth if azimuth is None else azimuth, sun.height if height is None else height)
        )
    return sky if turbidity is None else dataclasses.replace(sky, turbidity=turbidity)


def _slider(label: str, help: str, value: float, low: float, high: float, text: str) -> float | None:
    """What it was moved to, if it was."""
    widgets.labelled(label)
    imgui.set_next_item_width(-1)
    moved = _changed(imgui.slider_float, f"##{label}", value, low, high, text, widgets.SLIDER)
    widgets.tooltip(help[:1].upper() + help[1:])
    return moved


def _changed(widget: Callable[..., tuple[bool, Any]], *arguments: object) -> Any:
    """What a widget holds afterwards, if it was changed to what is a number."""
    changed, value = widget(*arguments)
    return value if changed and value == value else None


__all__ = ["draw"]
