"""The ambient term is the irradiance that all unshot light will make on average [Cohen88, section 5].

It is shown and baked with H, with the light that is still to come from outside. Where the storage can hold a residual below zero
that of patches is overshot [Feda92]: a patch shoots, with its residual, what it will reflect of the ambient light.
"""

from __future__ import annotations

from app.gpu import Gpu, Pass
from app.lightmap.lightmap import Lightmap
from app.solvers.shooting.choose import Bins
from app.solvers.shooting.ledger import Ledger
from app.solvers.shooting.records import RECORDS
from app.solvers.shooting.shooters import ShooterBatch


class Ambient:
    """Whoever makes it releases it. overshoot: one texel, what is overshot, see ambient.frag.glsl."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, shooters: ShooterBatch, ledger: Ledger) -> None:
        self._gpu, self._lightmap, self._shooters, self._ledger = gpu, lightmap, shooters, ledger
        self.overshoot = gpu.texture((1, 1), 4, "f4")
        self.overshoot_target = gpu.target(self.overshoot)
        self._estimate = Pass(gpu, "solvers/shooting/ambient", slots=RECORDS)

    def update(self, bins: Bins, shots: int = 0, *, shown: bool, to_each_given: float) -> None:
        """Estimate it from what is unshot in the bins, and from so many shots of a batch since. shown: also in pictures and
        bakes. to_each_given: see Outside."""
        ledger = self._ledger
        outside = tuple((ledger.to_come / ledger.watt).tolist())
        both = [(False, self._lightmap.ambient_target, outside, to_each_given)] * shown
        both += [(True, self.overshoot_target, (0.0, 0.0, 0.0), 0.0)] * (self._lightmap.storage != "fixed8")
        for overshoots, target, to_come, ratio in both:
            self._estimate.draw(
                target,
                textures={
                    "t_unshot": bins.unshot,
                    "t_ledger": ledger.texture,
                    "t_shooters": self._shooters.texture,
                },
                uniforms={
                    "u_shots": shots,
                    "u_albedo": ledger.albedo,
                    "u_area": ledger.area,
                    "u_overshoots": int(overshoots),
                    "u_outside": to_come,
                    "u_to_each_given": ratio,
                },
            )

    def hide(self) -> None:
        """Show none."""
        self._lightmap.ambient_target.clear()

    def clear(self) -> None:
        """Overshoot none."""
        self.overshoot_target.clear()

    def release(self) -> None:
        self._gpu.release_all(self.overshoot_target, self.overshoot)
