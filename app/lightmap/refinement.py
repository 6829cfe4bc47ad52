"""Quadtrees that follow the light: the options that say where, and whether leaves still come or go."""

from __future__ import annotations

from app.lightmap.options import QUADTREE, LightmapOptions


class Refinement:
    """options: obeyed from the next look at the leaves on. stable: whether the last look at them found nothing to do.
    changed: whether the user asked for other leaves since a solver last heard of it."""

    def __init__(self, options: LightmapOptions) -> None:
        self.options, self.stable, self.changed = options, False, False

    def set_options(self, options: LightmapOptions) -> None:
        """Let leaves follow other options."""
        self.stable = False
        self.changed |= any(getattr(options, name) != getattr(self.options, name) for name in QUADTREE)
        self.options = options
