"""From linear radiance to the screen: y = sRGB(curve(2^EV · L)); the tone curves are in app/shaders/render/tone_maps."""

from __future__ import annotations

from typing import Any

import numpy as np

from app.render.false_colour import Scale, measured, value_per_radiance
from app.render.options import DisplayOptions
from app.scene.model import F64


def curve(display: DisplayOptions, scale: Scale | None, *, exposed: bool) -> tuple[str, dict[str, Any]]:
    """The shader of the display's tone curve or false colour, and its uniforms; ``u_gain`` multiplies light.

    scale: of the false colour, where one is on. exposed: False for what is no light, shown without exposure and curve.
    """
    if scale:
        uniforms = {
            "u_range": (scale.low, scale.high),
            "u_logarithmic": float(scale.low > 0),
            "u_per_radiance": value_per_radiance(measured(display), display.quantities),
        }
        return "false_colour", uniforms | {"u_gain": 1.0}
    return "tone_maps/" + (display.tone_map if exposed else "clamp"), {
        "u_gain": 2.0**display.exposure if exposed else 1.0
    }


def encode_srgb(linear: F64) -> F64:
    """Linear [0, 1] to sRGB [0, 1] [IEC 61966-2-1]."""
    return np.asarray(
        np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)
    )
