"""Light in numbers, by one choice for all of them: radiometric (W) or photometric (lm), of which 179 are a watt of white light.

179 lm/W is Radiance's luminous efficacy of white light [Ward94; WHTEFFICACY in RADIANCE's color.h], so the numbers are
those that its tools give for the same scene. One number for three channels is their luminance Y from linear Rec.709, in watts as
in lumen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple

import numpy as np

Units = Literal["photometric", "radiometric"]

UNITS: tuple[Units, ...] = ("photometric", "radiometric")
WHITE_EFFICACY = 179.0  # lm/W
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
    return WHITE_EFFICACY if units == "photometric" else 1.0


def measure(rgb: Sequence[float], units: str) -> float:
    """One number for three channels in W."""
    return per_watt(units) * float(np.asarray(rgb, np.float64) @ LUMINANCE)
