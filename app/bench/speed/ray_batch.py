"""A batch of rays is traced from tables of origins and directions: for measurements, and for tests."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.gpu import Gpu, Pass
from app.scene.model import F32
from app.visibility.rays import RayScene

EDGE = 8  # rays, of the squares that lie one after the other in the texture


@dataclass(frozen=True, eq=False)
class Hits:
    """What rays met. distance (n,); triangle (n,) of the scene, -1: nothing; weights (n, 2) of its corners 1 and 2; place (n, 2)
    in the virtual atlas [texels of level 0]; front (n,) bool."""

    distance: F32
    triangle: NDArray[np.int64]
    weights: F32
    place: F32
    front: NDArray[np.bool_]


class RayBatch:
    """Rays on the GPU. Whoever makes it releases it. count: of rays."""

    def __init__(self, gpu: Gpu, rays: RayScene, origins: F32, directions: F32) -> None:
        """origins (n, 4), a: nearest; directions (n, 4), a: farthest; solver space. 64 that follow each other lie in a square."""
        self._gpu, self._rays, self.count = gpu, rays, len(origins)
        blocks = max(1, int(np.ceil(np.sqrt(self.count / EDGE**2))))
        self._blocks = blocks
        size = (blocks * EDGE, blocks * EDGE)
        self._origins = gpu.texture(size, 4, "f4", self._laid_out(origins))
        self._directions = gpu.texture(size, 4, "f4", self._laid_out(directions))
        self._hits, self._places = gpu.texture(size, 4, "f4"), gpu.texture(size, 4, "f4")
        self._target = gpu.target(self._hits, self._places)
        self._passes = {any_: Pass(gpu, "bench/rays", defines=rays.defines | {"ANY": any_}) for any_ in (False, True)}

    def _laid_out(self, rows: F32) -> bytes:
        filled = np.zeros((self._blocks**2 * EDGE**2, 4), np.float32)
        filled[: self.count] = rows
        cells = filled.reshape(self._blocks, self._blocks, EDGE, EDGE, 4).swapaxes(1, 2)
        return np.ascontiguousarray(cells).tobytes()

    def _listed(self, data: bytes) -> F32:
        cells = np.frombuffer(data, np.float32).reshape(self._blocks, EDGE, self._blocks, EDGE, 4).swapaxes(1, 2)
        return cells.reshape(-1, 4)[: self.count]

    def trace(self, any_will_do: bool = False) -> None:
        """Find the nearest hit of each, or whether there is any."""
        textures = self._rays.textures | {"t_origins": self._origins, "t_directions": self._directions}
        if any_will_do:
            textures.pop("t_bvh_uv")
        self._passes[any_will_do].draw(self._target, textures=textures)

    def closest(self) -> Hits:
        self.trace()
        hit, place = self._listed(self._hits.read()), self._listed(self._places.read())
        return Hits(hit[:, 0], hit[:, 1].astype(np.int64), hit[:, 2:], place[:, :2], place[:, 2] > 0)

    def any(self) -> NDArray[np.bool_]:
        """(n,) whether each meets anything."""
        self.trace(any_will_do=True)
        return np.asarray(self._listed(self._hits.read())[:, 0] > 0)

    def release(self) -> None:
        self._gpu.release_all(self._target, self._hits, self._places, self._origins, self._directions)
