"""Lamps are the triangles that emit, in sets that share one exitance: what shadow rays are sent to.

A set is one material, so that another exitance of it scales the light it gives and costs no ray. Beyond so many, materials share
a set, and shadow rays choose among them. Where a material has an image of what it emits, each shadow ray brings the light of the
texel that it is sent to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.lightmap.tile_pool import TilePool
from app.scene.model import F32, F64, Scene
from app.visibility.rays import places_of

ALONE = 8  # materials that are a set of their own, the strongest ones
CLOSED_FORM = 256  # triangles of a set, up to which all of them are summed up in closed form
PLAIN, PICTURE = 4, 7  # texels of a lamp, and of one with an image
CHANCES = 1 << 24  # of lamps in tiles: beyond, they are the same in all tiles


@dataclass(frozen=True, eq=False)
class LampSet:
    """materials: that emit in it. exitance: E = πL of it, RGB [W/m²]. rows (n, 4, 4) f32: its triangles, see lamp.glsl, (n, 7, 4)
    where they have an image. strength (n,): mean of RGB of each triangle's exitance, over that of the set."""

    materials: tuple[int, ...]
    exitance: F64
    rows: F32
    strength: F64

    @property
    def closed_form(self) -> bool:
        """Whether its light is a closed form times visibility."""
        return len(self.materials) == 1 and len(self.rows) <= CLOSED_FORM and not self.picture

    @property
    def picture(self) -> bool:
        """Whether an image says what they emit."""
        return bool(self.rows.shape[1] == PICTURE)

    def same_light(self, other: LampSet) -> bool:
        """Whether the other one gives the same light."""
        return (
            self.materials == other.materials
            and np.array_equal(self.exitance, other.exitance)
            and np.array_equal(self.rows, other.rows)
        )

    def exitance_in(self, scene: Scene) -> F64:
        """E of the set where materials may be others than when it was made, RGB [W/m²]."""
        alone = len(self.materials) == 1
        return np.pi * np.array(scene.materials[self.materials[0]].emission) if alone else self.exitance


def lamp_sets(pool: TilePool, scene: Scene, alone: Sequence[int] = ()) -> list[LampSet]:
    """Of all other materials that emit, but those that are a set already, ``alone``."""
    area = np.bincount(scene.material_ids, scene.normals_areas[1], len(scene.materials))
    power = area * np.array([sum(m.emission) for m in scene.materials])
    emitting = [i for i in np.argsort(-power, kind="stable").tolist() if power[i] > 0 and i not in alone]
    more = max(ALONE - len(alone), 0)
    groups = [(i,) for i in emitting[:more]]
    if rest := tuple(emitting[more:]):
        groups.append(rest)
    return [lamp_set(pool, scene, group) for group in groups]


def lamp_set(pool: TilePool, scene: Scene, materials: tuple[int, ...]) -> LampSet:
    """Of the triangles of these materials."""
    exitance = np.pi * np.array([scene.materials[i].emission for i in materials])
    base = exitance[0] if len(materials) == 1 else np.full(3, exitance.max())
    which = np.flatnonzero(np.isin(scene.material_ids, materials))
    corners = pool.space.local_from_world(scene.corners[which])
    of_material = np.zeros((len(scene.materials), 3))
    of_material[list(materials)] = exitance
    relative = of_material[scene.material_ids[which]] / np.maximum(base, 1e-300)
    picture = any(scene.materials[i].emission_texture is not None for i in materials)
    rows = np.zeros((len(which), PICTURE if picture else PLAIN, 4), np.float32)
    rows[:, 0, :3] = corners[:, 0]
    rows[:, 0, 3] = scene.normals_areas[1][which] / pool.space.scale**2
    rows[:, 1, :3] = corners[:, 1] - corners[:, 0]
    rows[:, 1, 3] = scene.sides[which]
    rows[:, 2, :3] = corners[:, 2] - corners[:, 0]
    rows[:, 3, :3] = relative
    if picture:
        rows[:, PLAIN:] = places_of(pool)[which]
        relative = relative * _means(pool, which)
    return LampSet(materials, base, rows, relative.mean(1))


