"""Polygons as triangles: fans, or by ear clipping where they are concave."""

from __future__ import annotations

import mapbox_earcut
import numpy as np
from numpy.typing import NDArray

from app.scene.model import F64


def fan_corners(lengths: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Of polygons with so many corners each, listed one after the other: the corners (3m,) of their fans, and how many triangles
    each has of those that have any."""
    first, fans = np.cumsum(lengths) - lengths, np.maximum(lengths - 2, 0)
    start = np.repeat(first, fans)
    nth = np.arange(fans.sum()) - np.repeat(np.cumsum(fans) - fans, fans)
    return np.stack([start, start + nth + 1, start + nth + 2], axis=1).reshape(-1), fans[fans > 0]


def with_ears_clipped(
    positions: F64, corners: NDArray[np.int64], fans: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The corners (3m, k), the first number of each its position, with other triangles in place of those fans that leave their
    face, and of each triangle which of the given ones it is or has its face in common with.

    fans: triangles of each face. A fan that leaves its face, which is concave then, folds over itself: one of its triangles turns
    its back on the face's normal, which is the sum of theirs.
    """
    triangles = corners.reshape(-1, 3, corners.shape[1])
    many = fans > 1
    if not many.any():
        return corners, np.arange(len(triangles))
    face = np.repeat(np.arange(len(fans)), fans)
    a, b, c = np.moveaxis(positions[triangles[..., 0]], 1, 0)
    cross = np.cross(b - a, c - a)
    normals = np.stack([np.bincount(face, cross[:, k], len(fans)) for k in range(3)], axis=1)
    turned = (cross * normals[face]).sum(axis=1) < 0.0
    rows, of, done = [], [], 0
    starts = np.cumsum(fans) - fans
    for f in np.flatnonzero(many & (np.bincount(face, turned, len(fans)) > 0)).tolist():
        start, stop = int(starts[f]), int(starts[f] + fans[f])
        ring = np.concatenate([triangles[start, :2], triangles[start:stop, 2]])
        clipped = _ears(positions[ring[:, 0]], normals[f])
        if len(clipped) == 0:  # a face that has no area to clip
            continue
        rows += [triangles[done:start], ring[clipped]]
        of += [np.arange(done, start), np.full(len(clipped), start)]
        done = stop
    rows.append(triangles[done:])
    of.append(np.arange(done, len(triangles)))
    return np.concatenate(rows).reshape(-1, corners.shape[1]), np.concatenate(of)


def _ears(ring: F64, normal: F64) -> NDArray[np.int64]:
    """(k, 3) corners of the triangles of a face with these corners (n, 3), each as the face winds about ``normal``."""
    drop = int(np.argmax(np.abs(normal)))  # the axis along which the face looks largest
    flat = np.ascontiguousarray(np.delete(ring, drop, axis=1))
    triangles = np.asarray(mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], np.uint32)), np.int64)
    triangles = triangles.reshape(-1, 3)
    a, b, c = np.moveaxis(ring[triangles], 1, 0)
    turned = (np.cross(b - a, c - a) * normal).sum(axis=1) < 0.0
    return np.where(turned[:, None], triangles[:, ::-1], triangles)
