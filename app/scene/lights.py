"""Lights are lamps without area: points, spots, and what shines from afar in one direction (KHR_lights_punctual).

    E = I(ω) w(d) cos θ / d²,    w = clamp(1 - (d / range)⁴, 0, 1),    and from afar E = E_0 cos θ

What a spot sends out falls between its cones: I(ω) = I sat(s cos ω + o)², s = 1 / max(0.001, cos inner - cos outer),
o = -s cos outer, ω from its axis. Files count in candela and lux; how much of either a watt is, colorimetry.py says.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

F64 = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
RGB = tuple[float, float, float]
Vector = tuple[float, float, float]
LightKind = Literal["point", "spot", "directional"]

OUTER = math.pi / 4  # of a spot whose file does not say
SHARPEST = 1e-3  # cos inner - cos outer, at least


@dataclass(frozen=True)
class Light:
    """A lamp without area. What it meets is lit by it; nothing sees it.

    intensity: linear Rec.709, [W/sr], or of a directional one what a surface that faces it receives [W/m²]. position [m].
    direction: unit, in which it shines, of spot and directional. inner, outer: angles of a spot's cones from its axis [rad].
    range: where its light ends [m]. radius [m] of the sphere that a point or spot is, angle [rad] across that a directional one
    is seen under, for the edges of shadows; 0 is sharp. on: whether it shines.
    """

    name: str
    kind: LightKind = "point"
    intensity: RGB = (1.0, 1.0, 1.0)
    position: Vector = (0.0, 0.0, 0.0)
    direction: Vector = (0.0, -1.0, 0.0)
    inner: float = 0.0
    outer: float = OUTER
    range: float = math.inf
    radius: float = 0.0
    angle: float = 0.0
    on: bool = True

    @property
    def emits(self) -> bool:
        return self.on and max(self.intensity) > 0.0

    @property
    def from_afar(self) -> bool:
        """Whether it has a direction and no place."""
        return self.kind == "directional"

    @property
    def slope(self) -> tuple[float, float]:
        """s and o of a spot's falloff; of a point light 0 and 1."""
        if self.kind != "spot":
            return 0.0, 1.0
        s = 1.0 / max(SHARPEST, math.cos(self.inner) - math.cos(self.outer))
        return s, -s * math.cos(self.outer)

    @property
    def solid_angle(self) -> float:
        """∫ I(ω) / I dω [sr] of a point or spot: 4π, or with z = cos ω, 2π ∫ (s z + o)² dz up to where it is 1, and 2π (1 - z)
        beyond."""
        if self.kind != "spot":
            return 4 * math.pi
        s, o = self.slope
        full = min((1 - o) / s, 1.0)
        return 2 * math.pi * ((s * full + o) ** 3 / (3 * s) + 1 - full)

    @property
    def flux(self) -> F64:
        """Power that a point or spot sends out, RGB [W]; 0 while it is off."""
        return self.solid_angle * np.array(self.intensity) * self.on

    def irradiance(self, positions: F64, normals: F64) -> F64:
        """(n, 3) that surfaces there (n, 3) [m] with these normals (n, 3) receive where nothing hides it [W/m²]."""
        towards = np.broadcast_to(-np.array(self.direction), positions.shape)
        share = np.ones(len(positions))
        if not self.from_afar:
            away = np.array(self.position) - positions
            distance = np.maximum(np.linalg.norm(away, axis=1), 1e-12)
            towards, (s, o) = away / distance[:, None], self.slope
            cone = np.clip(-s * towards @ np.array(self.direction) + o, 0.0, 1.0) ** 2
            share = cone * np.clip(1 - (distance / self.range) ** 4, 0.0, 1.0) / distance**2
        cosine = np.maximum(np.einsum("nk,nk->n", towards, normals), 0.0)
        return np.asarray((cosine * share * self.on)[:, None] * np.array(self.intensity))
