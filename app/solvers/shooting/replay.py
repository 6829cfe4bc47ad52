"""Replay makes earlier shots again, into leaves that came later.

A leaf that has just split off inherits interpolated light. The shots whose light is in it are made again, into such fresh leaves
only, a batch per piece of work, and their sum takes the place of what was inherited:

    C = Σ_i r_i F_ji V_ji - H_j,   H_j += C,   r_j += ρ_j C

so that the solution does not depend on when the tree grew. New shots meanwhile reach fresh leaves as any other.

Strong shots cast the shadows that leaves are split for. Once they are over, H as they left it, S, is kept: from then on only they
are made again (with S for H above, and S_j += C), and interpolated light of the weak ones, which is smooth, stays. Where the user
asked for other leaves, the weak ones follow: with H - S for H.
"""

from __future__ import annotations

from collections.abc import Generator

import numpy as np
from numpy.typing import NDArray

from app.gpu import Framebuffer, Gpu, Mesh, Pass, Texture, keep, take_over
from app.lightmap.lightmap import Lightmap
from app.lightmap.quadtree import Change
from app.lightmap.textures import QUAD_FORMAT, quads
from app.lightmap.tile_pool import Moves
from app.scene.lights import Light
from app.scene.model import F64
from app.solvers.shooting.material_edits import MaterialEdits
from app.solvers.shooting.outside import Outside
from app.solvers.shooting.outside_sources import OutsideShot
from app.solvers.shooting.receive import Receive
from app.solvers.shooting.receivers import receiver_meshes
from app.solvers.shooting.records import BLOCK_ROWS
from app.solvers.shooting.see import See
from app.solvers.shooting.shooters import ShooterBatch
from app.solvers.shooting.shot_log import ShotLog
from app.util.state import State, StateError

# Once the strongest shot left holds less of the emitted power, light is so even that interpolation serves: the Cornell box errs
# by 1.7 % where 100 of 2200 shots count as strong, as where all do, and by 2.5 % where the first 60 do.
# Where a lamp is cut into many patches, direct light is made of faint shots: half of all light is to be shot as well.
STRONG, MOSTLY_SHOT = 2.0**-10, 0.5
REPLAY_AFTER = 3  # new shots for each that was made again the last time, until some are made again once more


