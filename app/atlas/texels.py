"""The surface that every texel really covers: each triangle cut by the texel grid, exactly, see unit_square.py.

Area and centroid go to the world by the triangle's affine map; the fragments of a texel are summed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.contacts import inside_triangles
from app.atlas.sides import least, most
from app.atlas.texel_middles import FLAT, MISSING, along, beside_the_surface
from app.atlas.unit_square import SLIVER, area_and_centroid, edge_distances
from app.scene.model import F32, F64, I32, Scene
from app.util.ahead import ahead

BLOCK = 1 << 14  # candidate texels in work at a time: a processor's cache holds them
LEAST_SEEN = 1e-3  # of a texel, that is not hidden: less is no place to look from
PIECES = 1.5  # of triangles in a texel, about
PLACES = 8  # along the edge of a texel: where else to look from, when something lies on its middle

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

    def only(self, which: NDArray[np.bool_] | NDArray[np.int64]) -> Leaves:
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
    corners = scene.corners[charts.face_triangle]
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    d1, d2 = _uv_edges(charts.face_uv)
    scale = 1 / (d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0])
    dpdu = (d2[:, 1:] * e1 - d1[:, 1:] * e2) * scale[:, None]
    dpdv = (d1[:, :1] * e2 - d2[:, :1] * e1) * scale[:, None]
    return dpdu, dpdv


def uniform_leaves(charts: Charts, level: int = 0) -> Leaves:
    """The tiles of one level that some face covers, row by row."""
    columns = charts.size[0] * 2**level // charts.tile
    keys = [part.y * columns + part.x for part in _fragments(charts.face_uv * (2.0**level / charts.tile))]
    key = np.unique(np.concatenate(keys)) if keys else np.empty(0, np.int64)
    x, y = (key % columns).astype(np.int32), (key // columns).astype(np.int32)
    return Leaves(np.full(len(key), level, np.int32), x, y)


def texel_count(charts: Charts) -> int:
    """Texels of level 0 that cover a surface which something may see."""
    columns, used = charts.size[0], [np.empty(0, np.int64)]
    hidden = _hidden(charts, charts.hidden_uv, lambda part: part.y * columns + part.x)
    for part in _fragments(charts.face_uv):
        texel = part.y * columns + part.x
        used.append(np.unique(texel[hidden.take_from(part, part.pair, texel)[0]]))
    return len(np.unique(np.concatenate(used)))


def texel_surfaces(
    scene: Scene, charts: Charts, leaves: Leaves, report: Callable[[float], None] | None = None
) -> TexelSurfaces:
    """Where each texel of the leaves lies in the world, how much surface it covers, and which way that faces. report(share) is
    called from time to time and may raise to cancel."""
    done = 0
    shape = (len(leaves), charts.tile, charts.tile)
    texels = math.prod(shape)
    area, best = np.zeros(texels), np.zeros(texels)
    face = np.full(texels, -1, np.int32)
    cut = np.zeros(texels, bool)
    moment, normal, lead = np.zeros((3, texels)), np.zeros((3, texels)), np.zeros((3, texels))
    middle = np.zeros((2, texels))
    origin = scene.corners[charts.face_triangle, 0]
    normals, areas = scene.normals_areas
    towards = normals[charts.face_triangle] * np.where(charts.face_back, -1.0, 1.0)[:, None]
    d1, d2 = _uv_edges(charts.face_uv)
    per_texel = 2 * areas[charts.face_triangle] / np.abs(d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0])
    tangents = np.stack(faces_tangents(scene, charts))
    for level in np.unique(leaves.level):
        size = 0.5**level  # of a texel, in texels of level 0
        uv = charts.face_uv / size
        windows = _windows(uv, leaves, int(level), charts.tile)
        pieces = charts.hidden_uv / size
        over = _windows(pieces, leaves, int(level), charts.tile)
        hidden = _hidden(charts, pieces, over.slot, over)
        cut[hidden.key % hidden.cells] = True
        for part in _fragments(uv, windows):
            done += len(part.pair)
            if report is not None:
                report(min(1.0, done / (PIECES * texels)))
            kept, share, u, v = hidden.take_from(part, windows.face[part.pair], windows.slot(part))
            f, slot = windows.face[part.pair][kept], windows.slot(part)[kept]
            covered = share * per_texel[f] * size**2
            du, dv = (u - uv[f, 0, 0]) * size, (v - uv[f, 0, 1]) * size
            np.maximum.at(best, slot, covered)
            leading = covered >= best[slot]
            face[slot[leading]] = f[leading]
            for k in range(3):
                centre = origin[f, k] + du * tangents[0, f, k] + dv * tangents[1, f, k]
                np.add.at(moment[k], slot, covered * centre)
                np.add.at(normal[k], slot, covered * towards[f, k])
                lead[k, slot[leading]] = centre[leading]
            np.add.at(area, slot, covered)
            here = cut[slot]
            for k, at in enumerate((u, v)):
                np.add.at(middle[k], slot[here], (covered * at)[here])
        slot, at = _beside(pieces, over, uv, face, middle / np.where(area > 0, area, 1.0), leaves, charts.tile)
        f, (du, dv) = face[slot].astype(np.int64), (at - uv[face[slot], 0]).T * size
        for k in range(3):
            lead[k, slot] = origin[f, k] + du * tangents[0, f, k] + dv * tangents[1, f, k]
        moment[:, slot] = area[slot] * lead[:, slot]
        mine = np.flatnonzero((best < (1 - SLIVER) * area) & np.repeat(leaves.level == level, charts.tile**2))
        f = face[mine].astype(np.int64)
        partly = area[mine] < (1 - MISSING) * per_texel[f] * size**2
        partly &= np.linalg.norm(normal[:, mine], axis=0) > (1 - FLAT) * area[mine]
        mine, f = mine[partly], f[partly]
        off = (moment[:, mine] / area[mine]).T - origin[f]
        at = uv[f, 0] + np.stack(along(tangents[:, f], off), axis=1) / size
        slot = mine[beside_the_surface(at, f, uv, mine // charts.tile**2, windows.face, windows.leaf)]
        moment[:, slot] = area[slot] * lead[:, slot]
    with np.errstate(invalid="ignore", divide="ignore"):
        position = np.where(area > 0, moment / area, 0.0)
        length = np.linalg.norm(normal, axis=0)
        normal = np.where(length > 0, normal / length, 0.0)
    folded = (face >= 0) & (length < SLIVER * area)  # opposite fragments cancel: the largest decides
    normal[:, folded] = towards[face[folded]].T
    return TexelSurfaces(
        position=np.ascontiguousarray(position.T).reshape(*shape, 3),
        area=area.reshape(shape),
        normal=np.ascontiguousarray(normal.T, dtype=np.float32).reshape(*shape, 3),
        face=face.reshape(shape),
        leading=np.ascontiguousarray(lead.T).reshape(*shape, 3),
        cut=cut.reshape(shape),
    )


@dataclass(frozen=True, eq=False)
class _Fragments:
    """Pieces of triangles in cells: (n,) pair, cell x and y; share of the cell's area; centroid u, v in the atlas."""

    pair: I64
    x: I64
    y: I64
    share: F64
    u: F64
    v: F64


