"""In what units a file counts lengths and light, and which way is up in it."""

from __future__ import annotations

from dataclasses import dataclass

from app.options import Options, option

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}  # m
GUESSED = "auto"
PHOTOMETRIC = "photometric"
LIGHT_UNITS = (PHOTOMETRIC, "radiometric", "watts")


@dataclass(frozen=True)
class FileOptions(Options):
    unit: str = option(
        GUESSED, "what lengths in the file are counted in; guessed where plain", choices=(GUESSED, *UNITS)
    )
    light_units: str = option(
        PHOTOMETRIC,
        "of point, spot and directional lights in glTF: cd and lx, as exporters write them by default; W/sr and W/m² (Blender's "
        '"Unitless"); or W of point and spot (its "Raw")',
        choices=LIGHT_UNITS,
    )
    up: str = option(
        GUESSED, "the axis that points upwards in the file; guessed where plain", choices=(GUESSED, "y", "z")
    )
