"""The mean of pictures that are each drawn a part of a pixel aside: edges are smooth in it.

It is the mean of what the screen shows, as light: of tone-mapped colours without their sRGB curve. A mean of the light itself
would leave the edges of lamps as stairs, since a lamp a thousand times as bright as what is beside it outshines it in any
share. A linear picture is the mean of radiance.
"""

from __future__ import annotations

import numpy as np

from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.scene.model import F64

PLASTIC = 1.32471795724474602596  # ρ³ = ρ + 1: multiples of (1/ρ, 1/ρ²) fill a square evenly, however many [Roberts18]


class MeanPicture:
    """Of ``count`` pictures so far. Keeps their sum; whoever makes it releases it."""

    def __init__(self, gpu: Gpu, *, linear: bool = False) -> None:
        self._gpu, self.count = gpu, 0
        self._add = Pass(gpu, "render/add_picture", defines={"LINEAR": linear}, label="present")
        self._present = Pass(gpu, "render/present", defines={"LINEAR": linear}, label="present")
        self._sum: tuple[Texture, Framebuffer] | None = None

    @property
    def aside_px(self) -> F64:
        """How far aside the next one is to be drawn (2,), from -0.5 to 0.5 px; the first is not."""
        return (0.5 + self.count / PLASTIC ** np.array([1, 2])) % 1.0 - 0.5

    def clear(self) -> None:
        """Forget all pictures that were added."""
        self.count = 0

    def add(self, picture: Texture) -> None:
        """Add one more picture, of the same size as those before."""
        if self._sum is None or self._sum[0].size != picture.size:
            self.release()
            texture = self._gpu.texture(picture.size, 4, "f4")
            self._sum = texture, self._gpu.target(texture)
        if self.count == 0:
            self._sum[1].clear()
        self._add.draw(self._sum[1], textures={"t_picture": picture}, blend="add")
        self.count += 1

    def show(self, target: Framebuffer) -> None:
        """Into the lower left of ``target``."""
        assert self._sum is not None
        texture = self._sum[0]
        uniforms = {"u_share": 1.0 / self.count}
        self._present.draw(target, textures={"t_sum": texture}, uniforms=uniforms, viewport=(0, 0, *texture.size))

    def release(self) -> None:
        if self._sum is not None:
            self._gpu.release_all(*reversed(self._sum))
            self._sum = None