@dataclass(frozen=True, eq=False)
class _Hidden:
    """What of faces is hidden in cells: key (n,), of cell and face, in ascending order; share of the cell's area, and that times
    its centroid u, v."""

    key: I64
    cells: int
    share: F64
    u: F64
    v: F64

    def take_from(self, part: _Fragments, face: I64, cell: I64) -> tuple[NDArray[np.bool_], F64, F64, F64]:
        """Which fragments are left of those of faces in cells, and of these share and centroid u, v."""
        share, u, v = part.share, part.share * part.u, part.share * part.v
        if len(self.key):
            key = face * self.cells + cell
            place = np.minimum(np.searchsorted(self.key, key), len(self.key) - 1)
            here = self.key[place] == key
            share, u, v = (
                whole - np.where(here, own[place], 0.0)
                for whole, own in ((share, self.share), (u, self.u), (v, self.v))
            )
        kept = share > LEAST_SEEN * part.share
        share = share[kept]
        return kept, share, u[kept] / share, v[kept] / share


def _hidden(charts: Charts, uv: F64, cell_of: Callable[[_Fragments], I64], windows: _Windows | None = None) -> _Hidden:
    """Of pieces uv (k, 3, 2) of faces; cell_of: the number of each fragment's cell."""
    cells = 1 << 40
    keys, sums = [np.empty(0, np.int64)], [np.empty((0, 3))]
    for part in _fragments(uv, windows):
        piece = part.pair if windows is None else windows.face[part.pair]
        keys.append(charts.hidden_face[piece] * cells + cell_of(part))
        sums.append(part.share[:, None] * np.column_stack([np.ones(len(part.u)), part.u, part.v]))
    key, which = np.unique(np.concatenate(keys), return_inverse=True)
    share, u, v = (
        np.bincount(which.reshape(-1), column, len(key)).astype(np.float64) for column in np.concatenate(sums).T
    )
    return _Hidden(key, cells, share, u, v)


