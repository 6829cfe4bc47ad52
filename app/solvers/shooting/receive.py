"""Receiving finds what every texel sees of some shots, F_ji V_ji [Coombe03, eq. 1], for deliver.py."""

from __future__ import annotations

from collections.abc import Mapping

from app.gpu import Framebuffer, Gpu, Mesh, Pass
from app.lightmap.lightmap import Lightmap
from app.solvers.shooting.choose import band_of
from app.solvers.shooting.deliver import Delivery
from app.solvers.shooting.options import VISIBILITIES, ShootingOptions
from app.solvers.shooting.receivers import Receivers
from app.solvers.shooting.records import IN_BLOCKS, RECORDS
from app.solvers.shooting.see import See
from app.solvers.shooting.shooters import ShooterBatch


class Receive:
    """The receiver passes for one choice of options.

    passes: by whether the receivers are planar, and whether it is those near to the shooter. at_once: the same, that leave light.
    """

    def __init__(
        self,
        gpu: Gpu,
        lightmap: Lightmap,
        receivers: Receivers,
        delivery: Delivery,
        shooters: ShooterBatch,
        see: See,
        options: ShootingOptions,
    ) -> None:
        self._lightmap, self._receivers, self._shooters, self._see = lightmap, receivers, shooters, see
        self._delivery = delivery
        kinds = (True, False) if lightmap.pool.adaptive else tuple(receivers.meshes)
        self.passes, self.at_once = (
            {(p, n): self._make(gpu, options, p, n, at_once) for p in kinds for n in (False, True) if used}
            for at_once, used in ((False, True), (True, lightmap.pool.adaptive))
        )

    def _make(self, gpu: Gpu, options: ShootingOptions, planar: bool, near: bool, at_once: bool) -> Pass:
        defines: dict[str, object] = {
            "PLANAR": planar,
            "NEAR_FIELD": near,
            "RESOLUTION": self._see.resolution,
            "DISC": options.form_factor == "disc",
            "DISC_SUBDIVISION": options.discs,
            "AT_ONCE": at_once,
            "SHADOWS": self._lightmap.pool.adaptive,
            "VISIBILITY": VISIBILITIES.index(options.visibility),
        }
        return Pass(
            gpu,
            "solvers/shooting/receive",
            defines=defines | IN_BLOCKS | self._lightmap.defines("MATERIAL_BITS"),
            slots=RECORDS | self._see.slots,
            label=f"shooting/{'replay' if at_once else 'receive'} {'planar' if planar else 'general'} "
            f"{'near' if near else 'far'}",
        )

    def draw(self, first: int, shots: int, band: int = 0, bands: int = 1) -> None:
        """What all texels see of these shots of the batch, or those in one of so many bands."""
        self._draw(
            self.passes, self._delivery.target, self._receivers.meshes, first, shots, (band, bands), in_place=True
        )

    def light(
        self, target: Framebuffer, meshes: Mapping[bool, Mesh], first: int, shots: int, band: int = 0, bands: int = 1
    ) -> None:
        """The light of earlier shots, unscaled, added to what a target of texels holds, of these receivers. Patches need not be
        where they shot from any more."""
        self._draw(self.at_once, target, meshes, first, shots, (band, bands), in_place=False)

    def _draw(
        self,
        passes: Mapping[tuple[bool, bool], Pass],
        target: Framebuffer,
        meshes: Mapping[bool, Mesh],
        first: int,
        shots: int,
        band: tuple[int, int],
        *,
        in_place: bool,
    ) -> None:
        lightmap = self._lightmap
        general = lightmap.textures("t_position_area", "t_normal_ids", "t_facets")
        for (planar, _), receive in passes.items():
            if planar not in meshes:
                continue
            textures = self._see.textures
            receive.draw(
                target,
                textures=textures if planar else textures | general,
                uniforms={"u_size": lightmap.size, "u_first": first, "u_shots": shots}
                | ({} if planar else {"u_own": int(in_place)}),
                blocks=self._shooters.blocks,
                mesh=meshes[planar],
                blend="add",
                scissor=band_of(lightmap.size, *band),
            )
