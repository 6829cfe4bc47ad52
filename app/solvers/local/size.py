"""How large the local set is: how many patches of how many texels, by the options and by what memory and the driver allow."""

from __future__ import annotations

import numpy as np

from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.tile_pool import TilePool
from app.solvers.local.matrix import ROW
from app.solvers.local.options import LocalOptions
from app.solvers.local.patches import patch_count
from app.solvers.local.rows import BYTES, ROWS_OF_A_NODE

SOFTWARE, HARDWARE = 1024, 4096  # patches of the set by default, where a CPU rasterises and where not
WHOLE = 3  # highest level of patches that are large so that a whole scene is in the set


def size_of_set(gpu: Gpu, pool: TilePool, options: LocalOptions) -> tuple[int, int]:
    """The level of its patches, and the most of them."""
    most = options.patches or default_patches(gpu, options)
    level = options.patch_level
    if level is None:
        level = next((n for n in range(WHOLE + 1) if patch_count(pool, n) <= most), 0)
    return level, most


def fitting(most: int, there: int, options: LocalOptions) -> int:
    """The most patches, whole rows of the matrix and no more than are needed for those that are ``there``. Raises UserError where
    the matrix of so many is larger than it may be."""
    most = -(-min(most, there) // ROW) * ROW
    mebibytes = most**2 * _components(options) * options.bits / 8 / 2**20
    if mebibytes > options.matrix_memory:
        raise UserError(
            f"--matrix-memory {options.matrix_memory}: the matrix of {most} patches takes {mebibytes:.0f} MiB"
        )
    return most


def default_patches(gpu: Gpu, options: LocalOptions) -> int:
    """As many as the driver and the memory for the matrix allow, up to what this kind of renderer keeps up with."""
    most = min(SOFTWARE if gpu.software else HARDWARE, gpu.limits.max_texture)
    in_matrix = int(np.sqrt(options.matrix_memory * 2**20 * 8 / (_components(options) * options.bits)))
    in_rows = options.row_memory * 2**20 // (options.rays * BYTES) // ROWS_OF_A_NODE
    return max(min(most, in_matrix, in_rows) // ROW, 1) * ROW


def _components(options: LocalOptions) -> int:
    """Numbers in each element of the matrix."""
    return 1 if options.bounces == "iterate" else 4


__all__ = ["fitting", "size_of_set"]
