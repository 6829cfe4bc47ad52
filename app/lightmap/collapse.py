"""Collapsing makes one flat texture of texture quadtrees, smooth across leaves of different levels [Coombe03, 4.4].

From the finest level up, every level takes the means of the finer one where that holds leaves; from the root down, every level is
interpolated from the coarser one where it holds none. Interpolation thus meets, next to a finer leaf, the mean of its texels.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.lightmap.tile_pool import TilePool
from app.scene.model import F32

Mask = NDArray[np.bool_]


def collapse(pool: TilePool, values: F32) -> tuple[F32, Mask]:
    """Values (slots, t, t, c) as an image (H, W, c) of the atlas at the finest level in use, row 0 at v = 0, and which of its
    texels (H, W) cover a surface."""
    finest = int(pool.leaves.level.max(initial=0))
    levels = [_level_image(pool, values, level) for level in range(finest + 1)]
    for level in range(finest - 1, -1, -1):
        _take_means(levels[level], levels[level + 1])
    image, covered = levels[0]
    for level in range(1, finest + 1):
        finer, there = levels[level]
        image = np.where(there[..., None], finer, _interpolated(image, covered))
        covered = there | covered.repeat(2, 0).repeat(2, 1)
    return image, covered


def _level_image(pool: TilePool, values: F32, level: int) -> tuple[F32, Mask]:
    """What the leaves of one level hold, and where they cover something."""
    width, height = (side << level for side in pool.charts.size)
    image = np.zeros((height, width, values.shape[-1]), np.float32)
    covered = np.zeros((height, width), bool)
    mine = np.flatnonzero(pool.leaves.level == level)
    where = pool.leaves.y[mine], pool.leaves.x[mine]
    _tiled(image, pool.tile)[where] = values[mine]
    _tiled(covered, pool.tile)[where] = pool.surfaces.face[mine] >= 0
    return image, covered


def _tiled(image: NDArray[np.generic], tile: int) -> NDArray[np.generic]:
    """A view (rows, columns, t, t, …) of an image's tiles."""
    height, width = image.shape[:2]
    return image.reshape(height // tile, tile, width // tile, tile, *image.shape[2:]).swapaxes(1, 2)


def _take_means(coarse: tuple[F32, Mask], fine: tuple[F32, Mask]) -> None:
    """Means of the covered ones of each 2×2 finer texels, where the coarse image holds nothing."""
    image, covered = fine
    height, width = covered.shape
    four = image.reshape(height // 2, 2, width // 2, 2, -1) * covered.reshape(height // 2, 2, width // 2, 2, 1)
    count = covered.reshape(height // 2, 2, width // 2, 2).sum((1, 3))
    new = (count > 0) & ~coarse[1]
    coarse[0][new] = four.sum((1, 3))[new] / count[new][:, None]
    coarse[1][new] = True


def _interpolated(image: F32, covered: Mask) -> F32:
    """Twice the size, bilinear among the texels that cover something."""
    weight = covered[..., None].astype(np.float32)
    value = image * weight
    for axis in (0, 1):
        value, weight = _doubled(value, axis), _doubled(weight, axis)
    return np.asarray(value / np.maximum(weight, np.float32(1e-30)), np.float32)


def _doubled(image: F32, axis: int) -> F32:
    """Twice the texels along an axis: three parts of the texel itself and one of the neighbour on that side."""
    moved = np.moveaxis(image, axis, 0)
    before, after = np.concatenate([moved[:1], moved[:-1]]), np.concatenate([moved[1:], moved[-1:]])
    out = np.empty((2 * len(moved), *moved.shape[1:]), np.float32)
    out[::2], out[1::2] = 0.75 * moved + 0.25 * before, 0.75 * moved + 0.25 * after
    return np.moveaxis(out, 0, axis)
