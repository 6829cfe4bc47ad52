"""Form factors in closed form: point to polygon (Lambert's contour sum), and rectangles from the catalogue.

    F = 1/2π Σ θ_i n·Γ_i   over the polygon's edges,

θ_i the angle that edge i subtends at the point, Γ_i the unit normal of the plane through point and edge [Lambert 1760;
Baum, Rushmeier, Winget 1989, eq. 9]. What lies behind the point's horizon is clipped. C-11 and C-14 are the numbers in
Howell, *A Catalog of Radiation Heat Transfer Configuration Factors*.
"""

from __future__ import annotations

from math import atan, log, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from app.scene.model import F64

# A point nearer to a polygon's plane than this share of their distance lies in it: 64-bit rounding leaves about 1e-15.
IN_PLANE = 1e-10


def point_to_polygon(points: F64, normals: F64, polygons: F64) -> F64:
    """(…,) share of the light leaving a surface element at ``points`` (…, 3) that meets ``polygons`` (…, k, 3).

    ``normals`` (…, 3) are the elements' unit normals. Polygons are flat, convex, counter-clockwise from their front,
    and count only for points in front of them. The leading shapes broadcast. Nothing is in the way.
    """
    rays = polygons - points[..., None, :]
    height = np.einsum("...kc,...c->...k", rays, normals)
    edges = _clipped_edges(rays, height)
    total = np.zeros(np.broadcast_shapes(points.shape[:-1], polygons.shape[:-2]))
    for start, end in edges:
        cross = np.cross(start, end)
        length = np.linalg.norm(cross, axis=-1)
        angle = np.arctan2(length, np.einsum("...c,...c->...", start, end))
        towards = np.einsum("...c,...c->...", cross, normals)
        total -= angle * np.divide(towards, length, out=np.zeros_like(length), where=length > 0.0)
    return np.where(_in_front(rays), np.maximum(total, 0.0) / (2 * np.pi), 0.0)


def part_above_horizon(points: F64, normals: F64, polygons: F64) -> F64:
    """(…, 3) a point within the part of ``polygons`` (…, k, 3) above the horizon of ``points``: its corners' mean."""
    rays = polygons - points[..., None, :]
    starts, ends = np.moveaxis(np.array(_clipped_edges(rays, np.einsum("...kc,...c->...k", rays, normals))), 1, 0)
    there = (starts != ends).any(axis=-1, keepdims=True)
    return np.asarray(points + ((starts + ends) / 2 * there).sum(axis=0) / np.maximum(there.sum(axis=0), 1))


def _in_front(rays: F64) -> NDArray[np.bool_]:
    """(…,) whether the origin lies in front of the polygons ``rays`` (…, k, 3), and not in their planes."""
    a, b, c = rays[..., 0, :], rays[..., 1, :], rays[..., 2, :]
    normal = np.cross(b - a, c - a)
    distance = -np.einsum("...c,...c->...", a, normal)
    scale = np.linalg.norm(normal, axis=-1) * np.linalg.norm(rays, axis=-1).max(axis=-1)
    in_front: NDArray[np.bool_] = distance > IN_PLANE * scale
    return in_front


def _clipped_edges(rays: F64, height: F64) -> list[tuple[F64, F64]]:
    """The edges of the part above the horizon, (…, 3) start and end each; an edge that is not there has length 0.

    A convex polygon leaves through the horizon at most once and comes back once: one edge more closes the gap.
    """
    above = height > 0.0
    edges, exit_point, entry_point = [], np.zeros_like(rays[..., 0, :]), np.zeros_like(rays[..., 0, :])
    for i in range(rays.shape[-2]):
        j = (i + 1) % rays.shape[-2]
        a, b, above_a, above_b = rays[..., i, :], rays[..., j, :], above[..., i, None], above[..., j, None]
        rise = height[..., i] - height[..., j]
        share = np.divide(height[..., i], rise, out=np.zeros_like(rise), where=above[..., i] != above[..., j])
        crossing = a + share[..., None] * (b - a)
        start, end = np.where(above_a, a, crossing), np.where(above_b, b, crossing)
        there = above_a | above_b
        edges.append((np.where(there, start, 0.0), np.where(there, end, 0.0)))
        exit_point = np.where(above_a & ~above_b, crossing, exit_point)
        entry_point = np.where(~above_a & above_b, crossing, entry_point)
    return [*edges, (exit_point, entry_point)]


def parallel_rectangles(a: float, b: float, c: float) -> float:
    """F between equal, directly opposed a×b rectangles at distance c (C-11)."""
    x, y = a / c, b / c
    x1, y1 = sqrt(1 + x * x), sqrt(1 + y * y)
    return (
        2
        / (pi * x * y)
        * (
            log(x1 * y1 / sqrt(1 + x * x + y * y))
            + x * y1 * atan(x / y1)
            + y * x1 * atan(y / x1)
            - x * atan(x)
            - y * atan(y)
        )
    )


def perpendicular_rectangles(h: float, w: float, edge: float) -> float:
    """F from a w×edge rectangle to an h×edge one that stands on the common edge at a right angle (C-14)."""
    H, W = h / edge, w / edge
    h2, w2 = H * H, W * W
    s2 = h2 + w2
    logarithms = (
        log((1 + w2) * (1 + h2) / (1 + s2))
        + w2 * log(w2 * (1 + s2) / ((1 + w2) * s2))
        + h2 * log(h2 * (1 + s2) / ((1 + h2) * s2))
    )
    return (W * atan(1 / W) + H * atan(1 / H) - sqrt(s2) * atan(1 / sqrt(s2)) + logarithms / 4) / (pi * W)
