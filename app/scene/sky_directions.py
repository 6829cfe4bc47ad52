"""Directions that stand for the sky: stratified by its power, so many that open surfaces receive what they should."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from app.scene.lights import Light
from app.scene.model import F64
from app.scene.sky import Sky, solid_angles

COUNTS = (64, 128, 256, 512, 1024)
ERROR = (
    2.5e-3  # of the most that any surface receives, by which what one receives may be off where nothing hides the sky
)
SUN_SHOTS = 8  # over the disc of the sun, or of a directional light
GOLDEN = (5**0.5 - 1) / 2
NORMALS = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)])


class Directions(NamedTuple):
    """towards (n, 3): unit, to the sky. irradiance (n, 3): of each, on what faces it, RGB [W/m²]."""

    towards: F64
    irradiance: F64

    def on(self, normals: F64) -> F64:
        """(m, 3) what surfaces with these normals (m, 3) receive of all, unoccluded."""
        return np.asarray(np.maximum(normals @ self.towards.T, 0) @ self.irradiance)


def directions_of(sky: Sky | None, lights: Sequence[Light] = (), error: float = ERROR) -> Directions:
    """Of directional lights and the sun first, then of the sky, such that some of the first are spread over all of it. error: as
    ERROR."""
    sun = None if sky is None else sky.sun_light
    parts = [
        disc_directions(light) for light in (*lights, sun) if light is not None and light.from_afar and light.emits
    ]
    if sky is not None:
        parts.append(sky_directions(sky, error))
    towards, irradiance = (np.concatenate([np.empty((0, 3)), *(part[i] for part in parts)]) for i in (0, 1))
    return Directions(towards, irradiance)


def disc_directions(light: Light) -> Directions:
    """Of a directional light or the sun: evenly over the disc that it is seen as [Vogel79]; one direction where it is a point."""
    towards, irradiance = -np.array(light.direction), np.array(light.intensity)
    if light.angle == 0:
        return Directions(towards[None], irradiance[None])
    nth = np.arange(SUN_SHOTS)
    radius, turn = np.sin(light.angle / 2) * np.sqrt((nth + 0.5) / SUN_SHOTS), 2 * np.pi * GOLDEN * nth
    x, y = axes_of(towards)
    around = towards + (radius * np.cos(turn))[:, None] * x + (radius * np.sin(turn))[:, None] * y
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    return Directions(around, np.tile(irradiance / SUN_SHOTS, (SUN_SHOTS, 1)))


def sky_directions(sky: Sky, error: float = ERROR) -> Directions:
    """Of a sky without its sun: as few as are right to that, or the most; some of the first are spread over all of it. error: as
    ERROR."""
    if not sky.shines or not sky.scale.any():
        return Directions(np.empty((0, 3)), np.empty((0, 3)))
    normals = NORMALS / np.linalg.norm(NORMALS, axis=1, keepdims=True)
    right = sky.scale * sky.shape_irradiance(normals)
    for count in COUNTS:
        found = _stratified(sky, count)
        if np.abs(found.on(normals) - right).max() <= error * right.max():
            break
    lit = found.irradiance.any(1)
    return Directions(found.towards[lit], found.irradiance[lit])


def _stratified(sky: Sky, count: int) -> Directions:
    """So many of equal power, a power of 2: rows of the map by the steps of a count, places in them by the golden ratio. The
    count goes with its bits reversed, so that the first few are spread over all of the sky, too."""
    light = sky.shape.astype(np.float64)
    height, width, _ = light.shape
    weight = light * solid_angles(width, height)[..., None]
    power = weight.mean(2)
    nth = np.zeros(1, np.int64)
    while len(nth) < count:
        nth = np.concatenate([2 * nth, 2 * nth + 1])
    down, row = _place(np.cumsum(power.sum(1)), (nth + 0.5) / count)
    edges = np.cos(np.linspace(0, np.pi, height + 1))
    up = edges[row] + down * (edges[row + 1] - edges[row])
    across, column = np.empty(count), np.empty(count, np.int64)
    for at in np.unique(row).tolist():
        mine = row == at
        across[mine], column[mine] = _place(np.cumsum(power[at]), nth[mine] * GOLDEN % 1)
    azimuth = (column + across) / width * 2 * np.pi
    level = np.sqrt(np.maximum(1 - up**2, 0))
    towards = np.stack([level * np.sin(azimuth), up, -level * np.cos(azimuth)], axis=1)
    colour = light[row, column] / light[row, column].mean(1, keepdims=True)
    whole = sky.scale * weight.sum((0, 1))
    return Directions(towards, colour * (whole / np.maximum(colour.sum(0), 1e-300)))


def _place(summed: F64, share: F64) -> tuple[F64, np.ndarray[tuple[int, ...], np.dtype[np.int64]]]:
    """Where in an entry of a sum, and in which one, shares of it lie."""
    at = share * summed[-1]
    entry = np.minimum(np.searchsorted(summed, at, side="right"), len(summed) - 1)
    before = np.where(entry > 0, summed[entry - 1], 0.0)
    return np.clip((at - before) / np.maximum(summed[entry] - before, 1e-300), 0, 1), entry


def axes_of(towards: F64) -> tuple[F64, F64]:
    """x and y such that x, y and the direction are a right-handed frame."""
    aside = np.array([1.0, 0.0, 0.0]) if abs(towards[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    x = np.cross(aside, towards)
    x /= np.linalg.norm(x)
    return x, np.cross(towards, x)


__all__ = ["Directions", "axes_of", "directions_of", "disc_directions", "sky_directions"]
