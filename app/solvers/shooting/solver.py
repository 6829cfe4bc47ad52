"""Progressive refinement radiosity, on uniform texels and on quadtrees."""

from __future__ import annotations

from app.solvers.shooting.adaptive import AdaptiveShooting


class Shooting(AdaptiveShooting):
    """Shoots a lightmap to convergence; where that refines itself, leaves follow the light. Whoever makes it releases it."""


__all__ = ["Shooting"]
