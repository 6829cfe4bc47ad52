"""The triangles of a lightmap on the GPU, of which a view draws those that it may see, see app/atlas/drawn.py."""

from __future__ import annotations

import numpy as np

from app.atlas.visible_mesh import VERTEX_FORMAT
from app.gpu import Gpu, Mesh
from app.lightmap.tile_pool import TilePool
from app.scene.model import F64


class SurfaceMesh:
    """Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, pool: TilePool) -> None:
        self._drawn = drawn = pool.visible_mesh
        self._mesh = Mesh(gpu, drawn.vertices.tobytes(), VERTEX_FORMAT, indices=drawn.corners.tobytes())
        self._order = np.arange(0 if drawn.clusters is None else len(drawn.clusters.lower))

    def seen(self, clip_from_local: F64) -> Mesh:
        """What a view (4, 4) draws: with many triangles only those that it may see, from near to far. It stays so until the
        next view."""
        clusters = self._drawn.clusters
        if clusters is not None:
            order = clusters.seen(clip_from_local)
            if not np.array_equal(order, self._order):
                self._order = order
                self._mesh.choose(self._drawn.corners[clusters.triangles(order)])
        return self._mesh

    def triangle(self, primitive: int) -> int:
        """Of the scene: the one that the last view drew as so many-th, from 0."""
        clusters = self._drawn.clusters
        row = primitive if clusters is None else int(clusters.triangles(self._order)[primitive])
        return int(self._drawn.triangle[row])

    def release(self) -> None:
        self._mesh.release()
