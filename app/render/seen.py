"""Which texels a camera sees: rays through a coarse raster of pixels, each against the triangles whose bounding rectangle in the
picture it lies in. On the CPU: a scene is exposed before there is anything to draw.

What is not opaque is looked through, so that a pane of glass is not taken for what lies behind it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.atlas.points import SideIndex
from app.atlas.sides import least, most
from app.lightmap.tile_pool import TilePool
from app.scene.model import F64, Scene

ROWS, MOST_COLUMNS = 36, 144  # rays in a picture
ASPECT = 16 / 9  # of a picture that is not known yet
PAIRS = 1 << 20  # rays and triangles in work at a time
TRIANGLES = 1 << 18  # that are projected at a time
NEAREST = 1e-6  # of the largest coordinate, in front of the eye: what is nearer is projected nowhere

Ints = NDArray[np.int64]


class Texels(NamedTuple):
    """Of a tile pool: slot, row and column in it, (n,) each."""

    slot: Ints
    row: Ints
    column: Ints


def seen_texels(pool: TilePool, world_from_camera: F64, yfov: float, aspect: float = ASPECT) -> Texels:
    """A texel for each ray that meets a side with texels; aspect: width / height of the picture."""
    triangle, back, weights = _first_hits(pool.scene, world_from_camera, yfov, aspect)
    charts = pool.charts
    face = SideIndex(charts.face_triangle, charts.face_back).find(triangle, back)
    uv = np.einsum("nk,nkc->nc", weights, charts.face_uv[face])[face >= 0]
    slot = pool.slots_at(uv)
    uv, slot = uv[slot >= 0], slot[slot >= 0]
    leaves = pool.leaves
    place = (
        np.floor(uv * 2.0 ** leaves.level[slot][:, None]).astype(np.int64)
        - pool.tile * np.stack([leaves.x, leaves.y], 1)[slot]
    )
    column, row = np.clip(place, 0, pool.tile - 1).T
    there = pool.surfaces.face[slot, row, column] >= 0
    return Texels(slot[there], row[there], column[there])


def _first_hits(
    scene: Scene, world_from_camera: F64, yfov: float, aspect: float
) -> tuple[Ints, NDArray[np.bool_], F64]:
    """The first opaque triangle of each ray that meets any (n,), whether its back, and weights of its corners (n, 3)."""
    height = np.tan(yfov / 2)
    size = np.array([min(max(1, round(ROWS * aspect)), MOST_COLUMNS), ROWS])
    half = np.array([height * aspect, height])
    opaque = np.flatnonzero(np.array([m.opaque for m in scene.materials])[scene.material_ids])
    nearest = np.full(size.prod(), np.inf)
    hit, weights = np.full(size.prod(), -1), np.zeros((size.prod(), 3))
    for some in np.split(opaque, range(TRIANGLES, len(opaque), TRIANGLES)):
        corners = (scene.corners[some] - world_from_camera[:3, 3]) @ world_from_camera[:3, :3]
        low, high = _rectangles(corners, half, size)
        wide = np.maximum(high - low, 0)
        met = np.flatnonzero(wide.prod(1))
        ends = np.cumsum(wide[met].prod(1))
        for block in np.split(met, np.searchsorted(ends, np.arange(PAIRS, ends[-1] if len(ends) else 0, PAIRS))):
            count = wide[block].prod(1)
            which = np.repeat(block, count)
            nth = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
            px = low[which] + np.stack([nth % wide[which, 0], nth // wide[which, 0]], 1)
            ray = np.append((2 * (px + 0.5) / size - 1) * half, np.full((len(px), 1), -1.0), axis=1)
            away, bary = _met(ray, corners[which])
            pixel = px[:, 1] * size[0] + px[:, 0]
            order = np.lexsort((away, pixel))
            first = order[np.r_[True, pixel[order][1:] != pixel[order][:-1]]] if len(order) else order
            first = first[away[first] < nearest[pixel[first]]]
            at = pixel[first]
            nearest[at], hit[at], weights[at] = away[first], some[which[first]], bary[first]
    met_at = np.flatnonzero(hit >= 0)
    triangle = hit[met_at]
    normal = scene.normals_areas[0][triangle]
    point = np.einsum("nk,nkc->nc", weights[met_at], scene.corners[triangle])
    back = np.einsum("nc,nc->n", normal, point - world_from_camera[:3, 3]) > 0
    return triangle, back, weights[met_at]


def _rectangles(corners: F64, half: F64, size: Ints) -> tuple[Ints, Ints]:
    """First pixel and end (n, 2) of those whose middles triangles (n, 3, 3) may cover; camera space, half: of the picture at
    distance 1."""
    depth = -corners[:, :, 2]
    near = NEAREST * max(float(np.abs(corners).max(initial=0.0)), 1e-30)
    place = (corners[:, :, :2] / np.maximum(depth, near)[:, :, None] / half + 1) / 2 * size
    low, high = np.ceil(least(place) - 0.5), np.floor(most(place) - 0.5) + 1
    cut = (least(depth) <= near)[:, None]
    low, high = np.where(cut, 0, low), np.where(cut, size, high)
    high = np.where((most(depth) <= near)[:, None], 0, high)
    return np.clip(low, 0, size).astype(np.int64), np.clip(high, 0, size).astype(np.int64)


def _met(ray: F64, corners: F64) -> tuple[F64, F64]:
    """How far along rays (n, 3) from the origin their triangles (n, 3, 3) are, infinite where they are missed, and the weights of
    the corners (n, 3) [Moller97]."""
    a, b, c = np.moveaxis(corners, 1, 0)
    parts = np.stack([np.einsum("nk,nk->n", ray, np.cross(*edge)) for edge in ((b, c), (c, a), (a, b))], 1)
    total = parts.sum(1)
    inside = ((parts >= 0).all(1) | (parts <= 0).all(1)) & (total != 0)
    weights = parts / np.where(inside, total, 1.0)[:, None]
    away = -np.einsum("nk,nk->n", weights, corners[:, :, 2])
    return np.where(inside & (away > 0), away, np.inf), weights
