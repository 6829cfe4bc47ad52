"""Receivers are what light falls on, as few quads as possible: rows of planar tiles of one rectangle, and single tiles of any
other shape, whose texels must be read.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.gpu import Gpu, Mesh
from app.lightmap.tile_pool import TilePool
from app.scene.model import F32

# One instance: in_rect, in_a, in_b, in_c of solvers/shooting/receive.vert.glsl
RECEIVER_FORMAT = {"in_rect": "4f", "in_a": "4f", "in_b": "4f", "in_c": "4f"}


def receivers(pool: TilePool, used: NDArray[np.int64]) -> tuple[F32, F32]:
    """(rows, 16) f32 of planar tiles and (tiles, 16) f32 of general ones, see RECEIVER_FORMAT, of the ``used`` slots (n,), in
    order.

    Neighbouring planar tiles of one facet, side by side in atlas and tile pool, are one quad. Quads end where no texel is
    covered: most of a tile may be empty.
    """
    shapes, leaves, columns = pool.shapes, pool.leaves, pool.columns
    planar = used[shapes["planar"][used]]
    general = used[~shapes["planar"][used]]
    before = planar - 1
    joins = np.isin(before, planar) & (planar % columns != 0) & (shapes["a"][before, 3] == shapes["a"][planar, 3])
    joins &= (leaves.level[before] == leaves.level[planar]) & (leaves.y[before] == leaves.y[planar])
    joins &= leaves.x[before] + 1 == leaves.x[planar]
    left, right = shapes["box"][before], shapes["box"][planar]
    joins &= (left[:, 2] == pool.tile) & (right[:, 0] == 0) & (left[:, 1::2] == right[:, 1::2]).all(1)
    start = np.flatnonzero(~joins)
    last = np.append(start, len(planar))[1:] - 1
    return _quads(pool, planar[start], planar[last]), _quads(pool, general, general)


def _quads(pool: TilePool, first: NDArray[np.int64], last: NDArray[np.int64]) -> F32:
    """From the lower corner of what the first tile of each covers to the upper of the last."""
    lower = pool.corners(first) + pool.shapes["box"][first, :2]
    upper = pool.corners(last) + pool.shapes["box"][last, 2:]
    shape = pool.shapes[first]
    return np.concatenate([lower, upper - lower, shape["a"], shape["b"], shape["c"]], 1).astype(np.float32)


def receiver_meshes(gpu: Gpu, pool: TilePool, slots: NDArray[np.int64]) -> dict[bool, Mesh]:
    """The receivers in these slots, by whether they are planar; what there is none of is left out."""
    return {
        planar: Mesh(gpu, quads.tobytes(), RECEIVER_FORMAT, per_instance=True)
        for planar, quads in zip((True, False), receivers(pool, slots), strict=True)
        if len(quads)
    }


class Receivers:
    """All texels of a lightmap as receivers. Whoever makes it says when leaves have changed, and releases it."""

    def __init__(self, gpu: Gpu, pool: TilePool) -> None:
        self._gpu, self._pool = gpu, pool
        self.meshes: dict[bool, Mesh] = {}
        self.follow()

    def follow(self) -> None:
        """Take over the leaves that there are now."""
        self.release()
        self.meshes = receiver_meshes(self._gpu, self._pool, np.flatnonzero(self._pool.used))

    def release(self) -> None:
        self._gpu.release_all(*self.meshes.values())
        self.meshes = {}
