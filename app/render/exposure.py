"""Automatic exposure: 2^EV = key / exp(mean ln L) [Reinhard02, equation 1], L the luminance that surfaces reflect, ρ (H + A) / π.

The light not yet shot counts as an even ambient A = r̄ / (1 − ρ̄) [Cohen88, section 5]: a scene just opened is exposed
for the light to come.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.atlas.lightmap import Lightmap
from app.atlas.node_set import NodeSet
from app.options import specs
from app.render.false_colour import LUMINANCE
from app.render.options import DisplayOptions
from app.render.sample import sampled_colours, sampled_irradiance, sampled_tiles
from app.scene.model import F64, Scene

KEY = 0.18  # mid grey [Reinhard02]
EXPOSURES = next((s.minimum, s.maximum) for s in specs(DisplayOptions) if s.name == "exposure")  # that can be set
LEAST_ABSORBED = 0.01  # 1 − ρ̄: in a furnace of ρ̄ = 1 light never ends, but its exposure may


def first_exposure(nodes: NodeSet) -> float:
    """EV before the first shot, when H = 0 and r = E; 0 where nothing emits. Needs no GPU."""
    area = nodes.surfaces.area
    radiance = sampled_colours(nodes, [m.emission for m in nodes.scene.materials], nodes.emission_tiles, slice(None))
    mean_exitance = np.pi * np.einsum("tijc,tij->c", radiance, area) / max(float(area.sum()), 1e-30)
    return _exposure(nodes, nodes.scene, np.zeros(3), mean_exitance)


def exposure_of(lightmap: Lightmap, mean_residual: F64) -> float:
    """EV for the light as it is; 0 where there is none. Waits for the GPU.

    mean_residual: r̄ over all texels, RGB [W/m²], as the energy book has it.
    """
    return _exposure(lightmap.nodes, lightmap.scene, sampled_irradiance(lightmap), mean_residual)


def _exposure(nodes: NodeSet, scene: Scene, irradiance: NDArray[np.floating], mean_residual: F64) -> float:
    """irradiance: H of the sampled tiles (tiles, t, t, 3), or of all alike (3,) [W/m²]."""
    sample = sampled_tiles(nodes)
    area = nodes.surfaces.area[sample]
    albedo = sampled_colours(nodes, [m.albedo for m in scene.materials], nodes.albedo_tiles, sample)
    mean_albedo = np.einsum("tijc,tij->c", albedo, area) / max(float(area.sum()), 1e-30)
    ambient = mean_residual / np.maximum(1 - mean_albedo, LEAST_ABSORBED)
    luminance = (albedo * (irradiance + ambient)) @ LUMINANCE / np.pi
    lit = (luminance > 0) & (area > 0)
    if not lit.any():
        return 0.0
    exposure = np.log2(KEY) - np.average(np.log2(luminance[lit]), weights=area[lit])
    return float(np.clip(exposure, *EXPOSURES))
