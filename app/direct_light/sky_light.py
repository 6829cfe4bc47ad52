"""Direct light of the sky: shadow rays to where no surface is, chosen by the cosine and by the sky's own light [Veach95].

    H = U(n) Σ_k w_k V_k / Σ_k w_k,    w_k = L(ω_k) cos θ_k / p(ω_k),    p = c cos θ / π + (1 - c) p_sky(ω)

With U, what the normal would receive unoccluded, beside it there is noise only where something stands before the sky.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.direct_light.sky_map import SkyMap, irradiance_table
from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import upload
from app.lightmap.tile_pool import Moves
from app.scene.sky import Sky

BY_COSINE = 0.5  # share of directions that are chosen by the cosine alone; all under a sky that is even


@dataclass
class SkyLit:
    """What is known of the light of the sky. seen: Σ w V, RGB, and Σ over passes of V². all: Σ w. passes: of each slot."""

    sky: Sky
    map: SkyMap
    unoccluded: Texture
    seen: Texture
    all: Texture
    target: Framebuffer
    stream: int
    passes: NDArray[np.int64]
    passes_table: Texture

    def release(self, gpu: Gpu) -> None:
        self.map.release()
        gpu.release_all(self.target, self.seen, self.all, self.unoccluded, self.passes_table)


class SkyLight:
    """Programs, and what they read, for the sky's light on one lightmap."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, rays: dict[str, object], a_pass: int) -> None:
        """rays: defines of visibility/rays.glsl; a_pass: shadow rays in one."""
        self._gpu, self._lightmap = gpu, lightmap
        reads = lightmap.defines("MATERIAL_BITS", "TILE")
        self.shoot = Pass(gpu, "direct_light/sky_rays", defines={"PASS": a_pass} | reads | rays, vertex="common/rects")
        self.add = Pass(
            gpu, "direct_light/sky_light", defines=lightmap.defines("MATERIAL_BITS", "TILE"), vertex="common/rects"
        )

    def lit(self, sky: Sky, stream: int, passes_table: Texture) -> SkyLit:
        """Of another sky, nothing of which is known yet."""
        gpu, size = self._gpu, self._lightmap.size
        seen, all_ = gpu.texture(size, 4, "f4"), gpu.texture(size, 4, "f4")
        target = gpu.target(seen, all_)
        target.clear()
        unoccluded = upload(gpu, irradiance_table(sky))
        unoccluded.filter = (gpu.ctx.LINEAR, gpu.ctx.LINEAR)
        passes = np.zeros(self._lightmap.pool.tiles, np.int64)
        return SkyLit(sky, SkyMap(gpu, sky), unoccluded, seen, all_, target, stream, passes, passes_table)

    def reads(self, lit: SkyLit) -> tuple[dict[str, Texture], dict[str, Any]]:
        """Textures and uniforms of ``shoot``, besides origins and rays."""
        share = 1.0 if lit.map.even else BY_COSINE
        return lit.map.textures | {"t_passes": lit.passes_table}, {"u_stream": lit.stream, "u_by_cosine": share}

    def sums(self, lit: SkyLit, normals: Texture) -> tuple[dict[str, Texture], dict[str, Any]]:
        """Textures and uniforms of ``add``."""
        textures = {"t_seen": lit.seen, "t_all": lit.all, "t_unoccluded": lit.unoccluded}
        scale = lit.sky.scale / self._lightmap.unit
        return (
            textures | {"t_passes": lit.passes_table, "t_origin_normal": normals},
            {"u_scale": tuple(scale.tolist()), "u_size": self._lightmap.size},
        )

    def resized(self, lit: SkyLit, moves: Moves) -> None:
        """The tile pool has got another number of slots."""
        self._gpu.release_all(lit.target)
        lit.seen, lit.all = self._lightmap.moved(lit.seen, moves), self._lightmap.moved(lit.all, moves)
        lit.target = self._gpu.target(lit.seen, lit.all)


__all__ = ["SkyLight", "SkyLit"]
