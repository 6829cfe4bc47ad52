"""Choosing finds the shooters of a batch: the patches with the largest |Σ R A| [Coombe03, 3.4].

    texels -> blocks of 4×4 -> cells of 8×8 -> bins of cells -> the batch

Each step keeps the strongest candidate and adds up what is unshot. A batch takes at most one patch of each bin.
"""

from __future__ import annotations

import numpy as np

from app.gpu import Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.solvers.shooting.options import highest_level
from app.solvers.shooting.records import BLOCK_LEVEL, CELL_LEVEL, EMITTER, GROUP, IN_PATCHES, LEVELS, RECORDS, SHOOTER
from app.solvers.shooting.shooters import ShooterBatch

BINS = 64  # at least
ROOT_LEVEL = 2  # quadtrees: at this level a texel of the root shoots by itself


def band_of(size: tuple[int, int], band: int, bands: int) -> tuple[int, int, int, int] | None:
    """One of so many bands of a target of this size as a scissor (x, y, width, height) [px]; None for all of it."""
    width, height = size
    lower, upper = (height * nth // bands for nth in (band, band + 1))
    return None if bands == 1 else (0, lower, width, upper - lower)


class Bins:
    """Reduction bins hold the strongest candidate of some cells each, and what is unshot in them. Whoever makes them releases
    them."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap) -> None:
        self._gpu = gpu
        self._fit(lightmap)

    def _fit(self, lightmap: Lightmap) -> None:
        cells = (lightmap.pool.tile >> CELL_LEVEL) ** 2
        self.strongest = self._gpu.texture((-(-max(BINS, lightmap.rows) // cells) * cells, 1), 4, "f4")
        self.unshot = self._gpu.texture(self.strongest.size, 4, "f4")
        self.target = self._gpu.target(self.strongest, self.unshot)

    def fill(self, corner: tuple[int, int], level: int) -> None:
        """Let one patch, with this lower corner [texels of the tile pool], be the strongest of all."""
        candidates = np.zeros((self.strongest.width, 4), np.float32)
        candidates[0] = 1e38, corner[0], corner[1] * LEVELS + level, 0.0
        self.strongest.write(candidates.tobytes())

    def resize(self, lightmap: Lightmap) -> None:
        """For a lightmap that has got another number of slots."""
        self.release()
        self._fit(lightmap)

    def release(self) -> None:
        self._gpu.release_all(self.target, self.strongest, self.unshot)


class Choice:
    """Choosing among patches of one level and smaller ones; in quadtrees, of that level at the root and of finer ones below.
    Whoever makes it releases it.

    level: of the largest patches; settles: whether only groups of emitters shoot, all members of one at once.
    """

    def __init__(
        self, gpu: Gpu, lightmap: Lightmap, shooters: ShooterBatch, level: int, finest: int, *, settles: bool = False
    ) -> None:
        """finest: the level that will shoot in the end."""
        self._gpu, self._lightmap, self._shooters = gpu, lightmap, shooters
        self.level, self.settles = level, settles
        tile, root = lightmap.pool.tile, ROOT_LEVEL if lightmap.pool.adaptive else 0
        highest, cells = {"HIGHEST": highest_level(tile)}, {"TILE_CELLS": tile >> CELL_LEVEL}
        reads = lightmap.defines("TILE", "MATERIAL_BITS", "ALBEDO_TEXTURE")
        levels = {"LEVEL": level - root, "FINEST": finest - root, "EMITTER": EMITTER, "SETTLES": settles}
        cell = {"CELL_LEVEL": CELL_LEVEL}
        self._sum = Pass(gpu, "solvers/shooting/patches", defines=reads | IN_PATCHES | levels | highest)
        self._strongest = Pass(gpu, "solvers/shooting/strongest", defines=IN_PATCHES | cells | highest | cell)
        self._reduce = Pass(gpu, "solvers/shooting/bins", defines=cells)
        self._choose = Pass(
            gpu,
            "solvers/shooting/choose",
            defines=reads | IN_PATCHES | levels | highest | cell | {"GROUP": GROUP},
            slots=RECORDS,
        )
        self._fit()

    def _fit(self) -> None:
        width, height = self._lightmap.size
        size = width >> BLOCK_LEVEL, height >> BLOCK_LEVEL
        self._blocks = [self._gpu.texture(size, components, "f4") for components in (4, 4, 2)]
        self._block_target = self._gpu.target(*self._blocks)
        cells = width >> CELL_LEVEL, height >> CELL_LEVEL
        self._cells = [self._gpu.texture(cells, 4, "f4") for _ in range(2)]
        self._cell_target = self._gpu.target(*self._cells)

    def sum_blocks(self, finer: Texture, ambient: Texture, band: int = 0, bands: int = 1) -> None:
        """What each block of texels has to shoot, or those in one of so many bands. finer: of PatchMarks; ambient: overshoot."""
        reads = "t_position_area", "t_normal_ids", "t_materials", "t_albedo", "t_irradiance", "t_residual", "t_leaves"
        self._sum.draw(
            self._block_target,
            textures=self._lightmap.textures(*reads) | {"t_finer": finer, "t_ambient": ambient},
            scissor=band_of(self._blocks[0].size, band, bands),
        )

    def reduce(self, bins: Bins) -> None:
        """The strongest patch in each bin, and the power of all."""
        patches, unshot, lit = self._blocks
        self._strongest.draw(self._cell_target, textures={"t_patches": patches, "t_unshot": unshot, "t_lit": lit})
        candidates, unshot = self._cells
        self._reduce.draw(
            bins.target,
            textures={"t_candidates": candidates, "t_unshot": unshot},
            uniforms={"u_bins": bins.strongest.width, "u_slots": self._lightmap.pool.slots_in_use},
        )

    def choose(self, bins: Bins, finer: Texture, ambient: Texture, shots: int, least: float) -> None:
        """Write the shooters of a batch, the strongest patches of the bins. least: power that is worth a shot [stored units ·
        solver area]."""
        reads = "t_position_area", "t_normal_ids", "t_irradiance", "t_residual", "t_facets", "t_leaves", "t_materials"
        self._choose.draw(
            self._shooters.target,
            textures=self._lightmap.textures(*reads, "t_albedo")
            | {"t_bins": bins.strongest, "t_ambient": ambient, "t_finer": finer},
            uniforms={"u_least": least},
            viewport=(0, 0, SHOOTER.rows, shots),
        )
        self._shooters.share()

    def resize(self) -> None:
        """For a lightmap that has got another number of slots."""
        self.release()
        self._fit()

    def release(self) -> None:
        self._gpu.release_all(self._block_target, *self._blocks, self._cell_target, *self._cells)
