"""Whether surfaces have the texels that their light needs, material by material: too few where one sees them, or more than do any
good.

Between texels light is interpolated linearly, and off by an eighth of the second difference of the irradiance there; with half as
many along a metre, by an eighth of that between every other texel [Vedel92].
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.sides import totals
from app.lightmap.tile_pool import TilePool
from app.render.seen import Texels, seen_texels
from app.scene.model import F32, F64
from app.session.session import Session

LINES = 1080  # of the picture in which texels are seen
WIDE_PX = 10.0  # in it, from which on a texel can be told from the next one
OFF = 0.02  # of the mean light between texels, from which on it shows
SPARED = 0.005  # of the mean light, that half as many may be off: less than a bake's noise
MANY, NEARLY_ALL = (
    0.9,
    0.99,
)  # of the places where light is looked at: what a tenth exceeds shows, as edges of shadows do not
WORTH = 0.05  # of all texels, that must be spared for a word
SMALL = 0.5  # of a material's area, that must lie in surfaces smaller than a texel for a word
LEAST_AREA = 1e-3  # of all area: smaller materials are not worth one
NAMED = 3  # materials in a line
TILES = 2048  # that light is looked at in: of 2 million texels a window would notice all


@dataclass(frozen=True)
class TexelUse:
    """Of one material. texels: how many; width: of one [m]. seen_px: how wide one is in a picture of 1,080 lines, the median of
    those that are seen; None where none is. between: how far light is off between texels, over the scene's mean, at no more than
    a tenth of the places farther; halved: the same with half as many along a metre, at no more than a hundredth; None where its
    charts are too small to tell. small: share of its area in charts smaller than a texel."""

    material: str
    texels: int
    width: float
    seen_px: float | None
    between: float | None
    halved: float | None
    small: float


def texel_use(session: Session, irradiance: F32 | None = None, *, whole: bool = True) -> tuple[TexelUse, ...]:
    """Of each material of the open scene, seen from its first camera; of quadtrees, which follow the light, nothing. irradiance:
    (slots, t, t, 3) [W/m²], where it has been read back already; else it waits for the GPU, see ``Lightmap.irradiance`` for
    ``whole``."""
    if session.light.adaptive:
        return ()
    pool, camera = session.lightmap.pool, session.scene.cameras[0]
    world_from_camera, yfov = camera.world_from_camera, camera.yfov
    irradiance = session.lightmap.irradiance(ambient=True, whole=whole) if irradiance is None else irradiance
    scene, charts = pool.scene, pool.charts
    face = pool.surfaces.face
    covered = face >= 0
    owner = np.where(covered, scene.material_ids[charts.face_triangle[face]], -1)
    some = slice(None, None, -(-len(face) // TILES))
    light, there, of = (
        np.nan_to_num(irradiance[some].mean(-1, dtype=np.float64), posinf=0.0),
        covered[some],
        owner[some],
    )
    light = light / max(float(light[there].mean()) if there.any() else 0.0, 1e-300)
    count, (small, area) = len(scene.materials), _small(pool)
    texels = np.bincount(owner[covered], minlength=count)
    between = _quantiles(light, there, of, 1, MANY, count)
    halved = _quantiles(light, there, of, 2, NEARLY_ALL, count)
    seen = seen_texels(pool, world_from_camera, yfov)
    width = np.array([1 / (charts.density * material.lightmap_scale) for material in scene.materials])
    px = _seen_px(pool, seen, owner, width, world_from_camera, yfov)
    return tuple(
        TexelUse(
            scene.materials[index].name,
            int(texels[index]),
            float(width[index]),
            px.get(index),
            between.get(index),
            halved.get(index),
            float(small[index]),
        )
        for index in np.flatnonzero((texels > 0) & (area > LEAST_AREA * area.sum())).tolist()
    )


def _small(pool: TilePool) -> tuple[F64, F64]:
    """Of each material, the share of its area in charts smaller than a texel, and its area [m²]."""
    scene, charts = pool.scene, pool.charts
    a, b = (charts.face_uv[:, k] - charts.face_uv[:, 0] for k in (1, 2))
    in_texels = totals(charts.face_chart, np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2, charts.chart_count)
    world, owner = scene.normals_areas[1][charts.face_triangle], scene.material_ids[charts.face_triangle]
    count = len(scene.materials)
    area = totals(owner, world, count)
    small = totals(owner, world * (in_texels[charts.face_chart] < 1), count)
    return small / np.maximum(area, 1e-300), area


def _quantiles(
    light: F64, covered: NDArray[np.bool_], owner: NDArray[np.int32], step: int, share: float, count: int
) -> dict[int, float]:
    """By material, how far light (slots, t, t) is off by linear interpolation between every ``step``-th texel, at that share of
    the places at most. Charts lie two texels apart: what is covered without a gap is one."""
    values, owners = [], []
    for axis in (1, 2):
        rows, there, of = np.moveaxis(light, axis, 2), np.moveaxis(covered, axis, 2), np.moveaxis(owner, axis, 2)
        span = 2 * step
        whole = np.lib.stride_tricks.sliding_window_view(there, span + 1, axis=2).all(-1)
        bend = np.abs(rows[..., :-span] - 2 * rows[..., step:-step] + rows[..., span:]) / 8
        values.append(bend[whole])
        owners.append(of[..., step:-step][whole])
    value, label = np.concatenate(values), np.concatenate(owners)
    order = np.argsort(label, kind="stable")
    edges = np.searchsorted(label[order], np.arange(count + 1))
    parts = ((index, value[order[edges[index] : edges[index + 1]]]) for index in range(count))
    return {index: float(np.quantile(part, share)) for index, part in parts if len(part)}


def _seen_px(
    pool: TilePool, seen: Texels, owner: NDArray[np.int32], width: F64, world_from_camera: F64, yfov: float
) -> dict[int, float]:
    """By material, how many pixels of the picture a texel is wide."""
    away = pool.surfaces.position[tuple(seen)] - world_from_camera[:3, 3]
    depth = np.maximum(-away @ world_from_camera[:3, 2], 1e-300)  # the camera looks along -z
    of = owner[tuple(seen)]
    px = width[of] * LINES / (2 * math.tan(yfov / 2) * depth)
    return {index: float(np.median(px[of == index])) for index in np.unique(of).tolist()}


def texel_note(uses: Sequence[TexelUse]) -> str | None:
    """In one line, which materials have too few texels, or many that are not needed; None where there are none."""
    small = [use for use in uses if use.small > SMALL]
    wide = [use for use in uses if use not in small and _too_wide(use)]
    spare = sorted((use for use in uses if _spare(use, sum(u.texels for u in uses))), key=lambda use: -use.texels)
    few = [(use.material, f"{use.small:.0%} of it smaller than a texel") for use in small]
    few += [
        (use.material, f"{use.seen_px:.0f} px wide, light off by {use.between:.1%} between them")
        for use in sorted(wide, key=lambda use: -(use.seen_px or 0))
    ]
    many = [(use.material, f"half along a metre would do, off by {use.halved:.2%}") for use in spare]
    parts = [f"{words} {_named(found)}" for words, found in (("too few on", few), ("many on", many)) if found]
    return f"texels: {'; '.join(parts)}" if parts else None


def _too_wide(use: TexelUse) -> bool:
    return (use.seen_px or 0) > WIDE_PX and (use.between or 0) > OFF


def _spare(use: TexelUse, texels: int) -> bool:
    return use.halved is not None and use.halved < SPARED and use.texels > WORTH * texels


def _named(found: Sequence[tuple[str, str]]) -> str:
    more = f" and {len(found) - NAMED} more" if len(found) > NAMED else ""
    return ", ".join(f"{name} ({why})" for name, why in found[:NAMED]) + more


__all__ = ["TexelUse", "texel_note", "texel_use"]
