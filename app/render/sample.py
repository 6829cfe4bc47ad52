"""The light on an even sample of the tiles, with one texture read back: means and percentiles that no frame waits long for."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.lightmap.lightmap import Lightmap
from app.lightmap.options import STORAGE
from app.lightmap.tile_pool import TilePool
from app.render.seen import Texels
from app.scene.model import F32, RGB

SAMPLED = 1 << 18  # texels that means are taken over, evenly spread


def sampled_tiles(pool: TilePool) -> slice:
    """Tiles that means are taken over, evenly spread. A small lamp lies in few of them: r̄ is that of all."""
    return slice(None, None, max(1, pool.tiles * pool.tile**2 // SAMPLED))


def sampled_colours(pool: TilePool, factors: list[RGB], colours: F32 | None, sample: slice) -> F32:
    """A material's factor on each texel of the sampled tiles (tiles, t, t, 3), times its texture; 0 where nothing is."""
    face = pool.surfaces.face[sample]
    material = pool.scene.material_ids[pool.charts.face_triangle[face]]
    out = np.where((face >= 0)[..., None], np.array(factors, np.float32)[material], np.float32(0))
    return out if colours is None else out * colours[sample]


def sampled_irradiance(lightmap: Lightmap, *, whole: bool) -> F32:
    """H + a of the sampled tiles (tiles, t, t, 3) [W/m²], with what is still to come. whole: see
    ``LightTextures.refresh_ambient``."""
    return lightmap.irradiance(ambient=True, whole=whole)[sampled_tiles(lightmap.pool)]


def irradiance_at(lightmap: Lightmap, texels: Texels) -> F32:
    """H of these texels (n, 3) [W/m²]."""
    cells, unit = _stored_irradiance(lightmap)
    columns = lightmap.pool.columns
    slot, row, column = texels
    return cells[slot // columns, row, slot % columns, column, :3].astype(np.float32) * unit


def _stored_irradiance(lightmap: Lightmap) -> tuple[NDArray[Any], np.float32]:
    """All of the texture (rows of tiles, t, columns of tiles, t, 4), and what 1 in it stands for [W/m²]."""
    pool, texture = lightmap.pool, lightmap.texture("t_irradiance")
    dtype = {"f4": np.float32, "f2": np.float16, "f1": np.uint8}[STORAGE[lightmap.storage]]
    cells = np.frombuffer(texture.read(), dtype).reshape(pool.rows, pool.tile, pool.columns, pool.tile, 4)
    return cells, np.float32(lightmap.unit / (255 if dtype is np.uint8 else 1))
