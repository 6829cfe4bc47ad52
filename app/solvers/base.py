"""What every solver is: it writes a Lightmap in bounded steps and says how far it is."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol, TypeVar

import numpy as np

from app.gpu import Texture
from app.options import Options
from app.scene.model import F64, Material


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
class EnergyBalance:
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
    def returned(self) -> F64:
        """Share of the light leaving surfaces that they send out again, RGB [-]: ρ̄ H / (H + escaped), H what they receive."""
        received = self.absorbed / np.maximum(1.0 - self.reflectance, 1e-3)
        return np.asarray(self.reflectance * received / np.maximum(received + self.escaped, 1e-300))


OptionsT = TypeVar("OptionsT", bound=Options)


class PatchShot(Protocol):
    """The patch that shot, (u, v, u, v) in the virtual atlas [texels of level 0]: its leaf may be gone since, or elsewhere."""

    @property
    def rect(self) -> tuple[float, float, float, float]: ...


class Solver(Protocol[OptionsT]):
    """The whole interface of what writes a lightmap. ``step`` is one bounded unit of work: no UI, no clock.

    options: the knobs that the next shot obeys. report: the newest that ``poll`` has heard. shots: issued so far.
    """

    options: OptionsT
    report: StepReport
    shots: int
    note: str | None  # what the user should know of the solution, if anything

    @property
    def last_shot(self) -> PatchShot | None:
        """The last shooter that ``poll`` has heard of."""

    def reset(self) -> None:
        """Forget all light and begin again."""

    def set_options(self, options: OptionsT) -> None:
        """Use other knobs from the next shot on. Raises UserError."""

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        """Other albedos and emissions of the scene, from the next step on; solves for the difference if it can."""

    @property
    def grown(self) -> bool:
        """Whether no leaves come or go, and all hold what the shots gave them."""

    @property
    def settled(self) -> bool:
        """Whether the solution is as even as it will be: once the residual is small as well, it is solved."""

    def unshot_share(self) -> float:
        """The residual as a share of the emitted power, now. Waits for the GPU."""

    def step(self, shots: int) -> int:
        """Make up to ``shots`` shots, or a few more where some belong together, and no more than one batch of its own; how many
        were issued. Other work that must be done first is done instead, and counts as so many."""

    def step_part(self, bands: int) -> bool:
        """A part of a step of one shot, its longest pass cut into so many bands; whether the step is whole now. Everything else
        that needs whole steps finishes it first."""

    def poll(self, *, wait: bool = False) -> StepReport:
        """The newest report that has arrived; with ``wait`` that of the last step."""

    def books(self) -> EnergyBalance:
        """Where all emitted energy is now. Reads every texel and waits for the GPU."""

    def passes(self, shots: int) -> dict[str, Callable[[], None]]:
        """Each part of a step of so many shots by itself, to be timed. They spoil the light: reset afterwards."""

    def warm_up(self, shots: int) -> Iterator[None]:
        """Do once, in parts, all that a solve will do, so that no step waits for a driver that compiles. Spoils the light."""

    def patch_edge(self, texel: tuple[int, int]) -> int:
        """Texels along the edge of the largest patch that a texel (column, row) of the tile pool may shoot from now."""

    @property
    def level(self) -> int:
        """Mip level that shoots in the end: as set, or as the scene asks for."""

    @property
    def resolution(self) -> int:
        """Edge of a full face of the visibility map [px]: as set, or as the scene asks for."""

    def inspect(self) -> dict[str, Texture]:
        """Textures that explain ``last_shot``, by name; ``items`` and ``depth`` are what it sees, nothing before the first."""

    def vanished(self) -> int:
        """Triangles that ``last_shot`` sees only because each is drawn as one sample at least. Waits for the GPU."""

    def release(self) -> None:
        """Give back what is on the GPU, but for the lightmap."""


__all__ = ["EnergyBalance", "PatchShot", "Solver", "StepReport"]
