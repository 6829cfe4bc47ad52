"""A version of a scene has other surfaces, a lamp more or less; edits of materials pass from one version to another."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from app.scene.area_lamps import Key, Surfaces, keys_of, with_scale
from app.scene.model import Material, Scene

MaterialEdits = Mapping[Key, Material]  # those that are others than they came


@dataclass(frozen=True, eq=False)
class Version:
    """A scene with other surfaces, cut in the background, that then takes the place of what is open.

    surfaces: that it has. make: makes it from what is loaded. of: the open scene as it was read, of a version of that.
    """

    surfaces: Surfaces
    make: Callable[[Scene], Scene]
    of: Scene | None = None


def edits_of(came: tuple[Material, ...], now: tuple[Material, ...]) -> dict[Key, Material]:
    """Materials that are others now."""
    pairs = zip(keys_of(came), came, now, strict=True)
    return {key: after for key, before, after in pairs if after is not before}


def with_edits(came: tuple[Material, ...], edits: MaterialEdits) -> tuple[Material, ...]:
    """Materials as edited, cut as finely as they are; edits of others than these do nothing."""
    pairs = zip(keys_of(came), came, strict=True)
    return tuple(with_scale(edits.get(key, material), material.lightmap_scale) for key, material in pairs)


__all__ = ["MaterialEdits", "Version", "edits_of", "with_edits"]
