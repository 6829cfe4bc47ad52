"""What gathering shows of itself: what it knows of every texel, and the rays of one."""

from __future__ import annotations

from collections.abc import Mapping

from app.gpu import Framebuffer, Gpu, Texture
from app.lightmap.lightmap import Lightmap
from app.solvers.gathering.compose import Compose
from app.solvers.gathering.direct import DirectLight


class Inspectable:
    """Of one lightmap. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, direct: DirectLight, compose: Compose) -> None:
        self._gpu, self._lightmap, self._direct, self._compose = gpu, lightmap, direct, compose
        self._rays: tuple[Texture, Framebuffer] | None = None

    def layers(self, rays: int) -> Mapping[str, Texture]:
        """See app/solvers/base.py. rays: of each texel."""
        return {"direct": self._direct.light, "variance": self._compose.variance, "rays": self._ray_counts(rays)}

    def _ray_counts(self, rays: int) -> Texture:
        """Rays of each texel, the same for all."""
        if self._rays is None or self._rays[0].size != self._lightmap.size:
            self.release()
            counts = self._gpu.texture(self._lightmap.size, 1, "f4")
            self._rays = counts, self._gpu.target(counts)
        counts, target = self._rays
        target.clear(float(rays))
        return counts

    def release(self) -> None:
        if self._rays is not None:
            self._gpu.release_all(*self._rays)
            self._rays = None
