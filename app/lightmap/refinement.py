"""Refinement decides where the quadtrees of a lightmap split and merge, and moves their light along [Coombe03, 4].

A leaf splits where the light bends, or where light and shadow mix, and merges where it does neither. Every leaf is judged on the
GPU: by how much the gradient of H jumps in it, or by how many of its texels lie in shadow [Wallner10, 5]; the host reads that one
look later. Light is pushed down to children and pulled up to parents. The tile pool grows with the tree, and gives back what it
has too much of once the tree is stable.

A solver says when to look, and follows what changes as a LeafFollower. Which leaves must be looked at is a matter of work done
since: ``clock`` counts that, in the solver's own unit.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from app.gpu import Framebuffer, Pass, ReadBack, Texture
from app.lightmap.options import QUADTREE, LightmapOptions
from app.lightmap.quadtree import FIRST_ROOM, Change, Quadtree, Tile
from app.lightmap.textures import LightTextures
from app.lightmap.tile_pool import Moves
from app.lightmap.transfer import LightTransfer
from app.util.state import State, StateError

# A second difference of smooth light grows fourfold when texels double: leaves merge below a quarter of the threshold, and half
# of that again, so that what was merged is not split at once.
MERGE = 1 / 8
MERGE_AFTER = 4  # times as much work as when it was split, a leaf may merge


HELD = "leaves stay as they are: another depth or gradient lets them change again"


class LeafFollower(Protocol):
    """What follows the leaves of a lightmap: whatever a solver keeps for each of them."""

    @property
    def carried(self) -> Sequence[tuple[Texture, Framebuffer]]:
        """Textures of light on the same texels, with their targets, that are pushed and pulled as H is."""

    def options_changed(self) -> None:
        """The user asks for other leaves."""

    def leaves_changed(self, change: Change) -> None:
        """Leaves have split, or merged."""

    def give_up(self) -> None:
        """New leaves keep the light that they have from those before them."""

    def slots_will_move(self) -> None:
        """Leaves are about to change their slots: what names them by slot must be read now."""

    def resized(self, moves: Moves) -> None:
        """The tile pool has got another number of slots."""


class Refinement:
    """The quadtrees of one lightmap. Whoever makes it releases it.

    options: obeyed from the next look on. stable: whether the last look found nothing to do; looked_at: the clock then. waiting:
    whether a judgement is on its way, which the next look will act on. wanted: leaves that the last judgement would split. held:
    whether leaves stay as they are, whatever is judged. note: what the user should know, if anything.
    """

    def __init__(self, light: LightTextures, options: LightmapOptions) -> None:
        self._light, self._gpu, self.options = light, light.gpu, options
        self.tree = Quadtree(light.pool)
        self.follower: LeafFollower | None = None
        self.stable, self.looked_at = False, 0
        self.wanted, self.held = 0, False
        self.note: str | None = None
        self._transfer = LightTransfer(light.gpu, light)
        self._judge = Pass(light.gpu, "lightmap/judge", defines=light.defines("TILE"))
        self._judged: tuple[int, ReadBack] | None = None  # on its way, and the version of the leaves that it is of
        self._split_at: dict[Tile, int] = {}  # the clock when a leaf was split
        self._make_target()

    def _make_target(self) -> None:
        self._roughness = self._gpu.texture((self._light.columns, self._light.rows), 4, "f4")  # one texel for each slot
        self._roughness_target = self._gpu.target(self._roughness)

    @property
    def waiting(self) -> bool:
        return self._judged is not None

    def set_options(self, options: LightmapOptions) -> None:
        """Let leaves follow other options."""
        self.stable = False
        changed = any(getattr(options, name) != getattr(self.options, name) for name in QUADTREE)
        self.options = options
        if changed:
            self._let_go()
            self._split_at.clear()
            if self.follower is not None:
                self.follower.options_changed()

    def begin_again(self) -> None:
        """Forget what is known of the leaves: the light is another. They stay; those that are not needed merge."""
        self.drop_judgement()
        self.stable = False
        self._let_go()
        self._split_at.clear()

    def hold(self) -> None:
        """Leave the leaves as they are, until other ones are asked for or the light is another. Asked for again, new ones keep
        the light that they have."""
        if self.held and self.follower is not None:
            self.follower.give_up()
        self.held, self.wanted, self.note = True, 0, HELD

    def _let_go(self) -> None:
        if self.held:
            self.held, self.note = False, None

    def drop_judgement(self) -> None:
        """Forget the judgement that is on its way: it is of other light."""
        if self._judged is not None:
            self._judged[1].take()
            self._judged = None

    def release(self) -> None:
        self.drop_judgement()
        self._gpu.release_all(self._roughness_target, self._roughness)

    # -- kept for later ------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """The leaves, and what is known of them, with the judgement that is on its way."""
        state = State({"slots": self._light.pool.tiles, "stable": self.stable, "looked_at": self.looked_at})
        state.values["note"] = self.note
        state.put("tree", self.tree.state())
        split = [(*tile, clock) for tile, clock in self._split_at.items()]
        state.arrays["split"] = np.array(split, np.int64).reshape(-1, 4)
        if self._judged is not None:
            state.values["judged"] = self._judged[0]
            state.arrays["judgement"] = np.frombuffer(self._judged[1].look(), np.float32)
        return state

    def restore(self, state: State) -> None:
        """Hold the leaves of a ``state``; what follows them holds nothing that it knows by slot. Raises StateError."""
        tree, slots = state.part("tree"), int(state.values["slots"])
        if slots != sum(len(tree.array(name, np.int64, -1)) for name in ("taken", "free")):
            raise StateError(f"leaves of another number of slots than {slots}")
        if slots < len(self.tree):
            raise StateError(f"{slots} slots for the {len(self.tree)} leaves that there are")
        self.drop_judgement()
        if slots != self._light.pool.tiles:
            self._resize(slots)
        self.tree.restore(tree)
        self._light.write_tiles(np.arange(slots))
        self.stable, self.looked_at = bool(state.values["stable"]), int(state.values["looked_at"])
        self.note = state.values["note"]
        split = state.array("split", np.int64, -1, 4).tolist()
        self._split_at = {(level, x, y): clock for level, x, y, clock in split}
        if "judged" in state.values:
            judgement = state.array("judgement", np.float32, 4 * self._roughness.width * self._roughness.height)
            self._judged = int(state.values["judged"]), ReadBack.arrived(self._gpu, judgement.tobytes())

    # -- looking at the leaves -----------------------------------------------------------------------------------------

    def look(self, most: int, bands: int, clock: int) -> Iterator[None]:
        """Judge all leaves, in parts; at the next look act on the judgement, which has arrived, on so many of them at most. One
        look does one of both: a frame has time for either."""
        if self.held:
            self.drop_judgement()
            self.stable, self.looked_at = True, clock
            return
        if self._judged is None:
            for band in range(bands):
                self.judge(band, bands)
                yield
            self._judged = self._light.version, ReadBack.of(self._gpu, self._roughness_target)
            return
        (version, readback), self._judged = self._judged, None
        data = np.frombuffer(readback.take(), np.float32).reshape(-1, 4)
        if version == self._light.version:
            self.stable = not self._change(data[: self._light.pool.tiles].astype(np.float64), most, clock)
            self.looked_at = clock
            if self.stable:
                self._give_room_back()

    def judge(self, band: int = 0, bands: int = 1) -> None:
        """Judge the leaves in one of so many bands of the tile pool."""
        width, height = self._roughness.size
        lower, upper = (height * nth // bands for nth in (band, band + 1))
        self._judge.draw(
            self._roughness_target,
            textures=self._light.textures("t_position_area", "t_irradiance", "t_residual"),
            scissor=None if bands == 1 else (0, lower, width, upper - lower),
        )

    def split_and_merge(self) -> None:
        """Split the first leaf and merge it again, to be timed."""
        change = self.tree.split([min(self.tree.slots.values())])
        self._apply(change)
        self._apply(self.tree.merge([change.children.tolist()]))

    def _change(self, judged: NDArray[np.float64], most: int, clock: int) -> bool:
        """Split and merge where the judgement (slots, 4), see judge.frag.glsl, says so. Whether anything changed."""
        pool, options = self._light.pool, self.options
        level = pool.leaves.level
        rough, smooth = self._opinion(judged)
        grows = np.flatnonzero(pool.used & (level < options.depth) & rough)
        self.wanted = len(grows)
        grows = grows[np.argsort(-judged[grows, 0])][:most]
        self.note = None
        splits = self.tree.splits(grows.tolist(), options.depth)[:most]
        self._make_room(4 * len(splits))
        most_leaves, reason = self._bound
        fit = min(self.tree.room // 4, max(most_leaves - len(self.tree), 0) // 3)  # four leaves for one
        if len(splits) > fit:
            self.wanted, self.note = 0, f"leaves stop growing: {reason}"
            splits = splits[:fit]
        if splits:
            self._split_at |= {self.tree.tile(slot): clock for slot in splits}
            self._apply(self.tree.split(splits))
            return True
        siblings = self.tree.merges(np.flatnonzero(pool.used & ((level > options.depth) | smooth)))
        siblings = [leaves for leaves in siblings if self._may_merge(leaves, clock)][:most]
        if siblings:
            self._apply(self.tree.merge(siblings))
            return True
        return False

    def _opinion(self, judged: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Which leaves should split, and which need not be as fine as they are."""
        options = self.options
        if options.criterion == "shadow":
            share = judged[:, 3]
            mixed = (share > options.shadow) & (share < 1 - options.shadow)
            return mixed, (share == 0) | (share == 1)
        mean = judged[:, 1].sum() / max(judged[:, 2].sum(), 1e-300)
        jump = judged[:, 0] / max(mean, 1e-300)
        return jump > options.gradient, jump < MERGE * options.gradient

    def _may_merge(self, siblings: list[int], clock: int) -> bool:
        """A jump between two leaves is in neither: what was split for it would merge and split for ever. So siblings merge only
        when much more work has been done since."""
        level, x, y = self.tree.tile(siblings[0])
        since = self._split_at.get((level - 1, x >> 1, y >> 1))
        return level > self.options.depth or since is None or clock >= MERGE_AFTER * since

    def _apply(self, change: Change) -> None:
        follower = self.follower
        self._transfer.apply(change, () if follower is None else follower.carried)
        if follower is not None:
            follower.leaves_changed(change)

    # -- room ----------------------------------------------------------------------------------------------------------

    def _make_room(self, slots: int) -> None:
        """Have so many free slots, if the budget allows."""
        pool = self._light.pool
        if self.tree.room >= slots:
            return
        wanted = min(max(pool.tiles * 3 // 2, pool.tiles + slots), self._bound[0])
        if wanted > pool.tiles:
            self._resize(wanted)

    @property
    def _bound(self) -> tuple[int, str]:
        """How many leaves there may be, and why no more."""
        pool, texels = self._light.pool, self.options.budget
        longest = self._gpu.limits.max_texture // (pool.tile + 4)  # slots in a column of display texels and borders
        by_budget, by_texture = texels // pool.tile**2, pool.columns * longest
        if by_texture < by_budget:
            return by_texture, f"a texture of this GPU holds no more than {by_texture * pool.tile**2:,} texels"
        return by_budget, f"the budget of {texels:,} texels is reached"

    def _give_room_back(self) -> None:
        """Keep room for half as many leaves again, once there is more than twice that: leaves that come and go do not have it
        made anew each time."""
        kept = max(FIRST_ROOM // self._light.pool.tile**2, len(self.tree) * 3 // 2)
        if self._light.pool.tiles > 2 * kept:
            if self.follower is not None:
                self.follower.slots_will_move()
            self._resize(kept)

    def _resize(self, slots: int) -> None:
        """Have so many slots, between two judgements: those know leaves by slot."""
        assert self._judged is None
        moves = self.tree.resize(slots)
        self._light.resize(moves)
        self._gpu.release_all(self._roughness_target, self._roughness)
        self._make_target()
        if self.follower is not None:
            self.follower.resized(moves)
