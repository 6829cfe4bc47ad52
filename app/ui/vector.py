"""Three numbers that are dragged or typed: a place or a direction."""

from __future__ import annotations

import math

from imgui_bundle import imgui

from app.ui import slider, widgets
from app.ui.state import RGB

UNTWEAKED = int(imgui.SliderFlags_.no_speed_tweaks)  # Shift is slower here
STEP = 0.005  # of the scene's diagonal, for a pixel that a place is dragged by


def edit_vector(label: str, value: RGB, came: RGB, step: float, text: str, *, off: str = "", more: str = "") -> RGB:
    """The vector after it was edited. came: what a right click brings back. step: for a pixel. text: the format of a number. off:
    why it cannot be edited now, if so; more: that its tooltip says."""
    widgets.labelled(label, changed=value != came)
    imgui.begin_group()
    imgui.set_next_item_width(-1)
    shown = [component + 0.0 for component in value]  # -0 is 0
    slow = slider.FINE if imgui.get_io().key_shift else 1.0
    changed, moved = imgui.drag_float3(f"##{label}", shown, slow * step, 0.0, 0.0, text, UNTWEAKED)
    imgui.end_group()
    lines = [f"{more}."] * bool(more) + [f"Not now: {off}." if off else f"{widgets.SLIDES}."]
    widgets.tooltip("\n".join(lines))
    if off:
        return value
    if widgets.put_back(False, True):
        return came
    if not changed or not all(map(math.isfinite, moved)):
        return value
    x, y, z = (float(c) for c in moved)
    return (x, y, z)


__all__ = ["STEP", "edit_vector"]
