"""Automatic exposure: 2^EV = key / exp(mean ln L) [Reinhard02, equation 1], L the luminance that surfaces reflect, ρ (H + A) / π,
where the camera sees them; lamps and the sky are to be bright, whatever they are.

L counts as no more than what one pixel in a hundred exceeds, a glare beside a lamp, and not at all where it is RANGE below that:
no exposure that shows the rest shows it, and of what light hardly reaches there is no end of darkness [Ward97].

Light not yet shot counts as an even ambient A = r̄ / (1 − ρ̄) [Cohen88, section 5]. Before the first shot that is too bright
by what escapes, and by how unevenly light will fall (the mean logarithm of the Cornell box's light lies 1.2 EV below that of
its ambient, of two rooms 2.5 EV): a scene just opened is exposed for a forecast of its light.

What is seen becomes mid grey, whatever it is. No luminance tells a village at night from a lit room, both of about 5 cd/m² in
the scenes that come along, nor would a key that follows the mean luminance [Krawczyk05]. So a scene may say by how many EV it is
to be brighter or darker: exposure compensation, as cameras and engines have it.

What leaks through closed corners into a room without light is a few bright lines in the dark. It is exposed as if what is emitted
fell evenly on everything: dark, as it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.estimate.forecast import forecast
from app.lightmap.lightmap import Lightmap
from app.lightmap.tile_pool import TilePool
from app.options import specs
from app.render.options import DisplayOptions
from app.render.sample import colours_of, irradiance_at, sampled_colours, sampled_tiles, strongest_of
from app.render.seen import Texels
from app.render.units import LUMINANCE
from app.scene.model import F32, F64, Scene

KEY = 0.18  # mid grey [Reinhard02]
BRIGHT = 0.99  # quantile of what is seen
FORECAST = 128  # texels of those seen whose light is forecast, at most
RANGE = 2.0**-8  # what is darker than that beside what is bright, a screen of 8 bits shows as black
EXPOSURES = next((s.minimum, s.maximum) for s in specs(DisplayOptions) if s.name == "exposure")  # that can be set
TRAPPED = 1e-4  # of that even light: what leaks from texel to texel through closed corners is less
LEAKS = 1e-3  # of that even light: more is a room that is lit, or a bright window in the dark
TO_COME = 0.01  # of what is emitted: with less than that to come a dark room is taken for dark
LEAST_ABSORBED = 0.01  # 1 − ρ̄: in a furnace of ρ̄ = 1 light never ends, but its exposure may


def first_exposure(pool: TilePool, seen: Texels, scene: Scene | None = None) -> float:
    """EV for the light to come on what is seen, before the first shot; 0 where there is none. Needs no GPU. scene: the
    pool's, as it was edited."""
    return forecast_of(pool, seen, scene)[0]


def forecast_of(pool: TilePool, seen: Texels, scene: Scene | None = None) -> tuple[float, F64]:
    """As ``first_exposure``, and the median of H to come on what is seen, RGB (3,) [W/m²]."""
    scene = scene or pool.scene
    materials = scene.materials
    albedos, emissions = ([getattr(m, of) for m in materials] for of in ("albedo", "emission"))
    pi = np.float32(np.pi)

    def albedo(texels: NDArray[np.int64]) -> F32:
        return colours_of(pool, albedos, pool.albedo_tiles, texels)

    def exitance(texels: NDArray[np.int64]) -> F32:
        return pi * colours_of(pool, emissions, pool.emission_tiles, texels)

    some = Texels(*(values[:: -(-len(seen.slot) // FORECAST) or 1] for values in seen))
    asked = (some.slot * pool.tile + some.row) * pool.tile + some.column
    sky = scene.sky if scene.lit_by_sky else None
    strongest = pi * strongest_of(pool, emissions, pool.emission_tiles)
    light = forecast(pool.surfaces, albedo, exitance, strongest, asked, sky, scene.lights)
    usual = np.median(light.asked, axis=0) if len(asked) else np.zeros(3)
    return _exposure(albedo(asked) * light.asked, scene.exposure), usual


def exposure_of(lightmap: Lightmap, seen: Texels, mean_residual: F64, mean_emitted: F64 | None = None) -> float:
    """EV for the light as it is on what is seen; 0 where there is none. Waits for the GPU.

    mean_residual: r̄ over all texels, RGB [W/m²], as the energy book has it; mean_emitted: what is emitted, likewise, if known.
    """
    pool = lightmap.pool
    sample = sampled_tiles(pool)
    area = pool.surfaces.area[sample]
    factors = [m.albedo for m in lightmap.scene.materials]
    albedo = sampled_colours(pool, factors, pool.albedo_tiles, sample)
    mean_albedo = np.einsum("tijc,tij->c", albedo, area) / max(float(area.sum()), 1e-30)
    ambient = mean_residual / np.maximum(1 - mean_albedo, LEAST_ABSORBED)
    material = pool.scene.material_ids[pool.charts.face_triangle[pool.surfaces.face[seen]]]
    own = np.array(factors)[material] * (1.0 if pool.albedo_tiles is None else pool.albedo_tiles[seen])
    light = irradiance_at(lightmap, seen)
    if mean_emitted is not None and mean_residual.mean() < TO_COME * mean_emitted.mean():
        if _only_leaks(light.mean(1), float(mean_emitted.mean())):
            return _exposure(own * mean_emitted, pool.scene.exposure)
    return _exposure(own * (light + ambient), pool.scene.exposure)


def _only_leaks(light: F64, even: float) -> bool:
    """Whether so little light (n,) is seen as leaks through closed corners, and next to none on most of what is seen: light that
    comes into a room in earnest is reflected onto all of it."""
    return len(light) > 0 and light.mean() < LEAKS * even and bool(np.median(light) <= RANGE * light.mean())


def is_trapped(lightmap: Lightmap, seen: Texels, even: float) -> bool:
    """Whether no light to speak of is where the camera sees surfaces, and no lamp either. Waits for the GPU.

    even: H if all that is emitted fell evenly on all surfaces, mean over RGB [W/m²].
    """
    pool = lightmap.pool
    material = pool.scene.material_ids[pool.charts.face_triangle[pool.surfaces.face[seen]]]
    emits = np.array([m.emits for m in lightmap.scene.materials])[material].any()
    return bool(len(material) and not emits and irradiance_at(lightmap, seen).mean() < TRAPPED * even)


def _exposure(reflected: NDArray[np.floating], compensation: float) -> float:
    """reflected: ρ (H + A) (n, 3) [W/m²] of what is seen, each as large in the picture; compensation: EV beside the automatic."""
    luminance = reflected @ LUMINANCE / np.pi
    if not (luminance > 0).any():
        return 0.0
    bright = np.quantile(luminance, BRIGHT)
    bright = bright if bright > 0 else luminance.max()
    counted = np.minimum(luminance[luminance > RANGE * bright], bright)
    exposure = np.log2(KEY) - np.log2(counted).mean() + compensation
    return float(np.clip(exposure, *EXPOSURES))
