"""Progressive refinement radiosity over uniform texels [Coombe03, 3; Cohen88].

    while not converged:
        i    = patch with the largest power to shoot, R_i A_i; R_i = r_i + ρ_i a: the residual and what will come
               back of the ambient light [Feda92]
        see the scene from i (item buffer and depth on a hemicube)
        r_i -= R_i
        for every texel j:  ΔH_j = R_i F_ji V_ji;  H_j += ΔH_j;  r_j += ρ_j ΔH_j

The host only hears, a few steps late, how much is still unshot: see shot.py for what is done on the GPU.

Works badly where the middle of a patch sees something else than the rest of it (contact shadows): shoot from a lower level.
"""

from __future__ import annotations

import inspect
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.gpu import Gpu, ReadBack, Texture
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64, Material
from app.solvers.base import EnergyBalance, Inspection, Progress
from app.solvers.shooting.options import ShootingOptions, highest_level
from app.solvers.shooting.shot import Audit, AuditTargets, Shot, ShotPasses, powers_of
from app.solvers.shooting.stages import (
    BATCH,
    LEDGER_ROWS,
    LEVELS,
    OPEN,
    REPORT_HEAD,
    ChoiceStages,
    ShotBuffers,
    ShotStages,
)
from app.util.parts import run_to_end
from app.visibility.item_image import ItemImage

# Large patches shoot first, and finer ones what those leave once so little of the emitted power is unshot. What is left then is
# more here and less there: light that hardly leaves its corner. So they end once they hold so many times the residual asked for.
COARSE_LEAVE, FINE_LEAVE = 5e-3, 10
MOST = 0.02  # of the emitted power: emitters of more are divided, one lamp into 50 patches at least: shadows add up to soft ones
PAID = 1 / 16  # of that: families that owe no more may pay when others shoot as much
FAMILY = 4  # patches, two along each edge, see family.glsl
FEET = 2  # 1 + by how many levels patches at the foot of what stands on them are finer than the finest: they light it from near
REPORT_LAG = 2  # read-backs in flight before the oldest is looked at


@dataclass(frozen=True)
class Report:
    """What the GPU said last: shots made; residual: unshot share of the emitted power [-], 1 before the first shot; escaped:
    power that left the scene, RGB [W]."""

    shots: int
    residual: float
    escaped: F64


