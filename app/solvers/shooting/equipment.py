"""What shots of every kind are made with: the scene that casts shadows, what light falls on, and the records of a batch."""

from __future__ import annotations

from dataclasses import dataclass

from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.solvers.shooting.receivers import Receivers
from app.solvers.shooting.shooters import ShooterBatch
from app.visibility.occluders import Occluders


@dataclass(frozen=True)
class Equipment:
    """Of one lightmap. Owns none of it."""

    gpu: Gpu
    lightmap: Lightmap
    occluders: list[Occluders]
    receivers: Receivers
    shooters: ShooterBatch


__all__ = ["Equipment"]
