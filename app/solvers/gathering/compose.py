"""Composing writes the light that is shown, direct and indirect, and says how noisy it is."""

from __future__ import annotations

import numpy as np

from app.gpu import Framebuffer, Gpu, Pass, ReadBack, Texture
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64
from app.solvers.gathering.origins import Origins


class Compose:
    """Of one lightmap. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, origins: Origins) -> None:
        self._gpu, self._lightmap, self._origins = gpu, lightmap, origins
        reads = lightmap.defines("MATERIAL_BITS", "TILE")
        self._draw = {s: Pass(gpu, "solvers/gathering/compose", defines={"SMOOTH": s} | reads) for s in (True, False)}
        self._judge = Pass(gpu, "solvers/gathering/noise", defines=lightmap.defines("TILE"))
        self._target: Framebuffer | None = None
        self._of: Texture | None = None
        self._fit()

    def _fit(self) -> None:
        self.variance = self._gpu.texture(self._lightmap.size, 1, "f4")
        self._noise = self._gpu.texture((self._lightmap.columns, self._lightmap.rows), 4, "f4")
        self._noise_target = self._gpu.target(self._noise)

    def draw(self, direct: Texture, gathered: Texture, rays: int, *, smooth: bool) -> None:
        """Write H of the lightmap: the direct light, and what so many rays of each texel have gathered."""
        lightmap = self._lightmap
        if (irradiance := lightmap.texture("t_irradiance")) is not self._of:
            self._forget_target()
            self._target, self._of = self._gpu.target(irradiance, self.variance), irradiance
        assert self._target is not None
        textures, uniforms = {"t_direct": direct, "t_gathered": gathered}, {"u_rays": float(max(rays, 1))}
        if smooth:
            own = self._origins.textures
            textures |= {n: own[n] for n in ("t_origin", "t_origin_normal")} | lightmap.textures("t_pages", "t_leaves")
            uniforms |= {"u_pages": (float(lightmap.columns), lightmap.pool.pages_per_texel)}  # type: ignore[dict-item]
        self._draw[smooth].draw(self._target, textures=textures, uniforms=uniforms)

    def judge(self) -> ReadBack:
        """How noisy each tile is, on its way: see noise.frag.glsl."""
        textures = self._lightmap.textures("t_position_area", "t_irradiance") | {"t_variance": self.variance}
        self._judge.draw(self._noise_target, textures=textures)
        return ReadBack(self._gpu, self._noise_target)

    def noise(self, judged: ReadBack) -> float:
        """RMS noise over all surfaces, over the mean irradiance [-]."""
        tiles = tile_noise(judged)
        variance, light, area = tiles[:, :3].sum(0)
        return float(np.sqrt(max(variance * area, 0.0)) / light) if light > 0 else 0.0

    def resized(self) -> None:
        """The tile pool has got another number of slots."""
        self._gpu.release_all(self._noise_target, self._noise)
        variance = self.variance
        self._fit()
        self._forget_target()
        self._gpu.release_all(variance)

    def _forget_target(self) -> None:
        if self._target is not None:
            self._gpu.release_all(self._target)
        self._target = self._of = None

    def release(self) -> None:
        self._forget_target()
        self._gpu.release_all(self._noise_target, self._noise, self.variance)


def tile_noise(judged: ReadBack) -> F64:
    """(slots, 4) as noise.frag.glsl says."""
    return np.frombuffer(judged.take(), np.float32).reshape(-1, 4).astype(np.float64)
