"""Whether two points see each other, by brute force: every segment against every triangle.

A segment crosses a triangle's plane at t = s/(s - e), s and e its ends' distances from the plane; it hits the triangle
if the barycentric coordinates there, linear in t, are not negative. [Möller, Trumbore 1997] is the same in the order
that suits a single ray; here each of the three is a matrix product for all pairs.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.scene.model import F64

# Segments start and end on surfaces: crossings within this share of the length at either end are those surfaces
# themselves. It is ``form_factors.IN_PLANE``, so that what is too near to block is also too near to be seen.
END = 1e-10
# Triangles are this much larger, in barycentric coordinates, so that no segment slips through a shared edge.
EDGE = 1e-9
BLOCK = 1 << 16  # segment–triangle pairs at a time: 10 arrays that stay in the cache


def visible(starts: F64, ends: F64, triangles: F64) -> NDArray[np.bool_]:
    """(n,) whether nothing of ``triangles`` (m, 3, 3) cuts the segments from ``starts`` (n, 3) to ``ends`` (n, 3)."""
    origin = triangles.reshape(-1, 3).mean(axis=0)
    planes = _planes(triangles - origin)
    rows = max(1, BLOCK // len(triangles))
    seen = np.empty(len(starts), bool)
    for i in range(0, len(starts), rows):
        block = slice(i, i + rows)
        seen[block] = ~_blocked(starts[block] - origin, ends[block] - origin, planes)
    return seen


def _planes(triangles: F64) -> F64:
    """(3, m, 4): plane distance × twice the area, and barycentrics u and v, as linear functions of (x, y, z, 1)."""
    corner = triangles[:, 0]
    edge_1, edge_2 = triangles[:, 1] - corner, triangles[:, 2] - corner
    normal = np.cross(edge_1, edge_2)
    square = (normal**2).sum(axis=1, keepdims=True)
    slopes = np.stack([normal, np.cross(edge_2, normal) / square, np.cross(normal, edge_1) / square])
    return np.concatenate([slopes, -np.einsum("kmc,mc->km", slopes, corner)[:, :, None]], axis=2)


def _blocked(starts: F64, ends: F64, planes: F64) -> NDArray[np.bool_]:
    start_d, start_u, start_v = (starts @ p[:, :3].T + p[:, 3] for p in planes)
    end_d, end_u, end_v = (ends @ p[:, :3].T + p[:, 3] for p in planes)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = start_d / (start_d - end_d)  # infinite or NaN for a segment within the plane: no test below is then passed
        u, v = start_u + t * (end_u - start_u), start_v + t * (end_v - start_v)
        hit = (t > END) & (t < 1 - END) & (u >= -EDGE) & (v >= -EDGE) & (u + v <= 1 + EDGE)
    blocked: NDArray[np.bool_] = hit.any(axis=1)
    return blocked
