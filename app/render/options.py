"""What the picture shows and how it is developed: the display knobs of viewer and headless shot."""

from __future__ import annotations

from dataclasses import dataclass

from app.options import Options, option
from app.render.units import UNITS

LAYERS = (
    *("combined", "irradiance", "residual", "albedo", "charts", "leaves", "texels", "error"),
    *("direct", "indirect", "rays", "expected-error", "local", "seams"),
)
TONE_MAPS = ("clamp", "reinhard", "aces", "agx", "neutral")
INTERPOLATIONS = ("nearest", "bilinear", "bicubic")
SHOWN = ("solution", "reference", "split")
FALSE_COLOURS = ("off", "illuminance", "luminance")  # lux, cd/m²


@dataclass(frozen=True)
class DisplayOptions(Options):
    layer: str = option(
        "combined",
        "what is shown: B, H, r, albedo, charts, quadtree levels, texel density, error or jumps at seams; where the "
        "solver has it direct or indirect light, rays per texel, the error that it expects, or the local set around the observer",
        choices=LAYERS,
    )
    show: str = option("solution", "whose light: the solution's, a reference's, or both side by side", choices=SHOWN)
    split: float = option(
        0.5, "share of the picture that is the solution's, where both are shown", minimum=0, maximum=1
    )
    exposure: float = option(
        0.0, "exposure; where not given, found from the light", unit="EV", minimum=-24, maximum=24, usual=(-8, 8)
    )
    tone_map: str = option("agx", "tone curve", choices=TONE_MAPS)
    interpolation: str = option("bilinear", "what is shown between the middles of texels", choices=INTERPOLATIONS)
    grid: bool = option(False, "draw texels and tiles, in a quadtree each level in its colour")
    last_shooter: bool = option(False, "mark the patch that shot last")
    quantities: str = option("photometric", "what light is counted in: lux, cd/m² and lumen, or watts", choices=UNITS)
    false_colour: str = option("off", "false colour with a legend: lux or cd/m²", choices=FALSE_COLOURS)
    false_colour_log: bool = option(True, "logarithmic false-colour scale")
    false_colour_max: float = option(
        0.0,
        "top of the false-colour scale; 0 = found from the light",
        unit="as the scale",
        minimum=0,
        maximum=1e9,
        logarithmic=True,
        zero="auto",
    )
