"""Direct light of the sky: shadow rays to where no surface is, chosen by the cosine and by the sky's own light [Veach95].

    H = U(n) Σ_k w_k V_k / Σ_k w_k,    w_k = L(ω_k) cos θ_k / p(ω_k),    p = c cos θ / π + (1 - c) p_sky(ω)

With U, what the normal would receive unoccluded, beside it there is noise only where something stands before the sky. The sun is
a set of its own: rays to its disc, U = E cos θ.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.direct_light.sky_map import SkyMap, irradiance_table
from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import upload
from app.lightmap.tile_pool import Moves
from app.scene.sky import SUN_ANGLE, Sky

BY_COSINE = 0.5  # share of directions that are chosen by the cosine alone; all under a sky that is even


@dataclass
class SkyLit:
    """What is known of the light of the sky, or of its sun. seen: Σ w V, RGB, and Σ over passes of V². all: Σ w. map,
    unoccluded: of the sky alone. passes: of each slot."""

    sky: Sky
    map: SkyMap | None
    unoccluded: Texture | None
    seen: Texture
    all: Texture
    target: Framebuffer
    stream: int
    passes: NDArray[np.int64]
    passes_table: Texture

    @property
    def kept(self) -> dict[str, Texture]:
        """What shadow rays have found, by name."""
        return {"seen": self.seen, "all": self.all}

    @property
    def is_sun(self) -> bool:
        return self.map is None

    def knows(self, sky: Sky) -> bool:
        """Whether all that is known holds for another sky as well, but for its scale."""
        return self.sky.sun == sky.sun if self.is_sun else self.sky.same_shape(sky)

    def release(self, gpu: Gpu) -> None:
        gpu.release_all(self.target, self.seen, self.all, self.passes_table)
        if self.map is not None and self.unoccluded is not None:
            self.map.release()
            gpu.release_all(self.unoccluded)


class SkyLight:
    """Programs, and what they read, for the light of sky and sun on one lightmap. gathered: the light of the sky alone as rays
    have gathered it, to be smoothed."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, rays: dict[str, object], a_pass: int) -> None:
        """rays: defines of visibility/rays.glsl; a_pass: shadow rays in one."""
        self._gpu, self._lightmap = gpu, lightmap
        reads = lightmap.defines("MATERIAL_BITS", "TILE")
        self._shoot, self._add = (
            {sun: Pass(gpu, name, defines={"SUN": sun} | reads | more, vertex="common/rects") for sun in (False, True)}
            for name, more in (("direct_light/sky_rays", {"PASS": a_pass} | rays), ("direct_light/sky_light", {}))
        )
        gathered = {"GATHERED": True} | reads
        self.gathered = Pass(gpu, "direct_light/sky_light", defines=gathered, vertex="common/rects")

    def lit(self, sky: Sky, stream: int, passes_table: Texture, *, sun: bool) -> SkyLit:
        """Of another sky, or its sun, nothing of which is known yet."""
        gpu, size = self._gpu, self._lightmap.size
        seen, all_ = gpu.texture(size, 4, "f4"), gpu.texture(size, 4, "f4")
        target = gpu.target(seen, all_)
        target.clear()
        passes = np.zeros(self._lightmap.pool.tiles, np.int64)
        if sun:
            return SkyLit(sky, None, None, seen, all_, target, stream, passes, passes_table)
        unoccluded = upload(gpu, irradiance_table(sky))
        unoccluded.filter = (gpu.ctx.LINEAR, gpu.ctx.LINEAR)
        return SkyLit(sky, SkyMap(gpu, sky), unoccluded, seen, all_, target, stream, passes, passes_table)

    def shooting(self, lit: SkyLit) -> tuple[Pass, dict[str, Texture], dict[str, Any]]:
        """The program of shadow rays, and what it reads besides origins and rays."""
        how, textures, uniforms = self._shoot[lit.is_sun], {"t_passes": lit.passes_table}, {"u_stream": lit.stream}
        if lit.map is None:
            return how, textures, uniforms | {"u_sun": sun_uniform(lit.sky)}
        return how, textures | lit.map.textures, uniforms | {"u_by_cosine": 1.0 if lit.map.even else BY_COSINE}

    def adding(self, lit: SkyLit, normals: Texture) -> tuple[Pass, dict[str, Texture], dict[str, Any]]:
        """The program that sums up, and what it reads."""
        how = self._add[lit.is_sun]
        textures = {"t_seen": lit.seen, "t_all": lit.all, "t_passes": lit.passes_table, "t_origin_normal": normals}
        scale = (lit.sky.sun_irradiance if lit.is_sun else lit.sky.scale) / self._lightmap.unit
        uniforms = {"u_scale": tuple(scale.tolist()), "u_size": self._lightmap.size}
        if lit.unoccluded is None:
            return how, textures, uniforms | {"u_sun": sun_uniform(lit.sky)[:3]}
        return how, textures | {"t_unoccluded": lit.unoccluded}, uniforms

    def resized(self, lit: SkyLit, moves: Moves) -> None:
        """The tile pool has got another number of slots."""
        self._gpu.release_all(lit.target)
        lit.seen, lit.all = self._lightmap.moved(lit.seen, moves), self._lightmap.moved(lit.all, moves)
        lit.target = self._gpu.target(lit.seen, lit.all)


def sun_uniform(sky: Sky) -> tuple[float, float, float, float]:
    """As direct_light/sun.glsl has it."""
    assert sky.sun is not None
    x, y, z = sky.sun.direction.tolist()
    return x, y, z, 2 * math.sin(SUN_ANGLE / 4) ** 2


__all__ = ["SkyLight", "SkyLit", "sun_uniform"]
