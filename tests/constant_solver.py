"""A tiny family of solvers, to show that nothing outside of a family needs it: it fills H with a constant."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from app.gpu import Gpu, Texture
from app.lightmap.lightmap import Lightmap
from app.options import Options, option
from app.scene.lights import Light
from app.scene.model import F64, Material
from app.scene.sky import Sky
from app.solvers import EnergyBalance, Family, Inspection, Progress
from app.util.state import State

SWEEPS = 3  # until it has converged by its defaults


@dataclass(frozen=True)
class ConstantOptions(Options):
    irradiance: float = option(2.0, "of every texel", unit="W/m²", minimum=0, maximum=100)
    rest: float = option(0.5**SWEEPS, "converged when so little remains", minimum=1e-3, maximum=1)


class Constant:
    """Fills H with a constant; each sweep halves what it says remains."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, options: ConstantOptions) -> None:
        self.options, self._lightmap, self.issued = options, lightmap, 0

    def reset(self) -> None:
        self._lightmap.clear()
        self.issued = 0

    def set_options(self, options: ConstantOptions) -> None:
        self.options = options

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        self._lightmap.set_materials(materials)
        self.reset()

    def set_sky(self, sky: Sky | None) -> None:
        self._lightmap.set_sky(sky)
        self.reset()

    def set_lights(self, lights: tuple[Light, ...]) -> None:
        self._lightmap.set_lights(lights)
        self.reset()

    def set_observer(self, position: F64) -> None:
        """The light is the same wherever it is seen from."""

    def work(self, amount: int, bands: int = 1) -> Generator[None, None, int]:
        self._lightmap.light_target.clear(*[self.options.irradiance / self._lightmap.unit] * 3, 0.0)
        self.issued += 1
        yield
        return 1

    def state(self) -> State:
        return State({"issued": self.issued})

    def restore(self, state: State) -> None:
        self.issued = state.values["issued"]

    def poll(self, *, wait: bool = False) -> Progress:
        remaining = 0.5**self.issued
        return Progress(self.issued, remaining, np.zeros(3), remaining <= self.options.rest)

    def settle(self) -> Progress:
        return self.poll(wait=True)

    def energy(self) -> EnergyBalance:
        E, nothing = self._lightmap.emitted, np.zeros(3)
        return EnergyBalance(
            E, E if self.issued else nothing, nothing, nothing if self.issued else E, nothing + 0.5, 1.0
        )

    @property
    def resolved(self) -> Mapping[str, Any]:
        return {}

    @property
    def layers(self) -> Mapping[str, Texture]:
        return {}

    def inspect(self, texel: tuple[int, int] | None = None, *, images: bool = False) -> Inspection:
        return Inspection(texel_facts={} if texel is None else {"Constant": f"{self.options.irradiance}"})

    def passes(self, amount: int) -> dict[str, Callable[[], None]]:
        return {}

    def warm_up(self) -> Iterator[None]:
        yield

    def release(self) -> None:
        pass


FAMILY = Family("Constant", "all alike", ConstantOptions, Constant, "sweeps", "unswept", 1, "rest", keeps_light=True)
