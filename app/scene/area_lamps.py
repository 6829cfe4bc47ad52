"""Lamps with area that are added to a scene, surfaces that are taken from it, and how finely some are cut into texels, as plain
values; one function makes it so."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from app.scene.lamp_surfaces import with_copy, with_rectangle, with_shift, without_surfaces
from app.scene.model import F64, RGB, Material, Scene

UPRIGHT = 1e-6  # sine of the angle to the vertical, below which a direction is upright
Key = tuple[str, int]  # of a material: its name, and its number among those of that name


@dataclass(frozen=True)
class AreaLamp:
    """A lamp with area that was added: a rectangle that shines to its front, or the surfaces of a material once more.

    name: of its material and its object. position: its middle [m]. emission: L [W/(sr m²)]. Of a rectangle, size: width and
    height [m]; direction, across: unit vectors out of its front and along its width. of: the material, of a copy.
    """

    name: str
    position: RGB
    emission: RGB
    size: tuple[float, float] = (1.0, 1.0)
    direction: RGB = (0.0, -1.0, 0.0)
    across: RGB = (1.0, 0.0, 0.0)
    of: Key | None = None

    @property
    def corners(self) -> F64:
        """(4, 3) of a rectangle [m], counter-clockwise from its front."""
        width, height = self.size
        a = width / 2 * np.array(self.across)
        b = height / 2 * np.cross(self.direction, self.across)
        return np.asarray(np.array(self.position) + np.array([-a - b, a - b, a + b, b - a]))

    @property
    def turn(self) -> float:
        """Degrees by which a rectangle is turned around its direction, from where its width is level."""
        level = level_across(self.direction)
        return math.degrees(
            math.atan2(np.dot(np.cross(level, self.across), self.direction), np.dot(level, self.across))
        )


def turned(lamp: AreaLamp, direction: RGB, turn: float) -> AreaLamp:
    """A rectangle that shines there, a vector of any length, turned by so many degrees around it; as it is where that is 0."""
    length = math.hypot(*direction)
    if not length > 0:
        return lamp
    ahead = np.array(direction) / length
    level, angle = level_across(ahead.tolist()), math.radians(turn)
    across = math.cos(angle) * level + math.sin(angle) * np.cross(ahead, level)
    across /= np.linalg.norm(across)
    (x, y, z), (u, v, w) = ahead.tolist(), across.tolist()
    return dataclasses.replace(lamp, direction=(x, y, z), across=(u, v, w))


def level_across(direction: Sequence[float]) -> F64:
    """(3,) unit and level, at right angles to a direction; +x of one that is upright."""
    across = np.cross((0.0, 1.0, 0.0), direction)
    length = float(np.linalg.norm(across))
    return np.array([1.0, 0.0, 0.0]) if length < UPRIGHT else across / length


@dataclass(frozen=True)
class Moved:
    """The surfaces of a material of the scene's own, which are elsewhere: shift [m]."""

    key: Key
    shift: RGB


@dataclass(frozen=True)
class Surfaces:
    """What surfaces a scene has besides its own, which of its own are elsewhere, which it has not, and which are cut more or less
    finely than its file says. removed: the materials that these are of. scales: the ``lightmap_scale`` of materials."""

    lamps: tuple[AreaLamp, ...] = ()
    removed: tuple[Key, ...] = ()
    moved: tuple[Moved, ...] = ()
    scales: tuple[tuple[Key, float], ...] = ()

    def with_scale(self, key: Key, scale: float, came: float) -> Surfaces:
        """That material cut so finely. came: its ``lightmap_scale`` in the file, which needs no mention."""
        others = {other: value for other, value in self.scales if other != key}
        scales = others if scale == came else others | {key: scale}
        return dataclasses.replace(self, scales=tuple(sorted(scales.items())))


def with_surfaces(scene: Scene, surfaces: Surfaces) -> Scene:
    """The scene as ``surfaces`` say: each lamp has a material of its own behind all others, and materials without surfaces stay,
    so that all keep their index. What the scene does not have is neither copied nor moved nor removed; nor is all that there is
    removed."""
    index = {key: number for number, key in enumerate(keys_of(scene.materials))}
    made = scene
    for lamp in surfaces.lamps:
        if lamp.of is None:
            made = with_rectangle(made, lamp.corners, lamp.name, lamp.emission)
        elif lamp.of in index and (scene.material_ids == index[lamp.of]).any():
            shift = np.array(lamp.position) - middle_of(scene, index[lamp.of])
            made = with_copy(made, index[lamp.of], shift, lamp.name, lamp.emission)
    for moved in surfaces.moved:
        if moved.key in index:
            made = with_shift(made, index[moved.key], np.array(moved.shift))
    removed = [index[key] for key in surfaces.removed if key in index]
    made = without_surfaces(made, removed) if removed else made
    scales = dict(surfaces.scales)
    if not scales:
        return made
    pairs = zip(keys_of(made.materials), made.materials, strict=True)
    return made.with_materials(tuple(with_scale(material, scales.get(key)) for key, material in pairs))


def with_scale(material: Material, scale: float | None) -> Material:
    """The material with that ``lightmap_scale``; itself where that is its own, or None."""
    if scale is None or scale == material.lightmap_scale:
        return material
    return dataclasses.replace(material, lightmap_scale=scale)


def keys_of(materials: Iterable[Material]) -> list[Key]:
    """Of each material."""
    seen: dict[str, int] = {}
    keys = []
    for material in materials:
        number = seen[material.name] = seen.get(material.name, -1) + 1
        keys.append((material.name, number))
    return keys


def middle_of(scene: Scene, index: int) -> F64:
    """(3,) of the box around the surfaces of a material that has some [m]."""
    corners = scene.corners[scene.material_ids == index].reshape(-1, 3)
    return np.asarray((corners.min(axis=0) + corners.max(axis=0)) / 2)


__all__ = ["AreaLamp", "Key", "Moved", "Surfaces", "keys_of", "middle_of", "turned", "with_scale", "with_surfaces"]