def _means(pool: TilePool, triangles: NDArray[np.int64]) -> F64:
    """(n, 3) mean of the image of what triangles emit, over the texels on them."""
    assert pool.emission_tiles is not None
    covered = pool.surfaces.face >= 0
    triangle = pool.charts.face_triangle[pool.surfaces.face[covered]]
    area, colour = pool.surfaces.area[covered], pool.emission_tiles[covered]
    count = len(pool.scene.triangles)
    sums = np.stack([np.bincount(triangle, area * colour[:, c], count) for c in range(3)], axis=1)
    whole = np.bincount(triangle, area, count)
    means = sums / np.maximum(whole, 1e-300)[:, None]
    return np.asarray(np.where(whole[triangles, None] > 0, means[triangles], 1.0))


def chances(pool: TilePool, lamps: LampSet) -> F32:
    """(slots, n) f32, summed up along lamps, the last 1: the probability with which the shadow rays of a tile choose each lamp.

    Half of them in proportion to a bound of what it may give to any texel of the tile: its power, times the largest cosine at the
    lamp, over the least squared distance, which is not taken as less than the lamp's own area. The other half by its mean squared
    distance instead: many small lamps that are near to one texel each would leave few rays to a large one that all texels see.
    One row, by power, where there are too many.
    """
    area = lamps.rows[:, 0, 3].astype(np.float64)
    weight = np.maximum(area * lamps.strength, 1e-300)
    if pool.tiles * len(area) > CHANCES:
        return _summed_up(weight[None])
    centre, radius = _spheres(pool)
    corner, u, v = (lamps.rows[:, row, :3].astype(np.float64) for row in range(3))
    middle = corner + (u + v) / 3
    normal = np.cross(u, v) / (2 * area[:, None])
    extent = np.sqrt(np.maximum((u**2).sum(1), (v**2).sum(1)))
    out = np.empty((pool.tiles, len(area)), np.float32)
    step = max(1, (1 << 20) // len(area))
    for first in range(0, pool.tiles, step):
        part = slice(first, first + step)
        way = centre[part, None] - middle
        distance = np.linalg.norm(way, axis=2)
        reach = radius[part, None] + extent
        height = np.einsum("tlk,lk->tl", way, normal)
        height = np.where(lamps.rows[:, 1, 3] > 0, np.abs(height), height) + reach
        near = np.maximum(distance - reach, 0.0)
        cosine = np.clip(height / np.maximum(distance, 1e-30), 0.0, 1.0)
        most = weight * cosine / np.maximum(near**2, area)
        mean = weight * cosine / (distance**2 + radius[part, None] ** 2 + area)
        behind = ~(most.sum(1) > 0)  # all lamps: no light comes, whatever is chosen
        most[behind] = mean[behind] = weight
        out[part] = (_summed_up(most) + _summed_up(mean)) / 2
    return out


def _summed_up(bound: F64) -> F32:
    total = np.cumsum(bound, axis=1)
    out = np.asarray(total / total[:, -1:], np.float32)
    out[:, -1] = 1.0
    return out


def _spheres(pool: TilePool) -> tuple[F64, NDArray[np.float64]]:
    """Around the texels of each slot: centres (slots, 3) and radii, solver space."""
    covered = pool.surfaces.face >= 0
    at = np.where(covered[..., None], pool.space.local_from_world(pool.surfaces.position), np.nan)
    at = at.reshape(pool.tiles, -1, 3)
    empty = ~covered.reshape(pool.tiles, -1).any(1)
    at[empty] = 0.0
    low, high = np.nanmin(at, axis=1), np.nanmax(at, axis=1)
    texel = np.sqrt(pool.surfaces.area.reshape(pool.tiles, -1).max(1)) / pool.space.scale
    return (low + high) / 2, np.linalg.norm(high - low, axis=1) / 2 + texel
