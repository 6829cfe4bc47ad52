"""Automatic exposure: 2^EV = key / exp(mean ln L), L the luminance that surfaces reflect [Reinhard02, equation 1]."""

from __future__ import annotations

import numpy as np

from app.atlas.lightmap import Lightmap
from app.render.false_colour import LUMINANCE

KEY = 0.18  # mid grey [Reinhard02]
TILES = 1024  # that the mean is taken over, evenly spread


def auto_exposure(lightmap: Lightmap) -> float:
    """EV that makes the lit surfaces mid grey on average, weighted by area; 0 where nothing is lit. Waits for the GPU.

    The light not yet shot counts as an even ambient A = r̄ / (1 − ρ̄) on all surfaces [Cohen88, section 5]: a scene that
    has just been opened is exposed for the light to come.
    """
    area = lightmap.nodes.surfaces.area
    mean_residual = np.einsum("tijc,tij->c", lightmap.residual(), area) / max(float(area.sum()), 1e-30)
    # a small lamp lies in few tiles, so all residual counts; for the rest an even sample will do
    sample = slice(None, None, max(1, lightmap.tiles // TILES))
    area = area[sample, ..., None]
    albedo = lightmap.albedo()[sample].astype(np.float64)
    mean_albedo = (albedo * area).sum((0, 1, 2)) / max(float(area.sum()), 1e-30)
    # ρ̄ = 1 would be light for ever: a furnace never ends, but its exposure may
    ambient = mean_residual / np.maximum(1 - mean_albedo, 0.01)
    luminance = (albedo * (lightmap.irradiance()[sample] + ambient)) @ LUMINANCE / np.pi
    lit = (luminance > 0) & (area[..., 0] > 0)
    if not lit.any():
        return 0.0
    mean = np.average(np.log(luminance[lit]), weights=area[..., 0][lit])
    return float(np.log2(KEY) - mean / np.log(2))
