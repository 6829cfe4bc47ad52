"""A small read-back that nothing waits for: pixels go into a buffer now, and are looked at some frames later."""

from __future__ import annotations

import moderngl

from app.gpu.context import Gpu


class ReadBack:
    """The pixels of a target's first attachment (RGBA32F), on their way."""

    def __init__(self, buffer: moderngl.Buffer) -> None:
        self._buffer = buffer

    @staticmethod
    def of(gpu: Gpu, target: moderngl.Framebuffer) -> ReadBack:
        """What the target holds now."""
        buffer = gpu.ctx.buffer(reserve=target.size[0] * target.size[1] * 16)
        target.read_into(buffer, components=4, dtype="f4")
        return ReadBack(buffer)

    @staticmethod
    def arrived(gpu: Gpu, pixels: bytes) -> ReadBack:
        """One that has been looked at before."""
        return ReadBack(gpu.ctx.buffer(pixels))

    def look(self) -> bytes:
        """The pixels, which stay; waits if they have not arrived."""
        return bytes(self._buffer.read())

    def take(self) -> bytes:
        """The pixels; waits if they have not arrived. Once only."""
        data = self.look()
        self._buffer.release()
        return data
