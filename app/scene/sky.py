"""The sky is what is seen where no surface is: radiance from every direction, and the sun.

Directions are those of the world, +y up. An azimuth counts from north, -z, over east, +x. A map of the sky is equirectangular:
its first row is around the zenith, its first column at azimuth 0, and azimuths grow along a row.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from app.scene.clear_sky import clear_sky, sun_irradiance
from app.scene.lights import Light

F32 = np.ndarray[tuple[int, ...], np.dtype[np.float32]]
F64 = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
RGB = tuple[float, float, float]
SkyKind = Literal["uniform", "clear", "image"]

CLEAR_SIZE = 256, 128  # px of the map of a clear sky
COARSE = 128  # columns of a map that irradiance is summed up from: what lies between them changes cosines by 1 %, to either side
AT_ONCE = 512  # normals
TURBIDITY = 2.5  # of clear air [Preetham99, figure 2]; the model holds from 2 to 6
LEAST_TURBIDITY, MOST_TURBIDITY = 2.0, 6.0
SUN_ANGLE = math.radians(0.53)  # across, seen from the earth


@dataclass(frozen=True)
class Sun:
    """Where the sun stands, in degrees. azimuth: from north over east; height: above the horizon, 0 to 90."""

    azimuth: float
    height: float

    @property
    def direction(self) -> F64:
        """(3,) towards it."""
        return direction_at(math.radians(self.azimuth), math.radians(self.height))


DEFAULT_SUN = Sun(135, 40)  # of a clear sky, where nobody says


@dataclass(frozen=True, eq=False)
class Sky:
    """A sky of one kind.

    uniform: of the radiance ``colour``, from everywhere, also from below. clear: by the height of the sun [Preetham99], above a
    ground that is lit by it. image: ``image`` (h, w, 3) f32, an equirectangular map, turned by ``rotation`` [degrees, from north
    to east]. colour and strength multiply all of it, the sun too: radiance [W/(sr m²)], linear Rec.709. A sun stands in any kind
    of sky where one is given, as bright as in clear air of that turbidity; a clear sky has one.
    """

    kind: SkyKind = "uniform"
    colour: RGB = (1.0, 1.0, 1.0)
    strength: float = 1.0
    sun: Sun | None = None
    turbidity: float = TURBIDITY
    image: F32 | None = None
    rotation: float = 0.0
    name: str = ""  # of the image's file
    path: Path | None = None  # of that, where it is no file of the scene

    def __post_init__(self) -> None:
        assert self.kind != "clear" or self.sun is not None, "a clear sky has a sun"
        assert (self.kind == "image") == (self.image is not None), "an image, where it is the sky's kind"

    @property
    def scale(self) -> F64:
        """(3,) that multiplies ``shape``."""
        return self.strength * np.array(self.colour, np.float64)

    @functools.cached_property
    def shape(self) -> F32:
        """The map (h, w, 3) f32 but for ``scale``."""
        if self.kind == "uniform":
            return np.ones((1, 1, 3), np.float32)
        if self.kind == "clear":
            assert self.sun is not None
            width, height = CLEAR_SIZE
            return clear_sky(directions(width, height), self.sun.direction, self.turbidity).astype(np.float32)
        assert self.image is not None
        return np.roll(self.image, round(self.rotation / 360 * self.image.shape[1]), axis=1)

    @property
    def radiance(self) -> F32:
        """The map (h, w, 3) f32 [W/(sr m²)]."""
        return np.asarray(self.shape * self.scale.astype(np.float32))

    def shape_irradiance(self, normals: F64) -> F64:
        """(n, 3) that surfaces with these normals (n, 3) receive of ``shape`` where nothing hides it, without the sun [W/m² per
        unit of ``scale``]: a sum over pixels, scaled so that it is π for an even sky."""
        height, width, _ = self.shape.shape
        if width == height == 1:
            return np.pi * np.broadcast_to(self.shape[0, 0].astype(np.float64), (len(normals), 3))
        step = -(-width // COARSE)
        rows, columns = height // step, width // step
        light = self.shape[: rows * step, : columns * step].reshape(rows, step, columns, step, 3).mean((1, 3))
        towards = directions(columns, rows).reshape(-1, 3).astype(np.float32)
        weights = (light * solid_angles(columns, rows)[..., None]).reshape(-1, 3).astype(np.float32)
        angles = np.broadcast_to(solid_angles(columns, rows), (rows, columns)).ravel().astype(np.float32)
        out = np.empty((len(normals), 3))
        for first in range(0, len(normals), AT_ONCE):
            cosines = np.maximum(normals[first : first + AT_ONCE].astype(np.float32) @ towards.T, 0)
            out[first : first + AT_ONCE] = cosines @ weights * (np.pi / (cosines @ angles))[:, None]
        return out

    @property
    def sun_irradiance(self) -> F64:
        """(3,) on a surface that faces the sun, of the sun alone [W/m²]; 0 without one."""
        return np.zeros(3) if self.sun is None else self.scale * sun_irradiance(self.sun.height, self.turbidity)

    @property
    def sun_radiance(self) -> F64:
        """(3,) of the sun's disc, even [W/(sr m²)]; 0 without one."""
        return np.asarray(self.sun_irradiance / (np.pi * np.sin(SUN_ANGLE / 2) ** 2))

    @functools.cached_property
    def sun_light(self) -> Light | None:
        """The sun as a directional light; none without one, or where it is dark."""
        if self.sun is None or not self.sun_irradiance.any():
            return None
        r, g, b = self.sun_irradiance.tolist()
        x, y, z = (-self.sun.direction).tolist()
        return Light("sun", "directional", (r, g, b), direction=(x, y, z), angle=SUN_ANGLE)

    @property
    def most_irradiance(self) -> float:
        """About the most that a surface receives of it, in any colour [W/m²]."""
        normals = np.concatenate([np.eye(3), -np.eye(3)])
        return float((self.scale * self.shape_irradiance(normals).max(0) + self.sun_irradiance).max())

    @property
    def emits(self) -> bool:
        """Whether any light comes from it."""
        return bool(self.scale.max() > 0 and (self.sun is not None or self.shines))

    @property
    def shines(self) -> bool:
        """Whether any light would come from its map at another scale."""
        return bool(self.shape.max() > 0)

    def as_dict(self) -> dict[str, Any]:
        """For reports."""
        sun = None if self.sun is None else [self.sun.azimuth, self.sun.height]
        values = {"kind": self.kind, "colour": list(self.colour), "strength": self.strength, "sun": sun}
        return values | {"turbidity": self.turbidity, "file": self.name or None, "rotate": self.rotation}

    def same_shape(self, other: Sky) -> bool:
        """Whether the other one differs by ``scale`` at most."""
        if self.kind != other.kind or self.sun != other.sun or self.turbidity != other.turbidity:
            return False
        return self.image is other.image and self.rotation == other.rotation


