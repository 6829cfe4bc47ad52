"""False colour: illuminance E_v = 683·Y(H) [lx] and luminance L_v = 683·Y(B)/π [cd/m²] as colours with a scale, or both in W, see
app/render/units.py."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.gpu import Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.tile_pool import TilePool
from app.render.layers import LAYER_SHADERS
from app.render.options import DisplayOptions
from app.render.sample import sampled_colours, sampled_irradiance, sampled_tiles
from app.render.units import LUMINANCE, QUANTITIES, Quantity, per_watt
from app.scene.model import F32, F64

# Per cent of the area of what does not emit, between which a scale found from the light runs. A lamp's own luminance, or the
# illuminance beside it, lies decades above a room's; with them in it all of the room would get one colour.
SHARES = (1.0, 99.0)
DECADES = (0.5, 3.0)  # of a logarithmic scale: fewer would be noise, more cannot be told apart
NICE = (1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)  # ends of a scale, times a power of ten
LIGHT = {"illuminance": "arrives", "luminance": "seen"}  # the quantity of each
UNITS = {  # of what is no light
    "error": "%",
    "expected error": "%",
    "jump at seams": "%",
    "rays": "per texel",
    "texel density": "texels/m",
}
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


ERRORS = Scale(0.1, 100.0, "%")  # the same in every picture, so that they can be compared


def measured(display: DisplayOptions) -> str:
    """What is shown in false colour, a key of LIGHT or of UNITS, or ``off`` for nothing. Layers that are no colours go first."""
    return LAYER_SHADERS[display.layer].measures or display.false_colour


def value_per_radiance(kind: str, units: str = "photometric") -> float:
    """What a layer's radiance of 1 W/(sr m²) measures: lx for irradiance (shown as H/π), cd/m² for radiance B/π, or either in W.
    Errors [%] and counts are no radiance."""
    if kind in UNITS:
        return 100.0 if UNITS[kind] == "%" else 1.0
    return per_watt(units) * (np.pi if kind == "illuminance" else 1.0)


def quantity(kind: str, units: str) -> Quantity:
    """What the scale says that it shows."""
    return QUANTITIES[units][LIGHT[kind]] if kind in LIGHT else Quantity(kind, UNITS[kind])


def false_colour_scale(
    display: DisplayOptions, lightmap: Lightmap, offered: Mapping[str, Texture] | None = None, *, whole: bool = True
) -> Scale:
    """The scale of the display's false colour, found from the light on what does not emit and rounded to short numbers; only its
    lower end where ``false_colour_max`` gives the upper one. Waits for the GPU. Of errors it is always the same; of counts it
    reaches from 0 to the highest of those that are ``offered``; of texel density it is logarithmic around those that most of the
    area has. whole: see ``LightTextures.refresh_ambient``."""
    kind, high, low = measured(display), display.false_colour_max, 0.0
    unit = quantity(kind, display.quantities).unit
    if unit == "%":
        return ERRORS
    if kind == "rays":
        counts = np.frombuffer((offered or {})["rays"].read(), np.float32)
        return Scale(0.0, _nice_above(float(counts.max())), unit)
    if kind == "texel density":
        return _density_scale(lightmap.pool)
    if not high or display.false_colour_log:
        darkest, brightest = _ends(kind, lightmap, display.quantities, whole=whole)
        high = high or _nice_above(brightest)
        if display.false_colour_log:
            fewest, most = DECADES
            low = _nice_below(min(max(darkest, high / 10**most), high / 10**fewest))
    return Scale(low, high, unit)


def colour_map(count: int) -> F64:
    """(count, 3) sRGB in [0, 1]: the colours of the scale from low to high, for a legend."""
    x = np.linspace(0.0, 1.0, count)[:, None]
    powers = x ** np.arange(len(VIRIDIS))
    return np.asarray(np.clip(powers @ VIRIDIS, 0.0, 1.0))


def _ends(kind: str, lightmap: Lightmap, units: str, *, whole: bool) -> tuple[float, float]:
    """Between which the illuminance or luminance of nearly all that does not emit lies, from an even sample of the
    tiles; unlit texels are left out."""
    pool, sample = lightmap.pool, sampled_tiles(lightmap.pool)
    materials, area = lightmap.scene.materials, pool.surfaces.area[sample]
    emission = sampled_colours(pool, [m.emission for m in materials], pool.emission_tiles, sample)
    light: F32 = sampled_irradiance(lightmap, whole=whole) * np.float32(value_per_radiance(kind, units) / np.pi)
    if kind == "luminance":
        light = light * sampled_colours(pool, [m.albedo for m in materials], pool.albedo_tiles, sample)
    values = light @ LUMINANCE
    shown = (area > 0) & (emission.max(-1) == 0) & np.isfinite(values) & (values > 0)
    if not shown.any():
        return 0.0, 0.0
    return _between(values[shown], area[shown])


def _density_scale(pool: TilePool) -> Scale:
    """Of texels along a metre [texels/m], as finely as leaves are cut now."""
    charts = pool.charts
    edge = np.sqrt(np.linalg.norm(np.cross(pool.dpdu, pool.dpdv), axis=1)) * pool.space.scale
    area = pool.scene.normals_areas[1][charts.face_triangle]
    coarsest, finest = _between(1.0 / np.maximum(edge[charts.face_facet], 1e-10), area)
    levels = pool.leaves.level[np.flatnonzero(pool.used)]
    coarsest, finest = coarsest * 2.0 ** int(levels.min()), finest * 2.0 ** int(levels.max())
    wider = max(10.0 ** DECADES[0] / (finest / coarsest), 1.0) ** 0.5  # alike in the middle of the scale
    return Scale(_nice_below(coarsest / wider), _nice_above(finest * wider), UNITS["texel density"])


def _between(values: NDArray[np.floating], area: NDArray[np.floating]) -> tuple[float, float]:
    """Between which nearly all of the area has its values, see SHARES."""
    order = np.argsort(values)
    share = np.cumsum(area[order])
    lowest, highest = values[order][np.searchsorted(share, np.array(SHARES) / 100 * share[-1])]
    return float(lowest), float(highest)


def _nice_above(value: float) -> float:
    if value <= 0:
        return 1.0
    decade = 10.0 ** np.floor(np.log10(value))
    return float(next(step * decade for step in NICE if value <= step * decade * (1 + 1e-9)))


def _nice_below(value: float) -> float:
    decade = 10.0 ** np.floor(np.log10(value))
    return float(next(step * decade for step in reversed(NICE) if value >= step * decade * (1 - 1e-9)))
