"""Voxels are the cells of a cubic grid that triangles touch, as bits in a texture: see visibility/voxels.glsl.

A cell is found by halving the grid: of each cell that a triangle touches, the eight halves are looked at. Whether they touch is
exact but for rounding: triangle and box are apart where an axis separates them [Akenine01].
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.gpu import Gpu, Texture
from app.lightmap.textures import upload
from app.lightmap.tile_pool import TilePool
from app.scene.model import F64
from app.visibility.rays import corners_of

MARGIN = 1e-3  # of the scene's longest edge around it: no surface lies on the grid's own sides
BLOCK = 1 << 18  # pairs of triangle and cell that are looked at together
ROUNDING = 1e-6  # of a cell, by which a triangle may miss one and still touch it


class VoxelScene:
    """The occupied cells of a tile pool's scene on the GPU. Whoever makes it releases it.

    cells: along an edge, a power of two from 32. textures, uniforms: of visibility/voxels.glsl.
    """

    def __init__(self, gpu: Gpu, pool: TilePool, cells: int) -> None:
        self._gpu, self.cells = gpu, cells
        corners = corners_of(pool)
        lower, upper = corners.min((0, 1)), corners.max((0, 1))
        edge = float((upper - lower).max()) * (1 + 2 * MARGIN)
        corner = (lower + upper - edge) / 2
        self.occupied = occupied_cells((corners - corner) / edge, cells)
        self.textures: dict[str, Texture] = {"t_voxels": upload(gpu, words_of(self.occupied))}
        self.uniforms: dict[str, Any] = {"u_grid": (*corner.tolist(), edge / cells), "u_cells": cells}

    @property
    def memory(self) -> int:
        """Bytes on the GPU."""
        return int(self.cells**3 // 8)

    def release(self) -> None:
        self._gpu.release_all(*self.textures.values())


def occupied_cells(corners: F64, cells: int) -> NDArray[np.bool_]:
    """(z, y, x) which cells of the unit cube triangles (n, 3, 3) touch."""
    out = np.zeros((cells, cells, cells), bool)
    step = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)])
    for first in range(0, len(corners), BLOCK // 8):
        triangle = np.arange(first, min(first + BLOCK // 8, len(corners)))
        stack = [(1, triangle, np.zeros((len(triangle), 3), np.int64))]
        while stack:
            size, triangle, cell = stack.pop()
            if size == cells:
                out[cell[:, 2], cell[:, 1], cell[:, 0]] = True
                continue
            halves = (2 * cell[:, None] + step).reshape(-1, 3)
            triangle = np.repeat(triangle, 8)
            kept = touches(corners[triangle] * (2 * size) - halves[:, None])
            triangle, halves = triangle[kept], halves[kept]
            stack += [
                (2 * size, triangle[k : k + BLOCK // 8], halves[k : k + BLOCK // 8])
                for k in range(0, len(triangle), BLOCK // 8)
            ]
    return out


def touches(corners: F64) -> NDArray[np.bool_]:
    """(n,) whether triangles (n, 3, 3) touch the unit cell at the origin: no axis separates them [Akenine01]."""
    v = corners - 0.5
    half = 0.5 + ROUNDING
    out: NDArray[np.bool_] = (v.min(1) <= half).all(1) & (v.max(1) >= -half).all(1)
    edges = np.roll(v, -1, 1) - v
    axes = [np.cross(edges[:, 0], edges[:, 1])]
    axes += [np.cross(np.eye(3)[k], edges[:, e]) for k in range(3) for e in range(3)]
    for axis in axes:
        along = np.einsum("nck,nk->nc", v, axis)
        reach = half * np.abs(axis).sum(1)
        out &= (along.min(1) <= reach) & (along.max(1) >= -reach)
    return out


def words_of(occupied: NDArray[np.bool_]) -> NDArray[np.uint32]:
    """(z, y, x) as the texture (z, y · words, 1) holds it: 32 cells along x in each word, the first the lowest bit."""
    cells = len(occupied)
    packed = np.packbits(occupied, axis=2, bitorder="little").view(np.dtype("<u4"))
    return np.ascontiguousarray(packed.reshape(cells, -1, 1)).astype(np.uint32)


__all__ = ["VoxelScene"]
