"""How open surfaces are is the share of their rays that leaves the scene."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.gpu import Gpu, Pass
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import upload
from app.scene.model import F64
from app.visibility.origins import Origins
from app.visibility.rays import RayScene

I64 = NDArray[np.int64]
RAYS = 4  # of each texel
ROW = 1 << 10  # texels, of a row


def openness_of(gpu: Gpu, lightmap: Lightmap, rays: RayScene, origins: Origins, texels: I64) -> F64:
    """(n,) the share of rays of texels (n,), y << 16 | x in the tile pool, that leave the scene or hit a side without texels.
    Waits for the GPU."""
    rows = -(-len(texels) // ROW)
    given = np.zeros((rows * ROW, 1), np.uint32)
    given[: len(texels), 0] = texels
    starts, found = upload(gpu, given.reshape(rows, ROW, 1)), gpu.texture((ROW, rows), 1, "f4")
    target = gpu.target(found)
    look = Pass(gpu, "solvers/local/openness", defines=lightmap.defines("TILE") | dict(rays.defines) | {"RAYS": RAYS})
    look.draw(target, textures=origins.textures | dict(rays.textures) | {"t_starts": starts})
    share = np.frombuffer(found.read(), np.float32)[: len(texels)].astype(np.float64)
    gpu.release_all(target, found, starts)
    return share
