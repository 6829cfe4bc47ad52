"""Progressive radiosity on texture quadtrees: leaves split where the light bends, merge where it does not [Coombe03, 4].

Every leaf is judged on the GPU, and the host hears of it one step later: how much the gradient of H jumps in it, or how many of
its texels lie in shadow [Wallner10, 5]. Light is pushed down to children and pulled up to parents. While leaves change they are
judged at every second step, else when a quarter more shots have been made, and at the end. The tile pool grows with the tree,
and gives back what it has too much of once the tree rests.

A leaf that came late inherited interpolated light from earlier shots: reshooting.py makes them again into fresh leaves.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator

import numpy as np
from numpy.typing import NDArray

from app.gpu import Gpu, Pass, ReadBack
from app.lightmap.lightmap import Lightmap
from app.lightmap.quadtree import FIRST_ROOM, Change, Quadtree, Tile
from app.lightmap.refinement import Refinement
from app.lightmap.transfer import Regrowth
from app.scene.model import Material
from app.solvers.shooting.options import ShootingOptions
from app.solvers.shooting.reshooting import Reshooting
from app.solvers.shooting.shot import rows_of
from app.solvers.shooting.stages import ROOT_LEVEL

# A second difference of smooth light grows fourfold when texels double: leaves merge below a quarter of the threshold, and half
# of that again, so that what was merged is not split at once.
MERGE = 1 / 8
MERGE_AFTER = 4  # times as many shots as when it was split, a leaf may merge
LOOK_AFTER = 32  # shots, or a quarter of all, between two judgements of a tree that did not change at the last
PER_SHOT = 8  # leaves that split or families that merge, for each shot of a step: bounded work for a frame


class AdaptiveShooting(Reshooting):
    """Shoots a lightmap whose tile pool has room for more leaves than it holds. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, options: ShootingOptions) -> None:
        self.tree = Quadtree(lightmap.pool)
        self._regrowth = Regrowth(gpu, lightmap)
        self._judge = Pass(gpu, "solvers/shooting/judge", defines=lightmap.defines("TILE"))
        self._judged: tuple[int, ReadBack] | None = None  # on its way, and the version of the leaves that it is of
        self._look_at = 0
        self._split_at: dict[Tile, int] = {}  # shots in the log when a leaf was split
        self._calm_at = 0  # shots in the log then
        super().__init__(gpu, lightmap, options)
        if self.adaptive:
            self._roughness, self._roughness_target = self._texels(per_slot=True)

    # -- the solver's interface ----------------------------------------------------------------------------------------

    def reset(self) -> None:
        """Forget all light. The leaves stay: those that are not needed merge."""
        if self.refinement is not None:
            self.refinement.changed = False
        self._look_anew()
        super().reset()

    @property
    def refinement(self) -> Refinement | None:
        return self.lightmap.refinement

    @property
    def _calm(self) -> bool:
        """Whether the last look at the leaves found nothing to do."""
        return self.refinement is None or self.refinement.stable

    @_calm.setter
    def _calm(self, calm: bool) -> None:
        if self.refinement is not None:
            self.refinement.stable = calm

    def _heed_refinement(self) -> None:
        """Take in that the user asked for other leaves."""
        if self.refinement is not None and self.refinement.changed:
            self.refinement.changed = False
            self._all_again = bool(self._log.count)
            self._split_at.clear()

    def set_options(self, options: ShootingOptions) -> None:
        self._calm = False
        if options != self.options:
            super().set_options(options)

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        self.finish()
        self._look_anew()
        super().set_materials(materials)

    @property
    def settled(self) -> bool:
        """Whether the finest patches have shot, and the tree has stopped growing."""
        return super().settled and self.grown

    @property
    def grown(self) -> bool:
        """Whether the tree has stopped growing and all its leaves hold what the shots gave them."""
        if not self.adaptive:
            return True
        judged = self._calm and not (self._done and self._calm_at < self._log.count)  # once more at the end
        return judged and not self._fresh and self._redo_under_way is None

    @property
    def _done(self) -> bool:
        """Whether no shots are left to make."""
        return super().settled and self.report.residual <= self.options.residual

    def _parts(self, shots: int, bands: int) -> Generator[None, None, int]:
        """First what there is to do for fresh leaves, a batch of earlier shots at a time, then shots while light is left; not
        until the leaves have followed a slider that was moved."""
        if not self.adaptive:
            return (yield from super()._parts(shots, bands))
        self._heed_refinement()
        made = 0
        done = bool(self._log.count) and self._done
        if self._redo_under_way is not None:
            made = yield from self._redo(bands)
            if self._redo_under_way is None:
                self._drop_judged()  # by the light that leaves had inherited
                self._calm = False
        elif self._fresh and (self._calm if done or self._all_again else self._redo_pays):
            self._begin_redo()
        elif not done and (self._calm or not self._all_again):
            made = yield from super()._parts(shots, bands)
        if self._redo_under_way is None and (not self._calm or done or self._log.count >= self._look_at):
            yield
            yield from self._look(PER_SHOT * shots, bands)
            if self._judged is None:
                self._look_at = self._log.count + max(LOOK_AFTER, self._log.count // 4)
        self._all_again &= not self.grown
        return made or shots

    def _levels_above(self, slots: NDArray[np.int64]) -> NDArray[np.int64]:
        """Patches are about as large in the scene in leaves of every level."""
        if not self.adaptive:
            return super()._levels_above(slots)
        return ROOT_LEVEL - self.lightmap.pool.leaves.level[slots].astype(np.int64)

    def passes(self, amount: int) -> dict[str, Callable[[], None]]:
        if not self.adaptive:
            return super().passes(amount)
        return super().passes(amount) | {
            "judge": self._weigh_leaves,
            "grow": self._grow_and_back,
            "redo": self._redo_one,
        }

    def release(self) -> None:
        self._drop_judged()
        if self.adaptive:
            self.gpu.release_all(self._roughness_target, self._roughness)
        super().release()

    # -- judging and growing -------------------------------------------------------------------------------------------

    def _look(self, most: int, bands: int) -> Iterator[None]:
        """Judge all leaves, in parts; at the next look act on the judgement, which has arrived, on so many of them at most. One
        look does one of both: a frame has time for either."""
        if self._judged is None:
            for band in range(bands):
                self._weigh_leaves(band, bands)
                yield
            self._judged = self.lightmap.version, ReadBack(self.gpu, self._roughness_target)
            return
        (version, readback), self._judged = self._judged, None
        data = np.frombuffer(readback.take(), np.float32).reshape(-1, 4)
        if version == self.lightmap.version:
            self._calm = not self._grow(data[: self.lightmap.pool.tiles].astype(np.float64), most)
            self._calm_at = self._log.count
            if self._calm:
                self._give_room_back()

    def _look_anew(self) -> None:
        """What is known of the leaves is of another light."""
        self._drop_judged()
        self._calm, self._look_at = False, 0
        self._split_at.clear()

    def _weigh_leaves(self, band: int = 0, bands: int = 1) -> None:
        self._judge.draw(
            self._roughness_target,
            textures=self.lightmap.textures("t_position_area", "t_irradiance", "t_residual"),
            scissor=rows_of(self._roughness.size, band, bands),
        )

    def _grow_and_back(self) -> None:
        """Split the first leaf and merge it again."""
        change = self.tree.split([min(self.tree.slots.values())])
        self._regrowth.apply(change)
        self._regrowth.apply(self.tree.merge([change.children.tolist()]))

    def _grow(self, judged: NDArray[np.float64], most: int) -> bool:
        """Split and merge where the judgement (slots, 4), see judge.frag.glsl, says so. Whether anything changed."""
        pool, options = self.lightmap.pool, self.lightmap.options
        level = pool.leaves.level
        rough, smooth = self._opinion(judged)
        grows = np.flatnonzero(pool.used & (level < options.depth) & rough)
        grows = grows[np.argsort(-judged[grows, 0])][:most]
        self.note = None
        splits = self.tree.splits(grows.tolist(), options.depth)[:most]
        self._make_room(4 * len(splits))
        within_budget = max(options.budget // pool.tile**2 - len(self.tree), 0) // 3  # four leaves for one
        if len(splits) > min(self.tree.room // 4, within_budget):
            self.note = f"leaves stop growing: the budget of {options.budget:,} texels is reached"
            splits = splits[: min(self.tree.room // 4, within_budget)]
        if splits:
            self._split_at |= {self.tree.tile(slot): self._log.count for slot in splits}
            self._apply(self.tree.split(splits))
            return True
        families = self.tree.merges(np.flatnonzero(pool.used & ((level > options.depth) | smooth)))
        families = [family for family in families if self._may_merge(family)][:most]
        if families:
            self._apply(self.tree.merge(families))
            return True
        return False

    def _may_merge(self, family: list[int]) -> bool:
        """A jump between two leaves is in neither: what was split for it would merge and split for ever. So a family merges only
        when many more shots have been made since."""
        level, x, y = self.tree.tile(family[0])
        since = self._split_at.get((level - 1, x >> 1, y >> 1))
        return level > self.lightmap.options.depth or since is None or self._log.count >= MERGE_AFTER * since

    def _make_room(self, slots: int) -> None:
        """Have so many free slots, if the budget allows."""
        pool = self.lightmap.pool
        if self.tree.room >= slots:
            return
        longest = self.gpu.limits.max_texture // (pool.tile + 4)  # slots in a column of display texels and borders
        most = min(self.lightmap.options.budget // pool.tile**2, pool.columns * longest)
        wanted = min(max(pool.tiles * 3 // 2, pool.tiles + slots), most)
        if wanted > pool.tiles:
            self._resize(wanted)

    def _give_room_back(self) -> None:
        """Keep room for half as many leaves again, once there is more than twice that: leaves that come and go do not have it
        made anew each time."""
        kept = max(FIRST_ROOM // self.lightmap.pool.tile**2, len(self.tree) * 3 // 2)
        if self.lightmap.pool.tiles > 2 * kept:
            self.poll(wait=True)  # reports on their way name their shooter by its slot
            self._resize(kept)

    def _resize(self, slots: int) -> None:
        """Have so many slots, between two judgements: those know leaves by slot."""
        assert self._judged is None
        moves = self.tree.resize(slots)
        self.lightmap.resize(moves)
        self._resized(moves)
        self.gpu.release_all(self._roughness_target, self._roughness)
        self._roughness, self._roughness_target = self._texels(per_slot=True)
        self.buffers.resize(self.lightmap, moves)
        self.stages.resize(self.lightmap)

    def _opinion(self, judged: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Which leaves should split, and which need not be as fine as they are."""
        options = self.lightmap.options
        if options.criterion == "shadow":
            share = judged[:, 3]
            mixed = (share > options.shadow) & (share < 1 - options.shadow)
            return mixed, (share == 0) | (share == 1)
        mean = judged[:, 1].sum() / max(judged[:, 2].sum(), 1e-300)
        jump = judged[:, 0] / max(mean, 1e-300)
        return jump > options.gradient, jump < MERGE * options.gradient

    def _apply(self, change: Change) -> None:
        self._regrowth.apply(change, self._carried)
        self._emitted = self.lightmap.emitted
        gone, came = (change.parents, change.children) if change.split else (change.children, change.parents)
        self.buffers.hand_down(change)
        self._exchange(gone, came, inherit=change.split)

    def _drop_judged(self) -> None:
        if self._judged is not None:
            self._judged[1].take()
            self._judged = None
