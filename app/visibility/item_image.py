"""The visibility image is a visibility map as a picture: one colour per facet, darker with distance."""

from __future__ import annotations

from app.gpu import Gpu, Pass, Texture


class ItemImage:
    """Draws the map it is given. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._pass = Pass(gpu, "visibility/items")
        self._image: Texture | None = None

    def draw(self, items: Texture, depth: Texture, size: tuple[int, int]) -> Texture:
        """The map in the lower left of ``items`` and ``depth``, as an RGBA8 texture of that size."""
        if self._image is None or self._image.size != size:
            self.release()
            self._image = self._gpu.texture(size, 4, "f1")
            self._target = self._gpu.target(self._image)
        self._pass.draw(self._target, textures={"t_items": items, "t_depth": depth})
        return self._image

    def release(self) -> None:
        if self._image is not None:
            self._gpu.release_all(self._target, self._image)
            self._image = None
