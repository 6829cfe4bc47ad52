"""Patches shoot from coarse to fine: large ones first, and finer ones what those leave.

First as few patches as show all of the light soon; then, where emitters are divided, all members of their groups settle; then the
finest. What is left then is more here and less there: light that hardly leaves its corner.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.solvers.shooting.choose import ROOT_LEVEL, Choice
from app.solvers.shooting.options import MAX_LEVEL, ShootingOptions, highest_level
from app.solvers.shooting.patch_marks import PatchMarks
from app.solvers.shooting.shooters import ShooterBatch

# Patches of a scene: about so many show the light first, and unless a level is set, the finest are no more than the most, since
# more gain little, nor finer than a level.
FIRST_PATCHES, MOST_PATCHES, LEVEL = 400, 4096, 2
COARSE_FIRST = 100  # patches that show the light first where better light takes the place of this soon
# Finer patches follow once so little of the emitted power is unshot; the finest end once they hold so many times the residual
# asked for.
COARSE_ENOUGH, FINE_ENOUGH = 5e-3, 10


def patch_levels(lightmap: Lightmap, options: ShootingOptions, *, coarse: bool = False) -> list[int]:
    """Levels of the patches that begin and of the finest, as powers of 2 of texels; in quadtrees, of uniform ones. coarse:
    whether few begin."""
    adaptive, charts = lightmap.pool.adaptive, lightmap.charts
    top = MAX_LEVEL if adaptive else highest_level(lightmap.pool.tile)
    texels = lightmap.pool.surfaces.area.sum() * charts.density**2 * (4**ROOT_LEVEL if adaptive else 1)
    last = min(LEVEL if options.level is None else options.level, top)
    while options.level is None and last < top and texels / 4**last > MOST_PATCHES:
        last += 1
    first, patches = last, COARSE_FIRST if coarse else FIRST_PATCHES
    while options.coarsen and first < top and texels / 4 ** (first + 1) >= patches:
        first += 1
    return [first, last] if first > last else [last]


class Phases:
    """The phases of a solve, for one choice of options. Whoever makes it releases it.

    choices: one for each phase, the last of the finest patches; index: of the one that shoots now; even: whether the finest have
    shot, and hold little.
    """

    def __init__(
        self, gpu: Gpu, lightmap: Lightmap, shooters: ShooterBatch, options: ShootingOptions, *, coarse: bool
    ) -> None:
        """coarse: as of ``patch_levels``."""
        self._lightmap = lightmap
        levels = patch_levels(lightmap, options, coarse=coarse)
        self.choices = [Choice(gpu, lightmap, shooters, level, levels[-1]) for level in levels]
        if len(levels) > 1:
            self.choices.insert(1, Choice(gpu, lightmap, shooters, *levels, settles=True))
        self.begin()

    @property
    def now(self) -> Choice:
        """Among the patches that shoot now."""
        return self.choices[self.index]

    @property
    def finest(self) -> Choice:
        return self.choices[-1]

    def begin(self, index: int = 0) -> None:
        """Begin with this phase, or the last."""
        self.index, self.even = min(index, len(self.choices) - 1), False

    def follow(self, unshot: float, to_shoot: float, residual: float) -> bool:
        """Whether finer patches shoot from now on. unshot: share of the emitted power; to_shoot: what patches hold, with the
        overshoot; residual: share that is asked for."""
        if self.now.settles or unshot > max(COARSE_ENOUGH, residual):
            return False
        is_last = self.now is self.finest
        self.even = is_last and to_shoot <= FINE_ENOUGH * residual
        return not is_last

    def say(self, to_shoot: float | None) -> str:
        """What is being done once large patches have shot, which leaves the sum of what is unshot about as it is. to_shoot: as of
        ``follow``, once it is known."""
        if self.now.settles:
            return "lamps settle: all of their patches shoot"
        fine = self.now is self.finest and len(self.choices) > 1
        return f"finer patches even out {100 * to_shoot:.2f} %" if fine and to_shoot is not None else ""

    # -- how large patches are, as patch_level.glsl has it -------------------------------------------------------------

    def coarser(self, slots: NDArray[np.int64]) -> NDArray[np.int64]:
        """By how many levels patches of leaves in these slots are finer, since their texels are coarser: patches are about as
        large in the scene in leaves of every level."""
        if not self._lightmap.pool.adaptive:
            return np.zeros_like(slots)
        return ROOT_LEVEL - self._lightmap.pool.leaves.level[slots].astype(np.int64)

    def levels_of(self, slots: NDArray[np.int64], choice: Choice) -> NDArray[np.int64]:
        """The largest level that patches of leaves have by a choice."""
        return np.clip(choice.level - self.coarser(slots), 0, highest_level(self._lightmap.pool.tile))

    def level_at(self, texel: tuple[int, int], choice: Choice) -> int:
        """The same at a texel (column, row) of the tile pool."""
        pool = self._lightmap.pool
        slot = texel[1] // pool.tile * pool.columns + texel[0] // pool.tile
        return int(self.levels_of(np.array([slot]), choice)[0])

    def patch_edge(self, texel: tuple[int, int], marks: PatchMarks) -> int:
        """Texels along the edge of the largest patch that a texel (column, row) of the tile pool may shoot from now: the level,
        or as much finer as it is marked."""
        finer = marks.at(texel)
        if finer > 0:
            return 1 << max(self.level_at(texel, self.finest) + 1 - finer, 0)
        return 1 << self.level_at(texel, self.now)

    def resize(self) -> None:
        """For a lightmap that has got another number of slots."""
        for choice in self.choices:
            choice.resize()

    def release(self) -> None:
        for choice in self.choices:
            choice.release()
