"""Lamps are the triangles that emit, in sets that share one exitance: what shadow rays are sent to.

A set is one material, so that another exitance of it scales the light it gives and costs no ray. Beyond so many, materials share
a set, and shadow rays choose among them. Where a material has an image of what it emits, each shadow ray brings the light of the
texel that it is sent to. A lamp that is not opaque emits as much less all over.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from app.gpu import glsl_constant
from app.lightmap.tile_pool import TilePool
from app.scene.model import F32, F64, Scene
from app.visibility.rays import places_of

ALONE = 8  # materials that are a set of their own, the strongest ones
CLOSED_FORM = 256  # triangles of a set, up to which all of them are summed up in closed form
PLAIN, PICTURE = 4, 7  # texels of a lamp, and of one with an image
CELL = int(
    glsl_constant("direct_light/shadow_rays.frag.glsl", "CELL")
)  # texels along the edge of a cell: charts start at these
NEAR = int(glsl_constant("direct_light/shadow_rays.frag.glsl", "NEAR"))  # lamps that each cell knows
CANDIDATES = 3 * NEAR  # nearest lamps, of which those are chosen
LEAST, MOST = 0.2, 0.95  # shares of shadow rays that choose among them, where there are others


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
    of_material[list(materials)] = exitance * np.array([[_there(pool, i)] for i in materials])
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


def _there(pool: TilePool, material: int) -> float:
    """The share of a material's surfaces that is there."""
    how = pool.scene.materials[material]
    if how.opacity_texture is None:
        return how.opacity
    of = pool.scene.material_ids[pool.charts.face_triangle]
    covered = pool.surfaces.face >= 0
    area = pool.surfaces.area[covered][of[pool.surfaces.face[covered]] == material].sum()
    whole = pool.scene.normals_areas[1][pool.charts.face_triangle[of == material]].sum()
    return min(float(area / whole), 1.0) if whole > 0 else 1.0


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


def far_chances(lamps: LampSet) -> F32:
    """(n,) chances of all lamps of a set by power, summed up: by these a shadow ray finds one that its cell does not know."""
    return np.asarray(_summed_up(_weights(lamps)[None])[0])


class NearLamps:
    """The lamps of a set that each cell knows, and with which probability shadow rays choose them there. All of a cell is of one
    chart, since charts start at multiples of it.

    Half of the chances are in proportion to a bound of what a lamp may give to any texel of the cell: its power, times the
    largest cosine at the lamp, over the least squared distance, which is not taken as less than the lamp's own area. The other
    half go by power to all that face the cell: lamps that are near but hidden would leave few rays to what all texels see.
    """

    def __init__(self, pool: TilePool, lamps: LampSet) -> None:
        self._pool, self._area = pool, lamps.rows[:, 0, 3].astype(np.float64)
        self._weight = _weights(lamps)
        corner, u, v = (lamps.rows[:, row, :3].astype(np.float64) for row in range(3))
        self._middle = corner + (u + v) / 3
        self._normal = np.cross(u, v) / (2 * self._area[:, None])
        self._extent = np.sqrt(np.maximum((u**2).sum(1), (v**2).sum(1)))
        self._two_sided = lamps.rows[:, 1, 3] > 0
        self._tree = cKDTree(self._middle)

    def of(self, slots: NDArray[np.int64]) -> F32:
        """(slots, cells, NEAR, 2): of each cell the lamps that may give it most, in rows: their chances summed up, to 1 where
        they are all, and their numbers, which rise."""
        centre, radius = _spheres(self._pool, slots)
        there = np.flatnonzero(radius.reshape(-1) > 0)  # cells that hold anything
        near = np.ones((radius.size, NEAR, 2), np.float32)
        if len(there):
            known = min(len(self._area), NEAR)
            near[there, :known] = self._of_cells(centre.reshape(-1, 3)[there], radius.reshape(-1, 1)[there])
        return near.reshape(*radius.shape, NEAR, 2)

    def _of_cells(self, at: F64, radius: F64) -> F32:
        """The same of cells at (c, 3) that reach (c, 1) from there; as many lamps as there are, NEAR at most."""
        count, area, weight = len(self._area), self._area, self._weight
        known = min(count, NEAR)
        which = np.tile(np.arange(count), (len(at), 1))
        if count > CANDIDATES:
            which = np.asarray(self._tree.query(at, k=CANDIDATES)[1])
        way = at[:, None] - self._middle[which]
        distance = np.linalg.norm(way, axis=2)
        reach = radius + self._extent[which]
        height = np.einsum("clk,clk->cl", way, self._normal[which])
        height = np.where(self._two_sided[which], np.abs(height), height) + reach
        cosine = np.clip(height / np.maximum(distance, 1e-30), 0.0, 1.0)
        most = weight[which] * cosine / np.maximum(np.maximum(distance - reach, 0.0) ** 2, area[which])
        facing = weight[which] * (cosine > 0)
        behind = ~(most.sum(1) > 0)  # all of them: no light comes, whatever is chosen
        most[behind] = facing[behind] = weight[which[behind]]
        chance = most / most.sum(1, keepdims=True) + facing / facing.sum(1, keepdims=True)
        share = np.ones((len(chance), 1))
        if known < count:
            best = np.argpartition(-chance, known, axis=1)[:, :known]
            beyond = weight.sum() - weight[which].sum(1)  # of lamps that are farther than all of these
            rest = most.sum(1) - np.take_along_axis(most, best, 1).sum(1) + beyond / distance.max(1) ** 2
            share = np.clip(1 - rest / (most.sum(1) + beyond / distance.max(1) ** 2), LEAST, MOST)[:, None]
            chance, which = (np.take_along_axis(values, best, 1) for values in (chance, which))
        by_number = np.argsort(which, axis=1)
        chance, which = (np.take_along_axis(values, by_number, 1) for values in (chance, which))
        return np.stack([share * _summed_up(chance), which], axis=2).astype(np.float32)


def _weights(lamps: LampSet) -> F64:
    """(n,) by which lamps of a set are chosen: their power."""
    return np.asarray(np.maximum(lamps.rows[:, 0, 3].astype(np.float64) * lamps.strength, 1e-300))


def _summed_up(bound: F64) -> F32:
    total = np.cumsum(bound, axis=1)
    out = np.asarray(total / total[:, -1:], np.float32)
    out[:, -1] = 1.0
    return out


def _spheres(pool: TilePool, slots: NDArray[np.int64]) -> tuple[F64, F64]:
    """Around the texels of each cell of these slots: centres (slots, cells, 3) and radii (slots, cells),
    solver space, 0 of cells that hold nothing."""
    edge = pool.tile // CELL
    covered = pool.surfaces.face[slots] >= 0
    at = np.where(covered[..., None], pool.space.local_from_world(pool.surfaces.position[slots]), np.nan)

    def by_cell(values: NDArray[Any]) -> NDArray[Any]:
        cells = values.reshape(len(slots), edge, CELL, edge, CELL, -1).swapaxes(2, 3)
        return cells.reshape(len(slots), edge * edge, CELL * CELL, -1)

    at, there = by_cell(at), by_cell(covered)[..., 0].any(2)
    at[~there] = 0.0
    low, high = np.nanmin(at, axis=2), np.nanmax(at, axis=2)
    texel = np.sqrt(by_cell(pool.surfaces.area[slots])[..., 0].max(2)) / pool.space.scale
    return (low + high) / 2, np.where(there, np.linalg.norm(high - low, axis=2) / 2 + texel, 0.0)
