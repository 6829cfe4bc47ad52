"""Receiving adds the light of some shots to H and r of every texel that sees them [Coombe03, eq. 1].

H_j += R_i F_ji V_ji,   r_j += ρ_j R_i F_ji V_ji
"""

from __future__ import annotations

from collections.abc import Mapping

from app.gpu import Framebuffer, Gpu, Mesh, Pass
from app.lightmap.lightmap import Lightmap
from app.solvers.shooting.choose import band_of
from app.solvers.shooting.options import VISIBILITIES, ShootingOptions
from app.solvers.shooting.outside_sources import POINTS, places_edge
from app.solvers.shooting.receivers import Receivers
from app.solvers.shooting.records import IN_BLOCKS, RECORDS
from app.solvers.shooting.see import See
from app.solvers.shooting.shooters import ShooterBatch


class Receive:
    """The receiver passes for one choice of options.

    passes: by whether the receivers are planar, and whether it is those near to the shooter.
    """

    def __init__(
        self,
        gpu: Gpu,
        lightmap: Lightmap,
        receivers: Receivers,
        shooters: ShooterBatch,
        see: See,
        options: ShootingOptions,
    ) -> None:
        self._lightmap, self._receivers, self._shooters, self._see = lightmap, receivers, shooters, see
        self._facets = ("t_facets",) if options.visibility == "combined" else ()
        kinds = (True, False) if lightmap.pool.adaptive else tuple(receivers.meshes)
        fields = (False, True) if see.lights is None else (False,)
        self.passes = {(planar, near): self._make(gpu, options, planar, near) for planar in kinds for near in fields}

    def _make(self, gpu: Gpu, options: ShootingOptions, planar: bool, near: bool) -> Pass:
        defines: dict[str, object] = {
            "PLANAR": planar,
            "RESOLUTION": self._see.resolution,
            "VISIBILITY": VISIBILITIES.index(options.visibility),
        }
        if self._see.lights is not None:
            defines |= {"LIGHT": True, "POINT": True, "MANY_EDGE": places_edge(POINTS, self._lightmap.scene)}
        else:
            defines |= {"DISC": options.form_factor == "disc", "DISC_SUBDIVISION": options.discs, "NEAR_FIELD": near}
        return Pass(
            gpu,
            "solvers/shooting/receive",
            defines=defines | IN_BLOCKS | self._lightmap.defines("MATERIAL_BITS", "ALBEDO_TEXTURE", "TILE"),
            slots=RECORDS | self._see.slots,
            label=f"shooting/receive {'planar' if planar else 'general'} {'near' if near else 'far'}",
        )

    def draw(self, first: int, shots: int, band: int = 0, bands: int = 1) -> None:
        """The light of these shots of the batch on the lightmap, or on one of so many bands of it."""
        self.draw_into(self._lightmap.light_target, first, shots, band=band, bands=bands)

    def draw_into(
        self,
        target: Framebuffer,
        first: int,
        shots: int,
        *,
        meshes: Mapping[bool, Mesh] | None = None,
        band: int = 0,
        bands: int = 1,
        in_place: bool = True,
    ) -> None:
        """The same, added to what another target of texels holds, or on some receivers only.

        in_place: whether patches still are where they shot from, and do not light themselves."""
        lightmap = self._lightmap
        lit = self._see.lights is not None
        general = lightmap.textures("t_position_area", "t_normal_ids", "t_facets", *(("t_leaves",) if lit else ()))
        meshes = self._receivers.meshes if meshes is None else meshes
        for (planar, _), receive in self.passes.items():
            if planar not in meshes:
                continue
            textures = lightmap.textures("t_materials", "t_albedo", *self._facets) | self._see.textures
            receive.draw(
                target,
                textures=textures if planar else textures | general,
                uniforms={"u_size": lightmap.size, "u_first": first, "u_shots": shots}
                | ({} if planar or lit else {"u_own": int(in_place)}),
                blocks=self._shooters.blocks,
                mesh=meshes[planar],
                blend="add",
                scissor=band_of(lightmap.size, band, bands),
            )
