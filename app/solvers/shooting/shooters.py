"""The shooters of a batch never leave the GPU: choosing writes them there, and every later pass reads them there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.gpu import Buffer, Gpu
from app.solvers.shooting.records import BATCH, BLOCK_BYTES, BLOCK_ROWS, SHOOTER, Shot

Blocks = dict[str, tuple[Buffer, int, int]]  # what a pass binds: buffer, offset and size [bytes]


class ShooterBatch:
    """Whoever makes it releases it.

    texture: a row for each shooter; target: to write them; blocks: the same shooters as uniforms, once ``share`` was called.
    """

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self.texture = gpu.texture((BLOCK_ROWS, BATCH), 4, "f4")
        self.target = gpu.target(self.texture)
        self._uniforms = gpu.buffer(BATCH * BLOCK_BYTES)
        self._one = gpu.buffer(BATCH * BLOCK_BYTES)  # the first is a shooter that is looked at by itself

    @property
    def blocks(self) -> Blocks:
        return {"ShooterBlock": (self._uniforms, 0, BATCH * BLOCK_BYTES)}

    def share(self) -> None:
        """Copy what was written to the uniforms."""
        self.target.read_into(self._uniforms, components=4, dtype="f4")

    def alone(self, shot: Shot) -> Blocks:
        """One shooter, in whatever batch it shot."""
        self._one.write(SHOOTER.write(np.array([shot.record], SHOOTER.dtype), BLOCK_ROWS))
        return {"ShooterBlock": (self._one, 0, BATCH * BLOCK_BYTES)}

    def read(self, shots: int) -> NDArray[np.void]:
        """(shots,) SHOOTER of the first ones. Waits for the GPU."""
        return SHOOTER.read(self.texture.read(), BLOCK_ROWS)[:shots]

    def release(self) -> None:
        self._gpu.release_all(self.target, self.texture, self._uniforms, self._one)
