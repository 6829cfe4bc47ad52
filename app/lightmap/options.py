"""These options say how light is held on texels: whether quadtrees refine them, where, and in which format."""

from __future__ import annotations

from dataclasses import dataclass

from app.lightmap.quadtree import MAX_DEPTH
from app.options import Options, only_with, option

STORAGE = {"rgba32f": "f4", "rgba16f": "f2", "fixed8": "f1"}  # name: moderngl dtype
CRITERIA = ("gradient", "shadow")
UNIFORM = "texels are uniform; Adaptive turns quadtrees on"
QUADTREE = ("depth", "criterion", "gradient", "shadow", "budget")  # shown and heeded only where ``adaptive``


@dataclass(frozen=True)
class LightmapOptions(Options):
    """``adaptive`` asks for another lightmap and ``storage`` for another start; the rest is heeded at once."""

    adaptive: bool = option(
        False,
        "texture quadtrees that follow the light; --texels and --density are then those of the roots",
        tip="Texels become finer by themselves where light changes, at the edges of shadows, and stay coarse "
        "elsewhere. It begins with few texels, and takes longer for each of them",
        term="texture quadtrees",
    )
    depth: int = option(
        3,
        "finest level of quadtree leaves, each half the texel of the one above",
        minimum=0,
        maximum=MAX_DEPTH,
        tip="How often a texel may be halved: each level makes shadow edges twice as sharp, and may take four times "
        "the texels there",
        term="levels of the quadtree",
        off=only_with("adaptive", (True,), UNIFORM),
    )
    criterion: str = option(
        "gradient",
        "a leaf splits where the light's gradient jumps, or where light and shadow mix",
        choices=CRITERIA,
        tip="Where texels are refined: gradient, where light bends between neighbours; shadow, where light and shadow "
        "meet in a leaf",
        off=only_with("adaptive", (True,), UNIFORM),
    )
    gradient: float = option(
        0.5,
        "jump of irradiance between texels that splits a leaf, over the scene's mean",
        minimum=1e-4,
        maximum=10,
        logarithmic=True,
        tip="By how much light must bend between neighbouring texels for a leaf to split, of the scene's mean light. "
        "Less refines more places, also fainter shadows, and takes more texels and time",
        term="threshold of the gradient",
        off=lambda options: _not_of(options, "gradient"),
    )
    shadow: float = option(
        0.02,
        "share of a leaf's texels in shadow, or in light, that splits it",
        minimum=0,
        maximum=0.5,
        tip="A leaf splits where at least this share of its texels lies in shadow, and as much in light. Less follows "
        "edges more closely, and takes more texels",
        off=lambda options: _not_of(options, "shadow"),
    )
    budget: int = option(
        2_000_000,
        "texels that quadtree leaves may hold in all",
        minimum=65_536,
        maximum=16_000_000,
        logarithmic=True,
        tip="Texels that there may be in all: leaves stop to split there. More take more memory",
        off=only_with("adaptive", (True,), UNIFORM),
    )
    storage: str = option(
        "rgba32f",
        "format that holds irradiance and residual",
        choices=tuple(STORAGE),
        tip="In which numbers light is kept: rgba32f is exact; rgba16f takes half the memory and loses faint light of "
        "late shots; fixed8 is what old graphics cards had, and bands. Another one begins again",
        term="precision of the lightmap",
    )


def _not_of(options: LightmapOptions, criterion: str) -> str | None:
    """Why a threshold of that criterion has no effect."""
    if not options.adaptive:
        return UNIFORM
    return None if options.criterion == criterion else f"leaves split by {options.criterion}, see Criterion"
