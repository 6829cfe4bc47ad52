"""Radiosity by a dense matrix: B = E + ρ F B, solved at once [Goral et al. 1984].

Slow, in 64-bit floats and without chance, to judge the others. F_ij is Lambert's closed form from a grid of points on
patch i to a grid of pieces of patch j, each piece seen or not by its middle. In a closed room that is convex, rows of F
sum to exactly 1. With occluders the error is that of the grids, which can add up to a few per cent too much: such rows
are scaled to 1, so that no light is made. Raise ``samples`` or ``max_patches`` for less error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from app.reference.form_factors import part_above_horizon, point_to_polygon
from app.reference.line_of_sight import visible
from app.reference.patches import Patches, make_patches, subdivide
from app.scene.model import F64, Scene

BLOCK = 1 << 16  # point–piece pairs at a time: about 50 MB


@dataclass(frozen=True, eq=False)
class DenseSolution:
    """What ``solve_dense`` found.

    F (p, p): F_ij the share of i's light that meets j. H, B (p, 3) [W/m²]: irradiance and radiosity of each patch.
    samples: points and pieces per patch, squared.
    """

    patches: Patches
    F: F64
    H: F64
    B: F64
    samples: int


def solve_dense(scene: Scene, max_patches: int = 400, samples: int = 2) -> DenseSolution:
    """Solve for at most ``max_patches`` patches with samples² points and pieces on each.

    Time grows with max_patches² · samples⁴ · triangles. UserError if the scene has more triangle sides than patches.
    """
    patches = make_patches(scene, max_patches)
    points = subdivide(patches.corners, samples).mean(axis=2)
    normals = np.repeat(patches.normals, samples**2, axis=0)
    to_points = form_factors(points.reshape(-1, 3), normals, patches, samples, scene)
    F = to_points.reshape(len(points), samples**2, -1).mean(axis=1)
    F /= np.maximum(F.sum(axis=1, keepdims=True), 1.0)
    B = np.empty_like(patches.exitance)
    direct = from_lights(scene, points.reshape(-1, 3), normals).reshape(len(points), samples**2, 3).mean(axis=1)
    sent = patches.exitance + patches.albedo * direct
    for c in range(3):
        B[:, c] = np.linalg.solve(np.eye(len(F)) - patches.albedo[:, c, None] * F, sent[:, c])
    return DenseSolution(patches, F, direct + F @ B, B, samples)


def irradiance_at(solution: DenseSolution, scene: Scene, points: F64, normals: F64) -> F64:
    """H (n, 3) [W/m²] at surface ``points`` (n, 3) [m] with unit ``normals`` (n, 3), gathered from all patches."""
    direct = from_lights(scene, points, normals)
    return direct + form_factors(points, normals, solution.patches, solution.samples, scene) @ solution.B


def from_lights(scene: Scene, points: F64, normals: F64) -> F64:
    """(n, 3) [W/m²] that surface ``points`` (n, 3) [m] receive of lamps without area, as points: their shadows are sharp."""
    H, beyond = np.zeros((len(points), 3)), 2 * float(np.linalg.norm(np.ptp(np.array(scene.bounds), axis=0)))
    for light in scene.lights:
        E = light.irradiance(points, normals)
        lit = np.flatnonzero(E.any(axis=1))
        ends = points[lit] - beyond * np.array(light.direction)
        if not light.from_afar:
            ends = np.broadcast_to(light.position, ends.shape)
        H[lit] += E[lit] * visible(points[lit], ends, scene.corners)[:, None]
    return H


def form_factors(points: F64, normals: F64, patches: Patches, samples: int, scene: Scene) -> F64:
    """(n, p) share of the light leaving a surface element at each point that meets each patch, occluders considered."""
    pieces = subdivide(patches.corners, samples).reshape(-1, 3, 3)
    rows = max(1, BLOCK // len(pieces))
    factors = np.empty((len(points), len(patches.corners)))
    for first in range(0, len(points), rows):
        x, n = points[first : first + rows], normals[first : first + rows]
        share = point_to_polygon(x[:, None], n[:, None], pieces)
        i, j = np.nonzero(share)
        targets = part_above_horizon(x[i], n[i], pieces[j])
        share[i, j] *= visible(x[i], targets, scene.corners)
        factors[first : first + rows] = share.reshape(len(x), -1, samples**2).sum(axis=2)
    return factors
