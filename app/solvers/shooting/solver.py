"""Shooting is progressive refinement radiosity [Cohen88; Coombe03, 3], on uniform texels and on quadtrees.

A piece of work is one batch of shots (batch.py), or on quadtrees another step of what their leaves ask for. The host learns a few
batches late how much is unshot.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from app.gpu import Gpu, Texture
from app.lightmap.lightmap import Lightmap
from app.scene.lights import Light
from app.scene.model import F64, Material
from app.scene.sky import Sky
from app.solvers.base import EnergyBalance, Inspection, Progress
from app.solvers.shooting.audit import Audit
from app.solvers.shooting.batch import Batch
from app.solvers.shooting.leaves import Leaves
from app.solvers.shooting.material_edits import MaterialEdits, needs_restart
from app.solvers.shooting.options import ShootingOptions
from app.solvers.shooting.outside import Sent
from app.solvers.shooting.records import BATCH, Shot, powers_of, shot_of, sizes_of
from app.solvers.shooting.reports import Report, Reports
from app.util.parts import UnderWay, run_to_end
from app.util.state import State
from app.visibility.item_image import ItemImage

LOOK_AFTER = 32  # shots, or a quarter of all, between two looks at leaves that did not change at the last
SIGHT = "What the last shooter saw"
PICTURES = {SIGHT: "All that the patch that shot last sees, one colour per surface"}
# Light from outside shoots while it has at least 1 of so many of the power of the strongest patch: patches then pass on what it
# brought with what they held. A living room is off by 22 % RMS after 2.4 s, and by 29 % where the stronger of both shoots.
OUTSIDE_FIRST = 8
CHANGES_PER_SHOT = 8  # leaves that split or merge, for each shot of a piece of work: bounded work for a frame


class Shooting:
    """Shoots a lightmap until it has converged; where that refines itself, its leaves follow the light. Whoever makes it releases
    it.

    issued: shots given to the GPU. last_shot: the last that was reported. batch: the parts that make shots.
    """

    def __init__(
        self, gpu: Gpu, lightmap: Lightmap, options: ShootingOptions, *, audits: bool = True, coarse: bool = False
    ) -> None:
        """audits: whether strong shots are tried before they are made; coarse: whether soon is worth more than right: lamps are
        divided into few patches, the ambient term is an even one, and a batch is one shot."""
        self.gpu, self.lightmap, self.options = gpu, lightmap, options
        self.batch = Batch(gpu, lightmap, options, audits=audits, coarse=coarse)
        self._reports, self._edits, self._picture = Reports(gpu), MaterialEdits(gpu, lightmap), ItemImage(gpu)
        self._under_way, self._most = UnderWay(), 1 if coarse else BATCH
        self._leaves: Leaves | None = None
        if lightmap.refinement is not None and self.batch.replay is not None:
            self._leaves = Leaves(
                lightmap.refinement,
                self.batch,
                self.batch.replay,
                finish=self._under_way.finish,
                settle=lambda: self.poll(wait=True),
            )
        self._progress = Progress(0, 1.0, np.zeros(3))  # but for what follows from now
        self._look_at = 0  # shots at which leaves are looked at again
        self.issued = 0
        self.last_shot: Shot | None = None
        self._strongest = 0.0  # power of the strongest patch, as far as it is known [W]
        self._uneven: float | None = None  # share of the emitted power that patches hold, once it is known
        self.reset()

    # -- work ----------------------------------------------------------------------------------------------------------

    def work(self, amount: int, bands: int = 1) -> Generator[None, None, int]:
        """Up to ``amount`` shots (at most a batch), the strongest patches first, in parts. Returns how many were issued: of a
        batch, those too weak beside its best are left for later, and not counted once ``poll`` has the report of it."""
        self._under_way.finish()
        shots = min(amount, self._most)
        parts = self._shoot(shots, bands) if self.batch.replay is None else self._follow_leaves(shots, bands)
        return self._under_way.begin(parts)

    def _shoot(self, shots: int, bands: int) -> Generator[None, None, int]:
        """A batch of patches, or of light from outside where that is stronger, and the report of it."""
        batch, outside = self.batch, self.batch.outside
        from_outside = outside.left > 0 and (OUTSIDE_FIRST * outside.next_power >= self._strongest or batch.phases.even)
        if from_outside:
            choice, made = None, (yield from batch.shoot_outside(shots, bands))
        else:
            choice = batch.phases.now
            made = yield from batch.shoot(choice, shots, bands)
        self.issued += made
        sent = outside.sent if from_outside else Sent(outside.sent.to_come)
        self._reports.send(choice, batch.bins, batch.ledger, batch.shooters, sent)
        return made

    def set_sky(self, sky: Sky | None) -> None:
        """Another sky: the difference is shot. Begins again where nothing is left to emit, and where the storage holds no
        negative light."""
        self._under_way.finish()
        self.lightmap.set_sky(sky)
        self._follow_outside()

    def set_lights(self, lights: tuple[Light, ...]) -> None:
        """Other lamps without area, as of another sky."""
        self._under_way.finish()
        self.lightmap.set_lights(lights)
        self._follow_outside()

    def _follow_outside(self) -> None:
        """Let the difference that another sky, or other lights make be shot."""
        batch = self.batch
        if not self.issued or not self.lightmap.scene.emits or self.lightmap.storage != "rgba32f":
            self.reset()
            return
        self.poll(wait=True)
        if self.lightmap.refinement is not None and batch.replay is not None:
            self.lightmap.refinement.begin_again()
            batch.replay.stop()
            batch.replay.forget_strong()
            self._look_at = 0
        batch.outside.change()
        batch.weigh()
        batch.phases.begin()
        batch.auditor.begin()
        self._measure()

    # -- leaves of quadtrees -------------------------------------------------------------------------------------------

    def _follow_leaves(self, shots: int, bands: int) -> Generator[None, None, int]:
        """On quadtrees: first what there is to do for fresh leaves, a batch of earlier shots at a time, then shots while light is
        left; not until the leaves have followed options that were changed. Then, now and then, a look at the leaves."""
        refinement, replay = self.lightmap.refinement, self.batch.replay
        assert refinement is not None and replay is not None
        made, done = 0, bool(self._clock) and self._all_shot
        if replay.under_way is not None:
            made = yield from replay.work(self.batch.see, self.batch.receive, self.batch.outside, bands)
            if replay.under_way is None:
                self._corrected()
        elif replay.fresh and (refinement.stable if done or replay.all_again else replay.is_cheap):
            replay.start(self.batch.outside)
        elif not done and (refinement.stable or not replay.all_again):
            made = yield from self._shoot(shots, bands)
        clock = self._clock
        if replay.under_way is None and (not refinement.stable or done or clock >= self._look_at):
            yield
            yield from refinement.look(CHANGES_PER_SHOT * shots, bands, clock)
            if not refinement.waiting:
                self._look_at = clock + max(LOOK_AFTER, clock // 4)
        replay.all_again &= self._refining
        return made or shots

    @property
    def _clock(self) -> int:
        """Shots that leaves have followed, or are to follow."""
        replay = self.batch.replay
        return self.batch.outside.made + (0 if replay is None else replay.log.count)

    def _corrected(self) -> None:
        """Fresh leaves have got their light: less or more is unshot now, and what was judged is gone."""
        assert self.lightmap.refinement is not None
        self.poll(wait=True)  # or an older report would follow
        self._measure()
        self.batch.phases.even = False
        self.lightmap.refinement.drop_judgement()
        self.lightmap.refinement.stable = False

    # -- how far it is -------------------------------------------------------------------------------------------------

    def poll(self, *, wait: bool = False) -> Progress:
        """The newest progress that has arrived: the state before the work that sent it; with ``wait`` that of the last."""
        if wait:
            self._under_way.finish()
        for report in self._reports.arrived(wait=wait):
            self._follow_report(report)
        if self._reports.all_arrived:
            self.issued = self._progress.done
        refinement = self.lightmap.refinement
        refining, note = (False, None) if refinement is None else (self._refining, refinement.note)
        note = note or self.batch.ambient.note
        converged = bool(self._all_shot) and not refining
        leaves = self._leaves.say() if self._leaves is not None and refining else ""
        doing = "" if converged else self.batch.phases.say(self._uneven)
        now = replace(self._progress, converged=converged, refining=refining)
        return replace(now, leaves=leaves, note=note, doing=doing)

    def _follow_report(self, report: Report) -> None:
        """Take in what became of a batch."""
        batch, values, choice = self.batch, report.values, report.choice
        ledger, outside = batch.ledger, batch.outside
        outside.follow(values["directions"].astype(np.float64) * ledger.watt, report.sent)
        to_come = ledger.share(outside.power_to_come(report.sent) / ledger.watt)
        unshot = ledger.share(float(values["unshot"])) + to_come
        if choice is batch.phases.now:
            if choice.settles:
                finer = float(values["strongest"]) <= batch.groups.settled
            else:
                to_shoot = self._uneven = ledger.share(float(values["to_shoot"])) + to_come
                finer = batch.phases.follow(unshot, to_shoot, self.options.residual)
            if finer:
                batch.shoot_finer()
                self._uneven = None
        self._strongest = float(values["strongest"]) * ledger.watt
        batch.ambient.strongest = min(ledger.share(float(values["strongest"])), 1.0)
        self._progress = Progress(int(values["shots"]), batch.remaining(unshot), report.escaped * ledger.watt)
        if choice is None:
            return
        if sizes_of(report.shooter):
            self.last_shot = shot_of(self.lightmap, report.shooter)
        if batch.replay is not None and choice is batch.phases.now:
            batch.replay.follow_power(ledger.share(float(powers_of(report.shooter))), unshot)

    def _measure(self) -> None:
        """See what is unshot now, and what has escaped by now. All reports must have arrived. Waits for the GPU."""
        self._under_way.finish()
        ledger = self.batch.ledger
        remaining, self._reports.escaped = self.batch.remaining(ledger.share(self.batch.unshot())), ledger.escaped()
        self._progress = replace(self._progress, remaining=remaining, escaped=self._reports.escaped * ledger.watt)

    @property
    def _all_shot(self) -> bool:
        """Whether the finest patches have shot, and no more is unshot than asked for."""
        return (
            self.batch.phases.even and not self.batch.outside.left and self._progress.remaining <= self.options.residual
        )

    @property
    def _refining(self) -> bool:
        """Whether leaves come or go, or do not yet hold what the shots gave them. When all is shot they are looked at once
        more."""
        refinement, replay = self.lightmap.refinement, self.batch.replay
        assert refinement is not None and replay is not None
        judged = refinement.stable and not (self._all_shot and refinement.looked_at < self._clock)
        return not judged or bool(replay.fresh) or replay.under_way is not None

    def settle(self) -> Progress:
        """End the work under way, and measure what is unshot."""
        self.poll(wait=True)
        self._measure()
        return self.poll()

    def energy(self) -> EnergyBalance:
        """Where all emitted energy is now, RGB [W]; progress is of the same moment. Reads every texel and waits for the GPU."""
        self.poll(wait=True)
        if self.issued:
            self._measure()
        return self.batch.ledger.balance()

    # -- beginning, and other options ----------------------------------------------------------------------------------

    def reset(self) -> None:
        """Forget all light: H = 0, r = E. The leaves stay."""
        self._under_way.drop()
        if self.lightmap.refinement is not None:
            self.lightmap.refinement.begin_again()
        self._look_at = 0
        self._reports.drop()
        self.lightmap.clear()
        self.batch.begin()
        self.issued, self.last_shot, self._strongest = 0, None, 0.0
        self._progress = Progress(0, 1.0 if self.batch.ledger.emitted.sum() > 0 else 0.0, np.zeros(3))

    def set_options(self, options: ShootingOptions) -> None:
        """Use other knobs from the next shot on."""
        if self.lightmap.refinement is not None:
            self.lightmap.refinement.stable = False
            if options == self.options:
                return
        self._under_way.finish()
        if self.batch.replay is not None:
            self.batch.replay.stop()
        self.options = options
        self.batch.set_options(options)
        self.batch.ambient.show(options.ambient)
        if self.issued:
            self.batch.unshot()
            self.batch.ambient.update(self.batch.bins)

    def set_observer(self, position: F64) -> None:
        """The light is the same wherever it is seen from."""

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        """Other albedos and emissions: the light that is there stays, and the difference is shot, negative too [Chen90]. Begins
        again where nothing is left to emit, and where the storage holds no negative light."""
        self._under_way.finish()
        batch = self.batch
        if needs_restart(self.lightmap, materials) or batch.ledger.emitted.sum() <= 0:
            self.lightmap.set_materials(materials)
            self.reset()
            return
        self.poll(wait=True)
        if self.lightmap.refinement is not None:
            self.lightmap.refinement.begin_again()
            self._look_at = 0
        lit = batch.outside.left or batch.outside.made
        factor = np.ones(3) if lit else self.lightmap.common_factor(materials)  # not of light from outside
        before = self.lightmap.scene.materials
        batch.scale(self._edits, factor)
        self._edits.enter(materials, factor)
        batch.weigh(at_least=batch.groups.settled * float(factor.max()))
        if not np.allclose([m.emission for m in materials], [m.emission * factor for m in before]):
            batch.groups.divide(batch.phases)
        self._measure()
        batch.ambient.update(batch.bins)

    # -- kept for later ------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """Besides the batch's own, the reports on their way: they decide later what shoots next."""
        self._under_way.finish()
        state = State({"progress": self._progress.measured, "issued": self.issued, "look_at": self._look_at})
        state.values["strongest"] = self._strongest
        state.put("batch", self.batch.state())
        state.put("reports", self._reports.state(self.batch.phases.choices))
        return state

    def restore(self, state: State) -> None:
        """The last shot is not known until the next is."""
        self.batch.restore(state.part("batch"))
        self._reports.restore(state.part("reports"), self.batch.phases.choices)
        self._progress, self.issued = Progress.of(state.values["progress"]), int(state.values["issued"])
        self._look_at, self._strongest = int(state.values["look_at"]), float(state.values["strongest"])

    # -- what there is to see ------------------------------------------------------------------------------------------

    @property
    def resolved(self) -> Mapping[str, Any]:
        """The level that shoots in the end, and the edge of a full face of the visibility map [px]."""
        return {"level": self.batch.phases.finest.level, "resolution": self.batch.see.resolution}

    @property
    def layers(self) -> Mapping[str, Texture]:
        return {"residual": self.lightmap.texture("t_residual")}

    def inspect(self, texel: tuple[int, int] | None = None, *, images: bool = False) -> Inspection:
        """What ``last_shot`` saw, its patch, and the patch of a texel."""
        shot, facts, pictures, of_texel = self.last_shot, {"Projection": self.options.projection}, {}, {}
        if images:
            seen = self.sight()
            pictures[SIGHT] = self._picture.draw(seen["items"], seen["depth"], self.batch.see.map_size)
            if count := self.vanished():
                facts["Smaller than a sample"] = f"{count:,} triangles, each drawn as one sample"
        if memory := self.batch.ambient.memory:
            facts["Gather points"] = f"{memory / 2**20:.1f} MiB"
        if texel is not None:
            edge = self.patch_edge(texel)
            of_texel["Patch"] = f"{texel[0] // edge}, {texel[1] // edge} of {edge}×{edge} texels"
        rectangles = {} if shot is None else {"last shooter": shot.rect}
        return Inspection(pictures, rectangles, facts, of_texel)

    def sight(self, shot: Shot | None = None) -> dict[str, Texture]:
        """What ``last_shot`` or another one sees: ``items`` and ``depth``, nothing before the first."""
        maps = self.batch.see.inspect(shot or self.last_shot)
        return {"items": maps.items, "depth": maps.depth}

    def vanished(self, shot: Shot | None = None) -> int:
        """Triangles that a shot, or the last one, sees only since each is drawn as one sample at least. Waits for the GPU."""
        return 0 if (one := shot or self.last_shot) is None else self.batch.see.count_small(one)

    def patch_edge(self, texel: tuple[int, int]) -> int:
        """Texels along the edge of the largest patch that a texel (column, row) of the tile pool may shoot from now."""
        return self.batch.phases.patch_edge(texel, self.batch.marks)

    def audit(self, corner: tuple[int, int]) -> Audit:
        """What becomes of a shot from the patch with this lower corner [texels of the tile pool] if it shot now. Changes no
        light. The patch must hold some residual."""
        self._under_way.finish()
        return self.batch.audit(corner)

    def try_one(self) -> None:
        """Audit the first shot of the batch that was chosen last, to be timed."""
        self.batch.auditor.once(self.batch.see, self.batch.receive, 0, 1.0)

    def passes(self, amount: int) -> dict[str, Callable[[], None]]:
        """Each part of a batch by itself, to be timed. They leave the light wrong: reset afterwards."""
        return self.batch.passes(amount)

    def warm_up(self) -> Iterator[None]:
        """Every pass, and how finer patches are chosen."""
        runs: list[Callable[[], object]] = [*self.passes(1).values()]
        runs += [partial(run_to_end, self.batch.choose_once(choice, 1)) for choice in self.batch.phases.choices[1:]]
        for run in runs:
            with self.gpu.only_compiling():
                run()
            self.gpu.ctx.finish()
            yield
        yield from self.batch.outside.warm_up()

    def release(self) -> None:
        if self._leaves is not None:
            self._leaves.release()
        for part in (self._reports, self._picture, self.batch):
            part.release()


__all__ = ["Shooting"]
