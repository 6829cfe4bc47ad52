"""Progressive refinement radiosity over uniform texels [Coombe03, 3; Cohen88].

    while not converged:
        i    = patch with the largest residual power r_i A_i
        see the scene from i (item buffer and depth on a hemicube)
        r_i  = 0
        for every texel j:  ΔH_j = r_i F_ji V_ji;  H_j += ΔH_j;  r_j += ρ_j ΔH_j

The chosen shooters never leave the GPU: ``choose`` writes one row of t_shooters per shot of a batch, and every later pass
reads it there. All chosen residuals are zeroed before the first of the batch shoots, or what one gives to another would be
lost. The host only hears, a few steps late, how much is still unshot.

Works badly where the middle of a patch sees something else than the rest of it (contact shadows): shoot from a lower level.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from app.atlas.lightmap import Lightmap
from app.gpu import Buffer, Framebuffer, Gpu, Mesh, ReadBack, Texture
from app.scene.model import F64, Material
from app.solvers.base import EnergyBook, StepReport
from app.solvers.shooting.options import ShootingOptions
from app.solvers.shooting.stages import (
    BATCH,
    BLOCK_BYTES,
    OPEN,
    SHOOTER_ROWS,
    ChoiceStages,
    ShotBuffers,
    ShotStages,
)

# With ``coarsen``, a shot should carry this share of the emitted power: about 4096 shots for each time that all light is
# reflected, whatever the scene's size. Measured on the Cornell box: a quarter of the shots, error 1.8 % -> 2.4 %.
FAINT = 2.0**-12
WHOLE = object()  # no part is left
REPORT_LAG = 2  # read-backs in flight before the oldest is looked at


@dataclass(frozen=True)
class Shot:
    """The shooter of one shot: centre [m], unit normal, area [m²], lower corner (x, y) and edge of its patch in the node set
    [texels]."""

    centre: F64
    normal: F64
    area: float
    corner: tuple[int, int]
    size: int


@dataclass(frozen=True)
class Audit:
    """What becomes of a shot, as shares of its power: received by texels, Σ A_j F_ji V_ji / A_i, sent out of the scene, and
    lost on black sides that have no texels. Their sum should be 1."""

    received: float
    open: float
    black: float
    shot: Shot

    @property
    def total(self) -> float:
        return self.received + self.open + self.black


class UniformShooting:
    """Shoots ``lightmap`` to convergence. Whoever makes it releases it."""

    adaptive = False  # whether leaves come and go
    note: str | None = None

    def __init__(self, gpu: Gpu, lightmap: Lightmap, options: ShootingOptions) -> None:
        self.gpu, self.lightmap, self.options = gpu, lightmap, options
        if lightmap.storage != options.storage:
            lightmap.set_storage(options.storage)
        self.buffers = ShotBuffers(gpu, lightmap)
        self.stages = self._make_stages(options)
        self.last_shot: Shot | None = None
        self._under_way: Iterator[None] | None = None
        self._reports: deque[tuple[ChoiceStages, ReadBack]] = deque()
        self.reset()

    def _make_stages(self, options: ShootingOptions) -> ShotStages:
        return ShotStages(self.gpu, self.lightmap, options, adaptive=self.adaptive)

    # -- the solver's interface ----------------------------------------------------------------------------------------

    def reset(self) -> None:
        """Forget all light: H = 0, r = E."""
        self._under_way = None
        self.lightmap.clear()
        self.buffers.ledger_target.clear()
        self._drop_reports()
        self._choice = self.stages.choices[0]
        self.shots, self.last_shot = 0, None
        self._emitted = self.lightmap.emitted
        self.report = StepReport(0, 1.0 if self._emitted.sum() > 0 else 0.0, np.zeros(3))

    def set_options(self, options: ShootingOptions) -> None:
        """Use other knobs from the next shot on. Another storage format starts again."""
        self.finish()
        restart = options.storage != self.options.storage
        self._remake_stages(options)
        if restart:
            self.lightmap.set_storage(options.storage)
            self.reset()

    def _remake_stages(self, options: ShootingOptions) -> None:
        fresh = self._make_stages(options)
        self.stages.release()
        self.stages, self.options = fresh, options
        self._choice = fresh.choices[0]

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
            self.lightmap.scale(factor)
            self.lightmap.scale(factor, self.buffers.ledger_target)
        self.lightmap.edit_materials(materials, factor)
        self._emitted = self.lightmap.emitted
        self._choice = self.stages.choices[0]
        self.report = replace(self.report, residual=self.unshot_share())

    @property
    def settled(self) -> bool:
        """Always: only shots are left to do."""
        return True

    def unshot_share(self) -> float:
        """The residual now, Σ |r A| over patches, as a share of the emitted power. Waits for the GPU."""
        self.finish()
        self._weigh(self._choice)
        rows = np.frombuffer(self.buffers.rows.read(), np.float32).reshape(-1, 4)[:, 3].astype(np.float64)
        emitted = self._emitted.sum()
        return float(rows.sum()) * self._watt / emitted if emitted > 0 else 0.0

    def step(self, shots: int) -> int:
        """Make up to ``shots`` shots (at most BATCH), the strongest patches first. Returns how many were issued: of a batch,
        those too weak beside its best are left for later, and not counted once ``poll`` has heard of it."""
        self.finish()
        shots = min(shots, BATCH)
        for _ in self._parts(shots, 1):
            pass
        return shots

    def step_part(self, bands: int) -> bool:
        """A part of one shot, its receivers in so many bands; whether the shot is whole now. What needs whole shots finishes it
        first."""
        if self._under_way is None:
            self._under_way = self._parts(1, bands)
        if next(self._under_way, WHOLE) is WHOLE:
            self._under_way = None
        return self._under_way is None

    def finish(self) -> None:
        """Make the shot whole that is under way, if any."""
        while self._under_way is not None:
            self.step_part(1)

    def poll(self, *, wait: bool = False) -> StepReport:
        """The newest report that has arrived: the state before the step that sent it; with ``wait`` that of the last step."""
        while self._reports and (wait or len(self._reports) > REPORT_LAG):
            choice, readback = self._reports.popleft()
            self._hear(choice, np.frombuffer(readback.take(), np.float32).reshape(-1, 4).astype(np.float64))
        if not self._reports:
            self.shots = self.report.shots
        return self.report

    def books(self) -> EnergyBook:
        """Where all emitted energy is now, RGB [W]. Reads every texel and waits for the GPU."""
        self.finish()
        absorbed, unshot, reflectance = self._tile_sums()
        ledger = np.frombuffer(self.buffers.ledger.read(), np.float32).reshape(2, BATCH, 4)
        escaped, blackened = ledger[..., :3].astype(np.float64).sum(1) * self._watt
        area = absorbed[3] / self.lightmap.unit
        return EnergyBook(
            self._emitted,
            absorbed[:3] + blackened,
            escaped,
            unshot[:3],
            reflectance[:3] / max(absorbed[3], 1e-300),
            float(area),
        )

    def audit(self, patch: tuple[int, int]) -> Audit:
        """What becomes of a shot from this patch if it shot now. Changes no light. The patch must hold some residual."""
        self.finish()
        rows = np.zeros((self.lightmap.rows, 4), np.float32)
        rows[0] = 1.0, *(corner << self.options.level for corner in patch), 0.0
        self.buffers.rows.write(rows.tobytes())
        self._describe(self.stages.choices[0], 1)
        self._see(0, 1)
        scratch = [self.gpu.texture(self.lightmap.size, 4, "f4") for _ in range(2)]
        target = self.gpu.target(*scratch)
        target.clear()
        self._receive(target, 0, 1, blend=None)
        weight = np.frombuffer(scratch[0].read(), np.float32).reshape(*scratch[0].size[::-1], 4)[..., 3]
        area = np.frombuffer(self.lightmap.texture("t_position_area").read(), np.float32).reshape(*weight.shape, 4)[
            ..., 3
        ]
        self.gpu.release_all(target, *scratch)
        self._look_out(0, 1)
        blocks = (
            np.frombuffer(self.stages.maps.open.read(), np.float32).reshape(BATCH, -1, 2)[0].astype(np.float64).sum(0)
        )
        shooter = np.frombuffer(self.buffers.shooters.read(), np.float32).reshape(BATCH, -1, 4)[0]
        power = shooter[0, 3] * np.abs(shooter[5, :3].astype(np.float64)).sum()
        received = float((area.astype(np.float64) * weight).sum() / power)
        return Audit(received, float(blocks[0]), float(blocks[1]), self._shot_from_rows(shooter))

    def passes(self, shots: int) -> dict[str, Callable[[], None]]:
        """Each part of a step by itself, to be timed. They leave the light wrong: reset afterwards."""
        shots = min(shots, BATCH)
        return {
            "choose": lambda: self._choose(shots),
            "see": lambda: self._for_groups(self._see, shots),
            "receive": lambda: self._for_groups(self._light, shots),
            "look out": lambda: self._for_groups(self._look_out, shots),
            "book": lambda: self._book(shots),
        }

    def inspect(self) -> dict[str, Texture]:
        """What the first shot of the last step saw, in the lowest of the maps that lie above each other."""
        return {"items": self.stages.maps.items, "depth": self.stages.maps.depth}

    def release(self) -> None:
        self._drop_reports()
        self.stages.release()
        self.buffers.release()

    # -- one shot ------------------------------------------------------------------------------------------------------

    def _parts(self, shots: int, bands: int) -> Iterator[None]:
        """A step, from choosing to the report. [Coombe03, 3]"""
        self._choose(shots)
        yield
        for first, some in self.stages.groups(shots):
            self._see(first, some)
            yield
            for band in range(bands):
                self._light(first, some, band / bands, (band + 1) / bands)
                yield
            self._look_out(first, some)
        self._book(shots)
        self.shots += shots
        self._tell()

    def _for_groups(self, part: Callable[[int, int], None], shots: int) -> None:
        """Do this part of a step for all its shots, as many at once as there are maps for."""
        for first, some in self.stages.groups(shots):
            part(first, some)

    def _light(self, first: int, shots: int, start: float = 0.0, end: float = 1.0) -> None:
        """Receive into the lightmap, in the rows between two shares of its height."""
        width, height = self.lightmap.size
        lower, upper = round(start * height), round(end * height)
        rows = None if upper - lower == height else (0, lower, width, upper - lower)
        self._receive(self.lightmap.light_target, first, shots, blend="add", rows=rows)

    def _choose(self, shots: int) -> None:
        """Pick the strongest patches and zero them. [Coombe03, 3.4]"""
        lightmap, buffers = self.lightmap, self.buffers
        self._weigh(self._choice)
        self._describe(self._choice, shots)
        self.stages.zero.draw(
            lightmap.residual_target,
            textures=lightmap.textures("t_position_area", "t_normal_ids") | {"t_shooters": buffers.shooters},
            uniforms={"u_size": lightmap.size},
            vertices=4,
            instances=shots,
            strip=True,
        )

    def _weigh(self, choice: ChoiceStages) -> None:
        """Residual power of every patch of this level, and the strongest of each row of tiles."""
        textures = self.lightmap.textures("t_position_area", "t_residual", *choice.leaves)
        choice.add_patches.draw(choice.patch_target, textures=textures)
        choice.add_rows.draw(
            self.buffers.row_target, textures={"t_patches": choice.patches}, uniforms={"u_width": choice.patch_size[0]}
        )

    def _describe(self, choice: ChoiceStages, shots: int) -> None:
        """Write the shooters of the batch from the strongest patches of the rows."""
        choice.choose.draw(
            self.buffers.shooter_target,
            textures=self.lightmap.textures("t_position_area", "t_normal_ids", "t_residual", "t_facets", *choice.leaves)
            | {"t_rows": self.buffers.rows},
            uniforms={"u_rows": self.lightmap.rows},
            viewport=(0, 0, SHOOTER_ROWS, shots),
        )
        self.buffers.shooter_target.read_into(self.buffers.shooter_blocks, components=4, dtype="f4")

    def _see(self, first: int, shots: int) -> None:
        """Item buffer and depth from so many shooters of the batch, all views in one draw. [Coombe03, 3.2; Cohen85]"""
        maps = self.stages.maps
        used = None if shots == maps.count else (0, 0, maps.items.width, shots * maps.map_size[1])
        maps.target.clear(OPEN, depth=1.0, viewport=used)
        projection, occluders = self.stages.projection, self.buffers.occluders
        casters = projection.casters(occluders, self.options.resolution)
        self.stages.see.draw(
            maps.target,
            textures=casters.textures,
            uniforms={"u_maps": maps.count, "u_first": first},
            blocks=self._shooter_blocks,
            mesh=casters.mesh,
            vertices=casters.vertices,
            instances=projection.views * shots,
            depth=True,
            clip_distances=projection.clip_distances,
        )
        self.stages.see_small.draw(
            maps.target,
            textures={"t_triangles": occluders.texture},
            uniforms={"u_maps": maps.count, "u_first": first},
            blocks=self._shooter_blocks,
            vertices=occluders.count,
            instances=shots,
            points=True,
            depth=True,
        )

    def vanished(self) -> int:
        """Triangles that the first shooter of the last step sees, but between the samples of its map: each was drawn as one
        sample. Waits for the GPU."""
        texture = self.gpu.texture((1, 1), 1, "f4")
        target = self.gpu.target(texture)
        target.clear()
        self.stages.count_small.draw(
            target,
            textures={"t_triangles": self.buffers.occluders.texture},
            uniforms={"u_maps": 1, "u_first": 0},
            blocks=self._shooter_blocks,
            vertices=self.buffers.occluders.count,
            points=True,
            blend="add",
        )
        count = int(np.frombuffer(texture.read(), np.float32)[0])
        self.gpu.release_all(target, texture)
        return count

    def _receive(
        self,
        target: Framebuffer,
        first: int,
        shots: int,
        *,
        blend: str | None,
        meshes: Mapping[bool, Mesh] | None = None,
        rows: tuple[int, int, int, int] | None = None,
        own: bool = True,
    ) -> None:
        """The light of these shots on every texel that sees them, or on some receivers or rows only. [Coombe03, eq. 1]

        own: whether patches still are where they shot from, and do not light themselves."""
        lightmap = self.lightmap
        shaped = lightmap.textures("t_position_area", "t_normal_ids")
        meshes = lightmap.receivers if meshes is None else meshes
        for (flat, _), receive in self.stages.receive.items():
            if flat not in meshes:
                continue
            textures = lightmap.textures("t_materials", "t_albedo") | self.stages.sight_textures
            receive.draw(
                target,
                textures=textures if flat else textures | shaped,
                uniforms={"u_size": lightmap.size, "u_first": first, "u_shots": shots}
                | ({} if flat else {"u_own": int(own)}),
                blocks=self._shooter_blocks,
                mesh=meshes[flat],
                blend=blend,
                scissor=rows,
            )

    @property
    def _shooter_blocks(self) -> dict[str, tuple[Buffer, int, int]]:
        return {"ShooterBlock": (self.buffers.shooter_blocks, 0, BATCH * BLOCK_BYTES)}

    def _look_out(self, first: int, shots: int) -> None:
        """Add up how much of the shooters' sight leaves the scene."""
        maps = self.stages.maps
        width, height = maps.open_size
        self.stages.add_open.draw(
            maps.open_target,
            textures={"t_items": maps.items, "t_weights": self.stages.weights},
            uniforms={"u_row": first * height},
            viewport=(0, first * height, width, shots * height),
        )

    def _book(self, shots: int) -> None:
        """Enter in the ledger what the batch sent out of the scene."""
        self.stages.enter.draw(
            self.buffers.ledger_target,
            textures={"t_open": self.stages.maps.open, "t_shooters": self.buffers.shooters},
            uniforms={"u_blocks": self.stages.maps.open_size[1]},
            blend="add",
            viewport=(0, 0, shots, 2),
        )

    # -- what the host hears -------------------------------------------------------------------------------------------

    def _tell(self) -> None:
        buffers = self.buffers
        self.stages.tell.draw(
            buffers.report_target,
            textures={"t_rows": buffers.rows, "t_ledger": buffers.ledger, "t_shooters": buffers.shooters},
        )
        self._reports.append((self._choice, ReadBack(self.gpu, buffers.report_target)))

    def _hear(self, choice: ChoiceStages, report: F64) -> None:
        """report (2 + SHOOTER_ROWS, 4), see report.frag.glsl; choice: the level that it is about."""
        emitted = self._emitted.sum()
        residual = report[0, 0] * self._watt / emitted if emitted > 0 else 0.0
        faint = report[0, 1] * self._watt < FAINT * emitted
        if faint and choice is self._choice and choice is not self.stages.choices[-1]:
            self._choice = self.stages.choices[self.stages.choices.index(choice) + 1]
        self.report = StepReport(int(report[1, 3]), float(residual), report[1, :3] * self._watt)
        if report[2 + 5, 3] > 0:
            self.last_shot = self._shot_from_rows(report[2:])

    def _shot_from_rows(self, rows: F64) -> Shot:
        frame, corner = self.lightmap.frame, (int(rows[3, 3]), int(rows[4, 3]))
        area = float(rows[0, 3]) * frame.scale**2
        return Shot(frame.world_from_local(rows[2, :3]), rows[1, :3], area, corner, int(rows[5, 3]))

    @property
    def _watt(self) -> float:
        """Watts in one stored unit of power: lightmap unit [W/m²] times solver area."""
        return self.lightmap.unit * self.lightmap.frame.scale**2

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


__all__ = ["BATCH", "Audit", "Shot", "UniformShooting"]
