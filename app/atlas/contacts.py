"""What lies on a surface and hides it: a box on a floor, one box on another.

Under it no light comes and nobody looks, but texels that it hides in part would be as dark as their hidden share, and spread
that around the foot of what stands there. So such pieces of surface are no part of any texel.

A facet c hides a side f where it lies a little before the plane of f: a lamp under a ceiling, a rug. Where it lies in that
plane, c, or what would close a body that has no bottom, must face against f and bound a body that rises in front of f: all
triangles that meet c in an edge lie behind c, and face away from it. A wall without thickness between two rooms has theirs in
front of it.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from app.atlas.sides import FLAT, FLAT_ANGLE, distinct_rows, facets, least, middle, most, scene_size, weld
from app.scene.model import F64, I32, Scene
from app.util.background import Report

GAP = 0.05  # of a texel: what is no farther from a surface lies on it
LEAST = 1e-9  # of a face, that a piece is: less is rounding
MOST_NEAR = 4096  # facets in one plane, beyond which those that a side's box meets are looked for first
MOST_MEET = 1 << 22  # of such pairs, beyond which what lies there is not looked for: soups of loose triangles
MOST_CORNERS = 256  # of a loop that a cap closes: its triangles all meet in one corner
BLOCK = 1 << 14  # triangles whose neighbours are looked at at once

I64 = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Hidden:
    """Pieces of faces that something lies on: their corners (k, 3, 2) in the atlas [texels], and the face of each (k,);
    left_out: sides in whose plane more lies than is looked at."""

    uv: F64
    face: I64
    left_out: int


@dataclass(frozen=True, eq=False)
class Members:
    """The rows that bear each of some labels: of label k, ``order`` from ``first[k]`` up to ``first[k + 1]``."""

    order: I64
    first: I64

    @staticmethod
    def of(label: I64 | I32) -> Members:
        """label (n,): from 0, none missing."""
        return Members(np.argsort(label, kind="stable"), np.cumsum(np.append(0, np.bincount(label))))

    def __getitem__(self, label: int) -> I64:
        return self.order[self.first[label] : self.first[label + 1]]


@dataclass(frozen=True, eq=False)
class Facets:
    """Flat pieces of triangles, those of the scene first. corners (m, 3, 3); members: triangles of each facet; normal, point
    (n, 3): their planes; least, most (n, 3): boxes around them; depth (n,): see _depths; scene: how many are the scene's."""

    corners: F64
    members: Members
    normal: F64
    point: F64
    least: F64
    most: F64
    depth: F64
    scene: int

    @staticmethod
    def of_scene(scene: Scene, points: F64, triangles: I32, facet: I32) -> Facets:
        """points (n, 3), triangles (m, 3): welded; facet (m,) of them."""
        two = np.array([m.double_sided for m in scene.materials])[scene.material_ids]
        return Facets.of(points - points.min(0), triangles, facet, two, FLAT * scene_size(scene))

    @staticmethod
    def of(points: F64, triangles: I32, facet: I32, double_sided: NDArray[np.bool_], flat: float) -> Facets:
        """points (n, 3), triangles (m, 3), facet (m,), whether their material has two sides (m,)."""
        count = int(facet.max(initial=-1)) + 1
        caps, cap = _caps(points, triangles, double_sided, flat)
        triangles, facet = (
            np.concatenate([triangles, caps]),
            np.concatenate([facet.astype(np.int64), count + cap.astype(np.int64)]),
        )
        corners = points[triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        area = np.linalg.norm(normals, axis=1)
        normals /= np.maximum(area, np.finfo(float).tiny)[:, None]
        order = np.lexsort((-area, facet))
        first = np.flatnonzero(np.diff(facet[order], prepend=-1))
        return Facets(
            corners,
            Members(order, np.append(first, len(order))),
            normals[order[first]],
            corners[order[first], 0],
            np.minimum.reduceat(least(corners)[order], first),
            np.maximum.reduceat(most(corners)[order], first),
            _depths(corners, triangles, facet, normals, flat),
            count,
        )


def hidden_pieces(
    scene: Scene,
    all_: Facets,
    facet: I32,
    face_triangle: I32,
    face_back: NDArray[np.bool_],
    face_uv: F64,
    density: float,
    report: Report | None = None,
) -> Hidden:
    """all_: those of the scene; facet (m,) of its triangles; face_triangle (f,), face_back (f,), face_uv (f, 3, 2): sides in the
    atlas; density [texels/m]. report(share) is called now and then and may raise to cancel."""
    tell = report or (lambda share: None)
    tell(0.0)
    flat = FLAT * scene_size(scene)
    within = max(GAP / density, flat)
    sides, side = np.unique(2 * facet[face_triangle].astype(np.int64) + face_back, return_inverse=True)
    faces_of = Members.of(side.reshape(-1))
    own, up = sides // 2, all_.normal[sides // 2] * np.where(sides % 2 == 1, -1.0, 1.0)[:, None]
    tell(0.2)
    lids, left_out = _lids(all_, own, up, within, flat, tell)
    pieces, owners = [np.empty((0, 3, 2))], [np.empty(0, np.int64)]
    sheer = np.zeros(len(all_.normal), bool)  # nothing that is not opaque hides what it lies on
    sheer[facet] = ~np.array([m.opaque for m in scene.materials])[scene.material_ids]
    for nth, (one, those) in enumerate(lids):
        tell(0.6 + 0.4 * nth / len(lids))
        lid = those[~sheer[those]]
        if not len(lid):
            continue
        faces = faces_of[one]
        corners = all_.corners[face_triangle[faces]]
        axes = np.linalg.svd(up[one : one + 1])[2][1:].T  # (3, 2), of the plane
        piece, which = _cut(corners @ axes, _cover(all_, lid, axes))
        pieces.append(_on_faces(piece, corners[which] @ axes, face_uv[faces[which]]))
        owners.append(faces[which])
    return Hidden(np.concatenate(pieces), np.concatenate(owners), left_out)


def covers(
    points: F64, triangles: I32, facet: I32, double_sided: NDArray[np.bool_], own: I64, axes: F64, flat: float
) -> tuple[dict[int, shapely.Geometry], dict[int, shapely.Geometry]]:
    """What lies on the fronts of some facets, own (k,), and on their backs: by the place in ``own``, in axes (k, 3, 2) of their
    planes. points (n, 3) from their least, triangles (m, 3): welded; facet (m,) of them, whether they have two sides (m,)."""
    all_ = Facets.of(points, triangles, facet, double_sided, flat)
    up = all_.normal[own]
    lids, _ = _lids(all_, np.tile(own, 2), np.concatenate([up, -up]), flat, flat, lambda share: None)
    found: tuple[dict[int, shapely.Geometry], dict[int, shapely.Geometry]] = {}, {}
    for one, lid in lids:
        back, nth = divmod(one, len(own))
        found[back][nth] = _cover(all_, lid, axes[nth])
    return found


def hidden_points(scene: Scene, triangle: I32, back: NDArray[np.bool_], weights: F64) -> NDArray[np.bool_]:
    """(n,) whether something lies on points of sides: triangle and whether its back (n,), weights (n, 3) of its corners."""
    points, corners = weld(scene)
    sides, side = np.unique(2 * triangle.astype(np.int64) + back, return_inverse=True)
    own = np.tile(np.eye(3)[:, 1:], (len(sides), 1, 1))  # of each side, the weights of its second and third corner
    facet = facets(points, corners, scene.material_ids, scene_size(scene))
    at = (sides // 2).astype(np.int32), sides % 2 == 1, own
    found = hidden_pieces(scene, Facets.of_scene(scene, points, corners, facet), facet, *at, math.inf)
    hidden = np.zeros(len(triangle), bool)
    for piece, one in zip(found.uv, found.face.tolist(), strict=True):
        mine = np.flatnonzero(side.reshape(-1) == one)
        hidden[mine] |= inside_triangles(piece[None], weights[None, mine, 1:])[0]
    return hidden


def inside_triangles(triangles: F64, points: F64) -> NDArray[np.bool_]:
    """(n, k) whether points (n, k, 2) lie in triangles (n, 3, 2), of any winding."""
    edge = (np.roll(triangles, -1, axis=1) - triangles)[:, None]
    from_corners = points[:, :, None] - triangles[:, None]
    turns = edge[..., 0] * from_corners[..., 1] - edge[..., 1] * from_corners[..., 0]
    return np.asarray((turns >= 0).all(-1) | (turns <= 0).all(-1))


def _lids(
    all_: Facets, own: I64, up: F64, within: float, flat: float, report: Report
) -> tuple[list[tuple[int, I64]], int]:
    """Sides that something may lie on, and the facets that do; how many were left out. own, up: facet and normal of each side."""
    ends = np.flatnonzero(all_.depth > 2 * within)  # else of one thin body
    sheets = np.arange(all_.scene)
    lids, body = np.concatenate([ends, sheets, sheets]), np.arange(len(ends) + 2 * len(sheets)) < len(ends)
    down = np.concatenate([-all_.normal[ends], all_.normal[sheets], -all_.normal[sheets]])
    # planes as points (normal, height): angles in units of what is flat, distances in units of the gap
    units = np.array([FLAT_ANGLE, FLAT_ANGLE, FLAT_ANGLE, within])
    lid_planes = np.column_stack([down, (down * all_.point[lids]).sum(1)]) / units
    planes = np.column_stack([up, (up * all_.point[own]).sum(1)]) / units
    tree = cKDTree(lid_planes)
    count = tree.query_ball_point(planes, 1.0, return_length=True, workers=-1)
    report(0.4)
    few = np.flatnonzero((count > 1) & (count <= MOST_NEAR))  # one is the side's own facet
    near = tree.query_ball_point(planes[few], 1.0, workers=-1)
    side, lid = np.repeat(few, count[few]), np.fromiter(itertools.chain.from_iterable(near), np.int64, count[few].sum())
    report(0.5)
    crowded = np.flatnonzero(count > MOST_NEAR)
    there, those = _boxes_that_meet(all_, own[crowded], lids, np.abs(up[crowded]).argmax(1), within, report)
    left_out = len(crowded) if len(there) > MOST_MEET else 0
    if not left_out:
        one_plane = ((planes[crowded[there]] - lid_planes[those]) ** 2).sum(1) <= 1
        side, lid = np.append(side, crowded[there[one_plane]]), np.append(lid, those[one_plane])
    mine, other = own[side], lids[lid]
    height = np.einsum("pk,pk->p", all_.point[other] - all_.point[mine], up[side])
    lies = ((height > flat) | body[lid] & (height >= -flat)) & (other != mine)
    lies &= (all_.least[other] <= all_.most[mine] + within).all(1)
    lies &= (all_.most[other] >= all_.least[mine] - within).all(1)
    first = distinct_rows(side[lies], other[lies])[0]
    side, other = side[lies][first], other[lies][first]
    starts = np.flatnonzero(np.diff(side, prepend=-1))
    return list(zip(side[starts].tolist(), np.split(other, starts[1:]), strict=True)) if len(side) else [], left_out


def _boxes_that_meet(all_: Facets, own: I64, lids: I64, axis: I64, within: float, report: Report) -> tuple[I64, I64]:
    """Pairs of sides and lids, the number of each, whose boxes meet as seen along the axis of the side, in the order of sides; no
    more than MOST_MEET, and one block."""
    sides, others = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for k in np.unique(axis).tolist():
        flat_on = [other for other in range(3) if other != k]
        low, high = all_.least[:, flat_on] - within / 2, all_.most[:, flat_on] + within / 2
        tree = shapely.STRtree(shapely.box(*low[lids].T, *high[lids].T))
        mine = np.flatnonzero(axis == k)
        for first in range(0, len(mine), 64):
            report(0.5)
            block = mine[first : first + 64]
            side, lid = tree.query(shapely.box(*low[own[block]].T, *high[own[block]].T))
            sides.append(block[side])
            others.append(lid)
            if sum(map(len, others)) > MOST_MEET:
                break
    side, lid = np.concatenate(sides), np.concatenate(others)
    order = np.argsort(side, kind="stable")
    return side[order], lid[order]


def _cover(all_: Facets, lid: I64, axes: F64) -> shapely.Geometry:
    """All of these facets, in axes (3, 2) of their plane."""
    lying = shapely.polygons(np.concatenate([all_.corners[all_.members[k]] for k in lid]) @ axes)
    return shapely.union_all(lying[shapely.area(lying) > 0])


def _cut(faces: F64, cover: shapely.Geometry) -> tuple[F64, I64]:
    """What of triangles (n, 3, 2) is covered: triangles (k, 3, 2), and of which (k,)."""
    given = shapely.polygons(faces)
    shapely.prepare(cover)
    meets = np.flatnonzero((shapely.area(given) > 0) & shapely.intersects(given, cover))
    inside = shapely.intersection(given[meets], cover)
    made, which = shapely.get_parts(shapely.constrained_delaunay_triangles(inside), return_index=True)
    kept = shapely.area(made) > LEAST * shapely.area(given[meets[which]])
    corners = shapely.get_coordinates(made[kept]).reshape(-1, 4, 2)[:, :3]
    return np.asarray(corners), meets[which[kept]]


def _on_faces(pieces: F64, faces: F64, uv: F64) -> F64:
    """Triangles (n, 3, 2) in a plane, by the maps of faces there (n, 3, 2) to uv (n, 3, 2)."""
    edges, uv_edges = faces[:, 1:] - faces[:, :1], uv[:, 1:] - uv[:, :1]
    return np.asarray(uv[:, :1] + (pieces - faces[:, :1]) @ np.linalg.inv(edges) @ uv_edges)


def _depths(corners: F64, triangles: I32, facet: I32, normals: F64, flat: float) -> F64:
    """(facets,) how far a body reaches behind each facet that ends one, next to it: triangles that meet it in an edge are all
    behind and face away. 0 where it ends none."""
    count, centre = len(triangles), middle(corners)
    has = coo_array((np.ones(3 * count, bool), (np.repeat(np.arange(count), 3), _edges(triangles)[0]))).tocsr()
    of_edge = has.T.tocsr()
    deep = np.zeros(int(facet.max(initial=-1)) + 1)
    wrong = np.zeros(len(deep), bool)
    for first in range(0, count, BLOCK):
        one, other = (has[first : first + BLOCK] @ of_edge).nonzero()
        one = one + first
        one, other = one[facet[one] != facet[other]], other[facet[one] != facet[other]]
        heights = np.einsum("pck,pk->pc", corners[other] - corners[one, :1], normals[one])
        away = np.einsum("pk,pk->p", centre[other] - centre[one], normals[other]) > 0
        aside = np.abs(heights).max(1) > flat
        wrong[facet[one[(heights.max(1) > flat) | (aside & ~away)]]] = True
        np.maximum.at(deep, facet[one], -heights.min(1))
    deep[wrong] = 0.0
    return deep


def _caps(points: F64, triangles: I32, double_sided: NDArray[np.bool_], flat: float) -> tuple[I32, I32]:
    """(c, 3) triangles that would close bodies which lack a bottom and nothing else, each a fan in a loop of open edges, flat and
    convex; the number of each loop (c,). What has two sides may be looked into."""
    count = len(triangles)
    (edge, uses), owner = _edges(triangles), np.repeat(np.arange(count), 3)
    joins = coo_array((np.ones(3 * count, bool), (owner, count + edge)), shape=(count + len(uses),) * 2)
    body = connected_components(joins, directed=False)[1][owner]  # of each edge of each triangle
    alone = uses[edge] == 1
    open_edges, two = np.bincount(body, alone), np.bincount(body, double_sided[owner]) > 0
    alone &= (open_edges[body] <= MOST_CORNERS) & ~two[body]
    start, end = triangles.reshape(-1), np.roll(triangles, -1, axis=1).reshape(-1)
    at, to = (zip(body[alone].tolist(), ends[alone].tolist(), strict=True) for ends in (end, start))
    follows = dict(zip(at, to, strict=True))  # a cap turns the other way round
    caps = []
    while follows:
        first, after = follows.popitem()
        loop = [first]
        while after != first and after in follows:
            loop.append(after)
            after = follows.pop(after)
        corners = [corner for _, corner in loop]
        whole = after == first and len(loop) == open_edges[first[0]] > 2
        if whole and _flat_and_convex(points[corners], flat):
            caps.append(np.array([(corners[0], *corners[k : k + 2]) for k in range(1, len(loop) - 1)], np.int32))
    loops = np.repeat(np.arange(len(caps)), [len(fan) for fan in caps]).astype(np.int32)
    return np.concatenate([np.empty((0, 3), np.int32), *caps]), loops


def _edges(triangles: I32) -> tuple[I64, I64]:
    """The number of each edge of each triangle (3 m,), and how many triangles have it (edges,)."""
    start, end = triangles.reshape(-1).astype(np.int64), np.roll(triangles, -1, axis=1).reshape(-1)
    key = np.minimum(start, end) * (int(triangles.max(initial=0)) + 1) + np.maximum(start, end)
    _, which, uses = np.unique(key, return_inverse=True, return_counts=True)
    return which.reshape(-1), uses


def _flat_and_convex(loop: F64, flat: float) -> bool:
    """Of a polygon (n, 3)."""
    edge = np.roll(loop, -1, axis=0) - loop
    turns = np.cross(edge, np.roll(edge, -1, axis=0))
    normal = turns.sum(0) / max(float(np.linalg.norm(turns.sum(0))), np.finfo(float).tiny)
    return bool((np.abs((loop - loop[0]) @ normal) <= flat).all() and (turns @ normal >= -flat * flat).all())
