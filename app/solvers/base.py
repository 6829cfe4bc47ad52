"""What every solver is: it writes a Lightmap in bounded steps and says how far it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from app.gpu import Texture
from app.scene.model import F64


@dataclass(frozen=True)
class StepReport:
    """What is known after a step, a few steps late: nothing waits for the GPU.

    shots made so far; residual: unshot share of the emitted power [-], 1 before the first shot; escaped: power that left the
    scene, RGB [W].
    """

    shots: int
    residual: float
    escaped: F64


@dataclass(frozen=True)
class EnergyBook:
    """emitted = absorbed + escaped + unshot + imbalance, RGB [W]; the imbalance is the error of form factors and visibility.

    reflectance: area-weighted mean albedo, RGB; area: of all texels [m²].
    """

    emitted: F64
    absorbed: F64
    escaped: F64
    unshot: F64
    reflectance: F64
    area: float

    @property
    def imbalance(self) -> F64:
        return self.emitted - self.absorbed - self.escaped - self.unshot

    @property
    def imbalance_share(self) -> float:
        """Imbalance over emitted power, summed over RGB [-]; 0 without any emitter."""
        total = float(self.emitted.sum())
        return float(self.imbalance.sum()) / total if total > 0 else 0.0

    @property
    def ambient(self) -> F64:
        """Ambient radiosity of the light not yet shot, RGB [W/m²] [Cohen88, eq. 9]: mean unshot exitance over 1 - mean albedo."""
        return np.asarray(self.unshot / self.area / np.maximum(1.0 - self.reflectance, 1e-3))


class Solver(Protocol):
    """The whole interface. ``step`` is one bounded unit of work: no UI, no clock."""

    def reset(self) -> None: ...
    def step(self, shots: int) -> int: ...
    def poll(self, *, wait: bool = False) -> StepReport: ...
    def books(self) -> EnergyBook: ...
    def inspect(self) -> dict[str, Texture]: ...
    def release(self) -> None: ...


__all__ = ["EnergyBook", "Solver", "StepReport"]
