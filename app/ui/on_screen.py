"""Where a place of the scene is in the view."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from imgui_bundle import imgui

from app.ui.state import State

if TYPE_CHECKING:
    from app.scene.model import F64
    from app.session.view import View


def on_screen(view: View, state: State, place: F64, *, outside: bool = False) -> imgui.ImVec2 | None:
    """Of a place (3,) [m], display units; None where it is behind the eye or, without ``outside``, beside the view."""
    left, top, width, height = state.view_px
    space = view.session.lightmap.space
    local = np.append(space.local_from_world(np.asarray(place, np.float64)), 1.0)
    x, y, _, w = view.camera.clip_from_local(width / height, space) @ local
    if w <= 0 or (not outside and (abs(x) > w or abs(y) > w)):
        return None
    return imgui.ImVec2(left + (x / w + 1) / 2 * width, top + (1 - y / w) / 2 * height)


__all__ = ["on_screen"]
