"""Surfaces of many triangles: those that are seen whole from one side, as terrain is from above, are one chart, as they are
seen from there; the largest of the others are cut into pieces.

What is seen from a side that all normals point to is turned over nowhere. It lies nowhere twice if, besides, the borders of the
surface do not cross as they are seen from there, and enclose what its triangles cover: how often a place is covered changes at
borders only.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from app.atlas.sides import distinct_rows, groups_of, middle
from app.scene.model import F64, I32
from app.util.background import Report

LARGE = 4096  # triangles of a surface, from which on xatlas is spared it, or its charts are limited
PIECE = 16384  # triangles of a surface, beyond which it is cut
STEEP = 0.5  # cosine of a slope: along steeper ones, lengths are seen shortened to less than half
MOST_STEEP = 0.01  # of a surface that is seen whole may be steeper than that
EDGE_ON = 0.25  # cosine of a slope, than which none may be steeper
FILLED = 1 / 3  # of its rectangle, that one chart covers at least
SAME = 1e-6  # of an area, that sums may be off

I64 = NDArray[np.int64]


def large_surfaces(surface: I64) -> list[I64]:
    """The triangles of each surface of more than LARGE. surface (m,): of each triangle."""
    count = np.bincount(surface)
    rows = np.flatnonzero(count[surface] > LARGE)
    rows = rows[np.argsort(surface[rows], kind="stable")]
    return np.split(rows, np.cumsum(count[count > LARGE])[:-1]) if len(rows) else []


def pieces(centre: F64, rows: I64) -> list[I64]:
    """Triangles in two halves again and again, until none is larger than PIECE. centre (m, 3): the middle of each triangle."""
    return [part for half in halves(centre, rows) for part in pieces(centre, half)] if len(rows) > PIECE else [rows]


def halves(centre: F64, rows: I64) -> tuple[I64, I64]:
    """Triangles cut in two, halfway along the longest extent of their middles (m, 3)."""
    along = centre[rows, np.ptp(centre[rows], axis=0).argmax()]
    order = np.argsort(along, kind="stable")
    return np.sort(rows[order[: len(rows) // 2]]), np.sort(rows[order[len(rows) // 2 :]])


def seen_whole(points: F64, triangles: I32, surface: I64, report: Report) -> tuple[I32, F64]:
    """Of large surfaces, and of the halves and quarters of those that ``pieces`` cuts, those that are seen whole from one side:
    the chart of each triangle (m,) from 0, -1 for others, and its corners as they are seen from there, (m, 3, 2) [m]. What fills
    little of its rectangle then, as a road around a lake does, is halved further. triangles (m, 3) into points (n, 3) [m];
    surface (m,): the connected surface of each triangle. report(share) is called now and then and may raise to cancel."""
    chart, uv = np.full(len(triangles), -1, np.int32), np.zeros((len(triangles), 3, 2))
    waiting, count = large_surfaces(surface), 0
    if not waiting:
        return chart, uv
    corners = points[triangles]
    doubled = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    centre, looked_at = middle(corners), 0
    while waiting:
        rows = waiting.pop()
        looked_at += len(rows)
        report(looked_at / (looked_at + len(triangles)))
        seen = _seen_from_its_side(points, triangles[rows], doubled[rows])
        if seen is not None and (len(rows) <= LARGE or _fills_its_rectangle(seen)):
            chart[rows], uv[rows] = count + _connected(triangles[rows]), seen
            count = int(chart[rows].max()) + 1
        elif len(rows) > (PIECE if seen is None else LARGE):
            waiting += halves(centre, rows)
    return chart, uv


def _fills_its_rectangle(uv: F64) -> bool:
    """Whether triangles (m, 3, 2) cover much of the rectangle around them."""
    a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    covered = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2
    return bool(covered > FILLED * np.ptp(uv.reshape(-1, 2), axis=0).prod())


def _connected(triangles: I32) -> I64:
    """(m,) which of the connected parts each triangle belongs to, from 0."""
    joins = np.concatenate([triangles[:, :2], triangles[:, 1:]])
    label = groups_of(int(triangles.max()) + 1, joins)[1][triangles[:, 0]]
    return np.unique(label, return_inverse=True)[1]


def _seen_from_its_side(points: F64, triangles: I32, doubled: F64) -> F64 | None:
    """Triangles as they are seen along their mean normal, (m, 3, 2) [m]; None where some are turned away or hidden, or many are
    seen too steeply. doubled (m, 3): twice their areas, along their normals [m²]."""
    length = np.linalg.norm(doubled, axis=1)
    mean = doubled.sum(axis=0)
    if not np.linalg.norm(mean) > STEEP * length.sum():
        return None
    mean /= np.linalg.norm(mean)
    height = doubled @ mean
    if (height < EDGE_ON * length).any() or length[height < STEEP * length].sum() > MOST_STEEP * length.sum():
        return None
    borders = _borders(triangles)
    if borders is None:
        return None
    axis = np.eye(3)[np.abs(mean).argmin()]
    u = np.cross(axis, mean) / np.linalg.norm(np.cross(axis, mean))
    across = np.stack([u, np.cross(mean, u)], axis=1)
    lines = shapely.multilinestrings(shapely.linestrings(points[borders] @ across))
    covered = float(height.sum()) / 2
    if not shapely.is_simple(lines) or abs(shapely.area(shapely.build_area(lines)) - covered) > SAME * covered:
        return None
    box = shapely.get_coordinates(shapely.minimum_rotated_rectangle(lines))
    x, y = (box[1] - box[0]) / np.linalg.norm(box[1] - box[0])
    return np.asarray(points[triangles] @ across @ np.array([[x, -y], [y, x]]))


def _borders(triangles: I32) -> I32 | None:
    """The edges (b, 2) of one triangle alone; None where two triangles run along an edge the same way."""
    edges = np.concatenate([triangles[:, (k, (k + 1) % 3)] for k in range(3)])
    kind = distinct_rows(edges.min(axis=1), edges.max(axis=1))[1]
    up = edges[:, 0] < edges[:, 1]
    ways = np.bincount(kind[up], minlength=int(kind.max()) + 1), np.bincount(kind[~up], minlength=int(kind.max()) + 1)
    if max(way.max() for way in ways) > 1:
        return None
    return np.asarray(edges[(ways[0] + ways[1])[kind] == 1])
