"""What lies under a pixel: the scene drawn once more, into that pixel alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from app.gpu import Gpu, Pass
from app.lightmap.lightmap import Lightmap
from app.render.surfaces import Surfaces, uniform_matrix
from app.scene.model import F64


@dataclass(frozen=True)
class PickHit:
    """A point of a surface.

    triangle, material: of the scene. back: whether its back side is seen. position (x, y, z) [m]. None where that side
    has no texels: facet, from 0; atlas_uv, in atlas texels; texel (column, row) in the tile-pool textures; tile of the
    lightmap and tile_texel (column, row) in it.
    """

    triangle: int
    back: bool
    material: int
    position: tuple[float, float, float]
    facet: int | None = None
    atlas_uv: tuple[float, float] | None = None
    texel: tuple[int, int] | None = None
    tile: int | None = None
    tile_texel: tuple[int, int] | None = None


class Picker:
    """Owns the one-pixel target. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu) -> None:
        self._textures = [gpu.texture((1, 1), 2, "u4"), gpu.texture((1, 1), 4, "f4"), gpu.texture((1, 1), 4, "f4")]
        self._gpu, self._pass = gpu, Pass(gpu, "render/pick")
        self._sheer_pass: Pass | None = None
        self._depth = gpu.depth_texture((1, 1))
        self._target = gpu.target(*self._textures, depth=self._depth)

    def pick(self, surfaces: Surfaces, clip_from_local: F64, centre: F64, extent: F64) -> PickHit | None:
        """The nearest surface that a pixel sees: its centre (2,) and extent (2,) in the picture from -1 to 1, +y up.
        Waits for the GPU."""
        zoom = np.diag([2 / extent[0], 2 / extent[1], 1.0, 1.0])
        zoom[:2, 3] = -centre * zoom.diagonal()[:2]
        clip_from_local = zoom @ clip_from_local
        self._target.use()
        self._target.clear(depth=1.0)
        self._pass.draw(
            self._target,
            uniforms={"u_clip_from_local": uniform_matrix(clip_from_local)},
            mesh=surfaces.mesh.seen(clip_from_local),
            depth=True,
        )
        sheer = surfaces.mesh.sheer
        if sheer is not None:
            self._sheer_pass = self._sheer_pass or Pass(self._gpu, "render/pick", defines={"OPACITY": True})
            for mesh in sheer.meshes:
                uniforms = {"u_clip_from_local": uniform_matrix(clip_from_local)}
                self._sheer_pass.draw(self._target, textures=sheer.textures, uniforms=uniforms, mesh=mesh, depth=True)
        ids, atlas, local = (
            np.frombuffer(texture.read(), dtype)
            for texture, dtype in zip(self._textures, (np.uint32, np.float32, np.float32), strict=True)
        )
        if ids[0] == 0:
            return None
        lightmap, nth, back = surfaces.lightmap, int(ids[0]) - 1, bool(ids[1] & 1)
        triangle = int(sheer.triangles[nth]) if sheer is not None and ids[1] & 2 else surfaces.mesh.triangle(nth)
        x, y, z = lightmap.space.world_from_local(local[:3].astype(np.float64)).tolist()
        hit = PickHit(triangle, back, int(lightmap.scene.material_ids[triangle]), (x, y, z))
        charts = lightmap.charts
        face = np.flatnonzero((charts.face_triangle == triangle) & (charts.face_back == back))
        if not len(face):
            return hit
        facet, atlas_uv = int(charts.face_facet[face[0]]), (float(atlas[0]), float(atlas[1]))
        return with_texel(replace(hit, facet=facet, atlas_uv=atlas_uv), lightmap)

    def release(self) -> None:
        self._gpu.release_all(self._target, self._depth, *self._textures)


def with_texel(hit: PickHit, lightmap: Lightmap) -> PickHit:
    """The same point with the texel that it has now: quadtrees change."""
    uv = hit.atlas_uv
    tile = -1 if uv is None else lightmap.pool.slot_at(uv)
    if uv is None or tile < 0:
        return replace(hit, texel=None, tile=None, tile_texel=None)
    leaves, edge = lightmap.pool.leaves, lightmap.pool.tile
    finer = 2 ** int(leaves.level[tile])
    inside = (int(uv[0] * finer) - int(leaves.x[tile]) * edge, int(uv[1] * finer) - int(leaves.y[tile]) * edge)
    texel = (tile % lightmap.columns * edge + inside[0], tile // lightmap.columns * edge + inside[1])
    return replace(hit, texel=texel, tile=tile, tile_texel=inside)
