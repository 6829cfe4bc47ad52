"""Which places of a scene's surfaces let light pass, in textures: see visibility/opacity.glsl.

t_sheer  RGBA32F  four texels for each triangle whose material is not opaque: the place in the picture of its opacity [px] is
                  affine in the position (solver space), gradient and offset of u, then of v; rectangle of the picture in
                  t_alpha [px], of width 0 where there is none; opacity, its cutoff or -1, how places beyond the edges wrap
                  around, whether the picture is interpolated
t_alpha  R16F     the pictures, side by side
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.atlas.materials import texture_coordinates
from app.gpu import Gpu, Texture, glsl_constant
from app.lightmap.textures import upload
from app.lightmap.tile_pool import TilePool
from app.scene.model import F32, F64, Scene

A_ROW = int(glsl_constant("visibility/opacity.glsl", "SHEER_A_ROW"))
WRAPS = {"repeat": 0, "clamp": 1, "mirror": 2}
WIDTH = 8192  # px, of pictures side by side, unless one is wider: the loader shrinks them to 2048


def sheer_triangles(scene: Scene) -> NDArray[np.int64]:
    """Those whose material lets light pass somewhere."""
    return np.flatnonzero(~np.array([m.opaque for m in scene.materials])[scene.material_ids])


class Sheer:
    """The triangles of a tile pool that light may pass. Whoever makes it releases it.

    triangles: their numbers in the scene, in the order of rows. textures: to bind, by name.
    """

    def __init__(self, gpu: Gpu, pool: TilePool, triangles: NDArray[np.int64]) -> None:
        """triangles: that have rows, in this order; a triangle may have several."""
        self._gpu, self.triangles = gpu, triangles
        alpha, rects = _side_by_side(pool.scene)
        rows = _rows(pool, triangles, rects)
        filled = np.zeros((-(-max(len(rows), 1) // A_ROW) * A_ROW, 4, 4), np.float32)
        filled[: len(rows)] = rows
        table = filled.reshape(-1, 4 * A_ROW, 4)
        self.textures: dict[str, Texture] = {"t_sheer": upload(gpu, table), "t_alpha": upload(gpu, alpha)}

    def release(self) -> None:
        self._gpu.release_all(*self.textures.values())


def _side_by_side(scene: Scene) -> tuple[NDArray[np.float16], dict[int, tuple[int, int, int, int]]]:
    """All pictures of opacity (h, w, 1), and the rectangle (x, y, width, height) of each by the id of its pixels: in rows, the
    tallest first."""
    pictures = {id(t.pixels): t.pixels for m in scene.materials if (t := m.opacity_texture) is not None}
    rects: dict[int, tuple[int, int, int, int]] = {}
    x = y = row = 0
    for key, pixels in sorted(pictures.items(), key=lambda item: -item[1].shape[0]):
        height, width = pixels.shape[:2]
        if x + width > WIDTH and x:
            x, y, row = 0, y + row, 0
        rects[key] = (x, y, width, height)
        x, row = x + width, max(row, height)
    right = max((x + width for x, _, width, _ in rects.values()), default=1)
    image = np.zeros((y + row or 1, right, 1), np.float16)
    for key, (x, y, width, height) in rects.items():
        image[y : y + height, x : x + width] = pictures[key]
    return image, rects


def _rows(pool: TilePool, triangles: NDArray[np.int64], rects: dict[int, tuple[int, int, int, int]]) -> F32:
    """(n, 4, 4), see above."""
    scene = pool.scene
    corners = pool.space.local_from_world(scene.positions)[scene.triangles[triangles]]
    rows = np.zeros((len(triangles), 4, 4), np.float32)
    materials = scene.material_ids[triangles]
    for number in np.unique(materials).tolist():
        material, mine = scene.materials[number], np.flatnonzero(materials == number)
        texture = material.opacity_texture
        cutoff = -1.0 if material.opacity_cutoff is None else material.opacity_cutoff
        rows[mine, 3, :2] = material.opacity, cutoff
        coordinates = None if texture is None else texture_coordinates(scene, texture)
        if texture is None or coordinates is None:
            continue
        x, y, width, height = rects[id(texture.pixels)]
        rows[mine, 2] = x, y, width, height
        rows[mine, 3, 2:] = WRAPS[texture.wrap[0]] + 3 * WRAPS[texture.wrap[1]], texture.bilinear
        rows[mine, :2] = _affine(corners[mine], coordinates[triangles[mine]] * [width, height])
    return rows


def _affine(corners: F64, values: F64) -> F64:
    """(n, 2, 4) gradients in the plane and offsets of what takes two values (n, 3, 2) at the corners (n, 3, 3) of triangles."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(a, b)
    squared = np.einsum("nk,nk->n", normal, normal)[:, None]
    along_a, along_b = (
        np.cross(b, normal) / squared,
        np.cross(normal, a) / squared,
    )  # 1 along their own edge, 0 along the other
    da, db = values[:, 1] - values[:, 0], values[:, 2] - values[:, 0]
    gradient = da[:, :, None] * along_a[:, None] + db[:, :, None] * along_b[:, None]
    offset = values[:, 0] - np.einsum("nck,nk->nc", gradient, corners[:, 0])
    return np.concatenate([gradient, offset[:, :, None]], axis=2)