class UniformShooting(ShotPasses):
    """Shoots ``lightmap`` to convergence. Whoever makes it releases it."""

    note: str | None = None

    def __init__(self, gpu: Gpu, lightmap: Lightmap, options: ShootingOptions) -> None:
        self.gpu, self.lightmap, self.options = gpu, lightmap, options
        self.buffers = ShotBuffers(gpu, lightmap)
        self.stages = self._make_stages(options)
        self.last_shot: Shot | None = None
        self._under_way: Generator[None, None, int] | None = None
        self._items = ItemImage(gpu)
        self._reports: deque[tuple[ChoiceStages, ReadBack]] = deque()
        self.reset()

    @property
    def adaptive(self) -> bool:
        """Whether leaves come and go."""
        return self.lightmap.refinement is not None

    def _make_stages(self, options: ShootingOptions) -> ShotStages:
        return ShotStages(self.gpu, self.lightmap, options, adaptive=self.adaptive)

    # -- the solver's interface ----------------------------------------------------------------------------------------

    def reset(self) -> None:
        """Forget all light: H = 0, r = E."""
        if self.stages.storage != self.lightmap.storage:
            self.stages.release()
            self.stages = self._make_stages(self.options)
        if self._under_way is not None:
            self._under_way.close()
            self._under_way = None
        self.lightmap.clear()
        self.buffers.ledger_target.clear()
        self._drop_reports()
        self.buffers.all_alike()
        self._phase, self._audits, self._even = 0, True, False
        self.issued, self.last_shot = 0, None
        self.buffers.ambient_target.clear()
        self._weigh_scene()
        self._divide_emitters()
        if self.lightmap.storage != "fixed8":  # 8 bits do not hold what a small one gives
            self.buffers.divide_at(self.lightmap.pool.surfaces.cut, FEET)
        self.report = Report(0, 1.0 if self._emitted.sum() > 0 else 0.0, np.zeros(3))

    def set_options(self, options: ShootingOptions) -> None:
        """Use other knobs from the next shot on."""
        self.finish()
        if options.replace(ambient=self.options.ambient) == self.options:
            self.options = options
            self._expect_anew()
            return
        self._remake_stages(options)

    def _remake_stages(self, options: ShootingOptions) -> None:
        fresh, finest = self._make_stages(options), self._finest_level
        self.stages.release()
        self.stages, self.options = fresh, options
        self._phase, self._audits, self._even = min(self._phase, len(fresh.choices) - 1), True, False
        self.buffers.finest_is(self._finest_level - finest)
        self._divide_emitters()
        self._expect_anew()

    def _expect_anew(self) -> None:
        """What is still to come, of all that is unshot now."""
        self.lightmap.ambient_target.clear()
        if self.issued:
            self.unshot_share()
            self._expect()

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        """Other albedos and emissions: the light that is there stays, and the difference is shot, negative too [Chen90]. Begins
        again where nothing is left to emit, and where the storage holds no negative light."""
        self.finish()
        overflows = self.lightmap.storage == "rgba16f" and self.lightmap.exceeds_half(materials)
        if (
            overflows
            or self.lightmap.storage == "fixed8"
            or not any(m.emits for m in materials)
            or self._emitted.sum() <= 0
        ):
            self.lightmap.set_materials(materials)
            self.reset()
            return
        self.poll(wait=True)
        factor = self.lightmap.common_factor(materials)
        if (factor != 1).any():
            self._scale_light(factor)
        before, self._phase, self._audits, self._even = self.lightmap.scene.materials, 0, True, False
        self.lightmap.edit_materials(materials, factor)
        self._weigh_scene(at_least=self._paid * float(factor.max()))
        if not np.allclose([m.emission for m in materials], [m.emission * factor for m in before]):
            self._divide_emitters()
        self.report = replace(self.report, residual=self.unshot_share())
        self._expect()

    def _scale_light(self, factor: F64) -> None:
        """Multiply all light that was shot by a factor (3,)."""
        self.lightmap.scale(factor)
        self.lightmap.scale(factor, self.buffers.ledger_target)

    def _weigh_scene(self, at_least: float = 0.0) -> None:
        """What its emitters send out and its surfaces reflect; at_least: power that counts as much, for what is dimmed."""
        self._emitted = self.lightmap.emitted
        sums, _, reflectance = self._tile_sums()
        self._area = float(sums[3]) / self._watt
        self._albedo = tuple((reflectance[:3] / max(sums[3], 1e-300)).tolist())
        self._paid = float(np.float32(max(PAID * MOST * float(self._emitted.sum()) / self._watt, at_least)))

    def _divide_emitters(self) -> None:
        """Let no patch hold much of the light, but where 8 bits do not hold what a small one gives. What was divided stays so:
        others may be owed light there."""
        if self.lightmap.storage == "fixed8":
            return
        power = self.lightmap.emission().sum(-1, dtype=np.float64) * self.lightmap.pool.surfaces.area
        slots = np.arange(len(power))
        largest, finest = (self._levels_of(slots, choice) for choice in (self._choice, self.stages.choices[-1]))
        self.buffers.divide(power, MOST * self._emitted.sum(), largest, finest, self._levels_above(slots))

    @property
    def _choice(self) -> ChoiceStages:
        """Among the patches that shoot now."""
        return self.stages.choices[self._phase]

    @property
    def _least_power(self) -> float:
        return self._paid if self._choice.pays else 0.0

    @property
    def grown(self) -> bool:
        """Always: no leaves come or go."""
        return True

    @property
    def settled(self) -> bool:
        """Whether the finest patches have shot, and hold little."""
        return self._even

    def unshot_share(self) -> float:
        """The residual now, Σ |Σ r A| over tiles, as a share of the emitted power. Waits for the GPU."""
        self.finish()
        self._add_patches(self._choice)
        self._add_runs(self._choice)
        runs = np.frombuffer(self.buffers.unshot.read(), np.float32).reshape(-1, 4)[:, 3].astype(np.float64)
        emitted = self._emitted.sum()
        return float(runs.sum()) * self._watt / emitted if emitted > 0 else 0.0

    def work(self, amount: int, bands: int = 1) -> Generator[None, None, int]:
        """Up to ``amount`` shots (at most BATCH), the strongest patches first, in parts. Returns how many were issued: of a
        batch, those too weak beside its best are left for later, and not counted once ``poll`` has heard of it."""
        self.finish()
        self._under_way = self._parts(min(amount, BATCH), bands)
        return self._under_way

    def finish(self) -> None:
        """End the work that is under way, if any; of its own parts this asks nothing."""
        if self._under_way is not None and inspect.getgeneratorstate(self._under_way) != inspect.GEN_RUNNING:
            for _ in self._under_way:
                pass
            self._under_way = None

    def poll(self, *, wait: bool = False) -> Progress:
        """The newest progress that has arrived: the state before the work that sent it; with ``wait`` that of the last."""
        if wait:
            self.finish()
        while self._reports and (wait or len(self._reports) > REPORT_LAG):
            choice, readback = self._reports.popleft()
            self._hear(choice, np.frombuffer(readback.take(), np.float32).reshape(-1, 4).astype(np.float64))
        if not self._reports:
            self.issued = self.report.shots
        report = self.report
        converged = report.residual <= self.options.residual and self.settled
        return Progress(report.shots, report.residual, report.escaped, bool(converged), not self.grown, self.note)

    def settle(self) -> Progress:
        """End the work under way, and measure what is unshot."""
        self.poll(wait=True)
        self.report = replace(self.report, residual=self.unshot_share())
        return self.poll()

    def energy(self) -> EnergyBalance:
        """Where all emitted energy is now, RGB [W]. Reads every texel and waits for the GPU."""
        self.finish()
        absorbed, unshot, reflectance = self._tile_sums()
        ledger = np.frombuffer(self.buffers.ledger.read(), np.float32).reshape(LEDGER_ROWS, BATCH, 4)
        escaped, blackened, _ = ledger[..., :3].astype(np.float64).sum(1) * self._watt
        area = absorbed[3] / self.lightmap.unit
        return EnergyBalance(
            self._emitted,
            absorbed[:3] + blackened,
            escaped,
            unshot[:3],
            reflectance[:3] / max(absorbed[3], 1e-300),
            float(area),
        )

    def audit(self, corner: tuple[int, int]) -> Audit:
        """What becomes of a shot from the patch with this lower corner [texels of the tile pool] if it shot now. Changes no
        light. The patch must hold some residual."""
        self.finish()
        runs = np.zeros((self.buffers.runs.width, 4), np.float32)
        level = self.patch_edge(corner).bit_length() - 1
        choice = self.stages.choices[0] if self._choice.pays else self._choice
        runs[0] = 1e38, corner[0], corner[1] * LEVELS + level, 0.0
        self.buffers.runs.write(runs.tobytes())
        self._describe(choice, 1)
        row = self._shooter_rows(1)
        with AuditTargets(self.gpu, self.lightmap) as targets:
            shares = self._hand_out(targets, 0, float(powers_of(row)[0]))
        return Audit(*shares, self._shot_from_rows(row[0]))

    def passes(self, amount: int) -> dict[str, Callable[[], None]]:
        """Each part of a step by itself, to be timed. They leave the light wrong: reset afterwards."""
        shots = min(amount, BATCH)
        return {
            "choose": lambda: run_to_end(self._pick(shots)),
            "zero": lambda: self._zero(shots),
            "see": lambda: self._for_groups(self._see, shots),
            "receive": lambda: self._for_groups(self._light, shots),
            "look out": lambda: self._for_groups(self._look_out, shots),
            "book": lambda: self._book(shots),
        }

    def warm_up(self) -> Iterator[None]:
        """Every pass, and how finer patches are chosen."""
        for run in self.passes(1).values():
            run()
            self.gpu.ctx.finish()
            yield
        for phase in range(1, len(self.stages.choices)):
            self._phase = phase
            run_to_end(self._pick(1))
            self.gpu.ctx.finish()
            yield

    def patch_edge(self, texel: tuple[int, int]) -> int:
        """Texels along the edge of the largest patch that a texel (column, row) of the tile pool may shoot from now: the level,
        or as much finer as an audit made it."""
        slot, finer = self._slot_at(texel), self.buffers.finer_at(texel)
        if finer > 0:
            return 1 << max(self._level_of(slot, self.stages.choices[-1]) + 1 - finer, 0)
        return 1 << self._level_of(slot, self._choice)

    def _slot_at(self, texel: tuple[int, int]) -> int:
        pool = self.lightmap.pool
        return texel[1] // pool.tile * pool.columns + texel[0] // pool.tile

    def _level_of(self, slot: int, choice: ChoiceStages) -> int:
        return int(self._levels_of(np.array([slot]), choice)[0])

    def _levels_of(self, slots: NDArray[np.int64], choice: ChoiceStages) -> NDArray[np.int64]:
        """The largest that patches of leaves have by this choice."""
        return np.clip(choice.level - self._levels_above(slots), 0, highest_level(self.lightmap.pool.tile))

    def _levels_above(self, slots: NDArray[np.int64]) -> NDArray[np.int64]:
        """By how much patches of leaves are finer, as their texels are coarser."""
        return np.zeros_like(slots)

    def _finest_of(self, shot: Shot) -> tuple[int, int, int, int]:
        return *shot.corner, shot.size, self._level_of(self._slot_at(shot.corner), self.stages.choices[-1])

    @property
    def resolved(self) -> Mapping[str, Any]:
        """The level that shoots in the end, and the edge of a full face of the visibility map [px]."""
        return {"level": self._finest_level, "resolution": self.stages.resolution}

    @property
    def _finest_level(self) -> int:
        return self.stages.choices[-1].level

    def inspect(self, texel: tuple[int, int] | None = None, *, images: bool = False) -> Inspection:
        """What ``last_shot`` saw, its patch, and the patch of a texel."""
        shot, facts, pictures = self.last_shot, {"Projection": self.options.projection}, {}
        if images:
            seen = self.sight()
            pictures["What the last shooter saw"] = self._items.draw(seen["items"], seen["depth"], self.stages.map_size)
            if count := self.vanished():
                facts["Smaller than a sample"] = f"{count:,} triangles"
        rectangles = {} if shot is None else {"last shooter": shot.rect}
        return Inspection(pictures, rectangles, facts, {} if texel is None else self._facts_of(texel))

    def _facts_of(self, texel: tuple[int, int]) -> dict[str, str]:
        edge = self.patch_edge(texel)
        return {"Patch": f"{texel[0] // edge}, {texel[1] // edge} of {edge}×{edge} texels"}

    def sight(self, shot: Shot | None = None) -> dict[str, Texture]:
        """What ``last_shot`` or another one sees: ``items`` and ``depth``, nothing before the first. Drawn for this: the maps of
        a step are those of whatever it did last, and in use while it is under way."""
        maps, shot = self.stages.inspected, shot or self.last_shot
        if shot is None:
            maps.target.clear(OPEN, depth=1.0)
        else:
            self._see(0, 1, maps, self._shooter_alone(shot))
        return {"items": maps.items, "depth": maps.depth}

    def vanished(self, shot: Shot | None = None) -> int:
        """Triangles that ``last_shot`` or another one sees, but between the samples of its map: each is drawn as one sample.
        Waits for the GPU."""
        shot = shot or self.last_shot
        return 0 if shot is None else self._count_vanished(shot)

    def release(self) -> None:
        self._drop_reports()
        self._items.release()
        self.stages.release()
        self.buffers.release()

    # -- one shot ------------------------------------------------------------------------------------------------------

    def _parts(self, shots: int, bands: int) -> Generator[None, None, int]:
        """A step, from choosing to the report, its longest passes in so many bands; how many shots: of families that pay, whole
        ones. [Coombe03, 3]"""
        if self._choice.pays:
            shots = max(shots // FAMILY, 1) * FAMILY
        yield from self._choose(shots, bands)
        self._zero(shots)
        yield
        for first, some in self.stages.groups(shots):
            self._see(first, some)
            yield
            for band in range(bands):
                self._light(first, some, band, bands)
                yield
            self._look_out(first, some)
        self._book(shots)
        self.issued += shots
        self._tell()
        return shots

    # -- what the host hears -------------------------------------------------------------------------------------------

    def _tell(self) -> None:
        buffers = self.buffers
        self.stages.tell.draw(
            buffers.report_target,
            textures={"t_runs": buffers.runs, "t_unshot": buffers.unshot, "t_ledger": buffers.ledger}
            | {"t_shooters": buffers.shooters},
        )
        self._reports.append((self._choice, ReadBack(self.gpu, buffers.report_target)))

    def _hear(self, choice: ChoiceStages, report: F64) -> None:
        """report (REPORT_HEAD + SHOOTER_ROWS, 4), see report.frag.glsl; choice: the level that it is about."""
        emitted = self._emitted.sum()
        residual = report[0, 0] * self._watt / emitted if emitted > 0 else 0.0
        if choice is self._choice and choice.pays:
            if report[0, 2] <= self._paid:
                self._next_phase()
        elif choice is self._choice and residual <= max(COARSE_LEAVE, self.options.residual):
            finest = choice is self.stages.choices[-1]
            left = float(report[0, 1]) * self._watt
            self._even = finest and left <= FINE_LEAVE * self.options.residual * float(emitted)
            if not finest:
                self._next_phase()
        self.report = Report(int(report[1, 3]), float(residual), report[1, :3] * self._watt)
        if report[REPORT_HEAD + 5, 3] != 0:
            self.last_shot = self._shot_from_rows(report[REPORT_HEAD:])

    def _next_phase(self) -> None:
        """Finer patches shoot from now on, lamps' for themselves."""
        self._phase, self._audits = self._phase + 1, True

    def _tile_sums(self) -> tuple[F64, F64, F64]:
        """Absorbed and unshot power [W] and Σ ρA, RGB and in the first Σ A, as books.frag.glsl adds them per tile."""
        lightmap = self.lightmap
        self.stages.add_books.draw(
            self.buffers.books_target,
            textures=lightmap.textures(
                "t_position_area", "t_normal_ids", "t_materials", "t_albedo", "t_irradiance", "t_residual"
            ),
        )
        sums = [
            np.frombuffer(t.read(), np.float32).reshape(-1, 4).astype(np.float64).sum(0) for t in self.buffers.books
        ]
        return sums[0] * self._watt, sums[1] * self._watt, sums[2] * self._watt

    def _drop_reports(self) -> None:
        while self._reports:
            self._reports.popleft()[-1].take()


__all__ = ["UniformShooting"]
