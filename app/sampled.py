"""What the viewer must know of all light, from an even sample of the tiles and one texture read back: no frame waits long.

Exposure: 2^EV = key / exp(mean ln L) [Reinhard02, equation 1], with L the luminance that surfaces reflect, ρ (H + A) / π, and
the light not yet shot as an even ambient A = r̄ / (1 − ρ̄) [Cohen88, section 5]: a scene that has just been opened is exposed
for the light to come. Top of the false-colour scale: the 99.9th percentile, as app/render/false_colour.py has it of all texels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import TILE
from app.atlas.lightmap import STORAGE, Lightmap
from app.atlas.node_set import NodeSet
from app.render.exposure import KEY, TILES
from app.render.false_colour import LUMINANCE, NICE, WHITE_EFFICACY
from app.scene.model import F32, F64, RGB, Scene

BRIGHTEST_SHARE = 99.9  # per cent of the texels that the scale covers
LEAST_ABSORBED = 0.01  # 1 − ρ̄: in a furnace of ρ̄ = 1 light never ends, but its exposure may


def first_exposure(nodes: NodeSet) -> float:
    """EV before the first shot, when H = 0 and r = E; 0 where nothing emits. Needs no GPU."""
    area = nodes.surfaces.area
    radiance = _colours(nodes, [m.emission for m in nodes.scene.materials], nodes.emission_tiles, slice(None))
    mean_exitance = np.pi * np.einsum("tijc,tij->c", radiance, area) / max(float(area.sum()), 1e-30)
    return _exposure(nodes, nodes.scene, np.zeros(3), mean_exitance)


def exposure_of(lightmap: Lightmap, mean_residual: F64) -> float:
    """EV for the light as it is; 0 where there is none. Waits for the GPU.

    mean_residual: r̄ over all texels, RGB [W/m²], as the energy book has it.
    """
    return _exposure(lightmap.nodes, lightmap.scene, _irradiance(lightmap), mean_residual)


def top_of_scale(lightmap: Lightmap, kind: str) -> float:
    """A short number that nearly all illuminance [lx] or, lamps left out, luminance [cd/m²] is below. Waits for the GPU."""
    nodes, irradiance = lightmap.nodes, _irradiance(lightmap)
    sample = _sample(nodes)
    shown = nodes.surfaces.area[sample] > 0
    if kind == "illuminance":
        radiance = irradiance * np.float32(np.pi)
    else:
        emission = _colours(nodes, [m.emission for m in lightmap.scene.materials], nodes.emission_tiles, sample)
        albedo = _colours(nodes, [m.albedo for m in lightmap.scene.materials], nodes.albedo_tiles, sample)
        shown &= emission.max(-1) == 0
        radiance = albedo * irradiance
    values = radiance[shown] @ LUMINANCE * (WHITE_EFFICACY / np.pi)
    value = float(np.percentile(values, BRIGHTEST_SHARE)) if len(values) else 0.0
    if value <= 0:
        return 1.0
    decade = 10.0 ** np.floor(np.log10(value))
    return float(next(step * decade for step in NICE if value <= step * decade * (1 + 1e-9)))


def _sample(nodes: NodeSet) -> slice:
    """Tiles that means are taken over, evenly spread. A small lamp lies in few of them: r̄ is that of all."""
    return slice(None, None, max(1, nodes.tiles // TILES))


def _exposure(nodes: NodeSet, scene: Scene, irradiance: NDArray[np.floating], mean_residual: F64) -> float:
    """irradiance: H of the sampled tiles (tiles, 16, 16, 3), or of all alike (3,) [W/m²]."""
    sample = _sample(nodes)
    area = nodes.surfaces.area[sample]
    albedo = _colours(nodes, [m.albedo for m in scene.materials], nodes.albedo_tiles, sample)
    mean_albedo = np.einsum("tijc,tij->c", albedo, area) / max(float(area.sum()), 1e-30)
    ambient = mean_residual / np.maximum(1 - mean_albedo, LEAST_ABSORBED)
    luminance = (albedo * (irradiance + ambient)) @ LUMINANCE / np.pi
    lit = (luminance > 0) & (area > 0)
    if not lit.any():
        return 0.0
    return float(np.log2(KEY) - np.average(np.log2(luminance[lit]), weights=area[lit]))


def _colours(nodes: NodeSet, factors: list[RGB], colours: F32 | None, sample: slice) -> F32:
    """A material's factor on each texel of the sampled tiles (tiles, 16, 16, 3), times its texture; 0 where nothing is."""
    face = nodes.surfaces.face[sample]
    material = nodes.scene.material_ids[nodes.charts.face_triangle[face]]
    out = np.where((face >= 0)[..., None], np.array(factors, np.float32)[material], np.float32(0))
    return out if colours is None else out * colours[sample]


def _irradiance(lightmap: Lightmap) -> F32:
    """H of the sampled tiles (tiles, 16, 16, 3) [W/m²]."""
    nodes, texture = lightmap.nodes, lightmap.texture("t_irradiance")
    dtype = {"f4": np.float32, "f2": np.float16, "f1": np.uint8}[STORAGE[lightmap.storage]]
    cells = np.frombuffer(texture.read(), dtype).reshape(nodes.rows, TILE, nodes.columns, TILE, 4)
    tile = np.arange(nodes.tiles)[_sample(nodes)]
    stored = cells[tile // nodes.columns, :, tile % nodes.columns, :, :3].astype(np.float32)
    return stored * np.float32(lightmap.unit / (255 if dtype is np.uint8 else 1))
