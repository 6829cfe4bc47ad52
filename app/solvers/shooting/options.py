"""The knobs of progressive shooting."""

from __future__ import annotations

from dataclasses import dataclass

from app.atlas.lightmap import STORAGE
from app.options import Options, option
from app.projections import PROJECTIONS

MAX_LEVEL = 4  # a patch is a whole tile
FORM_FACTORS = ("polygon", "disc")
VISIBILITIES = ("item-id", "depth", "combined")  # in the order of VISIBILITY in shooting/visible.glsl


@dataclass(frozen=True)
class ShootingOptions(Options):
    """Only ``storage`` restarts the solution when it changes; the rest acts on the next shot."""

    level: int = option(2, "mip level that shoots: patches of 2^level texels squared", minimum=0, maximum=MAX_LEVEL)
    coarsen: bool = option(
        True, "shoot from a level higher once the strongest patch is weak: faint light needs no fine patches"
    )
    residual: float = option(
        1e-3, "converged when this share of the emitted power is unshot", minimum=1e-9, maximum=1, logarithmic=True
    )
    form_factor: str = option(
        "polygon", "closed form over the patch's polygon, or the papers' discs", choices=FORM_FACTORS
    )
    discs: int = option(1, "discs along each edge of a patch (disc form factor)", minimum=1, maximum=8)
    visibility: str = option("combined", "how a texel looks itself up in the visibility map", choices=VISIBILITIES)
    projection: str = option("hemicube", "how the shooter sees the scene", choices=tuple(PROJECTIONS))
    resolution: int = option(
        256, "edge of a full face of the visibility map", unit="px", minimum=64, maximum=2048, multiple=64
    )
    storage: str = option("rgba32f", "format that holds irradiance and residual", choices=tuple(STORAGE))
