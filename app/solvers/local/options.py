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
        tip="How light is reflected near the eye: inverse, all reflections, exactly; series, as the paper has it, cut "
        "short and a little dark; iterate, a few bounces in each frame, with a quarter of the memory",
        term="global form factor matrix",
    )
    outside: str = option(
        "cascade",
        "light from outside of the local set: cascade, the farther away, the larger are its patches, up to the whole world; "
        "constant, the mean of what is inside",
        choices=OUTSIDE,
        tip="Light from farther away than the patches near the eye: cascade, from coarser and coarser patches up to "
        "the end of the world; constant, a mean as in the paper, which leaks into dark places",
    )
    patches: int | None = option(
        None,
        "patches of the local set, in steps of 64; left out, as many as memory allows, 1024 at most where a CPU rasterises, "
        "else 4096",
        minimum=16,
        maximum=16_384,
        logarithmic=True,
        tip="Patches near the eye whose light is solved in detail. More of them reach farther; memory grows with "
        "their square",
        term="size of the local set",
    )
    swaps: int = option(
        8,
        "patches that enter or leave the local set between two pictures, at most",
        minimum=1,
        maximum=64,
        logarithmic=True,
        tip="Patches that enter or leave between two pictures, at most. More of them follow a fast walk, and make "
        "frames longer",
    )
    patch_level: int | None = option(
        None,
        "patches are squares of 2^n texels along each edge; left out, the finest up to 3 with which the whole scene is in the "
        "local set, else 0",
        minimum=0,
        maximum=4,
        tip="Patches are squares of 1, 2, 4, 8 or 16 texels along the edge, for 0 to 4. Small ones show indirect "
        "light in more detail, and reach less far",
    )
    rays: int = option(
        256,
        "rays of each patch that find its form factors",
        minimum=16,
        maximum=1024,
        multiple=16,
        logarithmic=True,
        tip="Rays of each patch that find what it sees. More of them make indirect light smoother, and patches slower "
        "to enter",
        term="form factors",
    )
    shadow_rays: int = option(
        64,
        "from each texel to each set of lamps, in the end",
        minimum=4,
        maximum=1024,
        multiple=4,
        logarithmic=True,
        tip="Rays from each texel to the lamps. More of them make the edges of shadows smoother, and take longer",
    )
    bits: int = option(
        16,
        "of each number in the matrix",
        choices=(16, 32),
        tip="Bits of each number in the matrix: 16 take half the memory and lose a little light, more where nearly "
        "all light is reflected",
    )
    matrix_memory: int = option(
        160,
        "memory for the matrix",
        unit="MiB",
        minimum=1,
        maximum=65_536,
        logarithmic=True,
        tip="Memory for the matrix: it bounds the patches that fit",
    )
    row_memory: int = option(
        512,
        "memory for rows of form factors; those of patches that are far away go first",
        unit="MiB",
        minimum=1,
        maximum=65_536,
        logarithmic=True,
        tip="Memory for what patches see, also of those left behind: what was seen before need not be traced again",
    )
    missing: float = option(
        1e-3,
        "converged when so much of the local set, and of shadow rays, is still to come",
        minimum=0,
        maximum=1,
        logarithmic=True,
        label="Missing at most",
        tip="At rest once no more than this share of the patches near the eye, and of shadow rays, is still to come",
    )