def _beside(pieces: F64, over: _Windows, uv: F64, face: I32, middle: F64, leaves: Leaves, tile: int) -> tuple[I64, F64]:
    """Texels on whose middle (2, texels) something lies, (n,), and the nearest places on them beside it, (n, 2) in the atlas.
    pieces (k, 3, 2): what is hidden; over: leaves that these meet; uv (f, 3, 2): the faces; face (texels,) of each."""
    pairs = [np.empty((0, 2), np.int64)]
    for part in _fragments(pieces, over):
        pairs.append(np.column_stack([over.face[part.pair], over.slot(part)]))
    piece, slot = np.concatenate(pairs).T
    on_it = (face[slot] >= 0) & inside_triangles(pieces[piece], middle.T[slot][:, None])[:, 0]
    slots = np.unique(slot[on_it])
    leaf, place = np.divmod(slots, tile * tile)
    corner = np.column_stack([leaves.x[leaf] * tile + place % tile, leaves.y[leaf] * tile + place // tile])
    steps = (np.arange(PLACES) + 0.5) / PLACES
    places = corner[:, None] + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    free = inside_triangles(uv[face[slots]], places)
    mine = np.isin(slot, slots)
    nth = np.searchsorted(slots, slot[mine])
    np.logical_and.at(free, nth, ~inside_triangles(pieces[piece[mine]], places[nth]))
    far = np.where(free, ((places - middle.T[slots][:, None]) ** 2).sum(-1), np.inf)
    nearest, found = far.argmin(axis=1), free.any(axis=1)
    return slots[found], places[np.arange(len(slots)), nearest][found]


@dataclass(frozen=True, eq=False)
class _Windows:
    """Pairs of a face and a leaf that it meets: (p,) face, leaf, whether it fills it, and the leaf's first texel; tile: the
    edge of a leaf [texels]."""

    face: I64
    leaf: I64
    full: NDArray[np.bool_]
    left: I64
    bottom: I64
    tile: int

    def slot(self, part: _Fragments) -> I64:
        """Where the fragments' texels are stored."""
        row, column = part.y - self.bottom[part.pair], part.x - self.left[part.pair]
        return np.asarray((self.leaf[part.pair] * self.tile + row) * self.tile + column)


def _windows(uv: F64, leaves: Leaves, level: int, tile: int) -> _Windows:
    """Which leaves of a level each face meets. uv: in texels of that level."""
    mine = np.flatnonzero(leaves.level == level)
    keys = (leaves.y[mine].astype(np.int64) << 32) | leaves.x[mine]
    order = np.argsort(keys)
    keys, mine = keys[order], mine[order]
    faces, places, fulls = [np.empty(0, np.int64)], [np.empty(0, np.int64)], [np.empty(0, bool)]
    few = _cells_of_few(uv / tile, leaves, mine)
    if few is not None:
        for part in _fragments(uv / tile, few):
            faces.append(few.face[part.pair])
            places.append(few.leaf[part.pair])
            fulls.append(part.share == 1.0)
    else:
        for part in _fragments(uv / tile):
            wanted = (part.y << 32) | part.x
            place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
            hit = keys[place] == wanted
            faces.append(part.pair[hit])
            places.append(mine[place[hit]])
            fulls.append(part.share[hit] == 1.0)
    leaf = np.concatenate(places)
    left, bottom = (corner[leaf].astype(np.int64) * tile for corner in (leaves.x, leaves.y))
    return _Windows(np.concatenate(faces), leaf, np.concatenate(fulls), left, bottom, tile)


def _cells_of_few(uv: F64, leaves: Leaves, mine: I64) -> _Windows | None:
    """Where leaves are few, as when some split: those that each face's bounds meet, as windows of one cell, in the order of the
    faces' cells; None where it takes less to cut the faces by the whole grid. uv: in leaves; mine: row by row."""
    low, high = _bounds(uv)
    if len(mine) * len(uv) > (high - low).prod(axis=1).sum():
        return None
    x, y = leaves.x[mine].astype(np.int64), leaves.y[mine].astype(np.int64)
    across, up = ((low[:, k, None] <= at) & (at < high[:, k, None]) for k, at in enumerate((x, y)))
    face, nth = np.nonzero(across & up)
    return _Windows(face, mine[nth], np.zeros(len(face), bool), x[nth], y[nth], tile=1)


def _bounds(uv: F64) -> tuple[I64, I64]:
    """(f, 2) each: the first cell of each triangle's box, and the one beyond the last."""
    low = np.floor(least(uv)).astype(np.int64)
    return low, np.maximum(np.ceil(most(uv)).astype(np.int64), low + 1)


def _fragments(uv: F64, windows: _Windows | None = None) -> Iterator[_Fragments]:
    """Cut triangles uv (f, 3, 2) by the unit grid, in blocks; with windows, each pair only inside its leaf."""
    face = np.arange(len(uv)) if windows is None else windows.face
    low, high = (cells[face] for cells in _bounds(uv))
    single = (high - low == 1).all(axis=1)
    if windows is not None:
        corner = np.stack([windows.left, windows.bottom], axis=1)
        low, high = np.maximum(low, corner), np.minimum(high, corner + windows.tile)
    across, up = np.maximum(high - low, 0).T
    planes = np.ascontiguousarray(uv.transpose(2, 1, 0))
    full = np.zeros(len(face), bool) if windows is None else windows.full
    for pairs in _blocks(np.flatnonzero(full), across * up):
        pair, x, y = _cells(pairs, low, across, up)
        yield _Fragments(pair, x, y, np.ones(len(pair)), x.astype(np.float64) + 0.5, y.astype(np.float64) + 0.5)

    def cut(pairs: I64) -> _Fragments:
        pair, x, y = _cells(pairs, low, across, up)
        return _cut_block(planes, face, pair, x, y, single[pair])

    yield from ahead(cut, _blocks(np.flatnonzero(~full), across * up))


def _blocks(pairs: I64, cells: I64) -> list[I64]:
    """Split pairs into runs of about BLOCK cells."""
    ends = np.cumsum(cells[pairs])
    return np.split(pairs, np.searchsorted(ends, np.arange(BLOCK, ends[-1] if len(ends) else 0, BLOCK)))


def _cells(pairs: I64, low: I64, across: I64, up: I64) -> tuple[I64, I64, I64]:
    """Every cell of every pair's box: pair, x, y."""
    cells = across[pairs] * up[pairs]
    pair = np.repeat(pairs, cells)
    nth = np.arange(len(pair)) - np.repeat(np.cumsum(cells) - cells, cells)
    row = nth // across[pair]
    return pair, low[pair, 0] + nth - row * across[pair], low[pair, 1] + row


def _cut_block(planes: F64, face: I64, pair: I64, x: I64, y: I64, single: NDArray[np.bool_]) -> _Fragments:
    """The fragments among candidate cells: whole cells and whole triangles directly, the rest by cutting.

    planes (2, 3, f): u and v of the triangles' corners.
    """
    f = face[pair]
    # (3, n): each cell is [0, 1]². np.take keeps rows together in memory, where u[:, some] would not: three times as fast
    u, v = (
        np.asarray(np.take(plane, f, axis=1) - cell, np.float64) for plane, cell in zip(planes, (x, y), strict=True)
    )
    doubled = (u[1] - u[0]) * (v[2] - v[0]) - (v[1] - v[0]) * (u[2] - u[0])
    least, most = edge_distances(u, v, np.sign(doubled))
    whole = ~single & (least >= 0)
    cut = ~single & ~whole & (most > 0)
    share, u_mean, v_mean = np.zeros(len(pair)), np.full(len(pair), 0.5), np.full(len(pair), 0.5)
    share[whole] = 1.0
    share[single] = np.abs(doubled[single]) / 2
    u_mean[single], v_mean[single] = ((side[0] + side[1] + side[2])[single] / 3 for side in (u, v))
    share[cut], u_mean[cut], v_mean[cut] = area_and_centroid(*(np.compress(cut, side, axis=1) for side in (u, v)))
    keep = share > SLIVER * np.minimum(np.abs(doubled) / 2, 1.0)
    return _Fragments(pair[keep], x[keep], y[keep], share[keep], (x + u_mean)[keep], (y + v_mean)[keep])


def _uv_edges(uv: F64) -> tuple[F64, F64]:
    return uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
