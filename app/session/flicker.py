"""Flicker is how much more or less than usual a lamp gives at a time: a smooth function of time alone, the same in every run."""

from __future__ import annotations

import dataclasses
import math

from app.scene.model import Material

WAVES = ((0.89, 0.11), (2.27, 0.08), (4.13, 0.06))  # Hz and amplitude of each: together a quarter at most
GOLDEN = (math.sqrt(5) - 1) / 2  # of a turn between one lamp and the next: no two are ever in step


def flicker(seconds: float, lamp: int) -> float:
    """The factor on what a lamp emits, around 1; lamp: its number, each of which has its own phase."""
    turns = ((hertz * seconds + GOLDEN * lamp * (nth + 1), size) for nth, (hertz, size) in enumerate(WAVES))
    return 1.0 + sum(size * math.sin(math.tau * turn) for turn, size in turns)


def flickering(materials: tuple[Material, ...], seconds: float) -> tuple[Material, ...]:
    """These materials with each lamp among them as bright as it is at that time."""
    return tuple(
        _times(material, flicker(seconds, nth)) if material.emits else material
        for nth, material in enumerate(materials)
    )


def _times(material: Material, factor: float) -> Material:
    red, green, blue = material.emission
    return dataclasses.replace(material, emission=(factor * red, factor * green, factor * blue))
