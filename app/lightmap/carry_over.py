"""Light is carried over from one lightmap to another of the same scene, whose texels are others: what was found in the texels of
one is shown in the other until its solver has found more.

For each block of 4×4 texels the nearest texel of the other lightmap is looked up by place and normal, and the light beside that
is read where the block lies in the plane of its facet.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.lightmap.probe import PlaceProbe
from app.lightmap.textures import FORESEEN_EDGE as EDGE
from app.lightmap.textures import NEAREST
from app.lightmap.tile_pool import TilePool
from app.scene.model import F32, F64

# Texels that the way is longer to one whose normal is turned by a radian: to the other side of a wall 8, so that its light does
# not come through where the wall is thinner; along a curved surface, where 10° lie between two texels, 0.7
TURNED = 4.0
FARTHEST = 1.0  # texels of the plane beside one, at most: as far as a bilinear look-up reads; farther is another chart
NOWHERE = -1e6  # a place that is none


def carry_over(gpu: Gpu, of: Lightmap, to: Lightmap, places: F32) -> None:
    """Let ``to``, in which nothing has been shot, show the light of another lightmap. places: of its blocks there. Raises
    UserError where memory does not do: then it shows what it would without."""
    if to.foresee is not None:
        probe = PlaceProbe(gpu, of, places)
        try:
            probe.draw(unit=to.unit)
            to.foresee(probe.made)
        finally:
            probe.release()


class TexelPlaces:
    """Where the texels of a tile pool are, as it is now, to find their light from elsewhere."""

    def __init__(self, pool: TilePool) -> None:
        slot, row, column = texel = np.nonzero(pool.surfaces.area > 0)
        leaves, facet = pool.leaves, pool.charts.face_facet[pool.surfaces.face[texel]]
        corner = np.stack([leaves.x[slot] * pool.tile + column, leaves.y[slot] * pool.tile + row], axis=1)
        self._uv = (corner + 0.5) / np.exp2(leaves.level[slot])[:, None]
        self._position, self._normal = pool.surfaces.position[texel], pool.surfaces.normal[texel]
        self._dpdu, self._dpdv = pool.dpdu[facet] * pool.space.scale, pool.dpdv[facet] * pool.space.scale
        self._turned = TURNED / pool.charts.density

    def of_blocks(self, pool: TilePool) -> F32:
        """(rows, columns, 4): u and v [texels of level 0], in the virtual atlas of these texels, of each block of another tile
        pool of the same scene; NOWHERE of blocks that cover nothing."""
        row, column, position, normal = _blocks(pool)
        known = cKDTree(np.concatenate([self._position, self._turned * self._normal], axis=1))
        nearest = known.query(np.concatenate([position, self._turned * normal], axis=1))[1]
        beside = _in_plane(position - self._position[nearest], self._dpdu[nearest], self._dpdv[nearest])
        places = np.full((pool.size[1] // EDGE, pool.size[0] // EDGE, 4), NOWHERE, np.float32)
        places[row, column, :2] = self._uv[nearest] + np.clip(beside, -FARTHEST, FARTHEST)
        return places


def _in_plane(off: F64, dpdu: F64, dpdv: F64) -> F64:
    """(n, 2) how many u and v lead to points (n, 3), as far as these lie in their plane."""
    uu, uv, vv = (np.einsum("nk,nk->n", a, b) for a, b in ((dpdu, dpdu), (dpdu, dpdv), (dpdv, dpdv)))
    u, v = np.einsum("nk,nk->n", off, dpdu), np.einsum("nk,nk->n", off, dpdv)
    solved = np.stack([vv * u - uv * v, uu * v - uv * u], axis=1)
    return np.asarray(solved / np.maximum(uu * vv - uv * uv, 1e-300)[:, None])


def _blocks(pool: TilePool) -> tuple[NDArray[np.int64], NDArray[np.int64], F64, F32]:
    """Row and column of each block that covers something, and its texel nearest to its middle: position [m] and normal."""
    across = pool.tile // EDGE
    covered = (pool.surfaces.area > 0).reshape(-1, across, EDGE, across, EDGE).swapaxes(2, 3).reshape(-1, EDGE**2)
    block = np.flatnonzero(covered.any(axis=1))
    inside = np.array(NEAREST)[covered[block][:, NEAREST].argmax(axis=1)]
    slot, row, column = np.unravel_index(block, (pool.tiles, across, across))
    texel = slot, row * EDGE + inside // EDGE, column * EDGE + inside % EDGE
    corner = pool.corners(slot) // EDGE
    return corner[:, 1] + row, corner[:, 0] + column, pool.surfaces.position[texel], pool.surfaces.normal[texel]
