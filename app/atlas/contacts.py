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
from scipy.spatial import cKDTree

from app.atlas.facets import facets
from app.atlas.planes import Facets, Members, Planes
from app.atlas.sides import FLAT_ANGLE, Edges, distinct_rows, numbered, scene_size, weld
from app.scene.model import F64, I32, Scene
from app.util.background import Report

GAP = 0.05  # of a texel: what is no farther from a surface lies on it
LEAST = 1e-9  # of a face, that a piece is: less is rounding
MOST_NEAR = 4096  # facets in one plane, beyond which those that a side's box meets are looked for first
MOST_MEET = 1 << 22  # of such pairs, beyond which what lies there is not looked for: soups of loose triangles

I64 = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Hidden:
    """Pieces of faces that something lies on: their corners (k, 3, 2) in the atlas [texels], and the face of each (k,);
    left_out: sides in whose plane more lies than is looked at."""

    uv: F64
    face: I64
    left_out: int


def hidden_pieces(
    scene: Scene,
    planes: Planes,
    facet: I32,
    face_triangle: I32,
    face_back: NDArray[np.bool_],
    face_uv: F64,
    density: float,
    report: Report | None = None,
) -> Hidden:
    """planes: those of the scene; facet (m,) of its triangles; face_triangle (f,), face_back (f,), face_uv (f, 3, 2): sides in
    the atlas; density [texels/m]. report(share) is called now and then and may raise to cancel."""
    tell = report or (lambda share: None)
    tell(0.0)
    within = max(GAP / density, planes.flat)
    all_ = planes.only(planes.near(within))
    slot = np.full(len(planes.normal), -1)
    slot[all_.number] = np.arange(len(all_.number))
    tell(0.2)
    face = np.flatnonzero(slot[facet[face_triangle]] >= 0)
    side = 2 * slot[facet[face_triangle[face]]] + face_back[face]
    sides, faces_of = np.unique(side), Members.of(numbered(side))
    own, up = sides // 2, all_.normal[sides // 2] * np.where(sides % 2 == 1, -1.0, 1.0)[:, None]
    lids, left_out = _lids(all_, own, up, within, planes.flat, tell)
    pieces, owners = [np.empty((0, 3, 2))], [np.empty(0, np.int64)]
    sheer = np.zeros(len(planes.normal), bool)  # nothing that is not opaque hides what it lies on
    sheer[facet] = ~np.array([m.opaque for m in scene.materials])[scene.material_ids]
    for nth, (one, those) in enumerate(lids):
        tell(0.6 + 0.4 * nth / len(lids))
        lid = those[~sheer[all_.number[those]]]
        if not len(lid):
            continue
        faces = face[faces_of[one]]
        corners = all_.corners[face_triangle[faces]]
        axes = np.linalg.svd(up[one : one + 1])[2][1:].T  # (3, 2), of the plane
        piece, which = _cut(corners @ axes, _cover(all_, lid, axes))
        pieces.append(_on_faces(piece, corners[which] @ axes, face_uv[faces[which]]))
        owners.append(faces[which])
    return Hidden(np.concatenate(pieces), np.concatenate(owners), left_out)


def covers(
    planes: Planes, own: I64, axes: F64, within: float
) -> tuple[dict[int, shapely.Geometry], dict[int, shapely.Geometry]]:
    """What lies on the fronts of some facets, own (k,), and on their backs, or no more than ``within`` before these: by the
    place in ``own``, in axes (k, 3, 2) of their planes."""
    all_ = planes.only(np.union1d(planes.near(within, own), own))
    mine = np.searchsorted(all_.number, own)
    up = all_.normal[mine]
    lids, _ = _lids(all_, np.tile(mine, 2), np.concatenate([up, -up]), within, planes.flat, lambda share: None)
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
    edges = Edges.of(corners)
    facet = facets(points, corners, scene.material_ids, scene_size(scene), edges)
    at = (sides // 2).astype(np.int32), sides % 2 == 1, own
    found = hidden_pieces(scene, Planes.of_scene(scene, points, corners, facet, edges), facet, *at, math.inf)
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
