"""Senders are what texels gather from: texels, or what stands for a window of them [Kahl22].

The covered texels of a lightmap are numbered tile by tile, in each chart by chart, and there along the Morton curve, so that a
window of any size is a range of numbers. No window holds texels of two charts: they may lie anywhere in the scene. What stands
for a window has its area: Σ A of the texels in it, where RTRad has the square of its edge.

    all, quadtree, directional   each texel by itself
    monte-carlo                  the same, and the ranges that one is chosen from
    stride                       the texel nearest to the window's middle; these are numbered first
    mipmapped                    mean position, normal and light, by area
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.gpu import Gpu, Texture, glsl_constant
from app.lightmap.textures import upload
from app.lightmap.tile_pool import TilePool
from app.scene.model import F32, F64
from app.solvers.pairs.options import BALANCED, PairsOptions

ENTRIES_A_ROW = 1 << int(glsl_constant("solvers/pairs/rows.glsl", "ENTRY_BITS"))
I64 = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class SenderTable:
    """Texels by number, and the senders made of them, as plain arrays.

    texels (n, 4) f32: column and row in the tile pool, part (a chart in a tile), place along the Morton curve in its tile. place
    (s, 4) f32: position and area, facing (s, 4) f32: normal and facet (from 1), of each sender, solver space. ranges (s, 2) f32:
    its first texel, and how many. windows (w, 2) f32: the same of each window; not of senders where one is chosen by chance.
    reciprocal: whether the first texels are the senders.
    """

    texels: F32
    place: F32
    facing: F32
    ranges: F32
    windows: F32
    reciprocal: bool

    @property
    def count(self) -> int:
        """Texels."""
        return len(self.texels)

    @property
    def senders(self) -> int:
        return len(self.place)


def window_of(options: PairsOptions, texels: int, tile: int) -> int:
    """Edge of the windows [texels]: the option, or what leaves BALANCED² of them at most; never more than a tile."""
    window = options.window or 1 << max(int(np.ceil(np.log2(np.sqrt(max(texels, 1)) / BALANCED))), 0)
    return min(window, tile)


def sender_table(pool: TilePool, mode: str, window: int) -> SenderTable:
    """Of all texels that cover a surface. mode: one of SENDERS; window: its edge [texels], a power of two."""
    slot, row, column = np.nonzero((pool.surfaces.face >= 0) & (pool.surfaces.area > 0))
    chart = pool.charts.face_chart[pool.surfaces.face[slot, row, column]]
    order = np.lexsort((morton(column, row), chart, slot))
    slot, row, column, chart = slot[order], row[order], column[order], chart[order]
    curve = morton(column, row)
    part = np.cumsum((np.diff(slot, prepend=-1) != 0) | (np.diff(chart, prepend=-1) != 0))  # of a chart in a tile
    arrays = pool.tile_arrays(np.arange(pool.tiles))
    place: F64 = arrays["t_position_area"][slot, row, column].astype(np.float64)
    facet = (arrays["t_normal_ids"][slot, row, column, 1] >> np.uint32(pool.material_bits)).astype(np.float64)
    facing = np.column_stack([pool.surfaces.normal[slot, row, column].astype(np.float64), facet])
    texels = np.column_stack([pool.corners(slot) + np.stack([column, row], 1), part, curve])
    ranges = np.column_stack([np.arange(len(slot)), np.ones(len(slot), np.int64)])
    levels = window.bit_length() - 1
    first = np.flatnonzero(np.diff(part << 10 | curve >> 2 * levels, prepend=-1))
    windows = np.column_stack([first, np.diff(first, append=len(slot))])
    if mode == "mipmapped":
        place, facing = means(place, facing, first)
        ranges = windows
    elif mode == "stride":
        chosen = nearest_to_middle(place, windows)
        texels = np.concatenate([texels[chosen], np.delete(texels, chosen, 0)])
        area = np.add.reduceat(place[:, 3], first)
        place, facing = np.column_stack([place[chosen, :3], area]), facing[chosen]
        ranges = ranges[: len(chosen)]
    columns = {"texels": texels, "place": place, "facing": facing, "ranges": ranges, "windows": windows}
    f32: dict[str, F32] = {name: np.asarray(array, np.float32) for name, array in columns.items()}
    return SenderTable(reciprocal=mode in ("all", "stride"), **f32)


def morton(x: I64, y: I64) -> I64:
    """Place along the Morton curve of x, y < 32 [Morton66]."""
    return np.asarray(sum((x >> b & 1) << 2 * b | (y >> b & 1) << 2 * b + 1 for b in range(5)), np.int64)


def means(place: F64, facing: F64, first: I64) -> tuple[F64, F64]:
    """Of ranges of texels that begin at ``first``: mean position and whole area; direction of the mean normal, and the facet of
    the first texel."""
    weight = place[:, 3:]
    area = np.add.reduceat(weight, first)
    position = np.add.reduceat(weight * place[:, :3], first) / area
    normal = np.add.reduceat(weight * facing[:, :3], first)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    return np.concatenate([position, area], 1), np.column_stack([normal, facing[first, 3]])


def nearest_to_middle(place: F64, windows: I64) -> I64:
    """(w,) of each range of texels the one nearest to the mean position."""
    first, count = windows.T
    window = np.repeat(np.arange(len(first)), count)
    middle = np.add.reduceat(place[:, 3:] * place[:, :3], first) / np.add.reduceat(place[:, 3:], first)
    away = ((place[:, :3] - middle[window]) ** 2).sum(1).astype(np.float32)
    return np.asarray(np.lexsort((away, window))[first], np.int64)


class Senders:
    """A table of senders on the GPU. Whoever makes it releases it.

    textures: t_texels, t_number, t_place, t_facing, t_ranges, t_windows. sent_size: of a texture with an entry for each sender.
    window: edge [texels].
    """

    def __init__(self, gpu: Gpu, pool: TilePool, options: PairsOptions) -> None:
        self._gpu = gpu
        self.window = window_of(options, pool.texel_count, pool.tile) if options.windowed else 1
        self.table = table = sender_table(pool, options.senders, self.window)
        number = np.zeros((*pool.size[::-1], 1), np.uint32)
        column, row = table.texels[:, :2].astype(np.int64).T
        number[row, column, 0] = np.arange(1, table.count + 1)
        tables = {"t_texels": table.texels, "t_place": table.place, "t_facing": table.facing}
        tables |= {"t_ranges": table.ranges, "t_windows": table.windows}
        self.textures: dict[str, Texture] = {name: upload(gpu, in_rows(array)) for name, array in tables.items()}
        self.textures["t_number"] = upload(gpu, number)

    @property
    def choices(self) -> int:
        """What each texel gathers from: senders, or windows where one is chosen by chance."""
        return self.table.senders

    @property
    def sent_size(self) -> tuple[int, int]:
        return self.textures["t_place"].size

    def some(self, *names: str) -> dict[str, Texture]:
        return {name: self.textures[name] for name in names}

    def release(self) -> None:
        self._gpu.release_all(*self.textures.values())


def in_rows(entries: F32) -> F32:
    """(n, c) as (rows, ENTRIES_A_ROW, c), the last row filled up with 0."""
    rows = max(1, -(-len(entries) // ENTRIES_A_ROW))
    filled = np.zeros((rows * ENTRIES_A_ROW, entries.shape[1]), np.float32)
    filled[: len(entries)] = entries
    return filled.reshape(rows, ENTRIES_A_ROW, -1)
