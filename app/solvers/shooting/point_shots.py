"""Point shots light all texels from a point or spot light: each by a map of half of all directions, as a patch has it.

    ΔH_j = I(ω) w(d) cos θ_j / d² V_j,    Δr_j = ρ_j ΔH_j

with no area and no form factor.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence

import numpy as np

from app.direct_light.punctual import light_rows
from app.gpu import Framebuffer, Mesh
from app.scene.sky_directions import axes_of
from app.solvers.shooting.equipment import Equipment
from app.solvers.shooting.ledger import Ledger
from app.solvers.shooting.options import ShootingOptions
from app.solvers.shooting.outside_sources import OutsideShot, share_of_shot
from app.solvers.shooting.receive import Receive
from app.solvers.shooting.records import BATCH, BLOCK_ROWS, SHOOTER
from app.solvers.shooting.see import See


class PointShots:
    """What makes them, for one choice of options. Whoever makes it releases it."""

    def __init__(self, equipment: Equipment, options: ShootingOptions, resolution: int) -> None:
        gpu, lightmap, shooters = equipment.gpu, equipment.lightmap, equipment.shooters
        self._gpu, self._lightmap, self._shooters = gpu, lightmap, shooters
        self._lights = gpu.texture((4, BATCH), 4, "f4")
        self._see = See(gpu, equipment.occluders, shooters, options, resolution, lights=self._lights)
        self._receive = Receive(gpu, lightmap, equipment.receivers, shooters, self._see, options)

    def shoot(self, shots: Sequence[OutsideShot], ledger: Ledger, bands: int) -> Generator[None, None, None]:
        """These, up to a batch, in parts."""
        self._write(shots)
        for first, some in self._see.groups(len(shots)):
            self._see.draw(first, some)
            yield
            for band in range(bands):
                self._receive.draw(first, some, band, bands)
                yield
            self._see.add_escaped(first, some)
        ledger.enter(self._see.maps.escaped, len(shots))

    def replay(
        self, shots: Sequence[OutsideShot], target: Framebuffer, meshes: Mapping[bool, Mesh], bands: int
    ) -> Generator[None, None, None]:
        """Add these once more to a target, on some receivers only, in parts."""
        self._write(shots)
        for first, some in self._see.groups(len(shots)):
            self._see.draw(first, some)
            yield
            for band in range(bands):
                self._receive.draw_into(target, first, some, meshes=meshes, band=band, bands=bands, in_place=False)
                yield

    def _write(self, shots: Sequence[OutsideShot]) -> None:
        """Write these shots as the shooters of the batch. Their axes are so long that all of the scene is nearer than FAR in
        them."""
        space, unit = self._lightmap.space, self._lightmap.unit
        records = np.zeros(BATCH, SHOOTER.dtype)
        for nth, (record, shot) in enumerate(zip(records, shots, strict=False)):
            origin = space.local_from_world(np.array(shot.source.position))
            x, y = axes_of(shot.axis)
            scale = min(2.0 / (1.0 + float(np.linalg.norm(origin))), 1.0)
            record["origin"] = record["centre"] = origin
            record["normal"], record["edge_u"], record["edge_v"] = scale * shot.axis, x, y
            record["area"] = shot.source.solid_angle * share_of_shot(shot.source)
            record["exitance"] = shot.light / (unit * space.scale**2)
            record["patch_x"], record["patch_y"], record["signed_size"] = nth, shot.place, 1
        self._shooters.texture.write(SHOOTER.write(records, BLOCK_ROWS))
        self._shooters.share()
        rows = np.zeros((BATCH, 4, 4), np.float32)
        rows[: len(shots)] = light_rows([shot.source for shot in shots], self._lightmap)
        rows[..., 2, :3] = 1.0  # the shooter has its intensity
        self._lights.write(rows.tobytes())

    def release(self) -> None:
        self._see.release()
        self._gpu.release_all(self._lights)


__all__ = ["PointShots"]
