"""The surface that every texel really covers: each triangle cut by the texel grid, see fragments.py and leaf_blocks.py."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.fragments import Cutter, Windows, bounds
from app.atlas.hidden_parts import hidden_parts
from app.atlas.leaf_blocks import BlockTexels, Faces, LeafBlocks
from app.atlas.unit_square import SLIVER
from app.scene.model import F32, F64, I32, Scene
from app.util.ahead import ahead

PIECES = 1.5  # of triangles in a texel, about
BLOCK = 1 << 14  # faces in work at a time

I64 = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Leaves:
    """(n,) i32 each: tile (level, x, y) has t×t texels, t = ``Charts.tile``, and covers [x, x + 1)·t/2^level texels, so y."""

    level: I32
    x: I32
    y: I32

    def __len__(self) -> int:
        return len(self.level)

    @property
    def keys(self) -> I64:
        """(n,) a number for each tile; -1 where there is none."""
        return (self.level.astype(np.int64) << 48) | (self.y.astype(np.int64) << 24) | self.x

    def only(self, which: slice | NDArray[np.bool_] | NDArray[np.int64]) -> Leaves:
        """Those of the leaves."""
        return Leaves(self.level[which], self.x[which], self.y[which])


@dataclass(frozen=True, eq=False)
class TexelSurfaces:
    """Per texel [tile, row (v), column (u)] of n tiles.

    position (n, t, t, 3) f64: centroid of the covered surface [m], where curved a mean that may lie off it;
    area (n, t, t) f64 [m²], 0 where nothing is covered; normal (n, t, t, 3) f32: unit area-weighted mean,
    towards the lit side; face (n, t, t) i32: the face with the largest share, -1 where nothing is covered;
    leading (n, t, t, 3) f64: centroid of that share alone [m]; cut (n, t, t): whether something lies on a part of it, or all.
    Where something lies on the centroid, position and leading are the nearest place beside it; where that lies beside the flat
    surface that is covered, position is leading.
    """

    position: F64
    area: F64
    normal: F32
    face: I32
    leading: F64
    cut: NDArray[np.bool_]


def faces_tangents(scene: Scene, charts: Charts) -> tuple[F64, F64]:
    """∂p/∂u and ∂p/∂v of each face, (f, 3) f64 [m per texel of level 0]. Their cross product points to the lit side."""
    count = len(charts.face_triangle)
    dpdu, dpdv = np.empty((count, 3)), np.empty((count, 3))

    def of(some: slice) -> None:
        corners = scene.corners[charts.face_triangle[some]]
        e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        d1, d2 = _uv_edges(charts.face_uv[some])
        scale = 1 / (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0])
        dpdu[some] = (d2[:, 1:] * e1 - d1[:, 1:] * e2) * scale[:, None]
        dpdv[some] = (d1[:, :1] * e2 - d2[:, :1] * e1) * scale[:, None]

    for _ in ahead(of, [slice(first, first + BLOCK) for first in range(0, count, BLOCK)]):
        pass
    return dpdu, dpdv


def uniform_leaves(charts: Charts, level: int = 0) -> Leaves:
    """The tiles of one level that some face covers, row by row."""
    columns, rows = (side * 2**level // charts.tile for side in charts.size)
    uv = charts.face_uv * (2.0**level / charts.tile)
    low, high = bounds(uv)
    d1, d2 = _uv_edges(uv)
    alone = (high - low == 1).all(axis=1) & (d1[:, 0] * d2[:, 1] != d1[:, 1] * d2[:, 0])
    met = np.zeros(rows * columns, bool)
    met[low[alone, 1] * columns + low[alone, 0]] = True
    for part in Cutter(uv[~alone]).parts():
        met[part.y * columns + part.x] = True
    key = np.flatnonzero(met)
    x, y = (key % columns).astype(np.int32), (key // columns).astype(np.int32)
    return Leaves(np.full(len(key), level, np.int32), x, y)


def texel_count(charts: Charts) -> int:
    """Texels of level 0 that cover a surface which something may see."""
    columns, used = charts.size[0], [np.empty(0, np.int64)]
    hidden = hidden_parts(
        (charts.hidden_face[part.pair], part.y * columns + part.x, part) for part in Cutter(charts.hidden_uv).parts()
    )
    for part in Cutter(charts.face_uv).parts():
        texel = part.y * columns + part.x
        used.append(np.unique(texel[hidden.take_from(part, part.pair, texel)[0]]))
    return len(np.unique(np.concatenate(used)))


def texel_surfaces(
    scene: Scene, charts: Charts, leaves: Leaves, report: Callable[[float], None] | None = None
) -> TexelSurfaces:
    """Where each texel of the leaves lies in the world, how much surface it covers, and which way that faces. report(share) is
    called from time to time and may raise to cancel."""
    shape, faces = (len(leaves), charts.tile, charts.tile), _faces(scene, charts)
    found = TexelSurfaces(
        position=np.zeros((*shape, 3)),
        area=np.zeros(shape),
        normal=np.zeros((*shape, 3), np.float32),
        face=np.full(shape, -1, np.int32),
        leading=np.zeros((*shape, 3)),
        cut=np.zeros(shape, bool),
    )
    done = 0
    for level in np.unique(leaves.level).tolist():
        blocks = _blocks_of(faces, charts, leaves, level)

        def cut(pairs: slice, blocks: LeafBlocks = blocks) -> int:
            return _write(found, blocks.texels(pairs), faces)

        for fragments in ahead(cut, blocks.blocks):
            done += fragments
            if report is not None:
                report(min(1.0, done / (PIECES * math.prod(shape))))
    return found


def _faces(scene: Scene, charts: Charts) -> Faces:
    normals, areas = scene.normals_areas
    triangle, (d1, d2) = charts.face_triangle, _uv_edges(charts.face_uv)
    return Faces(
        charts.face_uv,
        scene.corners[triangle, 0],
        *faces_tangents(scene, charts),
        towards=normals[triangle] * np.where(charts.face_back, -1.0, 1.0)[:, None],
        per_texel=2 * areas[triangle] / np.abs(d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]),
    )


def _blocks_of(faces: Faces, charts: Charts, leaves: Leaves, level: int) -> LeafBlocks:
    """Of the leaves of one level."""
    size = 0.5**level
    windows, over = (_windows(uv / size, leaves, level, charts.tile) for uv in (charts.face_uv, charts.hidden_uv))
    return LeafBlocks(faces, windows, charts.hidden_uv, charts.hidden_face, over, size)


def _write(found: TexelSurfaces, block: BlockTexels, faces: Faces) -> int:
    """The texels of a block into those of all leaves; how many fragments these were made of."""
    covered = block.area > 0
    length = np.linalg.norm(block.normal, axis=0)
    normal = np.where(length > 0, block.normal / np.where(length > 0, length, 1.0), 0.0)
    folded = covered & (length < SLIVER * block.area)  # opposite fragments cancel: the largest decides
    normal[:, folded] = faces.towards[block.face[folded]].T
    for name in ("area", "face", "cut"):
        tiles = getattr(found, name)
        tiles[block.leaf] = getattr(block, name).reshape(-1, *tiles.shape[1:])
    for tiles, values in (
        (found.position, block.position),
        (found.normal, normal),
        (found.leading, block.leading),
    ):
        tiles[block.leaf] = values.T.reshape(-1, *tiles.shape[1:])
    return block.fragments


def _windows(uv: F64, leaves: Leaves, level: int, tile: int) -> Windows:
    """Which leaves of a level each face meets. uv: in texels of that level."""
    mine = np.flatnonzero(leaves.level == level)
    keys = (leaves.y[mine].astype(np.int64) << 32) | leaves.x[mine]
    order = np.argsort(keys)
    keys, mine = keys[order], mine[order]
    faces, places, fulls = [np.empty(0, np.int64)], [np.empty(0, np.int64)], [np.empty(0, bool)]
    few = _cells_of_few(uv / tile, leaves, mine)
    if few is not None:
        for part in Cutter(uv / tile, few).parts():
            faces.append(few.face[part.pair])
            places.append(few.leaf[part.pair])
            fulls.append(part.share == 1.0)
    else:
        for part in Cutter(uv / tile).parts():
            wanted = (part.y << 32) | part.x
            place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
            hit = keys[place] == wanted
            faces.append(part.pair[hit])
            places.append(mine[place[hit]])
            fulls.append(part.share[hit] == 1.0)
    leaf = np.concatenate(places)
    left, bottom = (corner[leaf].astype(np.int64) * tile for corner in (leaves.x, leaves.y))
    return Windows(np.concatenate(faces), leaf, np.concatenate(fulls), left, bottom, tile)


def _cells_of_few(uv: F64, leaves: Leaves, mine: I64) -> Windows | None:
    """Where leaves are few, as when some split: those that each face's bounds meet, as windows of one cell, in the order of the
    faces' cells; None where it takes less to cut the faces by the whole grid. uv: in leaves; mine: row by row."""
    low, high = bounds(uv)
    if len(mine) * len(uv) > (high - low).prod(axis=1).sum():
        return None
    x, y = leaves.x[mine].astype(np.int64), leaves.y[mine].astype(np.int64)
    across, up = ((low[:, k, None] <= at) & (at < high[:, k, None]) for k, at in enumerate((x, y)))
    face, nth = np.nonzero(across & up)
    return Windows(face, mine[nth], np.zeros(len(face), bool), x[nth], y[nth], tile=1)


def _uv_edges(uv: F64) -> tuple[F64, F64]:
    return uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
