"""One batch of shots, pass by pass [Coombe03, 3]: choose, zero, see, receive, look out, book.

    i = patch with the largest |Σ R A|;  see the scene from i;  r_i -= R_i;  H_j += R_i F_ji V_ji;  r_j += ρ_j R_i F_ji V_ji

R: the residual and what will come back, see expected.glsl. The chosen shooters never leave the GPU: ``choose`` writes one row of
t_shooters per shot of a batch, and every later pass reads it there. What they shoot is taken from them before the first of the
batch shoots, or what one gives to another would be lost.

Σ_j A_j F_ji V_ji plus what leaves should be A_i: where a patch sees from its middle what its edges do not, in a coffer or beside
a box, it is not. So strong batches are audited before they shoot, and shoot from finer patches where they fail.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.gpu import Buffer, Framebuffer, Gpu, Mesh
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64
from app.solvers.shooting.options import ShootingOptions
from app.solvers.shooting.stages import (
    BATCH,
    BLOCK_BYTES,
    BLOCK_ROWS,
    LEDGER_ROWS,
    OPEN,
    SHOOTER_ROWS,
    ChoiceStages,
    Maps,
    ShotBuffers,
    ShotStages,
)

Blocks = dict[str, tuple[Buffer, int, int]]  # what a pass binds: buffer, offset and size [bytes]
# Shots of so large a share of the emitted power are audited before they are made; where one would make or lose more than this
# share of its own, its patch is split. Most light is shot by few patches: a hall under skylights in coffers gains 5.8 % without.
# A patch of two texels along its edge sees what its texels see.
AUDITED, SOUND, SMALL = 0.005, 0.02, 2


@dataclass(frozen=True)
class Shot:
    """The shooter of one shot: centre [m], unit normal, area [m²], lower corner (x, y) and edge of its patch in the tile pool as
    it is then [texels], and (u, v, u, v) of it in the virtual atlas [texels of level 0]; rows (SHOOTER_ROWS, 4): all of it, see
    shooter.glsl."""

    centre: F64
    normal: F64
    area: float
    corner: tuple[int, int]
    size: int
    rect: tuple[float, float, float, float]
    rows: F64


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


class AuditTargets:
    """What a shot that is only tried writes: light on texels, and the power on each tile. Gone when the audit is."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap) -> None:
        self._gpu = gpu
        self.light = gpu.texture(lightmap.size, 4, "f4")
        self.powers = gpu.texture((lightmap.columns, lightmap.rows), 1, "f4")
        self.light_target, self.power_target = gpu.target(self.light), gpu.target(self.powers)

    def __enter__(self) -> AuditTargets:
        return self

    def __exit__(self, *_: object) -> None:
        self._gpu.release_all(self.light_target, self.power_target, self.light, self.powers)


def powers_of(rows: F64) -> F64:
    """Σ |R A| of shooters (n, SHOOTER_ROWS, 4), summed over RGB [stored units · solver area]."""
    return np.asarray(rows[:, 0, 3] * np.abs(rows[:, 5, :3]).sum(-1))


def edges_of(rows: F64) -> NDArray[np.int64]:
    """Edges of their patches [texels], 0 for no shot."""
    return np.abs(rows[..., 5, 3]).astype(np.int64)


