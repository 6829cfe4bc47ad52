"""The triangles of a lightmap on the GPU, of which a view draws those that it may see, see app/atlas/visible_mesh.py."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.atlas.visible_mesh import VERTEX_FORMAT
from app.gpu import Gpu, Mesh
from app.lightmap.tile_pool import TilePool
from app.render.sheer_mesh import SheerMesh
from app.scene.model import F64
from app.visibility.opacity import sheer_triangles


class SurfaceMesh:
    """Whoever makes it releases it. sheer: those that are not opaque, where there are such; they are no part of what is seen."""

    def __init__(self, gpu: Gpu, pool: TilePool) -> None:
        self._drawn = drawn = pool.visible_mesh
        self._mesh = Mesh(gpu, drawn.vertices.tobytes(), VERTEX_FORMAT, indices=drawn.corners.tobytes())
        self._order = np.arange(0 if drawn.clusters is None else len(drawn.clusters.lower))
        sheer = sheer_triangles(pool.scene)
        self.sheer = SheerMesh(gpu, pool, sheer) if len(sheer) else None
        self._opaque = ~np.isin(drawn.triangle, sheer)  # of each row
        if self.sheer is not None:
            self._mesh.choose(drawn.corners[self._rows])

    @property
    def _rows(self) -> NDArray[np.int64]:
        """Of the triangles as the last view drew them."""
        clusters = self._drawn.clusters
        rows = np.arange(len(self._opaque)) if clusters is None else clusters.triangles(self._order)
        return np.asarray(rows[self._opaque[rows]])

    def seen(self, clip_from_local: F64) -> Mesh:
        """What a view (4, 4) draws: with many triangles only those that it may see, from near to far. It stays so until the
        next view."""
        clusters = self._drawn.clusters
        if clusters is not None:
            order = clusters.seen(clip_from_local)
            if not np.array_equal(order, self._order):
                self._order = order
                self._mesh.choose(self._drawn.corners[self._rows])
        return self._mesh

    def triangle(self, primitive: int) -> int:
        """Of the scene: the one that the last view drew as so many-th, from 0."""
        return int(self._drawn.triangle[self._rows[primitive]])

    def release(self) -> None:
        self._mesh.release()
        if self.sheer is not None:
            self.sheer.release()
