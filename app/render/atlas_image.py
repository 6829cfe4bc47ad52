"""The virtual atlas as a picture: the light of its leaves as it was shown last, each in a frame of the colour of its level."""

from __future__ import annotations

from app.gpu import Gpu, Pass, Texture
from app.render.resolve import PLACES_WIDTH
from app.render.surfaces import Surfaces


class AtlasImage:
    """Draws what surfaces showed last. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._pass = Pass(gpu, "render/atlas", defines={"PLACES_WIDTH": PLACES_WIDTH}, label="atlas")
        self.image: Texture | None = None  # as it was drawn last

    def draw(self, surfaces: Surfaces, size: tuple[int, int], *, turned: bool) -> Texture:
        """An RGBA8 texture of that size, v up or, if ``turned``, to the right; the same one as before while the size stays."""
        if self.image is None or self.image.size != size:
            self.release()
            self.image = self._gpu.texture(size, 4, "f1")
            self._target = self._gpu.target(self.image)
        surfaces.draw_atlas(self._pass, self._target, turned=turned)
        return self.image

    def release(self) -> None:
        if self.image is not None:
            self._gpu.release_all(self._target, self.image)
            self.image = None
