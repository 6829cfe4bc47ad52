"""Light in numbers, by one choice for all of them: radiometric (W) or photometric (lm), of which 683 are a watt.

Both are of the luminance Y of linear Rec.709, the one number for three channels: see colorimetry.py.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np

from app.scene.colorimetry import LUMENS_PER_WATT

Units = Literal["photometric", "radiometric"]

UNITS: tuple[Units, ...] = ("photometric", "radiometric")
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # Rec.709 [IEC 61966-2-1]


class Quantity(NamedTuple):
    """A quantity of light, by its name and the unit that it is counted in."""

    name: str
    unit: str


# by what light does: it arrives at a surface, leaves it, is seen of it, goes out into a direction, or flows in all
QUANTITIES: Mapping[str, Mapping[str, Quantity]] = {
    "photometric": {
        "arrives": Quantity("illuminance", "lx"),
        "leaves": Quantity("luminous exitance", "lm/m²"),
        "seen": Quantity("luminance", "cd/m²"),
        "directed": Quantity("luminous intensity", "cd"),
        "flows": Quantity("luminous flux", "lm"),
    },
    "radiometric": {
        "arrives": Quantity("irradiance", "W/m²"),
        "leaves": Quantity("radiosity", "W/m²"),
        "seen": Quantity("radiance", "W/(sr m²)"),
        "directed": Quantity("radiant intensity", "W/sr"),
        "flows": Quantity("radiant flux", "W"),
    },
}


def per_watt(units: str) -> float:
    """How much of the unit a watt is."""
    return LUMENS_PER_WATT if units == "photometric" else 1.0


def measure(rgb: Sequence[float], units: str) -> float:
    """One number for three channels in W."""
    return per_watt(units) * float(np.asarray(rgb, np.float64) @ LUMINANCE)
