"""Lamps that are surfaces: a rectangle of light is added, or the triangles of a material that emits are copied, moved or taken
away."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from app.scene.model import F64, RGB, Material, Scene

PER_TRIANGLE = ("triangles", "material_ids", "object_ids", "uv0", "uv1", "normals", "colours", "listed")
SQUARE = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float32)  # texture coordinates of a rectangle's corners
HALVES = np.array([(0, 1, 2), (0, 2, 3)])  # its triangles


def with_rectangle(scene: Scene, corners: F64, name: str, radiance: RGB) -> Scene:
    """The scene with a rectangle that emits in front, and is black: corners (4, 3) [m], counter-clockwise from the front;
    radiance L [W/(sr m²)]."""
    lamp = Material(name, albedo=(0.0, 0.0, 0.0), emission=radiance)
    normal = np.cross(corners[1] - corners[0], corners[3] - corners[0])
    normal /= np.linalg.norm(normal)
    new = {
        "triangles": (len(scene.positions) + HALVES).astype(np.int32),
        "material_ids": np.full(2, len(scene.materials), np.int32),
        "object_ids": np.full(2, len(scene.objects), np.int32),
        "uv0": SQUARE[HALVES],
        "uv1": SQUARE[HALVES],
        "normals": np.broadcast_to(normal.astype(np.float32), (2, 3, 3)),
        "colours": np.ones((2, 3, 3), np.float32),
        "listed": np.full(2, -1, np.int32),
    }
    return _with(scene, corners, new, lamp, name)


def with_copy(scene: Scene, index: int, shift: F64, name: str, radiance: RGB) -> Scene:
    """The scene with the triangles of material ``index`` once more, moved by (3,) [m], as a lamp of its own; radiance L
    [W/(sr m²)]."""
    chosen = np.flatnonzero(scene.material_ids == index)
    used, numbers = np.unique(scene.triangles[chosen], return_inverse=True)
    new = {key: value[chosen] for key in PER_TRIANGLE if (value := getattr(scene, key)) is not None}
    new["triangles"] = (len(scene.positions) + numbers.reshape(-1, 3)).astype(np.int32)
    new["material_ids"] = np.full(len(chosen), len(scene.materials), np.int32)
    new["object_ids"] = np.full(len(chosen), len(scene.objects), np.int32)
    if "listed" in new:
        new["listed"] = np.full(len(chosen), -1, np.int32)
    lamp = dataclasses.replace(scene.materials[index], name=name, emission=radiance)
    return _with(scene, scene.positions[used] + shift, new, lamp, name)


def with_shift(scene: Scene, index: int, shift: F64) -> Scene:
    """The scene with the triangles of material ``index`` moved by (3,) [m]."""
    chosen = np.flatnonzero(scene.material_ids == index)
    used, numbers = np.unique(scene.triangles[chosen], return_inverse=True)
    triangles = scene.triangles.copy()
    triangles[chosen] = len(scene.positions) + numbers.reshape(-1, 3)
    positions = np.concatenate([scene.positions, scene.positions[used] + shift])
    listed = None if scene.listed is None else np.where(scene.material_ids == index, np.int32(-1), scene.listed)
    return dataclasses.replace(scene, positions=positions, triangles=triangles, listed=listed)


def hangs_together(scene: Scene, index: int) -> bool:
    """Whether a corner of the triangles of material ``index`` is one of another material's, too."""
    own = scene.material_ids == index
    corners, others = scene.corners[own].reshape(-1, 3), scene.corners[~own].reshape(-1, 3)
    if not len(corners):
        return False
    near = others[((others >= corners.min(axis=0)) & (others <= corners.max(axis=0))).all(axis=1)]
    return not {tuple(corner) for corner in corners.tolist()}.isdisjoint(tuple(corner) for corner in near.tolist())


def without_surfaces(scene: Scene, materials: Sequence[int]) -> Scene:
    """The scene without the triangles of these materials, which stay; as it is where nothing else is there."""
    kept = ~np.isin(scene.material_ids, materials)
    if not kept.any():
        return scene
    less: dict[str, Any] = {key: value[kept] for key in PER_TRIANGLE if (value := getattr(scene, key)) is not None}
    return dataclasses.replace(scene, **less)


def new_name(kind: str, taken: object) -> str:
    """``kind`` with the first number that makes it a name of its own among those that are ``taken``."""
    names = set(taken)  # type: ignore[call-overload]
    return next(name for number in range(1, len(names) + 2) if (name := f"{kind} {number}") not in names)


def _with(scene: Scene, positions: F64, new: dict[str, Any], lamp: Material, name: str) -> Scene:
    """The scene and new triangles of a new material and object; what the scene does not have per corner, they do not have."""
    joined: dict[str, Any] = {
        key: np.concatenate([value, new[key]]) for key in PER_TRIANGLE if (value := getattr(scene, key)) is not None
    }
    return dataclasses.replace(
        scene,
        positions=np.concatenate([scene.positions, positions]),
        objects=(*scene.objects, name),
        materials=(*scene.materials, lamp),
        **joined,
    )


__all__ = ["hangs_together", "new_name", "with_copy", "with_rectangle", "with_shift", "without_surfaces"]
