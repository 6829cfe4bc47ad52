"""How finely surfaces are cut into texels."""

from __future__ import annotations

from dataclasses import dataclass

from app.atlas.charts import DEFAULT_TILE, TILES
from app.options import Options, option

MAX_TEXELS = 16_000_000


@dataclass(frozen=True)
class AtlasOptions(Options):
    density: float | None = option(
        None, "texels per metre; unset: from --texels", unit="1/m", minimum=1e-9, maximum=1e9, logarithmic=True
    )
    texels: int | None = option(
        None, "texels in all; unset: chosen from the scene", minimum=1, maximum=MAX_TEXELS, logarithmic=True
    )
    tile: int = option(
        DEFAULT_TILE,
        "texels along the edge of a leaf: small leaves follow the light more closely, large ones take less bookkeeping",
        choices=TILES,
    )
