"""Marks make patches finer than others: those of strong emitters, those at contacts, and those that failed their audit.

One mark for each block of 4×4 texels: 0, or 1 + by how many levels patches there are finer than the finest of others; plus
EMITTER where they make groups of an emitter. The same on the host, and on the GPU for patch_level.glsl.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.lightmap.quadtree import Change
from app.lightmap.tile_pool import Moves
from app.scene.model import F32, F64
from app.solvers.shooting.options import highest_level
from app.solvers.shooting.records import BLOCK_LEVEL, EMITTER


class PatchMarks:
    """Whoever makes it releases it. texture: the marks; levels (rows, columns) f32: the same."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap) -> None:
        self._gpu, self._tile = gpu, lightmap.pool.tile
        self._fit(lightmap)
        self.clear()

    def _fit(self, lightmap: Lightmap) -> None:
        width, height = lightmap.size
        self.texture = self._gpu.texture((width >> BLOCK_LEVEL, height >> BLOCK_LEVEL), 1, "f4")
        self.levels = np.zeros(self.texture.size[::-1], np.float32)

    @property
    def tiles(self) -> F32:
        """A view (rows, columns, blocks, blocks) of the marks of every slot."""
        edge = self._tile >> BLOCK_LEVEL
        rows, columns = (side // edge for side in self.levels.shape)
        return self.levels.reshape(rows, edge, columns, edge).swapaxes(1, 2)

    def upload(self) -> None:
        """Write the marks to the GPU, as they are on the host."""
        self.texture.write(self.levels.tobytes())

    def at(self, texel: tuple[int, int]) -> int:
        """0, or 1 and the levels by which the patch of this texel is finer than the finest of others."""
        return int(self.levels[texel[1] >> BLOCK_LEVEL, texel[0] >> BLOCK_LEVEL]) % EMITTER

    def clear(self) -> None:
        """Let nothing shoot from finer patches than other things."""
        self.levels[:] = 0
        self.upload()

    def divide_patches(self, patches: Iterable[tuple[int, int, int, int]]) -> None:
        """Let what is in these patches shoot from patches at least a level finer: column and row of the lower texel, edge, and
        the finest level of patches there."""
        for x, y, edge, finest in patches:
            columns, rows = (slice(c >> BLOCK_LEVEL, (c + edge - 1 >> BLOCK_LEVEL) + 1) for c in (x, y))
            _mark(self.levels[rows, columns], max(finest + 2 - (edge.bit_length() - 1), 1))
        self.upload()

    def divide_emitters(
        self,
        slots: NDArray[np.int64],
        power: F64,
        most: float,
        largest: NDArray[np.int64],
        finest: NDArray[np.int64],
        coarser: NDArray[np.int64],
    ) -> None:
        """Let no patch hold more than so much power (slots, t, t) of texels of these slots, which are all that emit; largest,
        finest (slots,): levels of patches.

        Where texels of uniform size, finer by ``coarser`` levels (slots,), hold more than ``most`` by themselves, patches shoot
        each for itself, ungrouped: one would represent three others beside which nothing else counts."""
        edge, highest = self._tile, highest_level(self._tile)
        level = np.full((len(power), edge, edge), highest)
        for one in range(highest, 0, -1):
            squares = power.reshape(-1, edge >> one, 1 << one, edge >> one, 1 << one).sum((2, 4)) > most
            level[squares.repeat(1 << one, 1).repeat(1 << one, 2)] = one - 1
        blocks = edge >> BLOCK_LEVEL
        in_blocks = -1, blocks, 1 << BLOCK_LEVEL, blocks, 1 << BLOCK_LEVEL
        grouped = (power <= most * 4.0 ** coarser[:, None, None]).reshape(in_blocks).all((2, 4))
        level = level.reshape(in_blocks).min((2, 4))
        largest, finest = largest[:, None, None], finest[:, None, None]
        finer = np.where(level < largest, np.maximum(finest + 1 - level, 1), 0)
        self.levels %= EMITTER
        place = np.divmod(slots, self.tiles.shape[1])
        tiles = self.tiles[place]
        _mark(tiles, finer)
        self.tiles[place] = tiles + EMITTER * ((finer > 0) & grouped)
        self.upload()

    def divide_at(self, places: NDArray[np.bool_], finer: int) -> None:
        """Let patches be so much finer in blocks that hold or touch any of these texels (slots, t, t)."""
        places = maximum_filter(places, size=(1, 3, 3))
        blocks = self._tile >> BLOCK_LEVEL
        held = places.reshape(-1, blocks, 1 << BLOCK_LEVEL, blocks, 1 << BLOCK_LEVEL).any((2, 4))
        place = np.divmod(np.arange(len(places)), self.tiles.shape[1])
        tiles = self.tiles[place]
        _mark(tiles, np.where(held, finer, 0).astype(np.int64))
        self.tiles[place] = tiles
        self.upload()

    # -- leaves and levels that change ---------------------------------------------------------------------------------

    def follow(self, change: Change) -> None:
        """Let leaves that came shoot as fine as what was in their place."""
        if not self.levels.any():
            return
        tiles, columns = self.tiles, self.tiles.shape[1]
        parents, children = (np.divmod(slots, columns) for slots in (change.parents, change.children))
        blocks = np.arange(tiles.shape[-1])
        across, up = (side * len(blocks) // 2 + blocks // 2 for side in change.corner.T[..., None])
        held, gone = tiles[parents if change.split else children], parents if change.split else children
        tiles[gone] = 0
        place = up[:, :, None], across[:, None, :]
        if change.split:
            tiles[children] = held[np.arange(len(held))[:, None, None], *place]
        else:
            place = tuple(at[:, None, None] for at in parents) + place
            flags, finer = np.zeros_like(tiles), np.zeros_like(tiles)
            np.maximum.at(flags, place, held // EMITTER)
            np.maximum.at(finer, place, held % EMITTER)
            tiles += flags * EMITTER + finer
        self.upload()

    def shift(self, levels: int) -> None:
        """For a finest level that is so much higher, or lower: what was divided stays as fine, since groups may yet have to
        settle there."""
        marks = self.levels
        marks[:] = np.where(marks > 0, marks // EMITTER * EMITTER + np.maximum(marks % EMITTER + levels, 1), 0)
        self.upload()

    def resize(self, lightmap: Lightmap, moves: Moves) -> None:
        """For a lightmap that has got another number of slots: all leaves shoot as fine as before."""
        held = moves.array(self.tiles.reshape(-1, *self.tiles.shape[2:]), 0)
        self.release()
        self._fit(lightmap)
        self.tiles[np.divmod(np.arange(moves.slots), lightmap.columns)] = held
        self.upload()

    def release(self) -> None:
        self._gpu.release_all(self.texture)


def _mark(marks: F32, finer: int | NDArray[np.int64]) -> None:
    """Let patches be so much finer at least; what emits stays marked so."""
    marks[:] = marks // EMITTER * EMITTER + np.maximum(marks % EMITTER, finer)
