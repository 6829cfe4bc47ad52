"""Irradiance at points, gathered through a hemicube above each from the solution as it is [Cohen85, delta form factors]:

    H'(x) = ∫ B(y) cosθ dω / π ≈ Σ B_q ΔF_q        over the samples q of a hemicube above x, B = E + ρH of the texel seen

It knows neither the texels nor the patches that the light came by: B's own error, spread over all that x sees, is what is left.
"""

from __future__ import annotations

import numpy as np

from app.atlas.visible_mesh import VERTEX_FORMAT
from app.gpu import Gpu, Mesh, Pass, ReadBack
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64

RESOLUTION = 128  # px, along a hemicube's edge
BLOCK = 16  # px, added up at once
VIEWS = 5


class HemicubeIrradiance:
    """Gathers from one lightmap, at up to ``maps`` points at once. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, maps: int) -> None:
        self._gpu, self._lightmap, self.maps = gpu, lightmap, maps
        drawn = lightmap.pool.visible_mesh
        self._mesh = Mesh(gpu, drawn.vertices.tobytes(), VERTEX_FORMAT, indices=drawn.corners.tobytes())
        size = 3 * RESOLUTION, maps * RESOLUTION
        self._samples, self._depth = gpu.texture(size, 4, "f4"), gpu.depth_texture(size)
        self._sums = gpu.texture((size[0] // BLOCK, size[1] // BLOCK), 4, "f4")
        self._points = gpu.texture((3, maps), 4, "f4")
        self._sample_target = gpu.target(self._samples, depth=self._depth)
        self._sum_target = gpu.target(self._sums)
        defines = lightmap.defines("TILE", "MATERIAL_BITS", "ALBEDO_TEXTURE", "EMISSION_TEXTURE")
        self._gather = Pass(gpu, "estimate/gather", defines=defines | {"RESOLUTION": RESOLUTION, "VIEWS": VIEWS})
        self._add = Pass(gpu, "estimate/add", defines={"BLOCK": BLOCK})

    def look(self, position: F64, normal: F64, turn: F64) -> ReadBack:
        """What points see now, on its way; ``irradiance`` reads it. position (n, 3) [m], normal (n, 3), turn (n,) [rad] of each
        hemicube about its normal; n at most ``maps``."""
        lightmap, count = self._lightmap, len(position)
        rows = np.zeros((self.maps, 3, 4), np.float32)
        rows[:count, 0, :3] = lightmap.space.local_from_world(position)
        rows[:count, 1, :3] = tangents(normal, turn)
        rows[:count, 2, :3] = normal
        self._points.write(rows.tobytes())
        self._sample_target.clear(depth=1.0)
        self._gather.draw(
            self._sample_target,
            textures={"t_points": self._points}
            | lightmap.textures("t_pages", "t_leaves", "t_normal_ids", "t_materials", "t_irradiance")
            | lightmap.textures("t_ambient", "t_albedo", "t_emission"),
            uniforms={
                "u_maps": self.maps,
                "u_unit": lightmap.unit,
                "u_pages": (float(lightmap.columns), lightmap.pool.pages_per_texel),
            },
            mesh=self._mesh,
            instances=VIEWS * count,
            depth=True,
            clip_distances=4,
        )
        self._add.draw(self._sum_target, textures={"t_samples": self._samples})
        return ReadBack(self._gpu, self._sum_target)

    def irradiance(self, looked: ReadBack) -> F64:
        """(maps, 3) [W/m²]. Waits if it has not arrived."""
        sums = np.frombuffer(looked.take(), np.float32).reshape(self.maps, -1, 4)
        return np.asarray(sums[..., :3].sum(1, dtype=np.float64))

    def release(self) -> None:
        self._mesh.release()
        self._gpu.release_all(self._sample_target, self._sum_target)
        self._gpu.release_all(self._samples, self._depth, self._sums, self._points)


def tangents(normal: F64, turn: F64) -> F64:
    """(n, 3) unit vectors square to normals (n, 3), turned about them by angles (n,) [rad]."""
    least = np.eye(3)[np.abs(normal).argmin(1)]
    x = np.cross(normal, least)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.asarray(np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * np.cross(normal, x))
