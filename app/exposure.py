"""The exposure that a scene opens with: 2^EV = key / exp(mean ln L) [Reinhard02, equation 1], from few read-backs.

L is the luminance that surfaces reflect, ρ·(H + A)/π, with the light not yet shot as an even ambient A = r̄ / (1 − ρ̄)
[Cohen88, section 5]. ``first_exposure`` needs no GPU and runs where the scene is loaded; ``exposure_of`` reads one texture.
"""

from __future__ import annotations

import numpy as np

from app.atlas.lightmap import Lightmap
from app.atlas.node_set import NodeSet
from app.render.exposure import KEY, TILES
from app.render.false_colour import LUMINANCE
from app.scene.model import F64

BRIGHTEST_AMBIENT = 0.01  # least 1 − ρ̄: a furnace of ρ̄ = 1 never ends, but its exposure may


def first_exposure(nodes: NodeSet) -> float:
    """EV for a scene before the first shot, H = 0 and r = E; 0 where nothing emits."""
    area = nodes.surfaces.area
    emission = [m.emission for m in nodes.scene.materials]
    exitance = _factor(nodes, emission, nodes.emission_tiles, slice(None)) * np.pi
    mean_exitance = np.einsum("tijc,tij->c", exitance, area) / max(float(area.sum()), 1e-30)
    return _exposure(nodes, np.zeros(3), mean_exitance)


def exposure_of(lightmap: Lightmap, mean_residual: F64) -> float:
    """EV for the light as it is; 0 where there is none. mean_residual: r̄ over all texels, RGB [W/m²], as the energy book has
    it. Waits for the GPU."""
    return _exposure(lightmap.nodes, lightmap.irradiance_of(_sample(lightmap.nodes)), mean_residual)


def _sample(nodes: NodeSet) -> slice:
    """Tiles that the mean is taken over, evenly spread."""
    return slice(None, None, max(1, nodes.tiles // TILES))


def _exposure(nodes: NodeSet, irradiance: F64, mean_residual: F64) -> float:
    """irradiance: H of the sampled tiles (tiles, 16, 16, 3) or of all (3,) [W/m²]."""
    sample = _sample(nodes)
    area = nodes.surfaces.area[sample]
    albedo = _factor(nodes, [m.albedo for m in nodes.scene.materials], nodes.albedo_tiles, sample)
    mean_albedo = np.einsum("tijc,tij->c", albedo, area) / max(float(area.sum()), 1e-30)
    ambient = mean_residual / np.maximum(1 - mean_albedo, BRIGHTEST_AMBIENT)
    luminance = (albedo * (irradiance + ambient)) @ LUMINANCE / np.pi
    lit = (luminance > 0) & (area > 0)
    if not lit.any():
        return 0.0
    return float(np.log2(KEY) - np.average(np.log2(luminance[lit]), weights=area[lit]))
