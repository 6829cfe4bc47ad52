"""Gathering finds the light of every texel along rays that are traced once [Kahl22].

    H = H_direct + 1/N Σ_k B(hit_k),    B = ρH

A piece of work is some rays more of each texel, what they hit kept (hits.py); shadow rays to the lamps (app/direct_light); the
bounces along all that is kept (bounces.py); and the light that is shown (compose.py), and how noisy it is (judging.py). Other
materials cost no ray: the bounces are solved again along what is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from app.direct_light.shadow_rays import DirectLight
from app.gpu import Gpu, Texture
from app.lightmap.lightmap import Lightmap
from app.scene.lights import Light
from app.scene.model import F64, Material
from app.scene.sky import Sky
from app.solvers.base import EnergyBalance, Inspection, Progress
from app.solvers.gathering.balance import Balance
from app.solvers.gathering.bounces import Bounces, steps_to
from app.solvers.gathering.compose import Compose
from app.solvers.gathering.hits import GROUP, Hits
from app.solvers.gathering.inspectable import Inspectable
from app.solvers.gathering.judging import FIRST, SHADOW_RAYS, Judging
from app.solvers.gathering.leaves import FreshLeaves
from app.solvers.gathering.options import GatheringOptions
from app.solvers.gathering.points import level_of, points_of
from app.util.parts import UnderWay, run_to_end
from app.util.state import State, StateError
from app.visibility.origins import Origins
from app.visibility.rays import RayScene

BATCH = 16  # rays of each texel at once
SYSTEM = 32  # rays of each texel along which bounces are solved; all of them then gather once more
JUDGED = 32  # rays of each texel, and at least two passes of shadow rays, from which on the noise is known well enough to end
SOON = 16  # shadow rays to what is new, before an edit is first shown
FIRST_STEPS = 2  # of the bounces, before an edit is first shown
SOLVED = 1e-3  # of the bounces, that may be missing
ALIKE = 3e-2  # of what solutions along other rays differ by, that may be missing


class Gathering:
    """Gathers the light of one lightmap. Whoever makes it releases it.

    issued: rays of each texel. drawn: how often the light that is shown was drawn anew.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, options: GatheringOptions) -> None:
        self.gpu, self.lightmap, self.options = gpu, lightmap, options
        self.rays = RayScene(gpu, lightmap.pool)
        adaptive = lightmap.refinement is not None
        self.points = Lightmap(gpu, points_of(lightmap)) if adaptive else lightmap
        self.origins = Origins(gpu, lightmap)
        self._at = Origins(gpu, self.points) if adaptive else self.origins
        self.hits = Hits(gpu, self.points, self.rays, self._at)
        self.direct = DirectLight(gpu, lightmap, self.rays, self.origins)
        self.at_points = DirectLight(gpu, self.points, self.rays, self._at) if adaptive else self.direct
        self.bounces = Bounces(gpu, self.points)
        self._compose = Compose(gpu, lightmap, self.origins, self.points, self._at, self.rays)
        self._balance = Balance(gpu, self.points)
        self._inspectable = Inspectable(gpu, lightmap, self.points, self._at, self.hits, self._directs, self._compose)
        self._under_way = UnderWay()
        self._judging = Judging(gpu, lightmap, self._compose)
        self._progress = Progress(0, 1.0, np.zeros(3))
        self._edited, self._shown, self.drawn = False, 0, 0
        self._leaves: FreshLeaves | None = None
        if lightmap.refinement is not None:
            self._leaves = FreshLeaves(
                lightmap, lightmap.refinement, self.origins, self.direct, self._compose, lambda: self.poll(wait=True)
            )
        self.issued = 0
        self.reset()

    # -- work ----------------------------------------------------------------------------------------------------------

    def work(self, amount: int, bands: int = 1) -> Generator[None, None, int]:
        """About ``amount`` rays more of each texel, whole groups of them, in parts. Returns how many."""
        self._under_way.finish()
        count = -(-min(amount, BATCH if self.issued else FIRST) // GROUP) * GROUP
        if self._edited:
            return self._under_way.begin(self._follow_edit())
        if self._leaves is not None and self._leaves.wait(self.issued):
            return self._under_way.begin(self._follow_leaves(self._leaves, bands))
        return self._under_way.begin(self._gather_more(count, bands))

    def _gather_more(self, count: int, bands: int) -> Generator[None, None, int]:
        """So many rays more of each texel, and the light that they bring."""
        first = self.issued
        kept = min(count, max(self.hits.room(self.options.ray_memory) - self.hits.count, 0))
        yield from self.hits.trace(kept, bands)
        for direct in self._directs:
            shadow_rays = self._judging.shadow_rays(count, first, self.direct)
            yield from direct.shoot(shadow_rays, self._judging.gain if direct is self.direct else None)
            direct.sum(self.lightmap.scene)
        self.issued = first + count
        if first < SYSTEM or first.bit_length() < self.issued.bit_length():  # twice as many as at the last time
            yield from self._solve(first == 0)
        else:
            yield from self.bounces.gather(self.hits, first, count, anew=False)
        self._show(self.issued)
        self._judge()
        return count

    def _follow_leaves(self, leaves: FreshLeaves, bands: int) -> Generator[None, None, int]:
        """Send for fresh leaves the shadow rays that the others have sent, and look at all leaves once more."""
        if leaves.slots:
            yield from leaves.light()
            self._compose.draw(self._direct_light)
            self._judge()
        yield from leaves.look(self.issued, bands)
        return 0

    def _solve(self, from_nothing: bool, begun: int = 0) -> Iterator[None]:
        """The bounces along a few of the rays, then along some, then what all of them find. What a few leave missing shrinks
        again along some. begun: steps along a few that were taken."""
        few, some = min(BATCH, self.issued), min(SYSTEM, self.issued)
        direct, reflected = self.at_points.light, self.bounces.reflected
        if from_nothing:
            steps = steps_to(SOLVED / ALIKE if some > few else SOLVED, reflected)
            yield from self.bounces.solve(self.hits, direct, few, steps, begun=begun)
        if some > few or not from_nothing:
            yield from self.bounces.solve(self.hits, direct, some, steps_to(ALIKE, reflected))
        yield from self.bounces.gather(self.hits, 0, self.issued, anew=True)

    def _follow_edit(self) -> Generator[None, None, int]:
        """The light of other materials, along the rays that are there: soon, along some of them, and once no more edits come
        along all. No ray is traced, but to lamps that were off, and to another sky."""
        while self._edited:
            self._edited = False
            usual = int(self.direct.count) or SHADOW_RAYS * self.issued // FIRST
            self._follow_lamps()
            for direct in self._directs:
                yield from direct.catch_up(min(SOON, usual))
                direct.sum(self.lightmap.scene)
            few = min(BATCH, self.issued)
            yield from self.bounces.solve(self.hits, self.at_points.light, few, FIRST_STEPS)
            yield from self.bounces.gather(self.hits, 0, few, anew=True)
            self._show(few)
            yield
            if not self._edited:
                yield from self._catch_up(usual)
            if not self._edited:
                yield from self._solve(from_nothing=True, begun=FIRST_STEPS)
                self._show(self.issued)
        self._judge()
        return 0

    def _catch_up(self, wanted: int) -> Iterator[None]:
        """So many shadow rays to lamps that have had few, or until another edit comes."""
        for direct in self._directs:
            for _ in direct.catch_up(wanted):
                yield
                if self._edited:
                    break
            direct.sum(self.lightmap.scene)

    def _judge(self) -> None:
        """Let the GPU say how noisy the light that is shown is."""
        self._judging.ask(self.issued, self._compose.direct or self.direct.light)

    def _show(self, rays: int) -> None:
        """What so many rays of each texel have gathered."""
        self._compose.smooth(self.bounces.gathered, rays, smooth=self.options.smooth)
        self._compose.draw(self._direct_light)
        self._shown, self.drawn = rays, self.drawn + 1

    @property
    def _direct_light(self) -> Texture:
        """As it is shown."""
        smooth = self.options.smooth
        return self._compose.smoothed_sky(self.direct, self.lightmap.scene) if smooth else self.direct.light

    @property
    def _directs(self) -> tuple[DirectLight, ...]:
        """On the points, and on texels where they are others."""
        return (self.direct,) if self.at_points is self.direct else (self.at_points, self.direct)

    # -- how far it is -------------------------------------------------------------------------------------------------

    def poll(self, *, wait: bool = False) -> Progress:
        """The newest progress that has arrived, a piece of work late; with ``wait`` that of the last."""
        if wait:
            self._under_way.finish()
        for done, level in self._judging.arrived(wait=wait):
            self._progress = Progress(done, level, self._progress.escaped)
        refinement = self.lightmap.refinement
        refining = self._leaves is not None and self._leaves.refining
        known = not self.lightmap.scene.emits or (self._progress.done >= JUDGED and self.direct.known)
        converged = known and self._progress.remaining <= self.options.noise and not self._edited and not refining
        note = None if refinement is None else refinement.note
        leaves = f"{refinement.wanted:,} more to split" if refining and refinement is not None else ""
        return replace(self._progress, converged=converged, refining=refining, leaves=leaves, note=note)

    def settle(self) -> Progress:
        """End the work under way, and wait for the GPU."""
        return self.poll(wait=True)

    def energy(self) -> EnergyBalance:
        """Where all light is now, RGB [W]. Reads every texel and waits for the GPU."""
        self._under_way.finish()
        balance = self._balance.measure(self.hits, self.at_points, self._compose.indirect)
        self._progress = replace(self._progress, escaped=balance.escaped)
        return balance

    # -- beginning, and other options ----------------------------------------------------------------------------------

    def reset(self) -> None:
        """Forget all light and all rays."""
        self._under_way.drop()
        self._judging.forget()
        if self._leaves is not None:
            self._leaves.begin_again()
        self.lightmap.clear()
        self.hits.forget()
        self.bounces.clear()
        for direct in self._directs:
            direct.forget()
        self._set_materials()
        self._follow_lamps()
        scene = self.lightmap.scene
        self.issued, self._edited = 0, False
        self._progress = Progress(0, 1.0 if scene.emits else 0.0, np.zeros(3))

    def set_options(self, options: GatheringOptions) -> None:
        """Use other knobs from the next rays on; what is shown follows at once."""
        self._under_way.finish()
        smooth, self.options = self.options.smooth, options
        if self.issued and options.smooth != smooth:
            self._show(self._shown)

    def set_observer(self, position: F64) -> None:
        """The light is the same wherever it is seen from."""

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        """Other albedos and emissions: the whole new solution, along the rays that are there."""
        factor = self.lightmap.common_factor(materials)
        before = factor * self.lightmap.emitted
        self.lightmap.set_materials(materials)
        self.bounces.scale(factor)
        if (self.lightmap.emitted < before / 2).any():
            self.bounces.clear()  # a thousandth of much light may be more than all of little
        if not self.issued:
            self.reset()
            return
        self._set_materials()
        self._edited = True

    def set_sky(self, sky: Sky | None) -> None:
        """Another sky: shadow rays to it are sent anew, but where only its strength or colour is another."""
        self.lightmap.set_sky(sky)
        if self.points is not self.lightmap:
            self.points.set_sky(sky)
        self._follow_scene()

    def set_lights(self, lights: tuple[Light, ...]) -> None:
        """Other lamps without area: shadow rays to them are sent anew, but where only their strength or colour is another."""
        self.lightmap.set_lights(lights)
        if self.points is not self.lightmap:
            self.points.set_lights(lights)
        self._follow_scene()

    def _follow_scene(self) -> None:
        """With the next piece of work."""
        if self.issued:
            self._edited = True
        else:
            self.reset()

    def _set_materials(self) -> None:
        """Let points and bounces follow the lightmap's materials."""
        scene = self.lightmap.scene
        if self.points is not self.lightmap:
            self.points.set_materials(scene.materials)
            self.points.unit = self.lightmap.unit
        self.bounces.set_materials()

    def _follow_lamps(self) -> None:
        """Let the sets of lamps follow the lightmap's materials: between pieces of work, which go through these sets."""
        for direct in self._directs:
            direct.follow(self.lightmap.scene)

    # -- kept for later ------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """All rays that are kept, and what they brought."""
        self._under_way.finish()
        state = State({"progress": self._progress.measured, "issued": self.issued})
        state.values |= {
            "edited": self._edited,
            "shown": self._shown,
            "point_level": level_of(self.points, self.lightmap),
        }
        if self._leaves is not None:
            self._leaves.keep(state)
        self._judging.keep(state)
        for nth, direct in enumerate(self._directs):
            state.put(f"direct {nth}", direct.state())
        for name, part in self._kept_parts.items():
            state.put(name, part.state())
        return state

    def restore(self, state: State) -> None:
        """The light that is shown is the lightmap's."""
        if state.values["point_level"] != level_of(self.points, self.lightmap):
            raise StateError("light bounced between points of another size")
        if self._leaves is not None:
            self._leaves.restore(state)
        scene = self.lightmap.scene
        for nth, direct in enumerate(self._directs):
            direct.restore(state.part(f"direct {nth}"), scene)
            direct.sum(scene)
        for name, part in self._kept_parts.items():
            part.restore(state.part(name))
        self._progress, self._edited = Progress.of(state.values["progress"]), bool(state.values["edited"])
        self.issued, self._shown = int(state.values["issued"]), int(state.values["shown"])
        if self._shown:
            self._compose.smooth(self.bounces.gathered, self._shown, smooth=self.options.smooth)
            self._compose.direct = self._direct_light
        self._judging.restore(state)

    @property
    def _kept_parts(self) -> dict[str, Hits | Bounces | Compose]:
        """Those that have a state of their own."""
        return {"hits": self.hits, "bounces": self.bounces, "compose": self._compose}

    # -- what there is to see ------------------------------------------------------------------------------------------

    @property
    def resolved(self) -> Mapping[str, Any]:
        """Rays of each texel whose hits are kept."""
        return {"kept_rays": self.hits.count}

    @property
    def layers(self) -> Mapping[str, Texture]:
        return self._inspectable.layers(self._shown)

    def inspect(self, texel: tuple[int, int] | None = None, *, images: bool = False) -> Inspection:
        """How much is traced and kept; of a texel, its rays, and what they bring."""
        bounces = self.bounces
        return self._inspectable.inspect(texel, self._progress, bounces.steps, bounces.outgoing if images else None)

    @property
    def traced(self) -> int:
        """Rays of all texels so far, to lamps as well."""
        return self.hits.traced + sum(direct.traced for direct in self._directs)

    def passes(self, amount: int) -> dict[str, Callable[[], None]]:
        """Each part of a piece of work by itself, to be timed."""
        count = -(-min(amount, BATCH) // GROUP) * GROUP
        return {
            "trace": lambda: run_to_end(self.hits.trace(count, 1)),
            "shadow rays": lambda: run_to_end(self.at_points.shoot(SHADOW_RAYS)),
            "bounce": lambda: run_to_end(self.bounces.solve(self.hits, self.at_points.light, count, 1)),
            "show": lambda: self._show(max(self.issued, GROUP)),
        }

    def warm_up(self) -> Iterator[None]:
        """Every pass."""
        for run in self.passes(GROUP).values():
            run()
            self.gpu.ctx.finish()
            yield

    def release(self) -> None:
        self._under_way.drop()
        self._judging.forget()
        if self._leaves is not None:
            self._leaves.release()
        parts: tuple[Any, ...] = (
            self._inspectable,
            self._balance,
            self._compose,
            self.bounces,
            *self._directs,
            self.hits,
            self.origins,
            self.rays,
        )
        for part in parts:
            part.release()
        if self.points is not self.lightmap:
            self._at.release()
            self.points.release()


__all__ = ["BATCH", "Gathering"]
