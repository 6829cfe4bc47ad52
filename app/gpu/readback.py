"""A small read-back that nothing waits for: pixels go into a buffer now, and are looked at some frames later."""

from __future__ import annotations

import moderngl

from app.gpu.context import Gpu


class ReadBack:
    """The pixels of a target's first attachment (RGBA32F), on their way."""

    def __init__(self, gpu: Gpu, target: moderngl.Framebuffer) -> None:
        self._buffer = gpu.ctx.buffer(reserve=target.size[0] * target.size[1] * 16)
        target.read_into(self._buffer, components=4, dtype="f4")

    def take(self) -> bytes:
        """The pixels; waits if they have not arrived. Once only."""
        data = bytes(self._buffer.read())
        self._buffer.release()
        return data
