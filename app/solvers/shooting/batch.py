"""A batch of shots is made by parts, one after the other [Coombe03, 3; Cohen88].

    i = patch with the largest power to shoot, R_i A_i: its residual and the overshoot      choose.py, ambient.py
    r_i -= R_i                                                                              ledger.py
    see the scene from i: item and depth in every direction                                 see.py
    for every texel j:  ΔH_j = R_i F_ji V_ji;  H_j += ΔH_j;  r_j += ρ_j ΔH_j                receive.py
    add what left the scene to the ledger                                                   ledger.py

The shooters of a batch are chosen at once, and never leave the GPU. Beside that: large patches shoot first (coarse_to_fine.py),
lamps are divided (emitter_groups.py), strong shots tried before they are made (audit.py); where leaves of quadtrees come and go,
earlier shots are made again into new ones (replay.py).

Works badly where the middle of a patch sees something else than the rest of it (contact shadows): shoot from a lower level.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator

import numpy as np

from app.gpu import Gpu, keep, take_over
from app.lightmap.lightmap import Lightmap
from app.lightmap.quadtree import Change
from app.lightmap.tile_pool import Moves
from app.scene.model import F64
from app.solvers.shooting.ambient import Ambient
from app.solvers.shooting.audit import Audit, Auditor
from app.solvers.shooting.choose import ROOT_LEVEL, Bins, Choice
from app.solvers.shooting.coarse_to_fine import Phases
from app.solvers.shooting.emitter_groups import EmitterGroups
from app.solvers.shooting.equipment import Equipment
from app.solvers.shooting.ledger import Ledger
from app.solvers.shooting.material_edits import MaterialEdits
from app.solvers.shooting.options import ShootingOptions
from app.solvers.shooting.outside import Outside
from app.solvers.shooting.patch_marks import PatchMarks
from app.solvers.shooting.receive import Receive
from app.solvers.shooting.receivers import Receivers
from app.solvers.shooting.records import BATCH, Shot, powers_of, shot_of
from app.solvers.shooting.replay import Replay
from app.solvers.shooting.see import See, fitting_resolution
from app.solvers.shooting.shooters import ShooterBatch
from app.util.parts import run_to_end
from app.util.state import State
from app.visibility.occluders import occluders_of


class Batch:
    """The parts that make a batch of shots. Whoever makes it releases it.

    phases, see, receive: follow from the options. replay: where leaves come and go.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, options: ShootingOptions, *, audits: bool, coarse: bool) -> None:
        """audits, coarse: as of Shooting."""
        self._gpu, self._lightmap, self.options, self._coarse = gpu, lightmap, options, coarse
        self.shooters, self.bins = ShooterBatch(gpu), Bins(gpu, lightmap)
        self.occluders, self.receivers = occluders_of(gpu, lightmap), Receivers(gpu, lightmap.pool)
        self.ledger = Ledger(gpu, lightmap, self.shooters)
        self.ambient = Ambient(gpu, lightmap, self.shooters, self.ledger, shown=options.ambient, gathers=not coarse)
        equipment = Equipment(gpu, lightmap, self.occluders, self.receivers, self.shooters)
        self.outside = Outside(equipment, self.ledger)
        self.marks = PatchMarks(gpu, lightmap)
        self.groups = EmitterGroups(lightmap, self.ledger, self.marks, coarse=coarse)
        self.auditor = Auditor(gpu, lightmap, self.shooters, self.ledger, enabled=audits)
        self.replay = None if lightmap.refinement is None else Replay(gpu, lightmap, self.shooters)
        self._make_passes()

    def _make_passes(self) -> None:
        options, lightmap = self.options, self._lightmap
        self.phases = Phases(self._gpu, lightmap, self.shooters, options, coarse=self._coarse)
        resolution = options.resolution or fitting_resolution(lightmap, ROOT_LEVEL if lightmap.pool.adaptive else 0)
        self.see = See(self._gpu, self.occluders, self.shooters, options, resolution)
        self.receive = Receive(self._gpu, lightmap, self.receivers, self.shooters, self.see, options)
        self.outside.set_options(options, resolution)

    # -- the batch -----------------------------------------------------------------------------------------------------

    def shoot(self, choice: Choice, shots: int, bands: int) -> Generator[None, None, int]:
        """Make so many shots, in parts: the longest passes in so many bands. How many: of groups that settle, whole ones."""
        if choice.settles:
            shots = self.groups.whole_groups(shots)
        yield from self.choose(choice, shots, bands)
        self.ambient.held = True
        self.ledger.take(self.ambient.overshoot, shots)
        yield
        for first, some in self.see.groups(shots):
            self.see.draw(first, some)
            yield
            for band in range(bands):
                self.receive.draw(first, some, band, bands)
                yield
            self.see.add_escaped(first, some)
        self.enter(shots)
        return shots

    def shoot_outside(self, shots: int, bands: int) -> Generator[None, None, int]:
        """The next shots of light from outside, in parts, and see what that leaves to come. How many."""
        made = yield from self.outside.shoot(shots, bands)
        for band in range(bands):
            self.phases.now.sum_blocks(self.marks.texture, self.ambient.overshoot, band, bands)
            yield
        self.phases.now.reduce(self.bins)
        self.ambient.update(self.bins)
        return made

    def choose(self, choice: Choice, shots: int, bands: int) -> Iterator[None]:
        """The strongest patches; those that fail their audit are divided, and others chosen. [Coombe03, 3.4]"""
        yield from self.choose_once(choice, shots, bands)
        while self.auditor.wanted and (failed := (yield from self.auditor.failed(self.see, self.receive, shots))):
            yield from self._try_quarters(failed[0])
            failed = [shooter for shooter in failed if self.auditor.found.fails(shooter)]
            self.marks.divide_patches(self._patch_of(shot_of(self._lightmap, shooter)) for shooter in failed)
            yield from self.choose_once(choice, shots, bands)
        if self.replay is not None and not self.outside.left:
            self.replay.keep_strong()

    def _try_quarters(self, shooter: np.void) -> Generator[None, None, None]:
        """Audit two quarters of a patch that failed, across from each other: does it help to divide it?"""
        shot, quarters = shot_of(self._lightmap, shooter), list[np.void]()
        half = shot.size // 2
        for off in (0, half):
            quarter = self._shooter_at((shot.corner[0] + off, shot.corner[1] + off), half.bit_length() - 1)
            if powers_of(quarter) > 0:
                yield from self.auditor.audit(self.see, self.receive, [0], self.shooters.read(1))
                quarters.append(quarter)
        self.auditor.found.learn(shooter, quarters)

    def _shooter_at(self, corner: tuple[int, int], level: int) -> np.void:
        """Let the batch be one patch, with this lower corner [texels of the tile pool]; what it would shoot now, SHOOTER."""
        self.bins.fill(corner, level)
        self._write_shooters(self.phases.choices[0] if self.phases.now.settles else self.phases.now, 1)
        return self.shooters.read(1)[0]  # type: ignore[no-any-return]

    def choose_once(self, choice: Choice, shots: int, bands: int = 1) -> Generator[None, None, None]:
        """The strongest patches, all texels read in so many bands."""
        for band in range(bands):
            choice.sum_blocks(self.marks.texture, self.ambient.overshoot, band, bands)
            yield
        choice.reduce(self.bins)
        self._write_shooters(choice, shots)

    def _write_shooters(self, choice: Choice, shots: int) -> None:
        least = self.groups.settled if choice.settles else 0.0
        choice.choose(self.bins, self.marks.texture, self.ambient.overshoot, shots, least)

    def enter(self, shots: int) -> None:
        """Enter in the ledger what the batch shot, and see what that leaves to come."""
        self.ledger.enter(self.see.maps.escaped, shots)
        self.ambient.held = False
        self.ambient.update(self.bins, shots)
        if self.replay is not None:
            self.replay.log.add(shots)

    def unshot(self) -> float:
        """What is still to be shot: Σ |Σ r A| over tiles now, and from outside [stored units · solver area]. Waits for the
        GPU."""
        self.phases.now.sum_blocks(self.marks.texture, self.ambient.overshoot)
        self.phases.now.reduce(self.bins)
        tiles = np.frombuffer(self.bins.unshot.read(), np.float32).reshape(-1, 4)[:, 3].astype(np.float64)
        return float(tiles.sum()) + self.outside.power_to_come() / self.ledger.watt

    def remaining(self, unshot: float) -> float:
        """Of a share of what is emitted that is unshot, what a progress says: while light from outside is left to shoot, an edit
        takes back light, and gives as much."""
        return self.ledger.capped(unshot) if self.outside.left else unshot

    def _patch_of(self, shot: Shot) -> tuple[int, int, int, int]:
        """Its patch, and the finest level of patches there."""
        return *shot.corner, shot.size, self.phases.level_at(shot.corner, self.phases.finest)

    # -- beginning, and other options ----------------------------------------------------------------------------------

    def begin(self) -> None:
        """Nothing has been shot."""
        if self.replay is not None:
            self.replay.begin()
        self.ledger.clear()
        self.outside.begin()
        self.ambient.clear()
        self.marks.clear()
        self.auditor.forget()
        self.auditor.begin()
        self.phases.begin()
        self.weigh()
        self.groups.divide(self.phases)
        self.groups.divide_contacts()

    def weigh(self, at_least: float = 0.0) -> None:
        """See what the scene emits and reflects. at_least: power that groups may be off by in any case."""
        self.ledger.weigh()
        self.groups.weigh(at_least)
        self.ambient.find_lamps()
        self.ambient.forget_foreseen()

    def shoot_finer(self) -> None:
        """Finer patches shoot from now on, those of lamps for themselves: strong shots again."""
        self.phases.index += 1
        self.auditor.begin()
        if self.replay is not None:
            self.replay.forget_strong()

    def scale(self, edits: MaterialEdits, factor: F64) -> None:
        """Begin again with all light that was shot, times a factor (3,): shots of the difference may be strong again."""
        if self.replay is not None:
            self.replay.stop()
            self.replay.forget_strong()
        if (factor != 1).any():
            edits.scale_light(factor)
            edits.scale(self.ledger.target, factor)
            if self.replay is not None:
                self.replay.scale(edits, factor)
        self.phases.begin()
        self.auditor.begin()

    def set_options(self, options: ShootingOptions) -> None:
        """Use other knobs from the next batch on; what is shown of the ambient light follows with its next update."""
        same, self.options = options.replace(ambient=self.options.ambient) == self.options, options
        if same:
            return
        phases, see = self.phases, self.see
        self._make_passes()
        phases.release()
        see.release()
        self.phases.begin(phases.index)
        self.marks.shift(self.phases.finest.level - phases.finest.level)
        self.auditor.forget()
        self.auditor.begin()
        self.groups.divide(self.phases)

    # -- leaves that come and go ---------------------------------------------------------------------------------------

    def leaves_changed(self, change: Change) -> None:
        """Follow leaves that have split, or merged."""
        self.ledger.follow_emission()
        self.auditor.forget()
        self.marks.follow(change)
        self.receivers.follow()
        self.ambient.leaves_changed()
        if self.replay is not None:
            self.replay.leaves_changed(change)

    def resized(self, moves: Moves) -> None:
        """Follow a lightmap that has got another number of slots."""
        self.auditor.forget()
        self.marks.resize(self._lightmap, moves)
        self.bins.resize(self._lightmap)
        self.ledger.resize()
        self.phases.resize()
        self.receivers.follow()
        self.ambient.resize(moves)
        if self.replay is not None:
            self.replay.resized(moves)

    # -- kept for later ------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """All that the next batch follows from, but the light."""
        phases, auditor = self.phases, self.auditor
        state = State({"phase": phases.index, "even": phases.even, "audits": auditor.wanted})
        state.values["settled"] = self.groups.settled
        state.arrays["marks"] = self.marks.levels.copy()
        keep(state, overshoot=self.ambient.overshoot)
        state.put("ledger", self.ledger.state())
        state.put("outside", self.outside.state())
        state.put("found", auditor.found.state())
        if self.replay is not None:
            state.put("replay", self.replay.state())
        return state

    def restore(self, state: State) -> None:
        """Go on as from a ``state``, on the leaves that there are now. Raises StateError."""
        self.receivers.follow()
        self.phases.begin(int(state.values["phase"]))
        self.phases.even = bool(state.values["even"])
        self.auditor.wanted = bool(state.values["audits"])
        self.auditor.found.restore(state.part("found"))
        self.groups.settled = float(state.values["settled"])
        self.marks.levels[:] = state.array("marks", np.float32, *self.marks.levels.shape)
        self.marks.upload()
        take_over(state, overshoot=self.ambient.overshoot)
        self.ambient.leaves_changed()
        self.outside.restore(state.part("outside"))
        self.ledger.restore(state.part("ledger"))
        if self.replay is not None:
            self.replay.restore(state.part("replay"))

    # -- one by one ----------------------------------------------------------------------------------------------------

    def audit(self, corner: tuple[int, int]) -> Audit:
        """What becomes of a shot from the patch with this lower corner [texels of the tile pool] if it shot now. Changes no
        light. The patch must hold some residual."""
        level = self.phases.patch_edge(corner, self.marks).bit_length() - 1
        shooter = self._shooter_at(corner, level)
        shares = self.auditor.once(self.see, self.receive, 0, float(powers_of(shooter)))
        return Audit(*shares, shot_of(self._lightmap, shooter))

    def passes(self, amount: int) -> dict[str, Callable[[], None]]:
        """Each part of a batch by itself, to be timed. They leave the light wrong."""
        shots = min(amount, BATCH)

        def for_maps(part: Callable[[int, int], None]) -> None:
            for first, some in self.see.groups(shots):
                part(first, some)

        passes: dict[str, Callable[[], None]] = {
            "choose": lambda: run_to_end(self.choose_once(self.phases.now, shots)),
            "zero": lambda: self.ledger.take(self.ambient.overshoot, shots),
            "see": lambda: for_maps(self.see.draw),
            "receive": lambda: for_maps(self.receive.draw),
            "add escaped": lambda: for_maps(self.see.add_escaped),
            "ledger": lambda: self.enter(shots),
        }
        refinement, replay = self._lightmap.refinement, self.replay
        if refinement is not None and replay is not None:
            passes |= {"judge": refinement.judge, "split and merge": refinement.split_and_merge}
            passes["replay"] = lambda: replay.once(self.receive)
        return passes

    def release(self) -> None:
        parts = self.phases, self.see, self.marks, self.ambient, self.ledger, self.bins, self.receivers, self.outside
        for part in (*parts, *self.occluders, self.shooters, *(() if self.replay is None else (self.replay,))):
            part.release()
