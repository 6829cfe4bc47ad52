"""Occluders are the scene's triangles as the projections draw them: what casts shadows.

Straight edges [Wallner10, 5]. In the stereographic map an edge is an arc of a circle at least as large as the disc. Drawn
straight, it misses an arc of length s by at most s²/8. An edge of length l at a distance d has s <= l/d: it is right within a
texel, 1/R, if

    l <= d √(8 / R)

Edges are halved until they are as short as that at the distance ``NEAR``. What is nearer to the shooter keeps errors. Measured at
R = 256: share of the hemisphere that shows another item than the exact map, and pieces:

    NEAR            1        1/2      1/4      1/8
    cornell-box     1.6 %    0.29 %   0.04 %   0.005 %
                    1592     6336     25280    100992
    museum, median  14 %     2.8 %    0.6 %
                    10434    24578    71450
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.gpu import Gpu, Mesh, Texture, glsl_constant
from app.lightmap.lightmap import Lightmap
from app.lightmap.tile_pool import TilePool
from app.visibility.opacity import Sheer, sheer_triangles

NEAR = 0.25  # solver space: an eighth of the scene's diagonal
TRIANGLES_A_ROW = 512  # see visibility/projections/triangles.glsl
UNCHARTED = glsl_constant("common/item.glsl", "UNCHARTED")  # item of a side that has no texels
OCCLUDER = np.dtype([("in_position", "f4", 3), ("in_sides", "f4", 2)])
OCCLUDER_FORMAT = {"in_position": "3f", "in_sides": "2f"}
CASTER = np.dtype([("in_position", "f4", 3), ("in_sides", "f4", 2), ("in_normal", "f4", 3)])
CASTER_FORMAT = {"in_position": "3f", "in_sides": "2f", "in_normal": "3f"}


@dataclass(frozen=True)
class Casters:
    """What one draw of the map needs: a mesh, or so many vertices that find their triangles in textures. triangles: drawn.
    uniforms: where they are not opaque."""

    triangles: int
    mesh: Mesh | None = None
    vertices: int = 3
    textures: dict[str, Texture] = field(default_factory=dict)
    uniforms: dict[str, int] = field(default_factory=dict)


def occluders_of(gpu: Gpu, lightmap: Lightmap) -> list[Occluders]:
    """All triangles of the scene: those that are opaque, and apart from them those that are not."""
    sheer = sheer_triangles(lightmap.scene)
    opaque = np.ones(len(lightmap.scene.triangles), bool)
    opaque[sheer] = False
    kinds = ((np.flatnonzero(opaque), False), (sheer, True))
    return [Occluders(gpu, lightmap.pool, triangles, sheer=some) for triangles, some in kinds if len(triangles)]


class Occluders:
    """Triangles of the scene on the GPU. Whoever makes it releases it.

    count: of triangles; texture: three texels each, see visibility/projections/triangles.glsl; sheer: whether light may pass
    them.
    """

    def __init__(self, gpu: Gpu, pool: TilePool, which: NDArray[np.int64], *, sheer: bool) -> None:
        """which: the triangles (n,), in this order."""
        self._gpu, self._pool, self._which, self.sheer = gpu, pool, which, sheer
        vertices, triangles = occluders(pool, which)
        self._mesh = Mesh(gpu, vertices.tobytes(), OCCLUDER_FORMAT, indices=triangles.tobytes())
        self.count = len(triangles)
        rows = -(-self.count // TRIANGLES_A_ROW)
        texels = np.zeros((rows * TRIANGLES_A_ROW, 3, 4), np.float32)
        self._corners, self._sides = texels[: self.count, :, :3], texels[: self.count, :2, 3]
        self._corners[:] = np.ascontiguousarray(vertices["in_position"]).take(triangles, axis=0)
        self._sides[:] = vertices["in_sides"][: self.count]
        self.texture = gpu.texture((3 * TRIANGLES_A_ROW, rows), 4, "f4", texels.tobytes())
        self._table = Sheer(gpu, pool, which) if sheer else None
        self._split: tuple[int, Mesh, Sheer | None] | None = None

    @property
    def opacity(self) -> dict[str, Texture]:
        """Of the triangles, to bind; none where they are opaque."""
        return self._table.textures if self._table is not None else {}

    def whole(self, resolution: int) -> Casters:
        """The triangles as they are, indexed."""
        return Casters(self.count, mesh=self._mesh, textures=self.opacity, uniforms=self._rows(self.count))

    def fetched(self, resolution: int) -> Casters:
        """Three vertices for each triangle, which fetch all of it."""
        textures = {"t_triangles": self.texture} | self.opacity
        return Casters(self.count, vertices=3 * self.count, textures=textures, uniforms=self._rows(self.count))

    def tessellated(self, resolution: int) -> Casters:
        """Triangles whose edges are short enough to be drawn straight in a map of this resolution."""
        if self._split is None or self._split[0] != resolution:
            self._drop_split()
            vertices, indices, parent = split_mesh(self._corners, self._sides, edge_limit(resolution))
            mesh = Mesh(self._gpu, vertices.tobytes(), CASTER_FORMAT, indices=indices.tobytes())
            table = Sheer(self._gpu, self._pool, self._which[parent]) if self.sheer else None
            self._split = resolution, mesh, table
            self._pieces = len(indices)
        _, mesh, table = self._split
        return Casters(self._pieces, mesh, textures=table.textures if table else {}, uniforms=self._rows(self._pieces))

    def _rows(self, count: int) -> dict[str, int]:
        return {"u_sheer": count} if self.sheer else {}

    def _drop_split(self) -> None:
        if self._split is not None:
            _, mesh, table = self._split
            for part in (mesh, table):
                if part is not None:
                    part.release()
            self._split = None

    def release(self) -> None:
        self._drop_split()
        self._gpu.release_all(self._mesh, self.texture)
        if self._table is not None:
            self._table.release()


def occluders(pool: TilePool, which: NDArray[np.int64]) -> tuple[Any, NDArray[np.uint32]]:
    """What a shooter sees of triangles (m,): vertices (v,) OCCLUDER and triangles (m, 3) u32.

    in_sides: the items of front and back, facet from 1 or UNCHARTED, of the one triangle that has this vertex last (flat values
    come from there). The other two corners share any vertex in their place: one vertex per triangle, not three.
    """
    scene, charts, count = pool.scene, pool.charts, len(which)
    sides = np.full((len(scene.triangles), 2), UNCHARTED, np.float32)
    sides[charts.face_triangle, charts.face_back.astype(int)] = charts.face_facet + 1
    corners = scene.triangles[which]
    last = corners[:, 2]
    vertex_at = np.full(len(scene.positions), -1, np.int64)
    vertex_at[corners] = -2
    vertex_at[last] = np.arange(count)
    bare = np.flatnonzero(vertex_at == -2)
    vertex_at[bare] = count + np.arange(len(bare))
    vertices = np.zeros(count + len(bare), OCCLUDER)
    vertices["in_position"] = pool.space.local_from_world(scene.positions[np.concatenate([last, bare])])
    vertices["in_sides"][:count] = sides[which]
    triangles = np.column_stack([vertex_at[corners[:, :2]], np.arange(count)])
    return vertices, triangles.astype(np.uint32)


def edge_limit(resolution: int) -> float:
    """The longest edge to be drawn straight, solver space."""
    return NEAR * math.sqrt(8 / resolution)


def halved(corners: NDArray[np.float32], limit: float) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Triangles (m, 3, 3), the longest edge of each halved until none is longer than ``limit``: pieces (p, 3, 3), and the
    triangle (p,) of each. Neighbours stay neighbours: whether and where an edge is cut follows from its ends alone."""
    pieces, parents = [], []
    parent = np.arange(len(corners))
    while len(corners):
        following = np.roll(corners, -1, axis=1)
        squared = ((following - corners) ** 2).sum(-1)
        longest = squared.argmax(1)
        done = squared.max(1) <= limit**2
        pieces.append(corners[done])
        parents.append(parent[done])
        # begin at the longest edge: a b c, with m between a and b
        turn = (longest[~done, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(corners[~done], turn[..., None], 1).swapaxes(0, 1)
        m = (a + b) * np.float32(0.5)
        corners = np.concatenate([np.stack([a, m, c], 1), np.stack([m, b, c], 1)])
        parent = np.tile(parent[~done], 2)
    return np.concatenate(pieces), np.concatenate(parents)


def split_mesh(
    corners: NDArray[np.float32], sides: NDArray[np.float32], limit: float
) -> tuple[NDArray[np.generic], NDArray[np.uint32], NDArray[np.int64]]:
    """Triangles (m, 3, 3) with sides (m, 2) in pieces: vertices (v,) CASTER, indices (p, 3) u32, the triangle (p,) of each. As in
    ``occluders``, each piece ends in a vertex of its own, which holds its values."""
    pieces, parent = halved(corners, limit)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).astype(np.float64)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    points, point = np.unique(pieces.reshape(-1, 3), axis=0, return_inverse=True)
    point = point.reshape(-1, 3)
    count = len(pieces)
    vertex_at = np.full(len(points), -1, np.int64)
    vertex_at[point[:, 2]] = np.arange(count)
    bare = np.flatnonzero(vertex_at < 0)
    vertex_at[bare] = count + np.arange(len(bare))
    vertices = np.zeros(count + len(bare), CASTER)
    vertices["in_position"] = np.concatenate([pieces[:, 2], points[bare]])
    vertices["in_sides"][:count] = sides[parent]
    vertices["in_normal"][:count] = normals[parent]
    return vertices, np.column_stack([vertex_at[point[:, :2]], np.arange(count)]).astype(np.uint32), parent
