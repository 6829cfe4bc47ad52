"""An edit of emission or albedo keeps the light that is there, and lets the difference be shot, negative too [Chen90]."""

from __future__ import annotations

import numpy as np

from app.gpu import Framebuffer, Gpu, Pass
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import upload
from app.scene.model import F64, Material
from app.solvers.shooting.records import SHOOTER

HALF_HEADROOM = 64.0  # of 65504, the largest half float: H may be many times the largest exitance


class MaterialEdits:
    """The passes that an edit takes."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap) -> None:
        self._gpu, self._lightmap = gpu, lightmap
        reads = lightmap.defines("MATERIAL_BITS", "ALBEDO_TEXTURE", "EMISSION_TEXTURE")
        self._edit = Pass(gpu, "solvers/shooting/edit", defines=reads)
        self._scale = Pass(gpu, "solvers/shooting/scale")

    def enter(self, materials: tuple[Material, ...], factor: F64) -> None:
        """Use other albedos and emissions, and enter in r what is to be shot for it: r += ΔE + Δρ·H.

        factor (3,): of the emissions until now, by which the light that is there was scaled."""
        lightmap = self._lightmap
        table = lightmap.pool.material_table(lightmap.scene)
        table[:, 1, :3] *= factor
        before = upload(self._gpu, table)
        lightmap.set_materials(materials)
        reads = "t_position_area", "t_normal_ids", "t_materials", "t_irradiance", "t_albedo", "t_emission"
        self._edit.draw(
            lightmap.residual_target,
            textures={"t_before": before} | lightmap.textures(*reads),
            uniforms={"u_unit": lightmap.unit},
            blend="add",
        )
        self._gpu.release_all(before)

    def scale_light(self, factor: F64) -> None:
        """Multiply H and r by a factor (3,) for each channel; their a by its mean."""
        self._draw(self._lightmap.light_target, factor, float(factor.mean()))

    def scale(self, target: Framebuffer, factor: F64) -> None:
        """Multiply what a target holds of light by a factor (3,), but for its a."""
        self._draw(target, factor, 1.0)

    def scale_shooters(self, target: Framebuffer, factor: F64) -> None:
        """Multiply the exitance of SHOOTERs, one in each row of a target."""
        viewport = (SHOOTER.field("exitance").row, 0, 1, target.size[1])
        self._scale.draw(target, uniforms={"u_factor": (*factor, 1.0)}, blend="multiply", viewport=viewport)

    def _draw(self, target: Framebuffer, factor: F64, a: float) -> None:
        self._scale.draw(target, uniforms={"u_factor": (*factor, a)}, blend="multiply")


def needs_restart(lightmap: Lightmap, materials: tuple[Material, ...]) -> bool:
    """Whether the storage cannot hold the difference, or nothing is left to emit."""
    overflows = lightmap.storage == "rgba16f" and exceeds_half(lightmap, materials)
    return overflows or lightmap.storage == "fixed8" or not lightmap.scene.with_materials(materials).emits


def exceeds_half(lightmap: Lightmap, materials: tuple[Material, ...]) -> bool:
    """Whether these emit so much more than what H and r are stored relative to that half floats would soon end."""
    return np.pi * max((max(m.emission) for m in materials), default=0.0) > HALF_HEADROOM * lightmap.unit
