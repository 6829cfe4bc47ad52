"""Plain geometry for authored scenes: quads, boxes, cylinders, cones, spheres. Counter-clockwise from the front."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.scene.model import F64

# The 20 triangles of an icosahedron over its three golden rectangles, in the order of ``icosphere``.
ICOSAHEDRON = """
    0 1 7  0 5 1  0 7 10  0 10 11  0 11 5  1 5 9  1 8 7  1 9 8  2 3 4  2 4 11
    2 6 3  2 10 6  2 11 10  3 6 8  3 8 9  3 9 4  4 5 11  4 9 5  6 7 8  6 10 7
"""
FACES = ("left", "right", "bottom", "top", "back", "front")  # -x +x -y +y -z +z


@dataclass(frozen=True, eq=False)
class Mesh:
    """positions (n, 3) f64, triangles (m, 3) int64, uv (n, 2) f64 with v = 0 at the top."""

    positions: F64
    triangles: NDArray[np.int64]
    uv: F64

    def transformed(self, matrix: F64) -> Mesh:
        """A copy moved by a (4, 4) matrix; mirrored copies keep their front."""
        moved = self.positions @ matrix[:3, :3].T + matrix[:3, 3]
        mesh = Mesh(moved, self.triangles, self.uv)
        return mesh.flipped() if np.linalg.det(matrix[:3, :3]) < 0.0 else mesh

    def moved(self, x: float, y: float, z: float) -> Mesh:
        return Mesh(self.positions + np.array([x, y, z]), self.triangles, self.uv)

    def flipped(self) -> Mesh:
        """The same surface seen from its other side."""
        return Mesh(self.positions, self.triangles[:, [0, 2, 1]], self.uv)


def merged(meshes: Sequence[Mesh]) -> Mesh:
    starts = np.cumsum([0, *(len(m.positions) for m in meshes)])
    return Mesh(
        np.concatenate([m.positions for m in meshes]),
        np.concatenate([m.triangles + start for m, start in zip(meshes, starts, strict=False)]),
        np.concatenate([m.uv for m in meshes]),
    )


def transform(translate: ArrayLike, rotate_deg: ArrayLike, scale: ArrayLike) -> F64:
    """(4, 4): scale first, then turn about x, y, z in this order, then translate."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.diag(np.broadcast_to(np.asarray(scale, np.float64), 3))
    for axis, degrees in enumerate(np.asarray(rotate_deg, np.float64)):
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turn = np.eye(4)
        turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
        matrix = turn @ matrix
    matrix[:3, 3] = translate
    return matrix


def polygon(corners: ArrayLike) -> Mesh:
    """A quad from four corners, counter-clockwise from the front; the first is its lower left one."""
    triangles = np.array([[0, 1, 2], [0, 2, 3]])
    uv = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]])
    return Mesh(np.asarray(corners, np.float64), triangles, uv)


def quad(origin: ArrayLike, edge_u: ArrayLike, edge_v: ArrayLike) -> Mesh:
    """A parallelogram that faces along edge_u × edge_v."""
    o, u, v = (np.asarray(x, np.float64) for x in (origin, edge_u, edge_v))
    return polygon([o, o + u, o + u + v, o + v])


def box(size: ArrayLike, without: Sequence[str] = ()) -> Mesh:
    """A box about the origin that faces outwards, each face its own quad; ``without`` names FACES to leave out."""
    x, y, z = np.asarray(size, np.float64)
    edges: dict[str, tuple[Any, Any, Any]] = {
        "left": ((0, 0, 0), (0, 0, z), (0, y, 0)),
        "right": ((x, 0, z), (0, 0, -z), (0, y, 0)),
        "bottom": ((0, 0, 0), (x, 0, 0), (0, 0, z)),
        "top": ((0, y, z), (x, 0, 0), (0, 0, -z)),
        "back": ((x, 0, 0), (-x, 0, 0), (0, y, 0)),
        "front": ((0, 0, z), (x, 0, 0), (0, y, 0)),
    }
    assert tuple(edges) == FACES
    quads = [quad(*corner) for face, corner in edges.items() if face not in without]
    return merged(quads).moved(-x / 2, -y / 2, -z / 2)


def lathe(profile: ArrayLike, sides: int) -> Mesh:
    """A profile of (radius, height) pairs, from the bottom up, turned about +y; it faces away from the axis.

    A radius of 0 closes the end in one point. uv: u once around, v along the profile's points.
    """
    r, y = np.asarray(profile, np.float64).T
    rings, k = len(r), np.arange(sides + 1)
    angle = 2.0 * np.pi * k / sides
    around = np.stack([np.sin(angle), np.cos(angle)], axis=1)
    around[-1] = around[0]
    positions = np.zeros((rings, sides + 1, 3))
    positions[:, :, [0, 2]] = r[:, None, None] * around
    positions[:, :, 1] = y[:, None]
    uv = np.stack(np.broadcast_arrays(k / sides, 1.0 - np.arange(rings)[:, None] / (rings - 1)), axis=2)
    ring, side = np.mgrid[0 : rings - 1, 0:sides].reshape(2, -1)
    a = ring * (sides + 1) + side
    b = a + sides + 1
    lower = np.stack([a, a + 1, b + 1], axis=1)[r[ring] > 0.0]
    upper = np.stack([a, b + 1, b], axis=1)[r[ring + 1] > 0.0]
    return Mesh(positions.reshape(-1, 3), np.concatenate([lower, upper]), uv.reshape(-1, 2))


def cylinder(radius: float, height: float, sides: int) -> Mesh:
    """A closed cylinder that stands on y = 0 about the y axis."""
    return lathe([(0.0, 0.0), (radius, 0.0), (radius, height), (0.0, height)], sides)


def icosphere(radius: float, subdivisions: int) -> Mesh:
    """An icosahedron about the origin whose triangles are split in four ``subdivisions`` times: 20·4^n triangles.

    Vertices are shared. uv is longitude and latitude, with a seam.
    """
    g = (1.0 + np.sqrt(5.0)) / 2.0
    golden = np.array([(-1.0, g, 0.0), (1.0, g, 0.0), (-1.0, -g, 0.0), (1.0, -g, 0.0)])
    positions = np.concatenate([golden, golden[:, [2, 0, 1]], golden[:, [1, 2, 0]]])
    triangles = np.array([int(i) for i in ICOSAHEDRON.split()]).reshape(20, 3)
    for _ in range(subdivisions):
        edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = (inverse.reshape(3, -1) + len(positions)).reshape(3, -1)
        positions = np.concatenate([positions, positions[unique].mean(axis=1)])
        a, b, c = triangles.T
        split = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        triangles = np.concatenate([np.stack(t, axis=1) for t in split])
    unit = positions / np.linalg.norm(positions, axis=1, keepdims=True)
    longitude = np.arctan2(unit[:, 0], unit[:, 2]) / (2.0 * np.pi) + 0.5
    latitude = np.arccos(np.clip(unit[:, 1], -1.0, 1.0)) / np.pi
    return Mesh(radius * unit, triangles, np.stack([longitude, latitude], axis=1))
