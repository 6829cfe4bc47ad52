"""Sky, a section of the Lights panel: its kind, strength and colour, and where the sun stands. Light follows live."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING

from imgui_bundle import imgui

from app.scene.sky import DEFAULT_SUN, LEAST_TURBIDITY, MOST_TURBIDITY, Sky, Sun
from app.ui import colour, slider, widgets
from app.ui.state import State

if TYPE_CHECKING:
    from app.session.view import View

NONE = "none"
STRENGTH = slider.Range(0.0, 100.0, logarithmic=True)
LOWEST = 0.1  # degrees above the horizon


def draw(view: View, state: State) -> None:
    """The section, for a scene that has a sky, or came with one."""
    came = view.session.read.sky or view.session.edited_scene.sky
    if came is None or not widgets.fold("Sky"):
        return
    sky = view.session.edited_scene.sky
    imgui.push_id("sky")
    edited = _kind(sky, came)
    if edited is not None:
        edited = _sun(_colour(edited, came), came)
    imgui.pop_id()
    if edited is not sky:
        state.act(lambda: view.session.set_sky(edited))


def _kind(sky: Sky | None, came: Sky) -> Sky | None:
    """Pictures are only there for a scene that came with one."""
    kinds = (NONE, "uniform", "clear", *(("image",) if came.image is not None else ()))
    now = NONE if sky is None else sky.kind
    widgets.labelled("Kind", changed=now != came.kind)
    imgui.set_next_item_width(-1)
    changed, index = imgui.combo("##kind", kinds.index(now), list(kinds))
    widgets.tooltip(
        "Where light comes from that meets no surface: nowhere, everywhere alike, a clear sky, or a picture of one. "
        f"{widgets.AS_READ}"
    )
    if widgets.put_back(False, True):
        return came
    kind = kinds[index]
    if not changed or kind == now:
        return sky
    before = sky or came
    if kind == "uniform":
        return dataclasses.replace(before, kind="uniform", image=None)
    if kind == "clear":
        return dataclasses.replace(before, kind="clear", image=None, sun=before.sun or DEFAULT_SUN)
    return None if kind == NONE else dataclasses.replace(before, kind="image", image=came.image)


def _colour(sky: Sky, came: Sky) -> Sky:
    widgets.labelled("Strength", changed=(sky.colour, sky.strength) != (came.colour, came.strength))
    tint = widgets.put_back(colour.edit_colour("##sky colour", sky.colour), came.colour)
    imgui.same_line()
    imgui.set_next_item_width(-1)
    strength = slider.slide("##sky strength", sky.strength, STRENGTH, "× %.3g")
    widgets.tooltip(f"Multiplies all light of the sky, and of its sun. {widgets.SLIDES}")
    strength = widgets.put_back(strength, came.strength)
    same = (tint, strength) == (sky.colour, sky.strength)
    return sky if same else dataclasses.replace(sky, colour=tint, strength=strength)


def _sun(sky: Sky, came: Sky) -> Sky:
    sun, first = sky.sun, came.sun or sky.sun or DEFAULT_SUN
    if sky.kind != "clear":
        widgets.labelled("Sun")
        changed, on = imgui.checkbox("##sun", sun is not None)
        if changed:
            return dataclasses.replace(sky, sun=DEFAULT_SUN if on else None)
    if sun is None:
        return sky
    help = "of the sun, from north, -z, over east"
    azimuth = _slider("Sun azimuth", help, sun.azimuth, first.azimuth, (0.0, 360.0), "%.1f°")
    height = _slider("Sun height", "above the horizon", sun.height, first.height, (LOWEST, 90.0), "%.1f°")
    ends = LEAST_TURBIDITY, MOST_TURBIDITY
    turbidity = _slider("Haze", "turbidity of the air", sky.turbidity, came.turbidity, ends, "%.2g")
    same = (azimuth, height, turbidity) == (sun.azimuth, sun.height, sky.turbidity)
    return sky if same else dataclasses.replace(sky, sun=Sun(azimuth, height), turbidity=turbidity)


def _slider(label: str, help: str, value: float, came: float, ends: tuple[float, float], text: str) -> float:
    """Draw one slider of the sky; the value that it was moved to."""
    widgets.labelled(label, changed=value != came)
    imgui.set_next_item_width(-1)
    moved = slider.slide(f"##{label}", value, slider.Range(*ends), text)
    widgets.tooltip(f"{help[:1].upper() + help[1:]}. {widgets.SLIDES}")
    return float(widgets.put_back(moved, came))


__all__ = ["draw"]
