"""Coarse forecast of the light, made on the CPU before any solving: radiosity H = F (E + ρ H) between some hundred points.

Points lie on texels drawn by area, and on lamps drawn by power; F_ij = cos_i cos_j A_j / (π d² + A_j / 4) is the form factor of a
small patch, kept finite where points nearly touch, with sums of at most 1. What stands between two points is looked up in a
grid of cells that surfaces lie in, so that the cost does not depend on the number of triangles. Coarse, but it knows where
light escapes, and which rooms it hardly reaches.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.atlas.texels import TexelSurfaces
from app.scene.lights import Light
from app.scene.model import F64
from app.scene.sky import Sky
from app.scene.sky_directions import directions_of

POINTS, LAMP_POINTS = 384, 64  # on all surfaces, and on lamps besides
CELLS = 48  # along the scene's longest edge, at most
TEXELS_PER_CELL = 1.5  # edges: a surface's cells have no holes
NEAR = 2.5  # cells around both points that hide nothing
PLANE = 1.25  # cells above a point's plane, up to which lie those of its own surface
BOUNCES = 50
SKY_ERROR = 0.02  # of directions that stand for the sky: as few as there may be
SEED = 2
BLOCK = 1 << 15  # texels in work at a time

Ints = NDArray[np.int64]
Colours = Callable[[Ints], NDArray[np.floating]]  # of texels, by their numbers: (n,) to (n, 3)


class Forecast(NamedTuple):
    """Points, each for an ``area`` (n,) [m²] of surface around it: H to come (n, 3) [W/m²]. asked: that of the texels that were
    asked for."""

    area: F64
    irradiance: F64
    asked: F64


def forecast(
    surfaces: TexelSurfaces,
    albedo: Colours,
    exitance: Colours,
    strongest: NDArray[np.floating],
    asked: Ints,
    sky: Sky | None = None,
    lights: Sequence[Light] = (),
) -> Forecast:
    """albedo, exitance E [W/m²]: of texels; strongest: the largest of E of each texel, (tiles, t, t). asked: the numbers of some
    texels. sky, and lights without area: seen by each point as far as it sees no other."""
    at, area = _points(surfaces.area.ravel(), strongest.ravel())
    rho, E = (of(at).astype(np.float64) for of in (albedo, exitance))
    shining = [light for light in lights if light.emits]
    if not E.any() and sky is None and not shining:
        return Forecast(area, np.zeros_like(E), np.zeros((len(asked), 3)))
    grid = _Grid(surfaces)
    F, towards = (_form_factors(surfaces, grid, texels, at, area) for texels in (at, asked))
    total = np.maximum(F.sum(1), 1.0)
    F /= np.maximum(total[:, None], total)
    towards /= np.maximum(towards.sum(1, keepdims=True), 1.0)
    from_lights, asked_from_lights = (_from_lights(surfaces, grid, texels, sky, shining) for texels in (at, asked))
    H = direct = F @ E + from_lights
    for _ in range(BOUNCES):
        H = direct + F @ (rho * H)
    return Forecast(area, H, towards @ (E + rho * H) + asked_from_lights)


def _points(area: F64, exitance: NDArray[np.floating]) -> tuple[Ints, F64]:
    """Texels, and the area that each stands for: by area of what is dark, by power of what emits."""
    rng = np.random.default_rng(SEED)
    dark, lamps = np.flatnonzero((area > 0) & (exitance <= 0)), np.flatnonzero(area * exitance > 0)
    share = float(area[lamps].sum() / max(area.sum(), 1e-30))
    points, areas = [], []
    for texels, count, density in (
        (dark, round(POINTS * (1 - share)), np.ones(len(dark))),
        (lamps, LAMP_POINTS + round(POINTS * share), exitance[lamps].astype(np.float64)),
    ):
        if len(texels) and count:
            total = np.cumsum(area[texels] * density)
            place = (np.arange(count) + rng.random(count)) / count * total[-1]
            chosen = np.minimum(np.searchsorted(total, place), len(texels) - 1)
            points.append(texels[chosen])
            areas.append(total[-1] / count / density[chosen])
    return (np.concatenate(points), np.concatenate(areas)) if points else (np.zeros(0, np.int64), np.zeros(0))


def _from_lights(surfaces: TexelSurfaces, grid: _Grid, at: Ints, sky: Sky | None, lights: Sequence[Light]) -> F64:
    """(n, 3) what texels receive of the sky and of lights without area [W/m²]."""
    p, n = (values.reshape(-1, 3)[at].astype(np.float64) for values in (surfaces.position, surfaces.normal))
    H = np.zeros((len(at), 3))
    if sky is not None or lights:
        H += _from_beyond(p, n, grid, sky, lights)
    for light in lights:
        if not light.from_afar:
            end = np.broadcast_to(light.position, p.shape)
            away = (p - end) / np.maximum(np.linalg.norm(p - end, axis=1, keepdims=True), 1e-30)
            H += light.irradiance(p, n) * grid.free(p, n, end, away)[:, None]
    return H


def _from_beyond(p: F64, n: F64, grid: _Grid, sky: Sky | None, lights: Sequence[Light]) -> F64:
    """(n, 3) what points p (n, 3) with normals n (n, 3) receive of sky, sun and directional lights [W/m²]."""
    towards, irradiance = directions_of(sky, lights, SKY_ERROR)
    cosine = n @ towards.T
    i, k = np.nonzero(cosine > 0)
    light = np.zeros(cosine.shape)
    light[i, k] = cosine[i, k] * grid.free(p[i], n[i], p[i] + grid.width * towards[k], -towards[k])
    return np.asarray(light @ irradiance)


def _form_factors(surfaces: TexelSurfaces, grid: _Grid, asked: Ints, at: Ints, area: F64) -> F64:
    """(asked, at) from each texel asked for to the disc around each point."""
    p, n = (values.reshape(-1, 3)[asked].astype(np.float64) for values in (surfaces.position, surfaces.normal))
    q, m = (values.reshape(-1, 3)[at].astype(np.float64) for values in (surfaces.position, surfaces.normal))
    way = q[None] - p[:, None]
    squared = np.maximum((way**2).sum(-1), 1e-30)
    leaves, arrives = np.einsum("ijk,ik->ij", way, n), -np.einsum("ijk,jk->ij", way, m)
    F = np.maximum(leaves, 0) * np.maximum(arrives, 0) / squared * area / (np.pi * squared + area / 4)
    i, j = np.nonzero(F)
    F[i, j] *= grid.free(p[i], n[i], q[j], m[j])
    return np.asarray(F)


class _Grid:
    """Cells that surfaces lie in; ``cell`` [m] is their edge."""

    def __init__(self, surfaces: TexelSurfaces) -> None:
        area = surfaces.area.ravel()
        covered, position = np.flatnonzero(area > 0), surfaces.position.reshape(-1, 3)
        along = np.empty((3, len(covered)))  # axes apart: three times as fast
        blocks = [slice(first, first + BLOCK) for first in range(0, len(covered), BLOCK)]
        for some in blocks:
            along[:, some] = position[covered[some]].T
        self._low = along.min(1)
        size = np.ptp(along, axis=1)
        self.width = float(np.linalg.norm(size))  # diagonal [m]: what is farther is beyond all
        texel = float(np.sqrt(np.quantile(area[covered], 0.9)))  # small charts' texels are covered in part
        self.cell = max(float(size.max()) / CELLS, TEXELS_PER_CELL * texel)
        self._filled = np.zeros(((along.max(1) - self._low) / self.cell).astype(np.int64) + 1, bool)
        for some in blocks:
            self._filled[tuple(((along[:, some] - self._low[:, None]) / self.cell).astype(np.int64))] = True

    def free(self, start: F64, start_normal: F64, end: F64, end_normal: F64) -> NDArray[np.bool_]:
        """Whether nothing lies between the points of each pair, (n, 3) each; looked up cell by cell. What lies in the plane of
        either point is its own surface."""
        way = (end - start) / self.cell
        length = np.maximum(np.linalg.norm(way, axis=1), 1e-30)
        start, way = (start - self._low) / self.cell, way / length[:, None]
        rise, fall = np.einsum("ij,ij->i", way, start_normal), -np.einsum("ij,ij->i", way, end_normal)
        free, along = np.ones(len(start), bool), np.arange(len(start))
        distance = NEAR
        while len(along := along[distance < length[along] - NEAR]):
            index = np.floor(start[along] + distance * way[along]).astype(np.int64)
            above = (distance * rise[along] > PLANE) & ((length[along] - distance) * fall[along] > PLANE)
            inside = above & ((index >= 0) & (index < self._filled.shape)).all(1)
            hit = inside.copy()
            hit[inside] = self._filled[tuple(index[inside].T)]
            free[along[hit]] = False
            along, distance = along[~hit], distance + 1
        return free
