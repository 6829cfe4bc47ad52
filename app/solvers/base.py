"""What every solver is: it writes the light of a Lightmap in bounded pieces of work, and says how far it is.

The contract is made for shooting [Cohen88], gathering along rays [Kahl22] and a local matrix [Shcherbakov19]: each family counts
its work in a unit of its own (shots, rays, updates), and says in its own words what remains, unshot light or noise.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar

import numpy as np

from app.gpu import Texture
from app.options import Options
from app.scene.lights import Light
from app.scene.model import F32, F64, Material
from app.scene.sky import Sky
from app.util.state import State

Rect = tuple[float, float, float, float]  # (u, v, u, v) in the virtual atlas [texels of level 0]
HEMISPHERE = "Hemisphere"  # caption of the picture that a view makes of the rays of an Inspection
# What a solver may know of every texel besides its light, see app/render/layers.py for how that is shown
LAYERS = {
    "residual": "r, RGB [stored units]: exitance that is still pending",
    "direct": "the part of H that came straight from lamps, RGB [stored units]",
    "variance": "variance of the mean of H over RGB [stored units²]",
    "rays": "rays traced from it",
    "local": "r: level of what it is in, of a local set, from 1, 0 in none; g: pieces of work since that entered; b: number of "
    "its colour",
}


@dataclass(frozen=True)
class Progress:
    """How far a solve is, as of a few pieces of work ago: nothing waits for the GPU.

    done: work done so far, in the family's unit. remaining: share of the emitted power that is still to be distributed, or
    the noise that is left, over the mean [-]; 1 before any work, and not finite where the light is not. escaped: power that left
    the scene, RGB [W]. converged: whether what remains is as little as the options ask for, and nothing else changes any more.
    refining: whether leaves of a quadtree come or go, or do not yet hold all of their light. leaves: what is being done for them
    then, in a few words. note: what the user should know of the solution, if anything. doing: what is being done that what
    remains does not tell, in a few words.
    """

    done: int
    remaining: float
    escaped: F64
    converged: bool = False
    refining: bool = False
    leaves: str = ""
    note: str | None = None
    doing: str = ""

    @property
    def measured(self) -> list[Any]:
        """What does not follow from other things, as plain values."""
        return [self.done, self.remaining, self.escaped.tolist()]

    @staticmethod
    def of(measured: list[Any]) -> Progress:
        """The progress whose ``measured`` this is."""
        done, remaining, escaped = measured
        return Progress(int(done), float(remaining), np.array(escaped, np.float64).reshape(3))


@dataclass(frozen=True)
class EnergyBalance:
    """Where all emitted power is, RGB [W]: emitted = absorbed + escaped + unshot + imbalance. The imbalance is the error of form
    factors and visibility.

    reflectance: area-weighted mean albedo, RGB; area: of all texels [m²]. estimated: whether what enters from outside is not
    known yet.
    """

    emitted: F64
    absorbed: F64
    escaped: F64
    unshot: F64
    reflectance: F64
    area: float
    estimated: bool = False

    @property
    def imbalance(self) -> F64:
        return self.emitted - self.absorbed - self.escaped - self.unshot

    @property
    def imbalance_share(self) -> float:
        """Imbalance over emitted power, summed over RGB [-]; 0 without any emitter."""
        total = float(self.emitted.sum())
        return float(self.imbalance.sum()) / total if total > 0 else 0.0


@dataclass(frozen=True)
class Rays:
    """Along which a texel receives light: where each starts and ends (n, 3) f32 [solver space], and the radiosity that it brings,
    RGB (n, 3) f32 [W/m²], of which the mean is irradiance."""

    start: F32
    end: F32
    light: F32


@dataclass(frozen=True)
class Inspection:
    """What a solver shows of its last piece of work, and of one texel.

    images: pictures by caption, the solver's own: valid until it works again. rectangles: places of the virtual atlas to mark, by
    name. facts: what there is to say, name and value. texel_facts: the same of the texel that was asked for. texel_light: parts
    of its H by name, RGB [W/m²]. rays: of that texel, where light comes along rays; with images only. figures: of the solution so
    far, name and value. counts: of what took place so far on all texels, which only grow, by name.
    """

    images: Mapping[str, Texture] = field(default_factory=dict)
    rectangles: Mapping[str, Rect] = field(default_factory=dict)
    facts: Mapping[str, str] = field(default_factory=dict)
    texel_facts: Mapping[str, str] = field(default_factory=dict)
    texel_light: Mapping[str, F64] = field(default_factory=dict)
    rays: Rays | None = None
    figures: Mapping[str, str] = field(default_factory=dict)
    counts: Mapping[str, int] = field(default_factory=dict)


OptionsT = TypeVar("OptionsT", bound=Options)


class Solver(Protocol[OptionsT]):
    """The whole interface of what writes a lightmap: no UI, no clock.

    options: the knobs that the next piece of work obeys. issued: work given to the GPU so far, in the family's unit; Progress
    tells, a little later, what came of it.
    """

    options: OptionsT

    @property
    def issued(self) -> int: ...

    def reset(self) -> None:
        """Forget all light and begin again."""

    def set_options(self, options: OptionsT) -> None:
        """Use other knobs from the next piece of work on. Raises UserError."""

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        """Use other albedos and emissions of the scene from the next piece of work on; solve for the difference where the method
        can."""

    def set_sky(self, sky: Sky | None) -> None:
        """Have another sky from the next piece of work on. Raises UserError."""

    def set_lights(self, lights: tuple[Light, ...]) -> None:
        """Have other lamps without area from the next piece of work on. Raises UserError."""

    def set_observer(self, position: F64) -> None:
        """The eye is at ``position`` (3,) [m]: what a solver does first, or alone, where the world is too large to solve at
        once. The others solve for all surfaces alike, wherever they are seen from."""

    def work(self, amount: int, bands: int = 1) -> Generator[None, None, int]:
        """Do about so much work, in the family's unit, but no more than suits the method at once (one batch), in bounded parts:
        one for each ``next``, the longest passes cut into so many bands. Returns how much was issued. Whatever needs whole pieces
        of work (``poll`` that waits, ``energy``, options, materials, other work) ends it first; the generator is then over."""

    def poll(self, *, wait: bool = False) -> Progress:
        """The newest progress that has arrived; with ``wait`` that of the last piece of work."""

    def settle(self) -> Progress:
        """End the work under way, wait for the GPU, and measure what remains now: ``poll`` says so from then on."""

    def energy(self) -> EnergyBalance:
        """Where all emitted energy is now. Reads every texel and waits for the GPU."""

    @property
    def resolved(self) -> Mapping[str, Any]:
        """The values in this scene of options that were left unset, by name."""

    @property
    def layers(self) -> Mapping[str, Texture]:
        """What it knows of every texel of the tile pool besides H, by name: those of LAYERS that its family has, to be shown.
        Valid until it works again."""

    def inspect(self, texel: tuple[int, int] | None = None, *, images: bool = False) -> Inspection:
        """What there is to see of the last piece of work, and of a texel (column, row) of the tile pool. With ``images`` it draws
        its pictures, and what takes as long; it may then wait for the GPU."""

    def passes(self, amount: int) -> dict[str, Callable[[], None]]:
        """Each pass of a piece of work by itself, to be timed. They spoil the light: reset afterwards."""

    def warm_up(self) -> Iterator[None]:
        """Do once, in parts, all that a solve will do, so that no frame waits for a driver that compiles. Spoils the light."""

    def state(self) -> State:
        """All that the work to come follows from, but for the lightmap, the scene and the options: from it another solver of the
        same kind goes on to the same light. Ends the work under way, and changes nothing else."""

    def restore(self, state: State) -> None:
        """Go on as from a ``state``: on the same scene with the same options, just after ``reset``, and with the state of the
        lightmap restored. Raises StateError; reset it then."""

    def release(self) -> None:
        """Give back what is on the GPU, but for the lightmap."""


__all__ = ["HEMISPHERE", "LAYERS", "EnergyBalance", "Inspection", "Progress", "Rays", "Rect", "Solver"]
