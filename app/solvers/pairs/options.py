"""The knobs of texel pairs: those of RTRad [Kahl22], and which of them exclude each other."""

from __future__ import annotations

from dataclasses import dataclass

from app.errors import UserError
from app.options import Options, option

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


@dataclass(frozen=True)
class PairsOptions(Options):
    """All act on the next bounce; the light that is there stays."""

    senders: str = option(
        "monte-carlo",
        "what a texel gathers from: all texels; the middle one of each window; one of it by chance; its mean; nodes of a "
        "quadtree, at most as large as it; or what directions meet",
        choices=SENDERS,
    )
    window: int | None = option(
        None,
        f"edge of a window, at most a leaf tile; unset: as many as leave {BALANCED}² windows",
        unit="texels",
        choices=WINDOWS,
    )
    occlusion: str = option("rays", "how two texels find whether they see each other", choices=OCCLUSIONS)
    voxels: int = option(64, "cells along the edge of the grid (voxels)", choices=(32, 64, 128, 256))
    directions: int = option(
        1024, "the same around every normal (directional)", minimum=1, maximum=65_536, logarithmic=True
    )
    merge: float = option(
        0.05,
        "texels merge into a node that differ by less: half of light, over its mean, plus normal (quadtree)",
        minimum=0.001,
        maximum=0.5,
        logarithmic=True,
    )
    keep_pairs: bool = option(
        False, f"keep a bit for each two texels, whether they see each other; at most {KEPT_TEXELS:,} texels"
    )
    change: float = option(
        0.01,
        "converged when a bounce changes what tiles receive by so much of all",
        minimum=1e-5,
        maximum=1,
        logarithmic=True,
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
