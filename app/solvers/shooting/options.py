"""The knobs of progressive shooting."""

from __future__ import annotations

from dataclasses import dataclass

from app.options import Options, only_with, option
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
        label="Patch level",
        tip="Patches that shoot in the end are squares of 1, 2, 4, 8 or 16 texels along the edge, for 0 to 4. Small "
        "ones cast softer and truer shadows and lose less light beside small things, and take up to four times "
        "the shots for each level",
        term="mip level of the shooter",
    )
    coarsen: bool = option(
        True,
        "shoot from larger patches first: as many as show all of the light soon",
        tip="Large patches shoot first, so that all of the light is there soon, and finer ones correct it. Off: "
        "sharper from the first shot on, and many times the shots until the room is lit",
    )
    ambient: bool = option(
        True,
        "show and bake what is unshot, too, about where it will be: an ambient term (Cohen et al. 1988), gathered by few rays",
        tip="Shows light that is still to come about where it will be, so that the picture looks early as it will in the "
        "end. It takes a few milliseconds of a picture; off, the picture brightens as light arrives",
        term="ambient term",
    )
    residual: float = option(
        1e-3,
        "converged when this share of the emitted power is unshot, and ten times that at most lies unevenly in finest patches",
        minimum=1e-9,
        maximum=1,
        logarithmic=True,
        label="Unshot at most",
        tip="The solve has converged once this share of the emitted light is unshot. Less is brighter in dark corners "
        "and without blotches, and takes more shots",
        term="residual",
    )
    form_factor: str = option(
        "polygon",
        "closed form over the patch's polygon, or the papers' discs",
        choices=FORM_FACTORS,
        tip="How much of a patch's light reaches a texel: polygon is exact; disc, as in the papers, loses light near "
        "the patch",
    )
    discs: int = option(
        1,
        "discs along each edge of a patch (disc form factor)",
        minimum=1,
        maximum=8,
        tip="Discs along each edge of a patch that shoots: more of them lose less light near it, and each shot takes "
        "longer",
        off=only_with("form_factor", ("disc",), "form factors are of polygons; Form factor: disc has discs"),
    )
    visibility: str = option(
        "combined",
        "how a texel looks itself up in the visibility map",
        choices=VISIBILITIES,
        tip="How a texel finds whether it is in shadow: combined by surface and distance; item-id by the surface "
        "alone, which loses light at the edges of triangles; depth by the distance alone",
        term="item buffer, shadow map",
    )
    projection: str = option(
        "hemicube",
        "how the shooter sees the scene",
        choices=tuple(PROJECTIONS),
        tip="How a patch sees the scene: hemicube, by five views, exact and the fastest here; nonlinear, by one "
        "curved view, exact; stereographic, by one view of corners alone, which is off close to the patch",
    )
    resolution: int | None = option(
        None,
        "edge of a full face of the visibility map; unset: a sample for each texel as seen from afar, 256 to 512",
        unit="px",
        minimum=64,
        maximum=2048,
        multiple=64,
        logarithmic=True,
        tip="Pixels along the edge of the map that a patch sees the scene in. More of them find thinner things and "
        "narrower gaps; the time of a shot grows with their square",
        term="hemicube resolution",
    )
