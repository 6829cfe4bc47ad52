"""Leaves of quadtrees come and go while light is shot: the parts of a batch follow them, and fresh ones wait for their light."""

from __future__ import annotations

from collections.abc import Callable

from app.gpu import Framebuffer, Texture
from app.lightmap.quadtree import Change
from app.lightmap.refinement import Refinement
from app.lightmap.tile_pool import Moves
from app.solvers.shooting.batch import Batch
from app.solvers.shooting.replay import Replay


class Leaves:
    """Follows the leaves of one lightmap, see LeafFollower in app/lightmap/refinement.py. Whoever makes it releases it."""

    def __init__(
        self,
        refinement: Refinement,
        batch: Batch,
        replay: Replay,
        *,
        finish: Callable[[], None],
        settle: Callable[[], object],
    ) -> None:
        """replay: of the batch. finish: ends the work under way; settle: that, and takes in all that the GPU has reported."""
        self._refinement, self._batch, self._replay = refinement, batch, replay
        self._finish, self._settle = finish, settle
        refinement.follower = self

    def say(self) -> str:
        """What is being done for leaves."""
        pending = self._replay.under_way
        if pending is not None:
            share = pending.next / max(pending.end, 1)
            return f"light of {len(pending.slots):,} new leaves: {share:.0%}"
        return f"{self._refinement.wanted:,} more to split" if self._refinement.wanted else "looking at leaves"

    # -- what the leaves tell ------------------------------------------------------------------------------------------

    @property
    def carried(self) -> list[tuple[Texture, Framebuffer]]:
        return [*self._replay.carried, *self._batch.ambient.carried]

    def options_changed(self) -> None:
        self._replay.all_again = bool(self._replay.log.count)

    def leaves_changed(self, change: Change) -> None:
        self._batch.leaves_changed(change)

    def give_up(self) -> None:
        self._finish()
        self._replay.give_up()

    def slots_will_move(self) -> None:
        self._settle()

    def resized(self, moves: Moves) -> None:
        self._batch.resized(moves)

    def release(self) -> None:
        if self._refinement.follower is self:
            self._refinement.follower = None


__all__ = ["Leaves"]
