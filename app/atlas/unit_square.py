"""What of triangles lies in the unit square S = [0, 1]². For a triangle counter-clockwise, slices along v give, by Green's
theorem,

    area = -∮ c(v) du,   ∫u = -∮ u c(v) du,   ∫v = -∮ c(v)²/2 du,   c(v) = clamp(v, 0, 1),

over the triangle's edges with u inside S: closed forms, since c(v) along an edge is a chain of three straight pieces.
"""

from __future__ import annotations

import numpy as np

from app.scene.model import F64

# Pieces below this share of the square, or of a smaller triangle, are rounding where an edge runs along a side of it.
SLIVER = 1e-9


def area_and_centroid(pu: F64, pv: F64) -> tuple[F64, F64, F64]:
    """Area and centroid (u, v) of triangles u, v (3, n) inside the unit square, by the formulas above."""
    qu, qv = np.roll(pu, -1, axis=0), np.roll(pv, -1, axis=0)
    ua, ub = np.clip(pu, 0, 1), np.clip(qu, 0, 1)
    upright = np.abs(qu - pu) < np.finfo(float).eps  # covers no u: adds nothing to any of the integrals
    ub = np.where(upright, ua, ub)
    slope = (qv - pv) / np.where(upright, 1.0, qu - pu)
    va, vb = pv + (ua - pu) * slope, qv + (ub - qu) * slope
    rise = np.where(va == vb, 1.0, vb - va)
    t0, t1 = np.clip(-va / rise, 0, 1), np.clip((1 - va) / rise, 0, 1)
    area, first_u, first_v = (np.zeros(pu.shape[1]) for _ in range(3))
    u, c = ua, np.clip(va, 0, 1)
    for t in (np.minimum(t0, t1), np.maximum(t0, t1), np.ones_like(t0)):
        un, cn = ua + t * (ub - ua), np.clip(va + t * (vb - va), 0, 1)
        du = un - u
        area -= (du * (c + cn) / 2).sum(axis=0)
        first_u -= (du * (u * (2 * c + cn) + un * (c + 2 * cn)) / 6).sum(axis=0)
        first_v -= (du * (c * c + c * cn + cn * cn) / 6).sum(axis=0)
        u, c = un, cn
    some = np.abs(area) > 0
    whole = np.where(some, area, 1.0)
    # a sliver's centroid is rounding, but it lies in the square
    u_mean, v_mean = np.clip(first_u / whole, 0, 1), np.clip(first_v / whole, 0, 1)
    return np.abs(area), np.where(some, u_mean, 0.5), np.where(some, v_mean, 0.5)
