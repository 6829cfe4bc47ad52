"""``glowtree info``: what a scene holds and what solving it would take, before any light is shot."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from app.atlas.charts import TILE
from app.atlas.options import AtlasOptions
from app.atlas.texels import uniform_leaves
from app.console import Console
from app.loading import read_and_unfold
from app.options import from_flags

BYTES_PER_TEXEL = {"position, area": 16, "normal, ids": 8, "irradiance": 16, "residual": 16}


def info(flags: argparse.Namespace) -> int:
    """Print triangles, charts, texels and memory."""
    console = Console(as_json=flags.json)
    with console.progress("reading") as tell:
        scene, charts, _ = read_and_unfold(flags.scene, from_flags(AtlasOptions, flags), flags.light, tell)
    area = float(scene.normals_areas[1][charts.face_triangle].sum())
    leaves = uniform_leaves(charts)
    texel_bytes = sum(BYTES_PER_TEXEL.values()) + 8 * _textured(scene)
    lower, upper = scene.bounds
    values: dict[str, Any] = {
        "scene": scene.name,
        "triangles": len(scene.triangles),
        "objects": len(scene.objects),
        "materials": len(scene.materials),
        "emitting_materials": sum(m.emits for m in scene.materials),
        "cameras": [c.name for c in scene.cameras],
        "size_m": [float(x) for x in upper - lower],
        "lit_sides": len(charts.face_triangle),
        "dark_sides": charts.dark_faces,
        "charts": charts.chart_count,
        "unfolded_by": charts.method,
        "texels_per_metre": charts.density,
        "texels": int(np.round(area * charts.density**2)),
        "tiles": len(leaves),
        "atlas": list(charts.size),
        "memory_mib": len(leaves) * TILE * TILE * texel_bytes / 2**20,
        "warnings": [*scene.warnings, *charts.warnings],
    }
    lines = [f"{name.replace('_', ' '):>20}  {_text(value)}" for name, value in values.items() if value != []]
    console.result(values, "\n".join(lines))
    return 0


def _textured(scene: Any) -> int:
    """Colour textures that the texels need: of albedo and of emission."""
    albedo = any(m.albedo_texture is not None for m in scene.materials)
    emission = any(m.emission_texture is not None and m.emits for m in scene.materials)
    return int(albedo) + int(emission)


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list):
        return ", ".join(_text(v) for v in value)
    return f"{value:,}" if isinstance(value, int) else str(value)


__all__ = ["info"]
