"""The sky on the GPU: its map, tables by which directions are chosen in proportion to its light, and what a normal receives."""

from __future__ import annotations

import numpy as np

from app.gpu import Gpu, Texture, glsl_constant
from app.lightmap.textures import upload
from app.scene.model import F32, F64
from app.scene.sky import Sky, solid_angles

NORMALS = int(glsl_constant("direct_light/sky_light.frag.glsl", "NORMALS"))  # along the edge of the octahedron's square
MOST_COLUMNS = 512  # of the tables: a sun among the pixels of a picture is found, and the search stays short


def sky_textures(gpu: Gpu, sky: Sky) -> dict[str, Texture]:
    """Its map, and the tables by which directions are chosen: see direct_light/sky_sample.glsl."""
    rows, columns = chances(sky.shape)
    light = upload(gpu, sky.shape)
    light.filter = (gpu.ctx.LINEAR, gpu.ctx.LINEAR)
    light.repeat_x = True
    return {"t_sky": light, "t_sky_rows": upload(gpu, rows), "t_sky_columns": upload(gpu, columns)}


def is_even(sky: Sky) -> bool:
    """Whether its light is the same from everywhere."""
    return bool((sky.shape == sky.shape[0, 0]).all())


def chances(shape: F32) -> tuple[F32, F32]:
    """Of a map (h, w, 3): chances of its rows, summed up, side by side (1, rows, 1); in each row those of its pixels, summed up,
    and the density of directions there over the map's unit square (rows, columns, 2)."""
    light = _as_interpolated(shape.mean(2, dtype=np.float64))
    step = -(-light.shape[1] // MOST_COLUMNS)
    height, width = max(light.shape[0] // step, 1), max(light.shape[1] // step, 1)
    light = light[: height * step, : width * step].reshape(height, step, width, step).mean((1, 3))
    weight = np.maximum(light, 1e-300) * solid_angles(width, height)
    rows = weight.sum(1)
    within = np.cumsum(weight, axis=1) / rows[:, None]
    within[:, -1] = 1.0
    density = weight / weight.sum() * (width * height)
    return _ends(np.cumsum(rows) / rows.sum()), np.stack([within, density], axis=-1).astype(np.float32)


def _as_interpolated(light: F64) -> F64:
    """(h, w) the mean over each pixel of what lies linearly between the middles of pixels: none that reaches into a pixel may
    be missed there, where directions lie far apart."""
    rows = np.concatenate([light[:1], light, light[-1:]])
    light = 0.125 * (rows[:-2] + rows[2:]) + 0.75 * light
    return np.asarray(0.125 * (np.roll(light, 1, 1) + np.roll(light, -1, 1)) + 0.75 * light)


def _ends(summed: F64) -> F32:
    summed[-1] = 1.0
    return np.asarray(summed[None, :, None], np.float32)


def irradiance_table(sky: Sky) -> F32:
    """(NORMALS, NORMALS, 4): what each normal receives of the sky's shape, unoccluded [W/m² per unit of its scale], on the nodes
    of a square onto which the octahedron is unfolded, see common/atlas.glsl."""
    x, y = np.meshgrid(*[np.linspace(-1, 1, NORMALS)] * 2)
    z = 1 - np.abs(x) - np.abs(y)
    sign_x, sign_y = np.where(x >= 0, 1, -1), np.where(y >= 0, 1, -1)
    folded = np.where(z < 0, [(1 - np.abs(y)) * sign_x, (1 - np.abs(x)) * sign_y], [x, y])
    normals = np.stack([*folded, z], axis=-1).reshape(-1, 3)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    out = np.zeros((NORMALS, NORMALS, 4), np.float32)
    out[..., :3] = sky.shape_irradiance(normals).reshape(NORMALS, NORMALS, 3)
    return out


__all__ = ["NORMALS", "chances", "irradiance_table", "is_even", "sky_textures"]
