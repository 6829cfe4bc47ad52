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


def colours_of(pool: TilePool, factors: list[RGB], colours: F32 | None, texels: NDArray[np.int64]) -> F32:
    """The same of texels that cover a surface, by their numbers: (n, 3)."""
    material = pool.scene.material_ids[pool.charts.face_triangle[pool.surfaces.face.reshape(-1)[texels]]]
    out = np.array(factors, np.float32)[material]
    return out if colours is None else out * colours.reshape(-1, 3)[texels]


def strongest_of(pool: TilePool, factors: list[RGB], colours: F32 | None) -> F32:
    """The largest of the three of each texel (tiles, t, t); 0 where nothing is."""
    if colours is not None:
        return np.asarray(sampled_colours(pool, factors, colours, slice(None)).max(-1))
    of_face = np.array(factors, np.float32).max(1)[pool.scene.material_ids[pool.charts.face_triangle]]
    return np.append(of_face, np.float32(0))[pool.surfaces.face]  # the last where there is none, -1


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
