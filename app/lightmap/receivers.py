"""What light falls on, as few quads as possible: spans of flat tiles whose texels follow from a corner and two edges, and tiles
of any other shape, whose texels must be read.

Most texels of a room lie on rectangles. Their position, normal and material need no texture look-up in the receiver pass, and a
row of tiles of one rectangle is a single quad.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.texels import Leaves
from app.scene.model import F32, F64

# One instance: in_rect, in_a, in_b, in_c of solvers/shooting/receive.vert.glsl
RECEIVER_FORMAT = {"in_rect": "4f", "in_a": "4f", "in_b": "4f", "in_c": "4f"}
FLAT_ERROR = 1e-3  # of a texel: how far its centroid may lie from where the plane's grid has it
NEVER_CULLED = 4.0  # thicker than the scene, whose diameter is 2


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


# What a tile is as a receiver: whether it is flat; the box of its covered texels, lower corner and the one beyond the upper
# (x, y); its in_a, in_b, in_c
KIND = np.dtype([("flat", "?"), ("box", "i4", 4), ("a", "f4", 4), ("b", "f4", 4), ("c", "f4", 4)])


def tile_kinds(t: TileTexels, material: NDArray[np.int32]) -> NDArray[np.void]:
    """(n,) KIND of each tile; material (facets,)."""
    facet, flat = _flat_tiles(t)
    out = np.zeros(len(facet), KIND)
    out["flat"], out["box"] = flat, _boxes(t.facet >= 0)
    owner = facet[flat]
    size, lower = t.size[flat, None], out["box"][flat]
    du, dv = t.dpdu[owner] * size, t.dpdv[owner] * size
    corner = _corners(t, facet)[flat] + lower[:, :1] * du + lower[:, 1:2] * dv
    out["a"][flat] = np.column_stack([corner, owner + 1])
    out["b"][flat] = np.column_stack([du, material[owner]])
    out["c"][flat, :3] = dv
    out["a"][~flat], out["b"][~flat] = _bounds(t, ~flat)
    return out


def receivers(
    kinds: NDArray[np.void], used: NDArray[np.int64], leaves: Leaves, columns: int, tile: int
) -> tuple[F32, F32]:
    """(spans, 16) f32 of flat tiles and (tiles, 16) f32 of the others, see RECEIVER_FORMAT, of the ``used`` slots (n,), in order.

    kinds and leaves of all slots; columns of the tile pool; tile: edge of a tile [texels]. Neighbouring flat tiles of one
    facet, side by side in atlas and tile pool, are one quad. Quads end where no texel is covered: most of a tile may be empty.
    """
    flat = used[kinds["flat"][used]]
    shaped = used[~kinds["flat"][used]]
    before = flat - 1
    joins = np.isin(before, flat) & (flat % columns != 0) & (kinds["a"][before, 3] == kinds["a"][flat, 3])
    joins &= (leaves.level[before] == leaves.level[flat]) & (leaves.y[before] == leaves.y[flat])
    joins &= leaves.x[before] + 1 == leaves.x[flat]
    left, right = kinds["box"][before], kinds["box"][flat]
    joins &= (left[:, 2] == tile) & (right[:, 0] == 0) & (left[:, 1::2] == right[:, 1::2]).all(1)
    start = np.flatnonzero(~joins)
    last = np.append(start, len(flat))[1:] - 1
    return _quads(kinds, flat[start], flat[last], columns, tile), _quads(kinds, shaped, shaped, columns, tile)


def _quads(kinds: NDArray[np.void], first: NDArray[np.int64], last: NDArray[np.int64], columns: int, tile: int) -> F32:
    """From the lower corner of what the first tile of each covers to the upper of the last."""
    lower, upper = (np.stack([slot % columns, slot // columns], 1) * tile for slot in (first, last))
    lower, upper = lower + kinds["box"][first, :2], upper + kinds["box"][last, 2:]
    kind = kinds[first]
    return np.concatenate([lower, upper - lower, kind["a"], kind["b"], kind["c"]], 1).astype(np.float32)


def _boxes(covered: NDArray[np.bool_]) -> NDArray[np.int64]:
    """(n, 4) of covered texels (n, t, t): lower corner and the one beyond the upper (x, y); empty where none is."""
    corners = []
    for axis in (1, 2):  # over rows: columns; over columns: rows
        some = np.asarray(covered.any(axis))
        beyond = np.where(some.any(1), some.shape[1] - some[:, ::-1].argmax(1), 0)
        corners.append((some.argmax(1), beyond))
    (x, right), (y, top) = corners
    return np.stack([x, y, right, top], 1)


def _flat_tiles(t: TileTexels) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """The facet of each tile, and whether all its covered texels are whole, of that facet, and on its grid."""
    covered = t.facet >= 0
    count = len(t.facet)
    facet = t.facet.reshape(count, -1).max(1)
    flat = np.where(covered, t.facet, facet[:, None, None]).reshape(count, -1).min(1) == facet
    du, dv = t.dpdu[facet] * t.size[:, None], t.dpdv[facet] * t.size[:, None]
    whole = np.linalg.norm(np.cross(du, dv), axis=-1)
    flat &= (
        (np.abs(t.area / whole[:, None, None] - 1) < FLAT_ERROR)
        .reshape(count, -1)
        .all(1, where=covered.reshape(count, -1))
    )
    flat &= (np.abs((du * dv).sum(-1)) < FLAT_ERROR * whole) & covered.any((1, 2))
    corner = _corners(t, facet)
    steps = np.arange(t.facet.shape[2]) + 0.5
    for row in range(t.facet.shape[1]):  # one row of all tiles at a time: bounded memory
        grid = corner[:, None] + steps[None, :, None] * du[:, None] + steps[row] * dv[:, None]
        error = np.linalg.norm(t.position[:, row] - grid, axis=-1)
        flat &= (error < FLAT_ERROR * np.sqrt(whole)[:, None]).all(1, where=covered[:, row])
    return facet, flat


def _corners(t: TileTexels, facet: NDArray[np.int32]) -> F64:
    """Where each tile's lower corner lies, extrapolated from its first covered texel."""
    first = (t.facet >= 0).reshape(len(facet), -1).argmax(1)
    row, column = np.divmod(first, t.facet.shape[2])
    at = t.position[np.arange(len(facet)), row, column]
    du, dv = t.dpdu[facet] * t.size[:, None], t.dpdv[facet] * t.size[:, None]
    return np.asarray(at - (column + 0.5)[:, None] * du - (row + 0.5)[:, None] * dv)


def _bounds(t: TileTexels, which: NDArray[np.bool_]) -> tuple[F64, F64]:
    """Tiles of any shape: a bounding sphere (n, 4), and the mean normal with the half thickness along it (n, 4)."""
    covered = (t.facet[which] >= 0)[..., None]
    position = np.where(covered, t.position[which], 0.0)
    centre = position.sum((1, 2)) / np.maximum(covered.sum((1, 2)), 1)
    offset = np.where(covered, position - centre[:, None, None], 0.0)
    axis = np.where(covered, t.normal[which], 0.0).sum((1, 2))
    axis /= np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-30)
    aligned = np.where(covered[..., 0], np.einsum("tijc,tc->tij", t.normal[which], axis), 1.0).min((1, 2), initial=1.0)
    thickness = np.abs(np.einsum("tijc,tc->tij", offset, axis)).max((1, 2), initial=0.0)
    radius = np.linalg.norm(offset, axis=-1).max((1, 2), initial=0.0)
    thickness = np.where(aligned > 1 - 1e-6, thickness, NEVER_CULLED)
    return np.column_stack([centre, radius]), np.column_stack([axis, thickness])
