"""Automatic exposure: 2^EV = key / exp(mean ln L) [Reinhard02, equation 1], L the luminance that surfaces reflect, ρ (H + A) / π.

Light not yet shot counts as an even ambient A = r̄ / (1 − ρ̄) [Cohen88, section 5]. Before the first shot that is too bright
by what escapes, and by how unevenly light will fall (the mean logarithm of the Cornell box's light lies 1.2 EV below that of
its ambient, of two rooms 2.5 EV): a scene just opened is exposed for a forecast of its light.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.estimate.forecast import forecast
from app.lightmap.lightmap import Lightmap
from app.lightmap.tile_pool import TilePool
from app.options import specs
from app.render.false_colour import LUMINANCE
from app.render.options import DisplayOptions
from app.render.sample import sampled_colours, sampled_irradiance, sampled_tiles
from app.scene.model import F64

KEY = 0.18  # mid grey [Reinhard02]
EXPOSURES = next((s.minimum, s.maximum) for s in specs(DisplayOptions) if s.name == "exposure")  # that can be set
LEAST_ABSORBED = 0.01  # 1 − ρ̄: in a furnace of ρ̄ = 1 light never ends, but its exposure may


def first_exposure(pool: TilePool) -> float:
    """EV for the light to come, before the first shot; 0 where nothing emits. Needs no GPU."""
    materials = pool.scene.materials
    albedo = sampled_colours(pool, [m.albedo for m in materials], pool.albedo_tiles, slice(None))
    emission = sampled_colours(pool, [m.emission for m in materials], pool.emission_tiles, slice(None))
    sky = pool.scene.sky if pool.scene.lit_by_sky else None
    light = forecast(pool.surfaces, albedo, np.float32(np.pi) * emission, sky, pool.scene.lights)
    return _exposure(light.albedo * light.irradiance, light.area)


def exposure_of(lightmap: Lightmap, mean_residual: F64) -> float:
    """EV for the light as it is; 0 where there is none. Waits for the GPU.

    mean_residual: r̄ over all texels, RGB [W/m²], as the energy book has it.
    """
    pool = lightmap.pool
    sample = sampled_tiles(pool)
    area = pool.surfaces.area[sample]
    albedo = sampled_colours(pool, [m.albedo for m in lightmap.scene.materials], pool.albedo_tiles, sample)
    mean_albedo = np.einsum("tijc,tij->c", albedo, area) / max(float(area.sum()), 1e-30)
    ambient = mean_residual / np.maximum(1 - mean_albedo, LEAST_ABSORBED)
    return _exposure(albedo * (sampled_irradiance(lightmap) + ambient), area)


def _exposure(reflected: NDArray[np.floating], area: F64) -> float:
    """reflected: ρ (H + A) (..., 3) [W/m²] of surfaces of that area (...) [m²]."""
    luminance = reflected @ LUMINANCE / np.pi
    lit = (luminance > 0) & (area > 0)
    if not lit.any():
        return 0.0
    exposure = np.log2(KEY) - np.average(np.log2(luminance[lit]), weights=area[lit])
    return float(np.clip(exposure, *EXPOSURES))
