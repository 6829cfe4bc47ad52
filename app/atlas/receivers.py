"""What light falls on, as few quads as possible: spans of flat tiles whose texels follow from a corner and two edges, and tiles
of any other shape, whose texels must be read.

Most texels of a room lie on rectangles. Their position, normal and material need no texture look-up in the receiver pass, and a
row of tiles of one rectangle is a single quad.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import TILE
from app.scene.model import F32, F64

# One instance: in_rect, in_a, in_b, in_c of shooting/receive.vert.glsl
RECEIVER_FORMAT = {"in_rect": "4f", "in_a": "4f", "in_b": "4f", "in_c": "4f"}
FLAT_ERROR = 1e-3  # of a texel: how far its centroid may lie from where the plane's grid has it
NEVER_CULLED = 4.0  # thicker than the scene, whose diameter is 2


@dataclass(frozen=True, eq=False)
class TileTexels:
    """Texels of all tiles in the solver frame: position, normal (t, 16, 16, 3), area (t, 16, 16), facet (t, 16, 16) from 0 or
    -1; dpdu, dpdv (facets, 3) per texel; material (facets,); x, y: the leaves' place in the atlas [tiles]; columns of the node
    set."""

    position: F64
    normal: NDArray[np.floating]
    area: F64
    facet: NDArray[np.int32]
    dpdu: F64
    dpdv: F64
    material: NDArray[np.int32]
    x: NDArray[np.int32]
    y: NDArray[np.int32]
    columns: int


def receivers(texels: TileTexels) -> tuple[F32, F32]:
    """(spans, 16) f32 of flat tiles and (tiles, 16) f32 of the others, see RECEIVER_FORMAT."""
    facet, flat = _flat_tiles(texels)
    return _spans(texels, facet, flat), _tiles(texels, np.flatnonzero(~flat))


def _flat_tiles(t: TileTexels) -> tuple[NDArray[np.int32], NDArray[np.bool_]]:
    """The facet of each tile, and whether all its covered texels are whole, of that facet, and on its grid."""
    covered = t.facet >= 0
    count = len(t.facet)
    facet = t.facet.reshape(count, -1).max(1)
    flat = np.where(covered, t.facet, facet[:, None, None]).reshape(count, -1).min(1) == facet
    du, dv = t.dpdu[facet], t.dpdv[facet]
    whole = np.linalg.norm(np.cross(du, dv), axis=-1)
    flat &= (
        (np.abs(t.area / whole[:, None, None] - 1) < FLAT_ERROR)
        .reshape(count, -1)
        .all(1, where=covered.reshape(count, -1))
    )
    flat &= np.abs((du * dv).sum(-1)) < FLAT_ERROR * whole
    corner = _corners(t, facet)
    steps = np.arange(TILE) + 0.5
    for row in range(TILE):  # one row of all tiles at a time: bounded memory
        grid = corner[:, None] + steps[None, :, None] * du[:, None] + steps[row] * dv[:, None]
        error = np.linalg.norm(t.position[:, row] - grid, axis=-1)
        flat &= (error < FLAT_ERROR * np.sqrt(whole)[:, None]).all(1, where=covered[:, row])
    return facet, flat


def _corners(t: TileTexels, facet: NDArray[np.int32]) -> F64:
    """Where each tile's lower corner lies, extrapolated from its first covered texel."""
    first = (t.facet >= 0).reshape(len(facet), -1).argmax(1)
    row, column = first // TILE, first % TILE
    at = t.position[np.arange(len(facet)), row, column]
    return np.asarray(at - (column + 0.5)[:, None] * t.dpdu[facet] - (row + 0.5)[:, None] * t.dpdv[facet])


def _spans(t: TileTexels, facet: NDArray[np.int32], flat: NDArray[np.bool_]) -> F32:
    """Neighbouring flat tiles of one facet, side by side in atlas and node set, as one quad each."""
    slot = np.flatnonzero(flat)
    if not len(slot):
        return np.zeros((0, 16), np.float32)
    before = slot - 1
    joins = flat[before] & (facet[before] == facet[slot]) & (slot % t.columns != 0)
    joins &= (t.x[before] + 1 == t.x[slot]) & (t.y[before] == t.y[slot])
    start = np.flatnonzero(~joins)
    length = np.diff(np.append(start, len(slot)))
    slot, owner = slot[start], facet[slot[start]]
    out = np.zeros((len(slot), 16), np.float32)
    out[:, :4] = np.stack(
        [slot % t.columns * TILE, slot // t.columns * TILE, length * TILE, np.full(len(slot), TILE)], 1
    )
    out[:, 4:7], out[:, 7] = _corners(t, facet)[slot], owner + 1
    out[:, 8:11], out[:, 11] = t.dpdu[owner], t.material[owner]
    out[:, 12:15] = t.dpdv[owner]
    return out


def _tiles(t: TileTexels, slot: NDArray[np.int64]) -> F32:
    """Tiles of any shape: a bounding sphere, and the mean normal with the half thickness along it."""
    covered = (t.facet[slot] >= 0)[..., None]
    position = np.where(covered, t.position[slot], 0.0)
    centre = position.sum((1, 2)) / np.maximum(covered.sum((1, 2)), 1)
    offset = np.where(covered, position - centre[:, None, None], 0.0)
    axis = np.where(covered, t.normal[slot], 0.0).sum((1, 2))
    axis /= np.maximum(np.linalg.norm(axis, axis=-1, keepdims=True), 1e-30)
    aligned = np.where(covered[..., 0], np.einsum("tijc,tc->tij", t.normal[slot], axis), 1.0).min((1, 2), initial=1.0)
    thickness = np.abs(np.einsum("tijc,tc->tij", offset, axis)).max((1, 2), initial=0.0)
    out = np.zeros((len(slot), 16), np.float32)
    out[:, :4] = np.stack([slot % t.columns * TILE, slot // t.columns * TILE, *np.full((2, len(slot)), TILE)], 1)
    out[:, 4:7], out[:, 7] = centre, np.linalg.norm(offset, axis=-1).max((1, 2), initial=0.0)
    out[:, 8:11] = axis
    out[:, 11] = np.where(aligned > 1 - 1e-6, thickness, NEVER_CULLED)
    return out
