"""How a bake is written: the knobs of its files."""

from __future__ import annotations

from dataclasses import dataclass

from app.options import Options, option


@dataclass(frozen=True)
class BakeOptions(Options):
    moz_lightmap: bool = option(
        False, "name the lightmap in scene.glb by MOZ_lightmap, too, which readers that parse all images may refuse"
    )
