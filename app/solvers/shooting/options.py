"""The knobs of progressive shooting."""

from __future__ import annotations

from dataclasses import dataclass

from app.options import Options, option
from app.visibility.projections import PROJECTIONS

MAX_LEVEL = 4  # of the patches that shoot: 16×16 texels
FORM_FACTORS = ("polygon", "disc")
VISIBILITIES = ("item-id", "depth", "combined")  # in the order of VISIBILITY in visibility/visible.glsl


def highest_level(tile: int) -> int:
    """Of patches in leaves of so many texels along the edge: none is larger than its leaf."""
    return min(MAX_LEVEL, tile.bit_length() - 1)


@dataclass(frozen=True)
class ShootingOptions(Options):
    """``ambient`` acts on what is shown, the rest on the next shot: none restarts the solution."""

    level: int | None = option(
        None,
        "mip level that shoots in the end: patches of 2^level texels squared, at most a leaf; unset: 2, or what makes 4096 "
        "patches at most",
        minimum=0,
        maximum=MAX_LEVEL,
    )
    coarsen: bool = option(True, "shoot from larger patches first: as many as show all of the light soon")
    ambient: bool = option(
        True, "show and bake what is unshot as even ambient light (Cohen et al. 1988), at most as much as has arrived"
    )
    residual: float = option(
        1e-3,
        "converged when this share of the emitted power is unshot, and ten times that at most lies unevenly in finest patches",
        minimum=1e-9,
        maximum=1,
        logarithmic=True,
    )
    form_factor: str = option(
        "polygon", "closed form over the patch's polygon, or the papers' discs", choices=FORM_FACTORS
    )
    discs: int = option(1, "discs along each edge of a patch (disc form factor)", minimum=1, maximum=8)
    visibility: str = option("combined", "how a texel looks itself up in the visibility map", choices=VISIBILITIES)
    projection: str = option("hemicube", "how the shooter sees the scene", choices=tuple(PROJECTIONS))
    resolution: int | None = option(
        None,
        "edge of a full face of the visibility map; unset: a sample for each texel as seen from afar, 256 to 512",
        unit="px",
        minimum=64,
        maximum=2048,
        multiple=64,
        logarithmic=True,
    )
