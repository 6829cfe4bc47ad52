"""Of facets, those that something may lie on are all found: against every pair of them."""

from __future__ import annotations

import numpy as np
import pytest

from app.atlas.planes import GENERIC, Planes
from app.atlas.sides import FLAT_ANGLE, Edges
from app.scene.model import F64

rng = np.random.default_rng(3)
WITHIN = 0.002
PLANES = 450


def _planes() -> tuple[Planes, F64]:
    """Loose triangles, a third of them beside another one's plane, and some seen edgewise along the axis that none should be."""
    normal = rng.normal(size=(PLANES, 3))
    normal[: PLANES // 10] -= (normal[: PLANES // 10] @ GENERIC[:, 2:]) * GENERIC[:, 2]
    height = rng.uniform(-1, 1, PLANES)
    near = rng.integers(0, PLANES // 3, PLANES // 3)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    turned = normal[near] + rng.normal(size=(len(near), 3)) * FLAT_ANGLE * rng.choice([0.0, 0.6], (len(near), 1))
    way = rng.choice([-1.0, 1.0], (len(near), 1))
    normal = np.concatenate([normal, way * turned / np.linalg.norm(turned, axis=1, keepdims=True)])
    height = np.append(height, way[:, 0] * (height[near] + rng.uniform(-1, 1, len(near)) * WITHIN))
    across = np.cross(normal, rng.normal(size=normal.shape))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    corners = (height[:, None] * normal)[:, None] + 0.01 * np.stack(
        [across, np.cross(normal, across), -across - np.cross(normal, across)], axis=1
    )
    triangles = np.arange(3 * len(normal), dtype=np.int32).reshape(-1, 3)
    facet = np.arange(len(normal), dtype=np.int32)
    points = corners.reshape(-1, 3)
    planes = Planes.of(points, triangles, facet, np.ones(len(facet), bool), 1e-6, Edges.of(triangles))
    units = np.array([FLAT_ANGLE, FLAT_ANGLE, FLAT_ANGLE, WITHIN])
    rows = np.column_stack([planes.normal, (planes.normal * planes.point).sum(1)]) / units
    near_each = [((rows[:, None] - side * rows) ** 2).sum(2) <= 1 for side in (1, -1)]
    return planes, (near_each[0] | near_each[1]) & ~np.eye(len(rows), dtype=bool)


@pytest.mark.parametrize("some", [False, True])
def test_all_facets_in_planes_of_others_are_found(some: bool) -> None:
    planes, pairs = _planes()
    own = np.sort(rng.permutation(len(planes.normal))[:100]) if some else np.arange(len(planes.normal))
    meant = np.flatnonzero(pairs[:, own].any(1))
    found = planes.near(WITHIN, own if some else None)
    assert len(meant) > 30 and np.isin(meant, found).all()
    assert len(found) < len(meant) + 0.25 * len(planes.normal)  # few others: those seen edgewise
