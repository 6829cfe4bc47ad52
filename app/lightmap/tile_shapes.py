"""The shape of a tile tells whether its texels lie in one plane, on a grid, so that a corner and two edges say where each is.

Most texels of a room lie on rectangles: whoever visits all of them need not look their position and normal up.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.scene.model import F64

PLANE_ERROR = 1e-3  # of a texel: how far its centroid may lie from where the plane's grid has it
ANY_THICKNESS = 4.0  # more than that of the scene, whose diameter is 2


@dataclass(frozen=True, eq=False)
class TileTexels:
    """Texels of some tiles in the solver space: position, normal (n, t, t, 3), area (n, t, t), facet (n, t, t) from 0 or
    -1; size (n,): of a texel, in texels of level 0; dpdu, dpdv (facets, 3) per texel of level 0."""

    position: F64
    normal: NDArray[np.floating]
    area: F64
    facet: NDArray[np.int32]
    size: F64
    dpdu: F64
    dpdv: F64

    def only(self, which: NDArray[np.int64]) -> TileTexels:
        """Those of the tiles."""
        position, normal, area = self.position[which], self.normal[which], self.area[which]
        return TileTexels(position, normal, area, self.facet[which], self.size[which], self.dpdu, self.dpdv)


# planar: whether corner and edges say all of it. box: of the covered texels, lower corner and the one beyond the upper (x, y). In
# the solver space, of planar tiles: a, the corner of the box and the facet, from 1; b, ∂p/∂u per texel and the material; c, ∂p/∂v
# per texel. Of others: a, centre and radius of a bounding sphere; b, mean normal and half the thickness along it.
SHAPE = np.dtype([("planar", "?"), ("box", "i4", 4), ("a", "f4", 4), ("b", "f4", 4), ("c", "f4", 4)])


def tile_shapes(t: TileTexels, material: NDArray[np.int32]) -> NDArray[np.void]:
    """(n,) SHAPE of each tile; material (facets,)."""
    facet, planar = _planar_tiles(t)
    out = np.zeros(len(facet), SHAPE)
    out["planar"], out["box"] = planar, _boxes(t.facet >= 0)
    owner = facet[planar]
    size, lower = t.size[planar, None], out["box"][planar]
    du, dv = t.dpdu[owner] * size, t.dpdv[owner] * size
    corner = _corners(t, facet)[planar] + lower[:, :1] * du + lower[:, 1:2] * dv
    out["a"][planar] = np.column_stack([corner, owner + 1])
    out["b"][planar] = np.column_stack([du, material[owner]])
    out["c"][planar, :3] = dv
    out["a"][~planar], out["b"][~planar] = _bounds(t, ~planar)
    return out


def _boxes(covered: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(n, 4) of covered texels (n, t, t): lower corner and the one beyond the upper (x, y); empty where none is."""
    corners = []
    for axis in (1, 2):  # over rows: columns; over columns: rows
        some = np.asarray(covered.any(axis))
        beyond = np.where(some.any(1), some.shape[1] - some[:, ::-1].argmax(1), 0)
        corners.append((some.argmax(1), beyond))
    (x, right), (y, top) = corners
    return np.stack([x, y, right, top], 1)


def _planar_tiles(t: TileTexels) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """The facet of each tile, and whether all its covered texels are whole, of that facet, and on its grid."""
    count = len(t.facet)
    facet = t.facet.reshape(count, -1).max(1)
    same = np.where(t.facet >= 0, t.facet, facet[:, None, None]).reshape(count, -1).min(1) == facet
    one, planar = np.flatnonzero(same & (facet >= 0)), np.zeros(count, bool)
    planar[one] = _on_grid(t.only(one), facet[one])
    return facet, planar


def _on_grid(t: TileTexels, facet: NDArray[np.int32]) -> NDArray[np.bool_]:
    """Of tiles that show one facet: whether all their covered texels are whole and on its grid."""
    covered = t.facet >= 0
    du, dv = t.dpdu[facet] * t.size[:, None], t.dpdv[facet] * t.size[:, None]
    whole = np.linalg.norm(np.cross(du, dv), axis=-1)
    found = (np.abs(t.area / whole[:, None, None] - 1) < PLANE_ERROR) | ~covered
    flat = found.all((1, 2)) & (np.abs((du * dv).sum(-1)) < PLANE_ERROR * whole)
    corner = _corners(t, facet)
    steps = np.arange(t.facet.shape[2]) + 0.5
    for row in range(t.facet.shape[1]):  # one row of all tiles at a time: bounded memory
        grid = corner[:, None] + steps[None, :, None] * du[:, None] + steps[row] * dv[:, None]
        error = np.linalg.norm(t.position[:, row] - grid, axis=-1)
        flat &= (error < PLANE_ERROR * np.sqrt(whole)[:, None]).all(1, where=covered[:, row])
    return np.asarray(flat)


def _corners(t: TileTexels, facet: NDArray[np.int32]) -> F64:
    """Where each tile's lower corner lies, extrapolated from its first covered texel."""
    first = (t.facet >= 0).reshape(len(facet), t.facet.shape[1] * t.facet.shape[2]).argmax(1)
    row, column = np.divmod(first, t.facet.shape[2])
    at = t.position[np.arange(len(facet)), row, column]
    du, dv = t.dpdu[facet] * t.size[:, None], t.dpdv[facet] * t.size[:, None]
    return np.asarray(at - (column + 0.5)[:, None] * du - (row + 0.5)[:, None] * dv)


def _bounds(t: TileTexels, which: NDArray[np.bool_]) -> tuple[F64, F64]:
    """Tiles of any shape: a bounding sphere (n, 4), and the mean normal with the half thickness along it (n, 4)."""
    covered = t.facet[which] >= 0
    position, normal = (_axes_apart(values[which], covered) for values in (t.position, t.normal))  # (3, n, t, t)
    centre = position.sum((2, 3)) / np.maximum(covered.sum((1, 2)), 1)
    offset = np.where(covered, position - centre[..., None, None], 0.0)
    axis = normal.sum((2, 3))
    axis /= np.maximum(np.linalg.norm(axis, axis=0), 1e-30)
    along = axis[..., None, None]
    aligned = np.where(covered, (normal * along).sum(0), 1.0).min((1, 2), initial=1.0)
    thickness = np.abs((offset * along).sum(0)).max((1, 2), initial=0.0)
    radius = np.sqrt((offset**2).sum(0).max((1, 2), initial=0.0))
    thickness = np.where(aligned > 1 - 1e-6, thickness, ANY_THICKNESS)
    return np.column_stack([*centre, radius]), np.column_stack([*axis, thickness])


def _axes_apart(vectors: NDArray[np.floating], covered: NDArray[np.bool_]) -> F64:
    """(3, n, t, t) of vectors (n, t, t, 3), 0 where no texel is covered; sums along it are several times as fast."""
    return np.where(covered, np.ascontiguousarray(np.moveaxis(vectors, -1, 0)), 0.0)
