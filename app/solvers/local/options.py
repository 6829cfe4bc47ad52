"""The knobs of the local matrix."""

from __future__ import annotations

from dataclasses import dataclass

from app.options import Options, option

BOUNCES = ("inverse", "series", "iterate")
OUTSIDE = ("cascade", "constant")


@dataclass(frozen=True)
class LocalOptions(Options):
    """``bounces``, ``patches``, ``patch_level``, ``rays`` and ``bits`` begin again; the others act from the next frame on."""

    bounces: str = option(
        "inverse",
        "how light is reflected within the local set: inverse, the exact matrix of all reflections; series, that of the "
        "paper, which is cut short; iterate, form factors alone, a quarter of the memory, and a few bounces in each frame",
        choices=BOUNCES,
    )
    outside: str = option(
        "cascade",
        "light from outside of the local set: cascade, the farther away, the larger are its patches, up to the whole world; "
        "constant, the mean of what is inside",
        choices=OUTSIDE,
    )
    patches: int | None = option(
        None,
        "patches of the local set, in steps of 64; left out, as many as memory allows, 1024 at most where a CPU rasterises, "
        "else 4096",
        minimum=16,
        maximum=16_384,
        logarithmic=True,
    )
    swaps: int = option(
        8,
        "patches that enter or leave the local set between two pictures, at most",
        minimum=1,
        maximum=64,
        logarithmic=True,
    )
    patch_level: int | None = option(
        None,
        "patches are squares of 2^n texels along each edge; left out, the finest up to 3 with which the whole scene is in the "
        "local set, else 0",
        minimum=0,
        maximum=4,
    )
    rays: int = option(
        256, "rays of each patch that find its form factors", minimum=16, maximum=1024, multiple=16, logarithmic=True
    )
    shadow_rays: int = option(
        64, "from each texel to each set of lamps, in the end", minimum=4, maximum=1024, multiple=4, logarithmic=True
    )
    bits: int = option(16, "of each number in the matrix", choices=(16, 32))
    matrix_memory: int = option(160, "memory for the matrix", unit="MiB", minimum=1, maximum=65_536, logarithmic=True)
    row_memory: int = option(
        512,
        "memory for rows of form factors; those of patches that are far away go first",
        unit="MiB",
        minimum=1,
        maximum=65_536,
        logarithmic=True,
    )
    missing: float = option(
        1e-3,
        "converged when so much of the local set, and of shadow rays, is still to come",
        minimum=0,
        maximum=1,
        logarithmic=True,
    )
