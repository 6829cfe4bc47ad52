"""Materials as a Scene promises them: finite, not negative, reflecting no more than MOST_ALBEDO, with pictures only where there
are texture coordinates. What is repaired is counted in a note; SceneError where nothing can be repaired."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.errors import SceneError
from app.scene.model import F32, MOST_ALBEDO, RGB, Material, Texture
from app.util.words import counted, one_line

BRIGHTEST = 1e30  # W/(sr m²): leaves room for areas and sums in single precision

Array = NDArray[Any]
Bools = NDArray[np.bool_]


def check_materials(source: str | Path, materials: Sequence[Material], notes: list[str]) -> list[Material]:
    checked, clamped, darkened = [], 0, 0
    for material in materials:
        if not all(math.isfinite(x) for x in (*material.albedo, *material.emission, material.opacity)):
            raise SceneError(source, f"material '{material.name}': albedo, emission and opacity must be finite numbers")
        if max(material.emission) > BRIGHTEST:
            raise SceneError(
                source, f"material '{material.name}': emission above {BRIGHTEST:g} W/(sr m²) is out of range"
            )
        albedo = as_rgb(max(x, 0.0) for x in material.albedo)
        emission = as_rgb(max(x, 0.0) for x in material.emission)
        clamped += albedo != material.albedo
        darkened += emission != material.emission
        name = one_line(material.name)
        checked.append(_even_opacity(dataclasses.replace(material, name=name, albedo=albedo, emission=emission)))
    if clamped:
        notes.append(f"{counted(clamped, 'material', 'materials')} with an albedo below 0: set to 0")
    if darkened:
        notes.append(f"{counted(darkened, 'material', 'materials')} with an emission below 0: set to 0")
    return checked


def _even_opacity(material: Material) -> Material:
    """Without the texture and the cutoff of an opacity that is 1, or 0, all over; held between 0 and 1."""
    texture, cutoff = material.opacity_texture, material.opacity_cutoff
    opacity = min(max(material.opacity, 0.0), 1.0)
    least, most = (
        opacity * float(f) for f in ((1, 1) if texture is None else (texture.pixels.min(), texture.pixels.max()))
    )
    all_over = float(least >= cutoff) if cutoff is not None else least
    if texture is None or all_over == 1.0 or most < (cutoff or 1e-300):
        return dataclasses.replace(material, opacity=all_over, opacity_texture=None, opacity_cutoff=None)
    return dataclasses.replace(material, opacity=opacity)


def check_colours(colours: F32 | None, notes: list[str]) -> F32 | None:
    """Vertex colours in [0, 1], 1 where a corner has none or one that is not finite."""
    if colours is None:
        return None
    colours = np.nan_to_num(colours, nan=1.0, posinf=1.0, neginf=1.0)
    outside = int(((colours < 0.0) | (colours > 1.0)).any(axis=(1, 2)).sum())
    if outside:
        notes.append(f"{counted(outside, 'triangle', 'triangles')} with vertex colours outside 0 to 1: clamped")
    return np.clip(colours, 0.0, 1.0)


def hold_albedo(
    materials: list[Material], ids: NDArray[np.int64], colours: F32 | None, notes: list[str]
) -> tuple[list[Material], F32 | None]:
    """Nothing reflects more than MOST_ALBEDO. What varies most is held: a material's picture, else its vertex colours, else its
    factor."""
    held, holding = list(materials), 0
    pictures: dict[tuple[int, RGB], F32] = {}
    for i in np.unique(ids).tolist():
        material, mine = materials[i], ids == i
        factor = as_rgb(min(a, 1.0) for a in material.albedo)
        most = as_rgb(MOST_ALBEDO / max(a, MOST_ALBEDO) for a in factor)
        above, texture = factor != material.albedo, material.albedo_texture
        if texture is not None:
            above |= bool((texture.pixels > np.array(most, np.float32)).any())
            if above:
                key = id(texture.pixels), most
                pictures.setdefault(key, np.minimum(texture.pixels, np.array(most, np.float32)))
                texture = dataclasses.replace(texture, pixels=pictures[key])
        elif colours is not None:
            above |= bool((colours[mine] > np.array(most, np.float32)).any())
            colours[mine] = np.minimum(colours[mine], np.array(most, np.float32))
        else:
            factor = as_rgb(min(a, MOST_ALBEDO) for a in factor)
            above |= factor != material.albedo
        if above:
            holding += 1
            held[i] = dataclasses.replace(material, albedo=factor, albedo_texture=texture)
    if holding:
        notes.append(f"{counted(holding, 'material', 'materials')} with an albedo above {MOST_ALBEDO:g}: held there")
    return held, colours


def drop_unmapped_textures(
    uvs: Sequence[Array | None], ids: NDArray[np.int64], materials: list[Material], notes: list[str]
) -> tuple[NDArray[np.int64], list[Material]]:
    """Give textured triangles without texture coordinates a copy of their material in its pictures' mean colours."""
    ids, materials, unmapped = ids.copy(), list(materials), 0
    for i, material in enumerate(tuple(materials)):
        textures = material.textures
        if not textures:
            continue
        mine = ids == i
        bad = np.zeros(len(ids), bool)
        for texcoord in {t.texcoord for t in textures}:
            uv = uvs[texcoord]
            bad |= mine if uv is None else mine & ~np.isfinite(uv).all(axis=(1, 2))
        if bad.any():
            unmapped += int(bad.sum())
            ids[bad] = len(materials)
            albedo = _mean_colour(material.albedo, material.albedo_texture)
            emission = _mean_colour(material.emission, material.emission_texture)
            opacity = _mean_colour((material.opacity,) * 3, material.opacity_texture)[0]
            plain = Material(
                material.name,
                albedo,
                emission,
                double_sided=material.double_sided,
                opacity=opacity,
                lightmap_scale=material.lightmap_scale,
            )
            materials.append(plain)
    if unmapped:
        what = counted(unmapped, "textured triangle", "textured triangles")
        notes.append(f"{what} without texture coordinates: the picture's mean colour is used")
    return ids, materials


def _mean_colour(factor: RGB, texture: Texture | None) -> RGB:
    if texture is None:
        return factor
    mean = np.broadcast_to(texture.pixels.mean(axis=(0, 1), dtype=np.float64), 3)
    return as_rgb(f * float(m) for f, m in zip(factor, mean, strict=True))


def as_rgb(values: Iterable[float]) -> RGB:
    r, g, b = (float(v) for v in values)
    return (r, g, b)