class Replay:
    """What is known of fresh leaves. Whoever makes it releases it.

    log: all shots so far; fresh: slots whose light is partly inherited; under_way: the replay into them, if any; all_again:
    whether weak shots are to be made again too.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, shooters: ShooterBatch) -> None:
        self._gpu, self._lightmap = gpu, lightmap
        self.log = ShotLog(gpu, shooters)
        self._subtract = Pass(gpu, "solvers/shooting/subtract_inherited", vertex="common/rects")
        reads = lightmap.defines("MATERIAL_BITS", "ALBEDO_TEXTURE")
        self._apply = Pass(gpu, "solvers/shooting/apply_correction", defines=reads, vertex="common/rects")
        self._copy = Pass(gpu, "common/copy")
        self._correction, self._correction_target = self._texels()
        self._strong: tuple[Texture, Framebuffer] | None = None  # S
        self.fresh: set[int] = set()
        self.under_way: Pending | None = None
        self.begin()

    def _texels(self) -> tuple[Texture, Framebuffer]:
        """As large as the tile pool."""
        texture = self._gpu.texture(self._lightmap.size, 4, "f4")
        return texture, self._gpu.target(texture)

    def begin(self) -> None:
        """Nothing has been shot."""
        self.log.clear()
        self.stop()
        self.forget_strong()
        self.fresh.clear()
        self._replayed_at = self._replayed = 0  # shots in the log when some were last made again; how many were
        self.all_again = False

    def stop(self) -> None:
        """Give up the replay that is under way: it begins again, all with the same options."""
        if self.under_way is not None:
            self.under_way.release()
            self.under_way = None

    def give_up(self) -> None:
        """Make no earlier shots again: fresh leaves keep what they inherited."""
        self.stop()
        self.fresh.clear()
        self.all_again = False

    def release(self) -> None:
        self.stop()
        self.forget_strong()
        self.log.release()
        self._gpu.release_all(self._correction_target, self._correction)

    # -- kept for later ------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """All shots, which leaves are fresh, and the replay that is under way."""
        names = ("_replayed_at", "_replayed", "_strong_shots", "_weak", "all_again")
        state = State({name: getattr(self, name) for name in names})
        state.arrays |= {"shots": self.log.rows(), "fresh": np.array(sorted(self.fresh), np.int64)}
        if self._strong is not None:
            keep(state, strong=self._strong[0])
        if (pending := self.under_way) is not None:
            state.values["pending"] = [pending.next, pending.end, pending.weak, pending.from_outside]
            state.values["pending_outside"] = [shot.values for shot in pending.outside]
            state.arrays["pending"] = pending.slots
            keep(state, correction=self._correction)
        return state

    def restore(self, state: State) -> None:
        """Know what is in a ``state``, of the leaves that there are now. Raises StateError."""
        self.stop()
        self.forget_strong()
        self.log.restore(state.array("shots", np.float32, -1, BLOCK_ROWS, 4))
        self.fresh = set(self._slots(state, "fresh").tolist())
        self._replayed_at, self._replayed = int(state.values["_replayed_at"]), int(state.values["_replayed"])
        self._strong_shots, self._weak = int(state.values["_strong_shots"]), bool(state.values["_weak"])
        self.all_again = bool(state.values["all_again"])
        if "strong" in state.arrays:
            self._strong = self._texels()
            take_over(state, strong=self._strong[0])
        if "pending" in state.values:
            following, end, weak, from_outside = state.values["pending"]
            known: dict[Light, Light] = {}
            outside = [OutsideShot.of(values, known) for values in state.values["pending_outside"]]
            slots, end = self._slots(state, "pending"), min(end, self.log.count)
            pending = self.under_way = Pending(self._gpu, self._lightmap, slots, end, outside)
            pending.next, pending.weak, pending.from_outside = int(following), bool(weak), int(from_outside)
            take_over(state, correction=self._correction)

    def _slots(self, state: State, name: str) -> NDArray[np.int64]:
        """Slots that hold leaves. Raises StateError."""
        slots = state.array(name, np.int64, -1)
        if not np.isin(slots, np.flatnonzero(self._lightmap.pool.used)).all():
            raise StateError(f"{name} slots hold nothing")
        return slots

    # -- strong and weak shots -----------------------------------------------------------------------------------------

    def forget_strong(self) -> None:
        """Shots may be strong again."""
        for texture, target in self.carried:
            self._gpu.release_all(target, texture)
        self._strong, self._strong_shots = None, 0  # of the log, whose light S is
        self._weak = False  # whether only weak shots are left

    def follow_power(self, strongest: float, unshot: float) -> None:
        """Of the strongest shot of a batch, and what is unshot: shares of the emitted power."""
        self._weak = self._weak or (strongest < STRONG and unshot < MOSTLY_SHOT)

    def keep_strong(self) -> None:
        """Keep H as S once only weak shots of patches are left, before the first of them."""
        if self._weak and self._strong is None and self._lightmap.storage != "fixed8":
            self._strong, self._strong_shots = self._texels(), self.log.count
            H = self._lightmap.texture("t_irradiance")
            self._copy.draw(self._strong[1], textures={"t_source": H}, uniforms={"u_offset_px": (0, 0)})

    def scale(self, edits: MaterialEdits, factor: F64) -> None:
        """All shots so far were stronger by a factor (3,)."""
        self.log.scale(edits, factor)

    # -- leaves that come and go ---------------------------------------------------------------------------------------

    @property
    def carried(self) -> list[tuple[Texture, Framebuffer]]:
        """Light besides the lightmap's that goes with its leaves."""
        return [] if self._strong is None else [self._strong]

    def leaves_changed(self, change: Change) -> None:
        """What leaves hold that have split off is interpolated; so is what merged of such ones."""
        gone, came = (change.parents, change.children) if change.split else (change.children, change.parents)
        inherits = change.split or not self.fresh.isdisjoint(gone.tolist())
        self.fresh.difference_update(gone.tolist())
        if inherits and self._lightmap.storage != "fixed8":
            self.fresh.update(came.tolist())  # fixed8 holds no negative correction: leaves keep what they inherit

    def resized(self, moves: Moves) -> None:
        """The lightmap has got another number of slots."""
        assert self.under_way is None, "it knows its leaves by slot"
        self._gpu.release_all(self._correction_target, self._correction)
        self._correction, self._correction_target = self._texels()
        if self._strong is not None:
            texture, target = self._strong
            self._gpu.release_all(target)
            texture = self._lightmap.moved(texture, moves)
            self._strong = texture, self._gpu.target(texture)
        now = dict(zip(moves.old.tolist(), moves.new.tolist(), strict=True))
        self.fresh = {now.get(slot, slot) for slot in self.fresh}

    # -- shots made again ----------------------------------------------------------------------------------------------

    @property
    def is_cheap(self) -> bool:
        """Whether so many shots were made since the last time that it costs little beside them."""
        return self.log.count >= self._replayed_at + REPLAY_AFTER * self._replayed

    def start(self, outside: Outside) -> None:
        """Begin the replay into all fresh leaves."""
        slots = np.array(sorted(self.fresh), np.int64)
        end = self.log.count if self._strong is None else self._strong_shots
        self.under_way = Pending(self._gpu, self._lightmap, slots, end, outside.given())
        self._subtract_inherited(self.under_way)

    def work(self, see: See, receive: Receive, outside: Outside, bands: int) -> Generator[None, None, int]:
        """A batch of what came from outside, or of the log, once more, for fresh leaves only, in parts; after the last, its sum
        takes the place of what was inherited, and nothing is under way. How many shots."""
        pending = self.under_way
        assert pending is not None
        if pending.outside:
            made = yield from outside.replay(
                pending.outside, self._correction_target, pending.receivers, pending.quads, bands
            )
            pending.outside = pending.outside[made:]
            return made
        if pending.next < pending.end:
            shots = min(self.log.recall(pending.next), pending.end - pending.next)
            for first, some in see.groups(shots):
                see.draw(first, some)
                yield
                for band in range(bands):
                    self._receive(pending, receive, first, some, band, bands)
                    yield
            pending.next += shots
            return shots
        self._apply_correction(pending)
        if self.all_again and self._strong is not None and not pending.weak:
            pending.weak, pending.end = True, self.log.count
            self._subtract_inherited(pending)
            return 0
        self.fresh.difference_update(pending.slots.tolist())
        self._replayed_at, self._replayed = self.log.count, pending.cost
        self.stop()
        return 0

    def once(self, receive: Receive) -> None:
        """The shot that was chosen last once more, into all leaves."""
        pending = Pending(self._gpu, self._lightmap, np.flatnonzero(self._lightmap.pool.used), 1, [])
        self._subtract_inherited(pending)
        receive.draw_into(self._correction_target, 0, 1, meshes=pending.receivers)
        self._apply_correction(pending)
        pending.release()

    def _receive(self, pending: Pending, receive: Receive, first: int, shots: int, band: int, bands: int) -> None:
        receive.draw_into(
            self._correction_target, first, shots, meshes=pending.receivers, band=band, bands=bands, in_place=False
        )

    def _subtract_inherited(self, pending: Pending) -> None:
        """C = minus what these leaves hold of the shots that follow."""
        H = self._lightmap.texture("t_irradiance")
        S = H if self._strong is None else self._strong[0]
        self._subtract.draw(
            self._correction_target,
            textures={"t_light": H if pending.weak else S, "t_other": S},
            uniforms={"u_size": self._lightmap.size, "u_other": float(pending.weak)},
            mesh=pending.quads,
        )

    def _apply_correction(self, pending: Pending) -> None:
        """H += C, r += ρ C; S += C, of strong shots."""
        strong = [] if pending.weak else [target for _, target in self.carried]
        for target in (self._lightmap.light_target, *strong):
            self._apply.draw(
                target,
                textures=self._lightmap.textures("t_normal_ids", "t_materials", "t_albedo")
                | {"t_correction": self._correction},
                uniforms={"u_size": self._lightmap.size},
                mesh=pending.quads,
                blend="add",
            )


class Pending:
    """A replay that is under way: the slots of its leaves, their quads and receivers, and which shots are still to be made into
    them: what came from outside, strong ones, or all where S is not kept yet, and then weak ones."""

    def __init__(
        self, gpu: Gpu, lightmap: Lightmap, slots: NDArray[np.int64], shots: int, outside: list[OutsideShot]
    ) -> None:
        self._gpu, self.slots, self.next, self.end, self.weak = gpu, slots, 0, shots, False
        self.outside, self.from_outside = outside, len(outside)
        place = lightmap.pool.corners(slots)
        self.quads = Mesh(gpu, quads(place, lightmap.pool.tile, place).tobytes(), QUAD_FORMAT, per_instance=True)
        self.receivers = receiver_meshes(gpu, lightmap.pool, slots)

    @property
    def cost(self) -> int:
        """Shots that are made again in all."""
        return self.end + self.from_outside

    def release(self) -> None:
        self._gpu.release_all(self.quads, *self.receivers.values())