def direction_at(azimuth: float, height: float) -> F64:
    """(3,) in the world, of angles in radians."""
    level = math.cos(height)
    return np.array([level * math.sin(azimuth), math.sin(height), -level * math.cos(azimuth)])


def directions(width: int, height: int) -> F64:
    """(height, width, 3) of the middles of a map's pixels."""
    azimuth = (np.arange(width) + 0.5) / width * 2 * np.pi
    down = (np.arange(height)[:, None] + 0.5) / height * np.pi
    level = np.sin(down)
    up = np.broadcast_to(np.cos(down), (height, width))
    return np.stack([level * np.sin(azimuth), up, -level * np.cos(azimuth)], axis=-1)


def solid_angles(width: int, height: int) -> F64:
    """(height, 1) of a pixel in each row of a map [sr]; all of them make 4π."""
    edges = np.cos(np.linspace(0, np.pi, height + 1))
    return np.asarray((edges[:-1] - edges[1:])[:, None] * 2 * np.pi / width)


__all__ = [
    "DEFAULT_SUN",
    "LEAST_TURBIDITY",
    "MOST_TURBIDITY",
    "SUN_ANGLE",
    "TURBIDITY",
    "Sky",
    "SkyKind",
    "Sun",
    "direction_at",
    "directions",
    "solid_angles",
]
