"""A version of the open scene has other surfaces, a lamp more or less: it is cut in the background, and then takes its place."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from app.scene.model import Material, Scene


@dataclass(frozen=True, eq=False)
class Version:
    """Other surfaces for a scene that is open.

    of: that scene, as it was read. make: makes the other one from it. origins: for each material of the other one, its index in
    the open scene; None where it is new.
    """

    of: Scene
    make: Callable[[Scene], Scene]
    origins: tuple[int | None, ...]

    @property
    def keeps_materials(self) -> bool:
        """Whether the materials are the same ones, in the same order."""
        return self.origins == tuple(range(len(self.of.materials)))

    def materials(self, made: Scene, now: Sequence[Material]) -> tuple[Material, ...]:
        """Those of the version that was made, as they are ``now`` in the open scene where they come from there."""
        own = zip(self.origins, made.materials, strict=True)
        return tuple(new if origin is None else now[origin] for origin, new in own)


__all__ = ["Version"]
