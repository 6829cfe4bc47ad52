"""What a material's textures and vertex colours put on each texel: the texture averaged over the texel's footprint, of what is
cut out of it over the rest, the colour at its centroid, which is the mean of what varies linearly.

Mip levels average a texture by area; each texel takes SAMPLES² bilinear look-ups at the level whose pixels are as large
as what a look-up stands for [Williams83].
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.points import barycentric
from app.atlas.texels import Leaves, TexelSurfaces, faces_tangents
from app.scene.model import F32, F64, I32, Material, Scene, Texture

__all__ = ["colours_at", "faces_tangents", "look_up", "texel_colours", "texel_opacity", "texture_coordinates"]

SAMPLES = 2  # look-ups along each side of a texel
CUT_OUT_SAMPLES = 8  # where each says yes or no
BLOCK = 1 << 17  # texels in work at a time


def texel_colours(
    scene: Scene, charts: Charts, leaves: Leaves, surfaces: TexelSurfaces
) -> tuple[F32 | None, F32 | None]:
    """Albedo and emission textures on every texel, (n, t, t, 3) f32, the albedo's times the scene's vertex colours: 1 where
    there is neither.

    None where nothing in use has one. The material's factors are not included.
    """
    albedo = {m: _weighted(material, material.albedo_texture) for m, material in enumerate(scene.materials)}
    emission = {m: _weighted(material, material.emission_texture) for m, material in enumerate(scene.materials)}
    painted = _colours(scene, charts, leaves, surfaces, albedo)
    if scene.colours is not None:
        painted = _vertex_colours(scene, charts, surfaces) * (1 if painted is None else painted)
    return painted, _colours(scene, charts, leaves, surfaces, emission)


def _vertex_colours(scene: Scene, charts: Charts, surfaces: TexelSurfaces) -> F32:
    """(n, t, t, 3) at the centroids of the texels, 1 where there is no surface."""
    assert scene.colours is not None
    out = np.ones((*surfaces.face.shape, 3), np.float32)
    covered = surfaces.face >= 0
    triangle = charts.face_triangle[surfaces.face[covered]]
    out[covered] = colours_at(scene, triangle, barycentric(surfaces.position[covered], scene.corners[triangle]))
    return out


def colours_at(scene: Scene, triangle: NDArray[np.integer[Any]], weights: F64) -> F32:
    """(n, 3) the vertex colours at points, by the weights (n, 3) of their triangles' corners; of points beside a triangle, those
    of its nearest corners."""
    assert scene.colours is not None
    inside = np.clip(weights, 0.0, 1.0)
    inside /= inside.sum(axis=1, keepdims=True)
    return np.asarray(np.einsum("nk,nkc->nc", inside, scene.colours[triangle]), np.float32)


def texel_opacity(scene: Scene, charts: Charts, leaves: Leaves, surfaces: TexelSurfaces) -> F32 | None:
    """The share of its surface that is there on every texel, (n, t, t) f32; None where all of it is."""
    if all(material.opaque for material in scene.materials):
        return None
    factor = np.array([1.0 if m.opacity_cutoff is not None else m.opacity for m in scene.materials], np.float32)
    textures = {m: _cut_out(material) for m, material in enumerate(scene.materials)}
    shares = _colours(scene, charts, leaves, surfaces, textures)
    there = factor[scene.material_ids[charts.face_triangle[surfaces.face]]]
    return there if shares is None else there * shares[..., 0]


@dataclasses.dataclass(frozen=True, eq=False)
class _CutOut(Texture):
    """A texture of opacity that is all there from a threshold on, and else not at all."""

    threshold: float = 0.0

    def looked_up(self, value: F32) -> F32:
        return (value >= self.threshold).astype(np.float32)


def _cut_out(material: Material) -> Texture | None:
    texture, cutoff = material.opacity_texture, material.opacity_cutoff
    if texture is None or cutoff is None:
        return texture
    return _CutOut(**vars(texture), threshold=cutoff / material.opacity)


def _weighted(material: Material, texture: Texture | None) -> Texture | None:
    """The texture, or where an opacity lies on it pixel by pixel, one of the product and, in a fourth channel, the opacity."""
    over = _cut_out(material)
    if texture is None or over is None or over.pixels.shape[:2] != texture.pixels.shape[:2]:
        return texture
    if over.texcoord != texture.texcoord or not np.array_equal(over.uv_transform, texture.uv_transform):
        return texture
    weight = over.looked_up(over.pixels) if isinstance(over, _CutOut) else over.pixels
    return dataclasses.replace(texture, pixels=np.concatenate([texture.pixels * weight, weight], axis=2))


def _unweighted(colours: F32, pixels: F32) -> F32:
    """The colours (n, 3) of means (n, 4) of ``_weighted``; where nothing is there, that of all that is."""
    mean = pixels.mean(axis=(0, 1))
    there = colours[:, 3:] > 1e-6
    return np.where(there, colours[:, :3] / np.where(there, colours[:, 3:], 1.0), mean[:3] / max(float(mean[3]), 1e-6))


def _colours(
    scene: Scene, charts: Charts, leaves: Leaves, surfaces: TexelSurfaces, textures: dict[int, Texture | None]
) -> F32 | None:
    """(n, t, t, 3) f32, of opacities (n, t, t, 1)."""
    face = surfaces.face.reshape(-1)
    materials = scene.material_ids[charts.face_triangle]
    colours: F32 | None = None
    for material in np.unique(materials):
        texture = textures[int(material)]
        coordinates = None if texture is None else texture_coordinates(scene, texture)
        if texture is None or coordinates is None:
            continue
        channels = min(texture.pixels.shape[2], 3)
        if colours is None:
            colours = np.ones((len(face), channels), np.float32)
        levels = _mip_levels(texture)
        mine = np.flatnonzero((face >= 0) & (np.append(materials, -1)[face] == material))
        for block in np.split(mine, range(BLOCK, len(mine), BLOCK)):
            f = face[block]
            at, du, dv = _footprints(charts, leaves, surfaces, scene, f, block, coordinates[charts.face_triangle[f]])
            mean = _average(texture, levels, at, du, dv)
            colours[block] = _unweighted(mean, texture.pixels) if texture.pixels.shape[2] == 4 else mean
    return None if colours is None else colours.reshape(*surfaces.face.shape, -1)


def _footprints(
    charts: Charts, leaves: Leaves, surfaces: TexelSurfaces, scene: Scene, face: I32, texel: NDArray[np.int64], uv: F64
) -> tuple[F64, F64, F64]:
    """Texture coordinates (n, 2) of the texels' centroids, and their change over one texel along u and along v.

    face, texel (n,); uv (n, 3, 2): texture coordinates of each face's corners.
    """
    triangle = charts.face_uv[face]
    d1, d2 = triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    t1, t2 = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    scale = 1 / (d1[:, :1] * d2[:, 1:] - d1[:, 1:] * d2[:, :1])
    per_u, per_v = (t1 * d2[:, 1:] - t2 * d1[:, 1:]) * scale, (t2 * d1[:, :1] - t1 * d2[:, :1]) * scale
    position = surfaces.position.reshape(-1, 3)[texel]
    weights = barycentric(position, scene.corners[charts.face_triangle[face]])
    at = uv[:, 0] + weights[:, 1:2] * t1 + weights[:, 2:] * t2
    size = 0.5 ** leaves.level[texel // charts.tile**2][:, None]
    return at, per_u * size, per_v * size


def _average(texture: Texture, levels: list[F32], at: F64, du: F64, dv: F64) -> F32:
    """Mean of the texture over the parallelograms at ± du/2 ± dv/2, (n, channels)."""
    height, width, channels = texture.pixels.shape
    extent = np.array([width, height])
    samples = CUT_OUT_SAMPLES if isinstance(texture, _CutOut) else SAMPLES
    step = np.maximum(np.linalg.norm(du * extent, axis=1), np.linalg.norm(dv * extent, axis=1)) / samples
    level = np.clip(np.round(np.log2(np.maximum(step, 1.0))), 0, len(levels) - 1).astype(np.int32)
    total = np.zeros((len(at), channels))
    offsets = (np.arange(samples) + 0.5) / samples - 0.5
    for number in np.unique(level):
        mine = level == number
        for a in offsets:
            for b in offsets:
                seen = look_up(texture, levels[number], at[mine] + a * du[mine] + b * dv[mine])
                total[mine] += texture.looked_up(seen) if number == 0 and isinstance(texture, _CutOut) else seen
    return (total / samples**2).astype(np.float32)


def texture_coordinates(scene: Scene, texture: Texture) -> F64 | None:
    """(m, 3, 2) where in the texture the corners of each triangle lie; None where the scene has no coordinates for it."""
    uv = (scene.uv0, scene.uv1)[texture.texcoord]
    return None if uv is None else uv @ texture.uv_transform[:, :2].T + texture.uv_transform[:, 2]


def look_up(texture: Texture, pixels: F32, at: F64) -> F32:
    """One look-up per texture coordinate (n, 2) in one mip level, (n, channels)."""
    size = np.array([pixels.shape[1], pixels.shape[0]])
    place = at * size
    if not texture.bilinear:
        column, row = (_wrap(np.floor(place[:, k]), int(size[k]), texture.wrap[k]) for k in range(2))
        return np.asarray(pixels[row, column])
    low = np.floor(place - 0.5)
    share = (place - 0.5 - low).astype(np.float32)
    left, right = (_wrap(low[:, 0] + k, int(size[0]), texture.wrap[0]) for k in range(2))
    top, bottom = (_wrap(low[:, 1] + k, int(size[1]), texture.wrap[1]) for k in range(2))
    s, t = share[:, :1], share[:, 1:]
    upper = pixels[top, left] * (1 - s) + pixels[top, right] * s
    lower = pixels[bottom, left] * (1 - s) + pixels[bottom, right] * s
    return np.asarray(upper * (1 - t) + lower * t, np.float32)


def _wrap(index: F64, size: int, mode: str) -> NDArray[np.int64]:
    """Pixel numbers in [0, size) for whole numbers outside it."""
    if mode == "clamp":
        return np.asarray(np.clip(index, 0, size - 1), np.int64)
    if mode == "mirror":
        back_and_forth = np.mod(index, 2 * size)
        return np.asarray(np.minimum(back_and_forth, 2 * size - 1 - back_and_forth), np.int64)
    assert mode == "repeat", mode
    return np.asarray(np.mod(index, size), np.int64)


def _mip_levels(texture: Texture) -> list[F32]:
    """The image and its area averages at half, a quarter ... of its size, down to one pixel; of a cut-out, of what is there."""
    levels = [texture.looked_up(texture.pixels) if isinstance(texture, _CutOut) else texture.pixels]
    while max(levels[-1].shape[:2]) > 1:
        levels.append(_halved(_halved(levels[-1], 0), 1))
    return [texture.pixels, *levels[1:]]


def _halved(pixels: F32, axis: int) -> F32:
    """Area average to half the pixels along an axis, rounded down; every old pixel weighs the same."""
    size = pixels.shape[axis]
    smaller = max(size // 2, 1)
    if size == 2 * smaller:
        even, odd = (pixels.take(np.arange(k, size, 2), axis) for k in range(2))
        return np.asarray((even + odd) / 2, np.float32)
    moved = np.moveaxis(pixels, axis, 0).astype(np.float64)
    running = np.concatenate([np.zeros_like(moved[:1]), np.cumsum(moved, axis=0)])
    edges = np.arange(smaller + 1) * (size / smaller)
    below = np.minimum(edges.astype(np.int64), size - 1)
    share = (edges - below).reshape(-1, *[1] * (moved.ndim - 1))
    sums = running[below] + share * moved[below]
    return np.asarray(np.moveaxis(np.diff(sums, axis=0) * (smaller / size), 0, axis), np.float32)