def rows_of(size: tuple[int, int], band: int, bands: int) -> tuple[int, int, int, int] | None:
    """One of so many bands of a target of this size as a scissor (x, y, width, height) [px]; None for all of it."""
    width, height = size
    lower, upper = (height * nth // bands for nth in (band, band + 1))
    return None if bands == 1 else (0, lower, width, upper - lower)


class ShotPasses(ABC):
    """What a shot is made of. Whoever shoots owns the lightmap's light, sets these and says when."""

    gpu: Gpu
    lightmap: Lightmap
    options: ShootingOptions
    buffers: ShotBuffers
    stages: ShotStages
    _audits: bool  # whether batches are still strong enough to be audited
    _emitted: F64  # RGB [W]
    _albedo: tuple[float, ...]  # mean, RGB
    _area: float  # of all texels, solver space

    @property
    @abstractmethod
    def _choice(self) -> ChoiceStages:
        """Among the patches that shoot now."""

    @property
    @abstractmethod
    def _least_power(self) -> float:
        """That is worth a shot [stored units · solver area]."""

    @abstractmethod
    def _finest_of(self, shot: Shot) -> tuple[int, int, int, int]:
        """Its patch, and the finest level of patches there, as buffers.shoot_finer takes them."""

    def _for_groups(self, part: Callable[[int, int], None], shots: int) -> None:
        """Do this part of a step for all its shots, as many at once as there are maps for."""
        for first, some in self.stages.groups(shots):
            part(first, some)

    def _choose(self, shots: int, bands: int) -> Iterator[None]:
        """The strongest patches, those that fail their audit split; in parts. [Coombe03, 3.4]"""
        yield from self._pick(shots, bands)
        while self._audits and (yield from self._fails(shots)):
            yield from self._pick(shots, bands)

    def _pick(self, shots: int, bands: int = 1) -> Generator[None, None, None]:
        """The strongest patches, all texels read in so many bands."""
        for band in range(bands):
            self._add_patches(self._choice, band, bands)
            yield
        self._add_runs(self._choice)
        self._describe(self._choice, shots)

    def _zero(self, shots: int) -> None:
        """r_i -= what is about to be shot, for all of the batch, before the first of them shoots."""
        lightmap, buffers = self.lightmap, self.buffers
        self.stages.zero.draw(
            lightmap.residual_target,
            textures=lightmap.textures(
                "t_position_area", "t_normal_ids", "t_facets", "t_materials", "t_albedo", "t_irradiance"
            )
            | {"t_shooters": buffers.shooters, "t_ambient": buffers.ambient},
            uniforms={"u_size": lightmap.size},
            vertices=4,
            instances=shots,
            blend="keep",
            strip=True,
        )

    def _fails(self, shots: int) -> Generator[None, None, bool]:
        """Whether a chosen shooter would make or lose light and can shoot from finer patches: it will. Only strong ones are worth
        asking, each patch once: after the first batch without any, none is. In parts; waits for the GPU."""
        rows = self._shooter_rows(shots)
        power = powers_of(rows)
        strong = power * self._watt > AUDITED * self._emitted.sum()
        self._audits = bool(strong.any())
        edge = edges_of(rows)
        patches = [(int(x), int(y), int(size)) for x, y, size in zip(rows[:, 3, 3], rows[:, 4, 3], edge, strict=True)]
        sound = self.buffers.sound
        tried = [k for k in np.flatnonzero(strong & (edge > SMALL)).tolist() if patches[k] not in sound]
        if not tried:
            return False
        failed = []
        with AuditTargets(self.gpu, self.lightmap) as targets:
            for shot in tried:
                if abs(sum(self._hand_out(targets, shot, power[shot])) - 1) > SOUND:
                    failed.append(shot)
                else:
                    sound.add(patches[shot])
                yield
        if failed:
            self.buffers.shoot_finer(self._finest_of(self._shot_from_rows(row)) for row in rows[failed])
        return bool(failed)

    def _hand_out(self, targets: AuditTargets, shot: int, power: float) -> tuple[float, float, float]:
        """What would become of a shot of the batch and its power: its shares received, open and black, see Audit. Changes no
        light. Waits for the GPU."""
        targets.light_target.clear()
        self._see(shot, 1)
        self._receive(targets.light_target, shot, 1, blend="add")
        self._look_out(shot, 1)
        area = self.lightmap.textures("t_position_area")
        self.stages.audit.draw(targets.power_target, textures=area | {"t_received": targets.light})
        received = np.frombuffer(targets.powers.read(), np.float32).astype(np.float64).sum()
        left = np.frombuffer(self.stages.maps.open.read(), np.float32).reshape(BATCH, -1, 2)[shot].astype(np.float64)
        return float(received / power), *left.sum(0).tolist()

    def _shooter_rows(self, shots: int) -> F64:
        """(shots, SHOOTER_ROWS, 4), see shooter.glsl. Waits for the GPU."""
        rows = np.frombuffer(self.buffers.shooters.read(), np.float32).reshape(BATCH, -1, 4)
        return rows[:shots, :SHOOTER_ROWS].astype(np.float64)

    def _add_patches(self, choice: ChoiceStages, band: int = 0, bands: int = 1) -> None:
        """What each block of texels holds to be shot, or those in one of so many bands."""
        reads = "t_position_area", "t_normal_ids", "t_materials", "t_albedo", "t_irradiance", "t_residual", "t_leaves"
        choice.add_patches.draw(
            choice.patch_target,
            textures=self.lightmap.textures(*reads)
            | {"t_finer": self.buffers.finer, "t_ambient": self.buffers.ambient},
            scissor=rows_of(choice.patches[0].size, band, bands),
        )

    def _add_runs(self, choice: ChoiceStages) -> None:
        """The strongest patch of each run of squares, and the power of all."""
        patches, unshot, lit = choice.patches
        choice.begin.draw(
            choice.candidate_target,
            textures={"t_patches": patches, "t_unshot": unshot, "t_lit": lit},
        )
        candidates, unshot = choice.candidates
        choice.add_runs.draw(
            self.buffers.run_target,
            textures={"t_candidates": candidates, "t_unshot": unshot},
            uniforms={"u_runs": self.buffers.runs.width, "u_slots": self.lightmap.pool.slots_in_use},
        )

    def _describe(self, choice: ChoiceStages, shots: int) -> None:
        """Write the shooters of the batch from the strongest patches of the runs."""
        choice.choose.draw(
            self.buffers.shooter_target,
            textures=self.lightmap.textures(
                "t_position_area", "t_normal_ids", "t_irradiance", "t_residual", "t_facets", "t_leaves"
            )
            | self.lightmap.textures("t_materials", "t_albedo")
            | {"t_runs": self.buffers.runs, "t_ambient": self.buffers.ambient, "t_finer": self.buffers.finer},
            uniforms={"u_least": self._least_power},
            viewport=(0, 0, SHOOTER_ROWS, shots),
        )
        self.buffers.shooter_target.read_into(self.buffers.shooter_blocks, components=4, dtype="f4")

    def _see(self, first: int, shots: int, maps: Maps | None = None, shooters: Blocks | None = None) -> None:
        """Item buffer and depth from so many shooters of the batch, all views in one draw; or of others, into other maps.
        [Coombe03, 3.2; Cohen85]"""
        maps, shooters = maps or self.stages.maps, shooters or self._shooter_blocks
        used = None if shots == maps.count else (0, 0, maps.items.width, shots * maps.map_size[1])
        maps.target.clear(OPEN, depth=1.0, viewport=used)
        projection, occluders = self.stages.projection, self.buffers.occluders
        casters = projection.casters(occluders, self.stages.resolution)
        self.stages.see.draw(
            maps.target,
            textures=casters.textures,
            uniforms={"u_maps": maps.count, "u_first": first},
            blocks=shooters,
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
            blocks=shooters,
            vertices=occluders.count,
            instances=shots,
            points=True,
            depth=True,
        )

    def _light(self, first: int, shots: int, band: int = 0, bands: int = 1) -> None:
        """Receive into the lightmap, or into one of so many bands."""
        rows = rows_of(self.lightmap.size, band, bands)
        self._receive(self.lightmap.light_target, first, shots, blend="add", rows=rows)

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
        shaped = lightmap.textures("t_position_area", "t_normal_ids", "t_facets")
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
    def _shooter_blocks(self) -> Blocks:
        return {"ShooterBlock": (self.buffers.shooter_blocks, 0, BATCH * BLOCK_BYTES)}

    def _shooter_alone(self, shot: Shot) -> Blocks:
        """One shooter, in whatever batch it shot."""
        rows = np.zeros((BLOCK_ROWS, 4), np.float32)
        rows[: len(shot.rows)] = shot.rows
        self.buffers.inspected_block.write(rows.tobytes())
        return {"ShooterBlock": (self.buffers.inspected_block, 0, BATCH * BLOCK_BYTES)}

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
        """Enter in the ledger what the batch shot and sent out of the scene."""
        self.stages.enter.draw(
            self.buffers.ledger_target,
            textures={"t_open": self.stages.maps.open, "t_shooters": self.buffers.shooters},
            uniforms={"u_blocks": self.stages.maps.open_size[1]},
            blend="add",
            viewport=(0, 0, shots, LEDGER_ROWS),
        )
        self._expect(shots)

    def _expect(self, shots: int = 0) -> None:
        """See what all that is unshot after so many shots will make come back: shown; shot ahead where storage can owe light."""
        shown, ahead = self.lightmap.ambient_target, self.buffers.ambient_target
        for target in [shown] * self.options.ambient + [ahead] * (self.lightmap.storage != "fixed8"):
            self.stages.expect.draw(
                target,
                textures={"t_unshot": self.buffers.unshot, "t_ledger": self.buffers.ledger}
                | {"t_shooters": self.buffers.shooters},
                uniforms={"u_shots": shots, "u_albedo": self._albedo, "u_area": self._area},
            )

    def _shot_from_rows(self, rows: F64) -> Shot:
        space, corner, edge = self.lightmap.space, (int(rows[3, 3]), int(rows[4, 3])), int(edges_of(rows))
        area = float(rows[0, 3]) * space.scale**2
        rect = self.lightmap.pool.atlas_rect(corner, edge)
        return Shot(space.world_from_local(rows[2, :3]), rows[1, :3], area, corner, edge, rect, rows[:SHOOTER_ROWS])

    @property
    def _watt(self) -> float:
        """Watts in one stored unit of power: lightmap unit [W/m²] times solver area."""
        return self.lightmap.unit * self.lightmap.space.scale**2

    def _count_vanished(self, shot: Shot) -> int:
        """Triangles that it sees, but between the samples of its map. Waits for the GPU."""
        texture = self.gpu.texture((1, 1), 1, "f4")
        target = self.gpu.target(texture)
        target.clear()
        self.stages.count_small.draw(
            target,
            textures={"t_triangles": self.buffers.occluders.texture},
            uniforms={"u_maps": 1, "u_first": 0},
            blocks=self._shooter_alone(shot),
            vertices=self.buffers.occluders.count,
            points=True,
            blend="add",
        )
        count = int(np.frombuffer(texture.read(), np.float32)[0])
        self.gpu.release_all(target, texture)
        return count
