"""The knobs of texel pairs: those of RTRad [Kahl22], and which of them exclude each other."""

from __future__ import annotations

from dataclasses import dataclass

from app.errors import UserError
from app.options import Options, only_with, option

SENDERS = ("all", "stride", "monte-carlo", "mipmapped", "quadtree", "directional")
OCCLUSIONS = ("rays", "voxels", "hemicube")
WINDOWS = (1, 2, 4, 8, 16)  # texels: powers of two are whole parts of a tile
BALANCED = 128  # windows along the edge of a square lightmap [Kahl22, conclusions]
NOT_KEPT = {
    "monte-carlo": "the pairs are others in each bounce",
    "quadtree": "nodes change with the light",
    "directional": "a direction is no pair",
}
KEPT_TEXELS = 256**2  # most, whose pairs may be kept: a bit for each two is 256 MiB


def _why_not_kept(options: PairsOptions) -> str | None:
    """Why it cannot be kept whether pairs see each other; None while it is kept, so that it can be turned off."""
    if options.keep_pairs:
        return None
    if options.senders in NOT_KEPT:
        return f"Senders: {options.senders}: {NOT_KEPT[options.senders]}"
    return "Occlusion: hemicube: a bit holds no part of a view" if options.occlusion == "hemicube" else None


@dataclass(frozen=True)
class PairsOptions(Options):
    """All act on the next bounce; the light that is there stays."""

    senders: str = option(
        "monte-carlo",
        "what a texel gathers from: all texels; the middle one of each window; one of it by chance; its mean; nodes of a "
        "quadtree, at most as large as it; or what directions meet",
        choices=SENDERS,
        tip="What a texel gathers from: all texels, exact and slow; the middle one of each window, one of it by "
        "chance, or its mean, faster and rougher; nodes of a quadtree; or what directions meet",
    )
    window: int | None = option(
        None,
        f"edge of a window, at most a leaf tile; unset: as many as leave {BALANCED}² windows",
        unit="texels",
        choices=WINDOWS,
        tip="Edge of the square of texels that one of them stands for. Twice as large is four times as fast, and "
        "rougher",
        off=lambda options: None if options.windowed else f"Senders: {options.senders} has no windows",
    )
    occlusion: str = option(
        "rays",
        "how two texels find whether they see each other",
        choices=OCCLUSIONS,
        tip="How two texels find whether they see each other: rays, exactly; voxels, by a coarse grid, which leaks "
        "light; hemicube, by a map of each sender",
    )
    voxels: int = option(
        64,
        "cells along the edge of the grid (voxels)",
        choices=(32, 64, 128, 256),
        tip="Cells along the edge of the grid: more of them leak less light, and take longer",
        off=only_with("occlusion", ("voxels",), "there is no grid; Occlusion: voxels has one"),
    )
    directions: int = option(
        1024,
        "the same around every normal (directional)",
        minimum=1,
        maximum=65_536,
        logarithmic=True,
        tip="Directions that every texel looks into: more of them have fewer bands, and take longer",
        off=only_with(
            "senders", ("directional",), "texels gather from texels; Senders: directional looks into directions"
        ),
    )
    merge: float = option(
        0.05,
        "texels merge into a node that differ by less: half of light, over its mean, plus normal (quadtree)",
        minimum=0.001,
        maximum=0.5,
        logarithmic=True,
        tip="Texels that differ by less than this are gathered from as one. More is faster, and rougher",
        off=only_with("senders", ("quadtree",), "there are no nodes; Senders: quadtree has them"),
    )
    keep_pairs: bool = option(
        False,
        f"keep a bit for each two texels, whether they see each other; at most {KEPT_TEXELS:,} texels",
        tip="Keeps whether each two texels see each other, so that later bounces need not ask: fast, for few texels, "
        "and much memory",
        term="visibility cache",
        off=_why_not_kept,
    )
    change: float = option(
        0.01,
        "converged when a bounce changes what tiles receive by so much of all",
        minimum=1e-5,
        maximum=1,
        logarithmic=True,
        label="Change at most",
        tip="The solve has converged once a bounce changes the light by no more than this share of all. Less takes "
        "more bounces",
    )

    @property
    def windowed(self) -> bool:
        """Whether a window makes a difference."""
        return self.senders not in ("all", "directional")


def check(options: PairsOptions, texels: int) -> None:
    """Raise UserError for what cannot go together, on so many texels."""
    senders, occlusion = f"--senders {options.senders}", f"--occlusion {options.occlusion}"
    if options.senders == "directional" and options.occlusion != "rays":
        raise UserError(f"{senders} with {occlusion}: only rays find what they meet")
    if options.senders == "monte-carlo" and options.occlusion == "hemicube":
        raise UserError(
            f"{senders} with {occlusion}: a map is drawn for a sender that all texels share; use rays or voxels"
        )
    if not options.keep_pairs:
        return
    if options.senders in NOT_KEPT:
        raise UserError(f"--keep-pairs with {senders}: {NOT_KEPT[options.senders]}; use all, stride or mipmapped")
    if options.occlusion == "hemicube":
        raise UserError(f"--keep-pairs with {occlusion}: a bit holds no part of a view; use rays or voxels")
    if texels > KEPT_TEXELS:
        size = texels**2 / 16 / 2**20
        raise UserError(
            f"--keep-pairs: {texels:,} texels would take {size:,.0f} MiB; at most {KEPT_TEXELS:,} texels can be kept"
        )
