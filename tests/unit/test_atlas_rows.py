"""Rows of whole numbers are told apart, and corners joined, as the plain and slow ways do."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from app.atlas.sides import FEW, WELD, Edges, distinct_rows, kinds, numbered, rows_by, scene_size, weld
from app.scene import shapes
from app.scene.model import Material, Scene

rng = np.random.default_rng(5)


@pytest.mark.parametrize("kind", [np.int8, np.int32])
@pytest.mark.parametrize("count", [0, 5, FEW + 1])
@pytest.mark.parametrize("most", [(1, 99, 2), (900, 700, 2), (1 << 40, 5, 1 << 20), (1 << 40, 1 << 40, 1 << 40)])
def test_distinct_rows(kind: type[np.integer], count: int, most: tuple[int, int, int]) -> None:
    columns = [rng.integers(-span, span, count) for span in most]
    columns = [np.concatenate([column, column[: count // 2]]) for column in columns]
    columns = [column.astype(kind) if span < 100 else column for column, span in zip(columns, most, strict=True)]
    index, own, uses = distinct_rows(*columns)
    rows, first, inverse, counts = np.unique(
        np.stack(columns, axis=1), axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    assert (np.stack(columns, axis=1)[index] == rows).all()
    assert (index == first).all() and (own == inverse.reshape(-1)).all() and (uses == counts).all()


def test_rows_by_label_and_their_numbers() -> None:
    label = rng.integers(0, 9, 1000) * 2
    order, first = rows_by(label, 20)
    assert (order == np.argsort(label, kind="stable")).all()
    assert (np.diff(first) == np.bincount(label, minlength=20)).all()
    assert (numbered(label) == np.unique(label, return_inverse=True)[1]).all()


def test_edges_have_all_their_half_edges() -> None:
    triangles = np.array([[0, 1, 2], [2, 1, 3], [1, 2, 4], [0, 5, 1]], np.int32)
    edges = Edges.of(triangles)
    halves = [sorted(edges.order[a:b].tolist()) for a, b in zip(edges.first, edges.first[1:], strict=False)]
    assert halves == [[0, 11], [2], [9], [1, 3, 6], [4], [8], [10], [5], [7]]
    assert [(i.tolist(), j.tolist()) for i, j in (edges.pairs(1), edges.pairs(2))] == [
        ([0, 1, 3], [11, 3, 6]),
        ([1], [6]),
    ]


def test_corners_that_nearly_coincide_are_joined() -> None:
    mesh = shapes.icosphere(1.0, 2)
    corners = np.concatenate([mesh.positions, rng.integers(0, 3, (500, 3)).astype(float)])  # many share an axis
    near = corners[::2] + rng.uniform(-1, 1, corners[::2].shape) * 4e-7
    positions = np.concatenate([corners, near])
    triangles = rng.permutation(len(positions))[: len(positions) // 3 * 3].reshape(-1, 3).astype(np.int32)
    ids = np.zeros(len(triangles), np.int32)
    scene = Scene("corners", positions, triangles, ids, ids, ("one",), (Material("grey"),))
    points, welded = weld(scene)
    apart = cKDTree(points).query_pairs(WELD * scene_size(scene), output_type="ndarray")
    assert len(points) < len(np.unique(positions, axis=0)) and not len(apart)
    assert np.abs(points[welded] - scene.corners).max() < 4 * WELD * scene_size(scene)


@pytest.mark.parametrize(
    "labels", [np.array([[5, 0, 5], [9, 5, 0]]), np.array([10**9, 3, 10**9]), np.empty(0, np.int64)]
)
def test_kinds_are_those_of_unique(labels: NDArray[np.int64]) -> None:
    found, number = kinds(labels)
    wanted, of = np.unique(labels, return_inverse=True)
    assert found.tolist() == wanted.tolist() and number.tolist() == of.reshape(labels.shape).tolist()
