"""The memory bandwidth of this machine's GPU (or of the CPU that plays one): a copy, which no pass can beat."""

from __future__ import annotations

from app.gpu import Gpu


class MemoryCopy:
    """An RGBA texture of ``size`` copied to another, of 32 bits a number unless ``dtype`` is f2. moved: bytes that a run reads
    and writes."""

    def __init__(self, gpu: Gpu, size: tuple[int, int], dtype: str = "f4") -> None:
        self._gpu = gpu
        self._textures = [gpu.texture(size, 4, dtype) for _ in range(2)]
        self._source, self._sink = (gpu.target(texture) for texture in self._textures)
        self._source.clear()
        self.moved = 2 * 4 * int(dtype[1]) * size[0] * size[1]

    def run(self) -> None:
        self._gpu.ctx.copy_framebuffer(self._sink, self._source)

    def release(self) -> None:
        self._gpu.release_all(self._source, self._sink, *self._textures)
