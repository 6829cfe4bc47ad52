"""A cave: an ellipsoid pushed about by value noise, with a levelled floor, stalagmites, a pool and glowing crystals.

Deterministic: noise and places come from an integer hash (the finaliser of MurmurHash3), never from a random generator,
so that the same file is the same cave everywhere. Some 35 000 triangles of uneven size, few of them coplanar.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from app.scene.model import F64
from app.scene.shapes import Mesh, icosphere, lathe, merged, transform

POOL_RADIUS = 0.17  # of the cave's length
ROUGHNESS = 0.45  # how far noise moves the wall, relative to its distance from the middle


class Grotto(BaseModel):
    """Lengths in the scene's unit. Uses the materials rock, dripstone, pool, crystal_a and crystal_b."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    kind: Literal["grotto"]
    name: str = "grotto"
    length: Annotated[float, Field(ge=8.0, le=200.0)] = 18.0
    width: Annotated[float, Field(ge=5.0, le=200.0)] = 11.0
    height: Annotated[float, Field(ge=3.0, le=100.0)] = 7.0
    subdivisions: Annotated[int, Field(ge=2, le=7)] = 5
    stalagmites: Annotated[int, Field(ge=0, le=500)] = 60
    crystals: Annotated[int, Field(ge=0, le=500, multiple_of=3)] = 45
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 5

    def pieces(self) -> list[tuple[str, str, Mesh]]:
        """(object name, material name, mesh) of the cave and all that grows in it; floor about y = 0."""
        sphere = icosphere(1.0, self.subdivisions)
        cave = Mesh(self.wall(sphere.positions), sphere.triangles, sphere.uv).flipped()
        radius = POOL_RADIUS * self.length
        pool = lathe([(radius, 0.0), (0.0, 0.0)], 48).moved(0.0, -0.02 * self.height, 0.0)
        return [("cave", "rock", cave), ("pool", "pool", pool), *self._dripstones(), *self._crystals()]

    @property
    def semi_axes(self) -> F64:
        """Of the ellipsoid that noise deforms; the floor cuts off its lower part."""
        return np.array([self.width / 2, 0.6 * self.height, self.length / 2])

    def wall(self, direction: F64) -> F64:
        """(n, 3) points of the cave's wall in the given directions from its middle."""
        middle = np.array([0.0, 0.3 * self.height, 0.0])
        unit = direction / np.linalg.norm(direction, axis=1, keepdims=True)
        stretch = 1.0 + ROUGHNESS * fractal_noise(2.2 * unit, self.seed)
        points: F64 = middle + unit * self.semi_axes * stretch[:, None]
        # A soft maximum levels the floor; a basin under the pool keeps its surface clear of the rock.
        soft, floor = 0.05 * self.height, self.floor(points[:, 0], points[:, 2])
        points[:, 1] = floor + soft * np.logaddexp(0.0, (points[:, 1] - floor) / soft)
        return points

    def floor(self, x: F64, z: F64) -> F64:
        """Height of the levelled ground before it runs up the walls."""
        ground = np.stack([x, np.zeros_like(x), z], axis=1) * (6.0 / self.length)
        bumps = 0.05 * self.height * fractal_noise(ground, self.seed + 1)
        basin = 0.14 * self.height * np.exp(-((np.hypot(x, z) / (0.8 * POOL_RADIUS * self.length)) ** 4))
        level: F64 = bumps - basin
        return level

    def ceiling(self, x: F64, z: F64) -> F64:
        """(n,) heights of the wall above spots of the ground, by bisection over the directions upwards."""
        low, high = np.zeros(len(x)), np.full(len(x), 2.0 * self.height)
        for _ in range(50):
            middle = (low + high) / 2
            points = np.stack([x, middle, z], axis=1) / self.semi_axes
            distance = np.linalg.norm(points, axis=1)
            inside = distance < 1.0 + ROUGHNESS * fractal_noise(2.2 * points / distance[:, None], self.seed)
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        return low + 0.3 * self.height

    def _spots(self, count: int, seed: int) -> F64:
        """(count, 2) x and z of places around the pool: even in angle, spread in radius."""
        golden_angle = np.pi * (3.0 - np.sqrt(5.0))  # its multiples never line up
        angle = np.array([golden_angle * i + 0.4 * random01(i, seed) for i in range(count)])
        reach = np.array([[0.26 + 0.18 * random01(i, seed + 1)] for i in range(count)]).reshape(-1, 1)
        spots: F64 = reach * np.stack([self.width * np.sin(angle), self.length * np.cos(angle)], axis=1)
        return spots

    def _dripstones(self) -> list[tuple[str, str, Mesh]]:
        """Stalagmites, and above every other one its stalactite."""
        out = []
        spots = self._spots(self.stalagmites, self.seed + 10)
        grounds, ceilings = self.floor(*spots.T), self.ceiling(*spots.T)
        for i, ((x, z), ground, ceiling) in enumerate(zip(spots, grounds, ceilings, strict=True)):
            size = 0.35 + 0.65 * random01(i, self.seed + 12) ** 2
            stone = self._dripstone(i, 0.3 * self.height * size, 0.045 * self.height * (0.5 + size))
            out.append((f"stalagmite {i + 1}", "dripstone", stone.moved(x, ground - 0.02 * self.height, z)))
            if i % 2:
                hanging = self._dripstone(i + 1000, 0.24 * self.height * size, 0.035 * self.height * (0.5 + size))
                place = transform((x, ceiling + 0.03 * self.height, z), (180.0, 0.0, 0.0), 1.0)
                out.append((f"stalactite {i + 1}", "dripstone", hanging.transformed(place)))
        return out

    def _dripstone(self, number: int, height: float, radius: float) -> Mesh:
        """A cone with rings and lumps."""
        t = np.linspace(0.0, 1.0, 10)
        stone = lathe(np.stack([radius * (1.0 - t) ** 0.8, height * t], axis=1), 12)
        axial = np.array([number * 3.7, 0.0, 0.0])
        lumps = 1.0 + 0.5 * fractal_noise(stone.positions * (2.5 / radius) * (1, 0.3, 1) + axial, self.seed + 20)
        return Mesh(stone.positions * np.stack([lumps, np.ones_like(lumps), lumps], axis=1), stone.triangles, stone.uv)

    def _crystals(self) -> list[tuple[str, str, Mesh]]:
        """Clusters of three leaning hexagonal prisms with a point."""
        out = []
        spots = self._spots(self.crystals // 3, self.seed + 30)
        for i, ((x, z), ground) in enumerate(zip(spots, self.floor(*spots.T), strict=True)):
            cluster = []
            for k in range(3):
                size = 0.1 * self.height * (0.6 + 0.8 * random01(3 * i + k, self.seed + 32))
                prism = lathe([(0.16 * size, 0.0), (0.2 * size, 0.7 * size), (0.0, size)], 6)
                lean = (25.0 * (random01(3 * i + k, self.seed + 33) + 0.4), 120.0 * k + 50.0 * i, 0.0)
                cluster.append(prism.transformed(transform((x, ground - 0.01 * self.height, z), lean, 1.0)))
            out.append((f"crystals {i + 1}", f"crystal_{'ab'[i % 2]}", merged(cluster)))
        return out


def _mixed(h: NDArray[np.uint32]) -> NDArray[np.uint32]:
    """The finaliser of MurmurHash3 (Appleby 2011): every input bit reaches every output bit."""
    h = (h ^ (h >> np.uint32(16))) * np.uint32(0x85EBCA6B)
    h = (h ^ (h >> np.uint32(13))) * np.uint32(0xC2B2AE35)
    return h ^ (h >> np.uint32(16))


def random01(number: int, seed: int) -> float:
    """A number in [0, 1) that depends on its arguments alone."""
    mixed = _mixed(_mixed(np.array([number], np.uint32)) ^ np.array([seed], np.uint32))
    return float(mixed[0]) / 2.0**32


def value_noise(points: F64, seed: int) -> F64:
    """(n,) smooth noise in [-1, 1): random values on the integer lattice, blended with 3t² - 2t³."""
    cell = np.floor(points)
    t = points - cell
    t = t * t * (3.0 - 2.0 * t)
    lattice = cell.astype(np.int64)
    total = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        h = np.full(len(points), seed, np.uint32)
        for axis in range(3):
            h = _mixed(h ^ (lattice[:, axis] + corner[axis]).astype(np.uint32))
        weight = np.prod(np.where(np.array(corner) == 1, t, 1.0 - t), axis=1)
        total += weight * (h / 2.0**31 - 1.0)
    return total


def fractal_noise(points: F64, seed: int) -> F64:
    """(n,) four octaves of value noise, each half as strong and twice as fine as the last; in (-1, 1)."""
    octaves = [0.5**k * value_noise(points * 2.0**k + 17.0 * k, seed + 101 * k) for k in range(4)]
    total: F64 = np.sum(octaves, axis=0) / 1.875
    return total
