"""These options say how light is held on texels: whether quadtrees refine them, where, and in which format."""

from __future__ import annotations

from dataclasses import dataclass

from app.lightmap.quadtree import MAX_DEPTH
from app.options import Options, option

STORAGE = {"rgba32f": "f4", "rgba16f": "f2", "fixed8": "f1"}  # name: moderngl dtype
CRITERIA = ("gradient", "shadow")
QUADTREE = ("depth", "criterion", "gradient", "shadow", "budget")  # shown and heeded only where ``adaptive``


@dataclass(frozen=True)
class LightmapOptions(Options):
    """``adaptive`` asks for another lightmap and ``storage`` for another start; the rest is heeded at once."""

    adaptive: bool = option(
        False, "texture quadtrees that follow the light; --texels and --density are then those of the roots"
    )
    depth: int = option(
        3, "finest level of quadtree leaves, each half the texel of the one above", minimum=0, maximum=MAX_DEPTH
    )
    criterion: str = option(
        "gradient", "a leaf splits where the light's gradient jumps, or where light and shadow mix", choices=CRITERIA
    )
    gradient: float = option(
        0.5,
        "jump of irradiance between texels that splits a leaf, over the scene's mean",
        minimum=1e-4,
        maximum=10,
        logarithmic=True,
    )
    shadow: float = option(
        0.02, "share of a leaf's texels in shadow, or in light, that splits it", minimum=0, maximum=0.5
    )
    budget: int = option(
        2_000_000, "texels that quadtree leaves may hold in all", minimum=65_536, maximum=16_000_000, logarithmic=True
    )
    storage: str = option("rgba32f", "format that holds irradiance and residual", choices=tuple(STORAGE))
