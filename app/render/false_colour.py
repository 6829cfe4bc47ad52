"""False colour: illuminance E_v = 179·Y(H) [lx] and luminance L_v = 179·Y(B)/π [cd/m²] as colours with a scale.

179 lm/W is Radiance's luminous efficacy of white light [Ward94; WHTEFFICACY in RADIANCE's color.h], so the numbers are
those that its tools give for the same scene. Y is luminance from linear Rec.709.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from app.atlas.lightmap import Lightmap
from app.render.options import DisplayOptions
from app.render.sample import sampled_colours, sampled_irradiance, sampled_tiles
from app.scene.model import F64

WHITE_EFFICACY = 179.0  # lm/W
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # Rec.709 [IEC 61966-2-1]
BRIGHTEST_SHARE = 99.9  # per cent of the texels that the scale covers
DECADES = 3.0  # of a logarithmic scale
NICE = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)  # tops of a scale, times a power of ten
UNITS = {"illuminance": "lx", "luminance": "cd/m²"}
LAYER = {"illuminance": "irradiance", "luminance": "combined"}  # the layer whose radiance is measured
VIRIDIS = np.array(
    [
        [0.2777273272234177, 0.005407344544966578, 0.3340998053353061],
        [0.1050930431085774, 1.404613529898575, 1.384590162594685],
        [-0.3308618287255563, 0.214847559468213, 0.09509516302823659],
        [-4.634230498983486, -5.799100973351585, -19.33244095627987],
        [6.228269936347081, 14.17993336680509, 56.69055260068105],
        [4.776384997670288, -13.74514537774601, -65.35303263337234],
        [-5.435455855934631, 4.645852612178535, 26.3124352495832],
    ]
)  # sixth-order fit by Matt Zucker (CC0) of viridis by van der Walt and Smith (CC0)


class Scale(NamedTuple):
    """What the lowest and the highest colour mean; ``low`` above 0 is a logarithmic scale."""

    low: float
    high: float
    unit: str


def value_per_radiance(kind: str) -> float:
    """What a layer's radiance of 1 W/(sr m²) measures: lx for irradiance (shown as H/π), cd/m² for radiance B/π."""
    return WHITE_EFFICACY * np.pi if kind == "illuminance" else WHITE_EFFICACY


def false_colour_scale(display: DisplayOptions, lightmap: Lightmap) -> Scale:
    """The scale of the display's false colour. With ``false_colour_max`` 0 its top is found from the light: the 99.9th
    percentile over the texels, lamps left out of luminance, rounded up to a short number. Waits for the GPU."""
    high = display.false_colour_max or _nice_above(_percentile(display.false_colour, lightmap))
    low = high / 10**DECADES if display.false_colour_log else 0.0
    return Scale(low, high, UNITS[display.false_colour])


def colour_map(count: int) -> F64:
    """(count, 3) sRGB in [0, 1]: the colours of the scale from low to high, for a legend."""
    x = np.linspace(0.0, 1.0, count)[:, None]
    powers = x ** np.arange(len(VIRIDIS))
    return np.asarray(np.clip(powers @ VIRIDIS, 0.0, 1.0))


def _percentile(kind: str, lightmap: Lightmap) -> float:
    """What nearly all illuminance [lx] or, lamps left out, luminance [cd/m²] is below, from an even sample of the tiles."""
    nodes, irradiance = lightmap.nodes, sampled_irradiance(lightmap)
    sample = sampled_tiles(nodes)
    shown = nodes.surfaces.area[sample] > 0
    radiance = irradiance * np.float32(np.pi)
    if kind == "luminance":
        emission = sampled_colours(nodes, [m.emission for m in lightmap.scene.materials], nodes.emission_tiles, sample)
        albedo = sampled_colours(nodes, [m.albedo for m in lightmap.scene.materials], nodes.albedo_tiles, sample)
        shown &= emission.max(-1) == 0
        radiance = albedo * irradiance
    values = radiance[shown] @ LUMINANCE * (WHITE_EFFICACY / np.pi)
    values = values[np.isfinite(values)]
    return float(np.percentile(values, BRIGHTEST_SHARE)) if len(values) else 0.0


def _nice_above(value: float) -> float:
    if value <= 0:
        return 1.0
    decade = 10.0 ** np.floor(np.log10(value))
    return float(next(step * decade for step in NICE if value <= step * decade * (1 + 1e-9)))
