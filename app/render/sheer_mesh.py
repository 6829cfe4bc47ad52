"""The triangles of a lightmap that are not opaque: what is cut out of them is not drawn, and blended ones come last, from far to
near, since what lies behind them must be there before."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.atlas.visible_mesh import VERTEX, VERTEX_FORMAT
from app.gpu import Gpu, Mesh, Texture
from app.lightmap.tile_pool import TilePool
from app.scene.model import F64
from app.visibility.opacity import Sheer

SHEER_VERTEX = np.dtype([*VERTEX.descr, ("in_row", "u4")])
SHEER_FORMAT = VERTEX_FORMAT | {"in_row": "1u"}


class SheerMesh:
    """Whoever makes it releases it.

    triangles: of the scene, by row. textures: what they are cut out by. cut_out, blended: None where there are no such.
    """

    def __init__(self, gpu: Gpu, pool: TilePool, triangles: NDArray[np.int64]) -> None:
        self._gpu, self.triangles = gpu, triangles
        self._table = Sheer(gpu, pool, triangles)
        drawn = pool.visible_mesh
        rows, which = drawn.rows_of(triangles)
        vertices: Any = np.zeros((len(rows), 3), SHEER_VERTEX)
        shared: Any = drawn.vertices[drawn.corners[rows]]
        for name in VERTEX_FORMAT:
            vertices[name] = shared[name]
        vertices["in_row"] = which[:, None]
        has_cutoff = np.array([m.opacity_cutoff is not None for m in pool.scene.materials])
        cut = has_cutoff[pool.scene.material_ids[triangles[which]]]
        self.cut_out = self._mesh(vertices[cut])
        self.blended = self._mesh(vertices[~cut])
        self._centre = vertices["in_position"][~cut].mean(1).astype(np.float64)

    def _mesh(self, vertices: NDArray[np.void]) -> Mesh | None:
        if not len(vertices):
            return None
        order = np.arange(vertices.size, dtype=np.uint32)
        return Mesh(self._gpu, vertices.tobytes(), SHEER_FORMAT, indices=order.tobytes())

    @property
    def textures(self) -> dict[str, Texture]:
        return self._table.textures

    @property
    def meshes(self) -> list[Mesh]:
        return [mesh for mesh in (self.cut_out, self.blended) if mesh is not None]

    def from_far_to_near(self, clip_from_local: F64) -> Mesh | None:
        """The blended ones as a view (4, 4) must draw them."""
        if self.blended is not None:
            _, _, _, w = clip_from_local
            nearest_last = np.argsort(-(self._centre @ w[:3]), kind="stable")
            self.blended.choose((3 * nearest_last[:, None] + [0, 1, 2]).astype(np.uint32))
        return self.blended

    def release(self) -> None:
        self._table.release()
        for mesh in self.meshes:
            mesh.release()
