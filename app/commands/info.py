"""``glowtree info``: what a scene holds and what solving it would take, before any light is shot; quadtrees as they begin."""

from __future__ import annotations

import argparse
import math
from typing import Any

from app.atlas.charts import Charts
from app.atlas.options import AtlasOptions
from app.atlas.texels import texel_count, uniform_leaves
from app.commands.flags import sky_of
from app.lightmap.options import STORAGE, LightmapOptions
from app.lightmap.quadtree import quadtree_pool
from app.lightmap.tile_pool import TABLE_WIDTH
from app.options import from_flags
from app.scene.model import Scene
from app.scene.options import FileOptions
from app.session.loading import read_and_unfold
from app.util.console import Console

SURFACE_BYTES = 24  # per texel: position and area, normal and ids
TEXTURE_BYTES = 8  # per texel, for albedo and for emission
FACET_ENTRY_BYTES = 16  # two of them per facet
PAGE_BYTES = 4  # per cell of tile×tile texels of the atlas


def info(flags: argparse.Namespace) -> int:
    """Print triangles, charts, texels and memory."""
    console = Console(quiet=flags.json)
    with console.progress("reading") as tell:
        atlas, light = from_flags(AtlasOptions, flags), from_flags(LightmapOptions, flags)
        scene, charts, _ = read_and_unfold(
            flags.scene,
            atlas,
            flags.light,
            tell,
            file=from_flags(FileOptions, flags),
            sky=sky_of(flags),
            roots=light.adaptive,
        )
        leaves, slots, depth = uniform_leaves(charts), 0, 0
        if light.adaptive:
            tell("planting quadtrees", 0.6)
            pool = quadtree_pool(scene, charts)
            leaves, slots, depth = pool.leaves.only(pool.used), pool.tiles, pool.depth
    tiles = len(leaves)
    lower, upper = scene.bounds
    values: dict[str, Any] = {
        "scene": scene.name,
        "triangles": len(scene.triangles),
        "objects": len(scene.objects),
        "materials": len(scene.materials),
        "emitting_materials": sum(m.emits for m in scene.materials),
        "lights": [f"{light.name} ({light.kind})" for light in scene.lights],
        "sky": None if scene.sky is None else scene.sky.kind,
        "cameras": [c.name for c in scene.cameras],
        "size_m": [float(x) for x in upper - lower],
        "lit_sides": len(charts.face_triangle),
        "dark_sides": charts.dark_faces,
        "charts": charts.chart_count,
        "unfolded_by": charts.method,
        "texels_per_metre": charts.density,
        "texels": pool.texel_count if light.adaptive else texel_count(charts),
        "tiles": tiles,
        "tile_edge": charts.tile,
        "atlas": list(charts.size),
        "memory_mib": _memory(scene, charts, max(tiles, slots), depth, light.storage) / 2**20,
        **({"texels_if_uniform": pool.uniform_texels(light.depth)} if light.adaptive else {}),
        "warnings": [*scene.warnings, *charts.warnings],
    }
    rows = [(name, value) for name, value in values.items() if name != "warnings"]
    rows += [("warning", warning) for warning in values["warnings"]]
    lines = [f"{name.replace('_', ' '):>20}  {_text(value)}" for name, value in rows]
    console.result(values, "\n".join(lines))
    return 0


def _memory(scene: Scene, charts: Charts, slots: int, depth: int, storage: str) -> int:
    """Bytes that the lightmap will take on the GPU to begin with: its slots, side by side in a square, and their tables; pages
    count cells of the finest level."""
    columns = math.isqrt(max(slots - 1, 0)) + 1
    texels = columns * -(-slots // columns) * charts.tile**2
    light = 2 * 4 * int(STORAGE[storage][1:])  # H and r, four channels of f4, f2 or f1
    pages = (PAGE_BYTES << 2 * depth) * math.prod(charts.size) // charts.tile**2
    facets = _whole_rows(FACET_ENTRY_BYTES, 2 * (charts.facet_count + 1))
    return texels * (SURFACE_BYTES + light + TEXTURE_BYTES * _textured(scene)) + pages + facets


def _whole_rows(entry_bytes: int, entries: int) -> int:
    return entry_bytes * TABLE_WIDTH * -(-entries // TABLE_WIDTH)


def _textured(scene: Scene) -> int:
    """Colour textures that the texels need: of albedo and of emission."""
    albedo = scene.colours is not None or any(m.albedo_texture is not None for m in scene.materials)
    emission = any(m.emission_texture is not None and m.emits for m in scene.materials)
    return int(albedo) + int(emission)


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return ", ".join(_text(v) for v in value)
    return f"{value:,}" if isinstance(value, int) else str(value)


__all__ = ["info"]
