"""``glowtree info``: what a scene holds and what solving it would take, before any light is shot; quadtrees as they begin.

Small scenes are unfolded to count. Of larger ones texels, memory and time are estimates, said to be such, and large files are not
even read whole: the answer comes at once, whatever the scene.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
from typing import Any

from app.atlas.charts import Charts
from app.atlas.charts_cache import kept_notes
from app.atlas.options import AtlasOptions
from app.atlas.parametrize import check, default_texels
from app.atlas.texels import texel_count, uniform_leaves
from app.commands.flags import sky_of
from app.lightmap.options import STORAGE, LightmapOptions
from app.lightmap.quadtree import quadtree_pool
from app.lightmap.tile_pool import FACET_ENTRIES, TABLE_WIDTH
from app.options import from_flags
from app.scene.gltf import outline_gltf
from app.scene.load import NO_LIGHT, load_scene, scene_file
from app.scene.mesh_outline import outline_mesh
from app.scene.model import Scene
from app.scene.options import PHOTOMETRIC, FileOptions
from app.scene.orientation import outline_oriented
from app.scene.outline import Outline
from app.session.loading import read_and_unfold
from app.util.background import Progress, Report
from app.util.console import Console

SURFACE_BYTES = 24  # per texel: position and area, normal and ids
AMBIENT_BYTES = 16  # per texel, of what is shown beside H while it is shot
TEXTURE_BYTES = 8  # per texel, for albedo and for emission
FACET_ENTRY_BYTES = 16  # FACET_ENTRIES of them per facet
PAGE_BYTES = 4  # per cell of tile×tile texels of the atlas


COUNTED = 8192  # triangles, up to which unfolding takes a moment
# By suffix, what tells of a file at once what it holds, and triangles up to which it is read and put together nevertheless
OUTLINES = {
    **dict.fromkeys((".glb", ".gltf"), (outline_gltf, 500_000)),
    **dict.fromkeys((".obj", ".ply", ".stl"), (outline_mesh, 100_000)),
}
TILE_SHARE = 1.6  # texels of tiles for each one that covers a surface: 1.2 in a box, 1.2 to 2.5 in furnished rooms, 3.4 of voxels
NOT_CHECKED = "surfaces that meet or overlap, and such as are smaller than a texel: view and shot say of them"
SECONDS = 4e-5, 2e-6  # for each triangle and texel, on two cores of 2020


def info(flags: argparse.Namespace) -> int:
    """Print triangles, charts, texels and memory. Raises UserError (SceneError)."""
    console = Console(quiet=flags.json)
    with console.progress("reading") as tell:
        atlas, light = from_flags(AtlasOptions, flags), from_flags(LightmapOptions, flags)
        check(atlas.density, atlas.texels)
        found = _found(flags, lambda share: tell("reading", share))
        outline = found if isinstance(found, Outline) else Outline.of(found)
        values: dict[str, Any] = {
            "scene": outline.name,
            "triangles": outline.triangles,
            "objects": outline.objects,
            "materials": outline.materials,
            "emitting_materials": outline.emitting_materials,
            "lights": [f"{light.name} ({light.kind})" for light in outline.lights],
            "sky": outline.sky,
            "cameras": list(outline.cameras),
            "size_m": [float(x) for x in outline.upper - outline.lower],
        }
        if isinstance(found, Scene) and outline.triangles <= COUNTED:
            counts, warnings, estimated = _counts(found, outline, atlas, light, tell)
        else:
            counts, warnings = _estimates(outline, atlas, light), outline.warnings
            estimated = [*counts] if outline.exact else ["triangles", "size_m", *counts]
            counts["tile_edge"] = atlas.tile
            notes = kept_notes(found, atlas, roots=light.adaptive) if isinstance(found, Scene) else None
            warnings = (*warnings, *(notes or ()))
            values |= {"not_checked_here": NOT_CHECKED} if notes is None else {}
    values |= {**counts, "estimated": estimated, "warnings": list(warnings)}
    rows = [
        (name, _about(name, value) if name in estimated else _text(value))
        for name, value in values.items()
        if name not in ("estimated", "warnings")
    ]
    rows += [("warning", warning) for warning in values["warnings"]]
    console.result(values, "\n".join(f"{name.replace('_', ' '):>20}  {text}" for name, text in rows))
    return 0


def _found(flags: argparse.Namespace, report: Report) -> Scene | Outline:
    """The scene, or of a large file only its outline."""
    file, sky = from_flags(FileOptions, flags), sky_of(flags)
    path = scene_file(flags.scene)
    suffix = path.suffix.lower()
    if suffix in OUTLINES and file.light_units == PHOTOMETRIC:
        of, most = OUTLINES[suffix]
        outline = of(path, most)
        if outline is not None:
            outline = outline_oriented(outline, suffix, file)
            lit = outline.emitting_materials or outline.lights or sky or flags.light
            warnings = outline.warnings if lit else (*outline.warnings, NO_LIGHT)
            return dataclasses.replace(outline, sky=sky.kind if sky else None, warnings=warnings)
    return load_scene(flags.scene, file, default_light=flags.light, sky=sky, report=report)


def _counts(
    scene: Scene, outline: Outline, atlas: AtlasOptions, light: LightmapOptions, tell: Progress
) -> tuple[dict[str, Any], tuple[str, ...], list[str]]:
    """What unfolding the scene comes to, all warnings, and which of it are estimates."""
    _, scene, charts, _ = read_and_unfold(scene, atlas, False, tell, roots=light.adaptive)
    leaves, slots, depth = uniform_leaves(charts), 0, 0
    if light.adaptive:
        tell("planting quadtrees", 0.6)
        pool = quadtree_pool(scene, charts)
        leaves, slots, depth = pool.leaves.only(pool.used), pool.tiles, pool.depth
    memory = _memory(charts, max(len(leaves), slots), depth, light.storage, outline.textures)
    texels = pool.texel_count if light.adaptive else texel_count(charts)
    counts = {
        "lit_sides": len(charts.face_triangle),
        "dark_sides": charts.dark_faces,
        "charts": charts.chart_count,
        "unfolded_by": charts.method,
        "texels_per_metre": charts.density,
        "texels": texels,
        "tiles": len(leaves),
        "tile_edge": charts.tile,
        "atlas": list(charts.size),
        "memory_mib": memory / 2**20,
        **({"texels_if_uniform": pool.uniform_texels(light.depth)} if light.adaptive else {}),
        "seconds_to_open": _seconds(outline.triangles, texels),
    }
    return counts, (*scene.warnings, *charts.warnings), ["seconds_to_open"]


def _estimates(outline: Outline, atlas: AtlasOptions, light: LightmapOptions) -> dict[str, Any]:
    """The same by area alone. How quadtrees begin follows from their charts: only their roots are known."""
    default = default_texels(outline.sides, light.adaptive)
    aim, area = (default, outline.area) if atlas.texels is None else (atlas.texels, outline.texel_area)
    density = atlas.density or math.sqrt(aim / area)
    texels = round(outline.texel_area * density**2)
    values: dict[str, Any] = {"lit_sides": outline.sides, "texels_per_metre": density}
    if light.adaptive:
        return values | {"texels_of_roots": texels, "texels_if_uniform": texels << 2 * light.depth}
    tiles = math.ceil(texels * TILE_SHARE / atlas.tile**2)
    memory = tiles * atlas.tile**2 * _texel_bytes(light.storage, outline.textures)
    memory += _whole_rows(FACET_ENTRY_BYTES, FACET_ENTRIES * (outline.sides + 1))
    return values | {
        "texels": texels,
        "tiles": tiles,
        "memory_mib": memory / 2**20,
        "seconds_to_open": _seconds(outline.triangles, texels),
    }


def _seconds(triangles: int, texels: int) -> float:
    return float(SECONDS[0] * triangles + SECONDS[1] * texels)


def _memory(charts: Charts, slots: int, depth: int, storage: str, textures: int) -> int:
    """Bytes that the lightmap will take on the GPU to begin with: its slots, side by side in a square, and their tables; pages
    count cells of the finest level."""
    columns = math.isqrt(max(slots - 1, 0)) + 1
    texels = columns * -(-slots // columns) * charts.tile**2
    pages = (PAGE_BYTES << 2 * depth) * math.prod(charts.size) // charts.tile**2
    facets = _whole_rows(FACET_ENTRY_BYTES, FACET_ENTRIES * (charts.facet_count + 1))
    return texels * _texel_bytes(storage, textures) + pages + facets


def _texel_bytes(storage: str, textures: int) -> int:
    light = 2 * 4 * int(STORAGE[storage][1:])  # H and r, four channels of f4, f2 or f1
    return SURFACE_BYTES + light + AMBIENT_BYTES + TEXTURE_BYTES * textures


def _whole_rows(entry_bytes: int, entries: int) -> int:
    return entry_bytes * TABLE_WIDTH * -(-entries // TABLE_WIDTH)


def _about(name: str, value: Any) -> str:
    """An estimate; of seconds no more figures than it is good for."""
    if name != "seconds_to_open":
        return f"about {_text(value)}"
    return "under 1" if value < 1 else f"about {float(f'{value:.2g}'):g}"


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if value is None:
        return "none"
    if isinstance(value, list):
        return ", ".join(_text(v) for v in value) or "none"
    return f"{value:,}" if isinstance(value, int) else str(value)


__all__ = ["info"]
