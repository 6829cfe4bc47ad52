"""All shots so far, to be made again into leaves that came later: on the GPU, one row for each, as t_shooters has them."""

from __future__ import annotations

import numpy as np

from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.scene.model import F64
from app.solvers.shooting.stages import BATCH, BLOCK_ROWS, ShotBuffers, release_all

FIRST_ROOM = 1024  # shots; doubled when full
EXITANCE_ROW = 5  # of a shooter's record, see shooter.glsl


class ShotLog:
    """Whoever makes it releases it."""

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._copy, self._scale = Pass(gpu, "common/copy"), Pass(gpu, "lightmap/scale")
        self.count = 0
        self._make(FIRST_ROOM)

    def _make(self, room: int) -> None:
        self._rows = self._gpu.texture((BLOCK_ROWS, room), 4, "f4")
        self._target = self._gpu.target(self._rows)
        self._target.clear()

    def add(self, buffers: ShotBuffers, shots: int) -> None:
        """Append the first shots of the batch in ``buffers``."""
        if self.count + shots > self._rows.height:
            target, rows = self._target, self._rows
            self._make(2 * rows.height)
            self._draw(self._target, rows, (0, 0), (0, 0, *rows.size))
            self._gpu.release_all(target, rows)
        self._draw(self._target, buffers.shooters, (0, -self.count), (0, self.count, BLOCK_ROWS, shots))
        self.count += shots

    def recall(self, buffers: ShotBuffers, first: int) -> int:
        """Make the batch in ``buffers`` of the shots from ``first`` on; how many."""
        shots = min(BATCH, self.count - first)
        self._draw(buffers.shooter_target, self._rows, (0, first), (0, 0, BLOCK_ROWS, shots))
        buffers.shooter_target.read_into(buffers.shooter_blocks, components=4, dtype="f4")
        return shots

    def scale(self, factor: F64) -> None:
        """All shots were stronger by a factor (3,) for each channel."""
        where = (EXITANCE_ROW, 0, 1, max(self.count, 1))
        self._scale.draw(
            self._target, uniforms={"u_factor": tuple(np.asarray(factor))}, blend="multiply", viewport=where
        )

    def clear(self) -> None:
        self.count = 0

    def release(self) -> None:
        release_all(self._gpu, self)

    def _draw(
        self, target: Framebuffer, source: Texture, offset: tuple[int, int], viewport: tuple[int, int, int, int]
    ) -> None:
        self._copy.draw(target, textures={"t_source": source}, uniforms={"u_offset_px": offset}, viewport=viewport)
