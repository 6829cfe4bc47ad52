"""Lamps without area as a Scene promises them: finite, not negative, with cones in order. What is repaired or dropped is counted
in a note; SceneError where nothing can be repaired."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path

from app.errors import SceneError
from app.scene.checked_materials import BRIGHTEST, as_rgb
from app.scene.lights import Light
from app.util.words import counted, one_line


def check_lights(source: str | Path, lights: Sequence[Light], notes: list[str]) -> tuple[Light, ...]:
    """Lights that a solver can use: finite, not negative, with the inner cone within the outer one, and that within half of all
    directions."""
    checked, dark, cones, aimless = [], 0, 0, 0
    for light in lights:
        name = one_line(light.name)
        if not all(map(math.isfinite, (*light.intensity, *light.position, light.inner, light.outer, light.radius))):
            raise SceneError(source, f"light '{name}': intensity, position, cones and radius must be finite numbers")
        if max(light.intensity) > BRIGHTEST:
            raise SceneError(source, f"light '{name}': an intensity above {BRIGHTEST:g} is out of range")
        direction = light.direction
        if not all(map(math.isfinite, direction)):
            if light.kind != "point":
                aimless += 1
                continue
            direction = (0.0, -1.0, 0.0)
        intensity = as_rgb(max(x, 0.0) for x in light.intensity)
        outer = min(light.outer, math.pi / 2)
        inner = min(light.inner, outer)
        dark += intensity != light.intensity
        cones += (inner, outer) != (light.inner, light.outer)
        held = dataclasses.replace(light, name=name, intensity=intensity, direction=direction)
        checked.append(dataclasses.replace(held, inner=inner, outer=outer))
    if aimless:
        notes.append(f"{counted(aimless, 'light was', 'lights were')} dropped: without a direction")
    if dark:
        notes.append(f"{counted(dark, 'light', 'lights')} with an intensity below 0: set to 0")
    if cones:
        notes.append(f"{counted(cones, 'spot light', 'spot lights')} with cones out of order or above 90 degrees: held")
    return tuple(checked)
