"""How finely surfaces are cut into texels."""

from __future__ import annotations

from dataclasses import dataclass

from app.atlas.charts import DEFAULT_TILE, TILES
from app.options import Options, option

MAX_TEXELS = 16_000_000


@dataclass(frozen=True)
class AtlasOptions(Options):
    density: float | None = option(
        None,
        "texels per metre; unset: from --texels",
        unit="texels/m",
        minimum=1e-9,
        maximum=1e9,
        logarithmic=True,
        tip="Texels along a metre of surface, instead of a number of texels in all: the same sharpness in scenes of "
        "any size. Twice as many are four times the texels",
    )
    texels: int | None = option(
        None,
        "texels in all; unset: chosen from the scene",
        minimum=1,
        maximum=MAX_TEXELS,
        logarithmic=True,
        tip="Each texel holds its own light. More of them make shadows sharper and light beside small things right; "
        "memory and the time of a shot or ray grow with them",
        term="elements",
        off=lambda options: None if options.density is None else "Density says how many there are",
    )
    tile: int = option(
        DEFAULT_TILE,
        "texels along the edge of a leaf: small leaves follow the light more closely, large ones take less bookkeeping",
        choices=TILES,
        tip="Texels along the edge of a quadtree's leaf. Small leaves follow shadow edges more closely, so that fewer "
        "texels do; large ones take less bookkeeping",
        term="leaf size",
    )
