"""Leaves of quadtrees come and go while rays are gathered: fresh ones first need the shadow rays that all others have sent."""

from __future__ import annotations

from collections.abc import Callable, Generator

import numpy as np
from numpy.typing import NDArray

from app.direct_light.shadow_rays import DirectLight
from app.gpu import Framebuffer, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.quadtree import Change
from app.lightmap.refinement import Refinement
from app.lightmap.tile_pool import Moves
from app.solvers.gathering.compose import Compose
from app.util.state import State, StateError
from app.visibility.origins import Origins

MOST_CHANGES = 256  # leaves that split or merge at once: bounded work for a frame
FIRST_LOOK = 32  # rays, after which leaves are looked at: what few rays say is noise
LOOK_AGAIN = 2  # times as many rays, when leaves did not change at the last look


class FreshLeaves:
    """Follows the leaves of one lightmap, see LeafFollower in app/lightmap/refinement.py. Whoever makes it releases it.

    slots: of the leaves that have no rays yet.
    """

    def __init__(
        self,
        lightmap: Lightmap,
        refinement: Refinement,
        origins: Origins,
        direct: DirectLight,
        compose: Compose,
        settle: Callable[[], object],
    ) -> None:
        """origins, direct, compose: of the lightmap's texels; settle: ends the work under way, and takes in all that the
        GPU has said."""
        self._lightmap, self._refinement, self._origins = lightmap, refinement, origins
        self._direct, self._compose, self._settle = direct, compose, settle
        self.slots: set[int] = set()
        self._look_at = 0  # rays at which leaves are looked at again
        refinement.follower = self

    # -- work ----------------------------------------------------------------------------------------------------------

    @property
    def refining(self) -> bool:
        """Whether leaves come and go."""
        return bool(self.slots) or not self._refinement.stable

    def wait(self, rays: int) -> bool:
        """Whether there is work to be done for them, or they are to be looked at, after so many rays of each texel."""
        return rays >= FIRST_LOOK and (self.refining or rays >= self._look_at)

    def light(self) -> Generator[None, None, None]:
        """Send for fresh leaves the shadow rays that the others have sent."""
        slots = self._written()
        yield from self._direct.shoot_tiles(slots)
        self._direct.sum(self._lightmap.scene)

    def look(self, rays: int, bands: int) -> Generator[None, None, None]:
        """Look at all leaves once more, after so many rays of each texel."""
        yield from self._refinement.look(MOST_CHANGES, bands, rays)
        if self._refinement.stable:
            self._look_at = LOOK_AGAIN * rays

    def _written(self) -> NDArray[np.int64]:
        """The slots of fresh leaves, which have origins now and are fresh no more."""
        slots = np.array(sorted(self.slots), np.int64)
        self.slots.clear()
        self._origins.write(slots)
        return slots

    def begin_again(self) -> None:
        """All light and all rays are forgotten."""
        self._refinement.begin_again()
        if self.slots:
            self._written()
        self._look_at = 0

    # -- what the leaves tell ------------------------------------------------------------------------------------------

    @property
    def carried(self) -> list[tuple[Texture, Framebuffer]]:
        return []

    def options_changed(self) -> None:
        pass

    def leaves_changed(self, change: Change) -> None:
        old, new = (change.parents, change.children) if change.split else (change.children, change.parents)
        self.slots = self.slots - set(old.tolist()) | set(new.tolist())

    def give_up(self) -> None:
        """Rays of new leaves are one piece of work: it is done."""

    def slots_will_move(self) -> None:
        self._settle()

    def resized(self, moves: Moves) -> None:
        now = dict(zip(moves.old.tolist(), moves.new.tolist(), strict=True))
        self.slots = {now.get(slot, slot) for slot in self.slots}
        self._origins.resized(moves)
        self._direct.resized(moves)
        self._compose.resized()

    # -- kept for later ------------------------------------------------------------------------------------------------

    def keep(self, state: State) -> None:
        """Put into the solver's state which leaves are fresh, and when all are looked at again."""
        state.values["look_at"] = self._look_at
        state.arrays["fresh"] = np.array(sorted(self.slots), np.int64)

    def restore(self, state: State) -> None:
        """Go on from such a state. Raises StateError."""
        used = np.flatnonzero(self._lightmap.pool.used)
        self._origins.write(used)
        fresh = state.array("fresh", np.int64, -1)
        if not np.isin(fresh, used).all():
            raise StateError("fresh slots hold nothing")
        self.slots, self._look_at = set(fresh.tolist()), int(state.values["look_at"])

    def release(self) -> None:
        if self._refinement.follower is self:
            self._refinement.follower = None


__all__ = ["FreshLeaves"]
