"""What lies under the pointer: a point of a surface, its texel, and the light on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.lightmap.lightmap import Lightmap
from app.render.pick import PickHit
from app.scene.model import RGB
from app.solvers import Solver


@dataclass(frozen=True)
class Picked:
    """A picked point. Indices are the scene's and its charts'; texel (column, row) in the tile pool; facts: what the
    solver says of it, name and value; parts: of H, RGB [W/m²] by name; position [m], area [m²]; B, E, H, r are
    RGB [W/m²]. A side without texels has chart and facet -1 and area 0: it only emits. hit: with which it can be read again."""

    triangle: int
    object: str
    material: int
    back: bool
    chart: int
    facet: int
    texel: tuple[int, int]
    facts: Mapping[str, str]
    parts: Mapping[str, RGB]
    position: RGB
    normal: RGB
    area: float
    B: RGB
    E: RGB
    H: RGB
    r: RGB
    albedo: RGB
    hit: PickHit


def picked_from_hit(lightmap: Lightmap, hit: PickHit, solver: Solver[Any]) -> Picked:
    """Look up the texel that was hit. Waits for the GPU."""
    scene, charts = lightmap.scene, lightmap.charts
    material = scene.materials[hit.material]
    normal = scene.normals_areas[0][hit.triangle] * (-1.0 if hit.back else 1.0)
    albedo, E = np.array(material.albedo), np.pi * np.array(material.emission)
    if hit.back and not material.double_sided:
        albedo, E = np.zeros(3), np.zeros(3)
    H, r, area, texel, chart = np.zeros(3), np.zeros(3), 0.0, (0, 0), -1
    facts: Mapping[str, str] = {}
    parts: Mapping[str, RGB] = {}
    if hit.tile is not None and hit.tile_texel is not None and hit.texel is not None:
        texel, (column, row) = hit.texel, hit.tile_texel
        at, inspection = (hit.tile, row, column), solver.inspect(texel)
        facts, parts = inspection.texel_facts, {name: _rgb(part) for name, part in inspection.texel_light.items()}
        H, r = lightmap.light_at(texel)
        area = float(lightmap.pool.surfaces.area[at])
        face = int(lightmap.pool.surfaces.face[at])
        chart = int(charts.face_chart[face]) if face >= 0 else -1
        if lightmap.pool.albedo_tiles is not None:
            albedo = albedo * lightmap.pool.albedo_tiles[at]
        if lightmap.pool.emission_tiles is not None:
            E = E * lightmap.pool.emission_tiles[at]
    return Picked(
        triangle=hit.triangle,
        object=scene.objects[scene.object_ids[hit.triangle]],
        material=hit.material,
        back=hit.back,
        chart=chart,
        facet=-1 if hit.facet is None else hit.facet,
        texel=texel,
        facts=facts,
        parts=parts,
        position=hit.position,
        normal=_rgb(normal),
        area=area,
        B=_rgb(E + albedo * H),
        E=_rgb(E),
        H=_rgb(H),
        r=_rgb(r),
        albedo=_rgb(albedo),
        hit=hit,
    )


@dataclass(frozen=True)
class LeafAt:
    """A leaf: its level, (u, v, u, v) in the virtual atlas [texels of level 0], how many of its texels cover a surface, and
    the edge of a texel at the density aimed at, the finest where it has several [m]."""

    level: int
    rect: tuple[float, float, float, float]
    texels: int
    texel: float


def leaf_at(lightmap: Lightmap, uv: tuple[float, float]) -> LeafAt | None:
    """The leaf at a place of the virtual atlas [texels of level 0]; None where there is none."""
    pool = lightmap.pool
    slot = pool.slot_at(uv)
    if slot < 0:
        return None
    level = int(pool.leaves.level[slot])
    face = pool.surfaces.face[slot]
    shown = pool.scene.material_ids[lightmap.charts.face_triangle[face[face >= 0]]]
    scale = max((pool.scene.materials[material].lightmap_scale for material in np.unique(shown)), default=1.0)
    edge = 0.5**level / (lightmap.charts.density * scale)
    return LeafAt(level, pool.atlas_rect(pool.corner(slot), pool.tile), int((face >= 0).sum()), edge)


def _rgb(values: np.ndarray) -> RGB:
    return float(values[0]), float(values[1]), float(values[2])
