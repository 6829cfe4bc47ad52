"""From what a loader found to a Scene that keeps its promises: the one gate that every file passes.

Repaired and counted as warnings: triangles without area, triangles in the place of others, textured triangles without texture
coordinates, albedo below 0 or above MOST_ALBEDO, vertex colours outside [0, 1], emission below 0, cameras that make
no sense, lights with an intensity below 0 or with odd cones. Repaired without a word: normals that are zero or not finite.
Refused with ``SceneError``: corners that are not finite, indices out of range, no triangle left, more than
``MAX_TRIANGLES``, an absurd size.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.errors import SceneError
from app.scene.checked_lights import check_lights
from app.scene.checked_materials import check_colours, check_materials, drop_unmapped_textures, hold_albedo
from app.scene.doubles import doubles
from app.scene.lights import Light
from app.scene.model import F64, Camera, Material, Scene
from app.util.background import Report, unheard
from app.util.words import counted, one_line

MAX_TRIANGLES = 20_000_000
BLOCK = 1 << 14  # triangles in work at a time: a processor's cache holds them
EXTENT_RANGE = (1e-12, 1e12)  # m; outside of it areas leave the range of 32-bit floats by far
# Files and GPU hold 32-bit floats: a triangle flatter than their spacing (2^-23 relative) has no shape, only rounding.
FLATNESS = 2.0**-23

Array = NDArray[Any]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Part:
    """Some triangles as a loader found them; nothing about them is trusted yet.

    positions (n, 3) [m]; triangles (m, 3) whole numbers; object_ids and material_ids: one for all or (m,).
    uv0, uv1, normals, colours: per vertex (n, 2|3), per corner (m, 3, 2|3), or None; NaN where a corner has none.
    """

    positions: Array
    triangles: Array
    object_ids: int | Array = 0
    material_ids: int | Array = 0
    uv0: Array | None = None
    uv1: Array | None = None
    normals: Array | None = None
    colours: Array | None = None


def check_triangle_count(source: str | Path, count: int) -> None:
    """Raise SceneError if ``count`` is more than any scene may have."""
    if count > MAX_TRIANGLES:
        raise SceneError(source, f"{count:,} triangles: at most {MAX_TRIANGLES:,} are allowed")


@np.errstate(all="ignore")
def validate(
    source: str | Path,
    name: str,
    parts: Sequence[Part],
    objects: Sequence[str],
    materials: Sequence[Material],
    cameras: Sequence[Camera] = (),
    warnings: Iterable[str] = (),
    lights: Sequence[Light] = (),
    report: Report = unheard,
) -> Scene:
    """Check, repair and join ``parts`` into a Scene. ``source`` names the file in errors; SceneError if unusable."""
    report(0.0)
    notes = [one_line(w) for w in warnings]
    total = sum(len(p.triangles) for p in parts)
    check_triangle_count(source, total)
    if total == 0:
        raise SceneError(source, "no triangles")
    for part in parts:
        _check_part(source, part, len(objects), len(materials))

    positions, triangles = _join_geometry(source, parts)
    report(0.2)
    keep = has_area(positions, triangles)
    kept = int(keep.sum())
    if kept == 0:
        raise SceneError(source, f"no triangle has an area ({total} given)")
    if kept < total:
        verb = "has no area and was" if total - kept == 1 else "have no area and were"
        notes.append(f"{total - kept} of {counted(total, 'triangle', 'triangles')} {verb} dropped")
    report(0.4)
    material_ids = _join_ids([p.material_ids for p in parts], parts)
    keep &= ~doubles(positions, triangles, material_ids, materials, keep, notes)

    report(0.6)
    triangles = triangles[keep]
    used = np.zeros(len(positions), bool)
    used[triangles] = True
    triangles = (np.cumsum(used) - 1)[triangles]
    uvs = [_join_corners([p.uv0 for p in parts], parts, keep, 2), _join_corners([p.uv1 for p in parts], parts, keep, 2)]
    normals = _join_corners([p.normals for p in parts], parts, keep, 3)
    colours = check_colours(_join_corners([p.colours for p in parts], parts, keep, 3), notes)
    checked_materials = check_materials(source, materials, notes)
    material_ids = material_ids[keep]
    material_ids, checked_materials = drop_unmapped_textures(uvs, material_ids, checked_materials, notes)
    report(0.8)
    checked_materials, colours = hold_albedo(checked_materials, material_ids, colours, notes)

    scene = Scene(
        name=name,
        positions=np.ascontiguousarray(positions[used]),
        triangles=triangles.astype(np.int32),
        material_ids=material_ids.astype(np.int32),
        object_ids=_join_ids([p.object_ids for p in parts], parts)[keep].astype(np.int32),
        objects=tuple(one_line(o) for o in objects),
        materials=tuple(checked_materials),
        cameras=_check_cameras(cameras, notes),
        uv0=None if uvs[0] is None else np.nan_to_num(uvs[0], nan=0.0, posinf=0.0, neginf=0.0),
        uv1=None if uvs[1] is None else np.nan_to_num(uvs[1], nan=0.0, posinf=0.0, neginf=0.0),
        colours=colours,
        listed=np.flatnonzero(keep).astype(np.int32),
        source=Path(source),
        lights=check_lights(source, lights, notes),
    )
    return dataclasses.replace(scene, normals=_unit_normals(scene, normals), warnings=tuple(notes))


def has_area(positions: F64, triangles: Array) -> Bools:
    """(m,) whether each triangle is more than a line or a point.

    Its least height must exceed FLATNESS of the scene's extent, and with it of its own longest edge, which is at most
    √3 times that. Everything is relative, so the answer does not depend on the unit.
    """
    low, high = _bounds(positions, triangles)
    extent = float((high - low).max())
    if extent == 0.0:
        return np.zeros(len(triangles), bool)
    places = (positions - low) / extent
    solid = np.empty(len(triangles), bool)
    for first in range(0, len(triangles), BLOCK):
        some = triangles[first : first + BLOCK]
        a, b, c = (np.ascontiguousarray(places.take(some[:, k], axis=0).T) for k in range(3))
        longest = np.maximum.reduce([_length(e) for e in (b - a, c - b, a - c)])
        solid[first : first + BLOCK] = _length(np.cross(b - a, c - a, axis=0)) > FLATNESS * longest
    return solid


def _length(vectors: F64) -> F64:
    """(n,) of vectors (3, n)."""
    return np.asarray(np.sqrt((vectors**2).sum(axis=0)))


def _bounds(positions: F64, triangles: Array) -> tuple[F64, F64]:
    """Lower and upper corner of the box around triangles (m, 3) of positions (n, 3)."""
    used = np.zeros(len(positions), bool)
    used[triangles] = True
    columns = [column[used] for column in positions.T]
    return np.array([column.min() for column in columns]), np.array([column.max() for column in columns])


def _check_part(source: str | Path, part: Part, object_count: int, material_count: int) -> None:
    if len(part.triangles) == 0:
        return
    for what, values, count in (
        ("index", part.triangles, len(part.positions)),
        ("object", part.object_ids, object_count),
        ("material", part.material_ids, material_count),
    ):
        low, high = int(np.min(values)), int(np.max(values))
        if low < 0 or high >= count:
            things = {"index": "vertices", "object": "objects", "material": "materials"}[what]
            raise SceneError(source, f"{what} {low if low < 0 else high} is out of range: there are {count} {things}")


def _join_geometry(source: str | Path, parts: Sequence[Part]) -> tuple[F64, NDArray[np.int64]]:
    """All positions (n, 3) and the triangles (m, 3) that index them; SceneError where a corner is not finite."""
    starts = np.cumsum([0, *(len(p.positions) for p in parts)])
    positions = np.concatenate([np.asarray(p.positions, np.float64).reshape(-1, 3) for p in parts])
    triangles = np.concatenate(
        [np.asarray(p.triangles, np.int64).reshape(-1, 3) + start for p, start in zip(parts, starts, strict=False)]
    )
    finite = np.isfinite(positions).all(axis=1)
    if not finite.all():
        bad = int((~finite[triangles]).any(axis=1).sum())
        if bad:
            given = counted(len(triangles), "triangle has", "triangles have")
            raise SceneError(source, f"{bad} of {given} a corner that is not a finite number")
        positions = np.where(finite[:, None], positions, 0.0)
    low, high = _bounds(positions, triangles)
    extent = float((high - low).max())
    least, most = EXTENT_RANGE
    if extent > 0.0 and not least <= extent <= most:
        raise SceneError(source, f"the scene is {extent:.3g} m across: allowed is {least:g} m to {most:g} m")
    return positions, triangles


def _join_ids(ids: Sequence[int | Array], parts: Sequence[Part]) -> NDArray[np.int64]:
    return np.concatenate(
        [np.broadcast_to(np.asarray(i, np.int64), len(p.triangles)) for i, p in zip(ids, parts, strict=True)]
    )


def _join_corners(
    values: Sequence[Array | None], parts: Sequence[Part], keep: Bools, width: int
) -> NDArray[np.float32] | None:
    """(m, 3, width) f32 values per kept corner, NaN where a part has none; None if no part has any."""
    if all(v is None for v in values):
        return None
    joined = []
    for value, part in zip(values, parts, strict=True):
        if value is None:
            joined.append(np.full((len(part.triangles), 3, width), np.nan, np.float32))
        elif value.ndim == 3:
            joined.append(np.asarray(value, np.float32))
        else:
            joined.append(np.asarray(value, np.float32)[part.triangles])
    return np.concatenate(joined)[keep]


def _check_cameras(cameras: Sequence[Camera], notes: list[str]) -> tuple[Camera, ...]:
    """Make every camera rigid and its name unique; drop what is singular, not finite or has no field of view."""
    good: list[Camera] = []
    for camera in cameras:
        matrix = np.asarray(camera.world_from_camera, np.float64)
        z = matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
        x = np.cross(matrix[:3, 1], z)
        x = x / np.linalg.norm(x)
        rigid = np.eye(4)
        rigid[:3] = np.stack([x, np.cross(z, x), z, matrix[:3, 3]], axis=1)
        if not np.isfinite(rigid).all() or not 0.0 < camera.yfov < math.pi:
            continue
        name, taken = one_line(camera.name), {c.name for c in good}
        if name in taken:
            name = next(f"{name} {n}" for n in range(2, len(taken) + 3) if f"{name} {n}" not in taken)
        good.append(Camera(name, rigid, float(camera.yfov)))
    if len(good) < len(cameras):
        dropped = len(cameras) - len(good)
        notes.append(f"{counted(dropped, 'camera was', 'cameras were')} dropped: singular or without a field of view")
    return tuple(good)


def _unit_normals(scene: Scene, normals: Array | None) -> NDArray[np.float32] | None:
    """Corner normals of length 1; the triangle's own where the file's is missing, zero or not finite."""
    if normals is None:
        return None
    unit = normals.astype(np.float64)
    unit /= np.linalg.norm(unit, axis=2, keepdims=True)
    flat = np.broadcast_to(scene.normals_areas[0][:, None], unit.shape)
    return np.where(np.isfinite(unit).all(axis=2, keepdims=True), unit, flat).astype(np.float32)
