"""Bare triangles as rays need them, without an atlas; and what rays meet among them, in float64."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.bench.speed.ray_batch import RayBatch
from app.gpu import Gpu
from app.lightmap.tile_pool import SolverSpace
from app.scene.model import F64, Material
from app.visibility.rays import RayScene


class BarePool(SimpleNamespace):
    """It is known by who it is, as a tile pool is."""

    __hash__ = object.__hash__


def bare_pool(positions: F64, triangles: NDArray[np.integer]) -> Any:
    """As much of a tile pool as rays ask for; no side has texels."""
    corners = positions[triangles].reshape(-1, 3)
    space = SolverSpace.of(SimpleNamespace(bounds=(corners.min(0), corners.max(0))))  # type: ignore[arg-type]
    count = len(triangles)
    charts = SimpleNamespace(
        face_triangle=np.empty(0, np.int32), face_back=np.empty(0, bool), face_uv=np.empty((0, 3, 2))
    )
    material = {"materials": (Material("grey"),), "material_ids": np.zeros(count, np.int32)}
    return BarePool(
        space=space, scene=SimpleNamespace(positions=positions, triangles=triangles, **material), charts=charts
    )


@contextlib.contextmanager
def batch(
    gpu: Gpu, pool: Any, origins: F64, directions: F64, nearest: float = 0.0, farthest: float = 4.0
) -> Iterator[RayBatch]:
    rays = RayScene(gpu, pool)
    count = len(origins)
    made = RayBatch(
        gpu,
        rays,
        np.column_stack([origins, np.full(count, nearest)]).astype(np.float32),
        np.column_stack([directions, np.full(count, farthest)]).astype(np.float32),
    )
    yield made
    made.release()
    rays.release()


def unit(rng: np.random.Generator, count: int) -> F64:
    v = rng.normal(size=(count, 3))
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True))


def met(corners: F64, origins: F64, directions: F64, farthest: float = 4.0) -> tuple[F64, F64]:
    """Of each ray (n, 3) and triangle (m, 3, 3): distance (n, m), infinite where it is not met, and the least of the three
    weights there (n, m)  [Moller97]."""
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = np.cross(b - a, c - a)
    det = -directions @ normal.T
    # u = (c-a) · ((o-a) × d) / det, spread out so that all is products of matrices
    across = np.cross(origins, directions)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = (across @ (c - a).T - (directions @ np.cross(c - a, a).T)) / det
        v = -(across @ (b - a).T - (directions @ np.cross(b - a, a).T)) / det
        t = (origins @ normal.T - (a * normal).sum(1)) / det
    least = np.minimum(np.minimum(u, v), 1 - u - v)
    return np.where((least >= 0) & (t >= 0) & (t < farthest), t, np.inf), least
