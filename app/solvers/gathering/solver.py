"""Gathering finds the light of every texel along rays that are traced once [Kahl22].

    H = H_direct + 1/N Σ_k B(hit_k),    B = ρH

A piece of work is some rays more of each texel, what they hit kept (hits.py); shadow rays to the lamps (app/direct_light); the
bounces along all that is kept (bounces.py); and the light that is shown (compose.py). Other materials cost no ray: the bounces
are solved again along what is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from app.atlas.texels import uniform_leaves
from app.direct_light.lit import PASS
from app.direct_light.shadow_rays import DirectLight
from app.gpu import Framebuffer, Gpu, ReadBack, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.quadtree import Change
from app.lightmap.tile_pool import Moves, TilePool
from app.scene.lights import Light
from app.scene.model import F64, Material
from app.scene.sky import Sky
from app.solvers.base import EnergyBalance, Inspection, Progress
from app.solvers.gathering.balance import Balance
from app.solvers.gathering.bounces import Bounces, steps_to
from app.solvers.gathering.compose import Compose, Noise, noise_of
from app.solvers.gathering.hits import GROUP, Hits
from app.solvers.gathering.inspectable import Inspectable
from app.solvers.gathering.options import GatheringOptions
from app.util.parts import UnderWay, run_to_end
from app.util.state import State, StateError
from app.visibility.origins import Origins
from app.visibility.rays import RayScene

BATCH, FIRST = 16, 8  # rays of each texel at once, and at first
MOST_POINTS = 100_000  # in quadtrees: as many as two cores trace rays from at interactive rates
SYSTEM = 32  # rays of each texel along which bounces are solved; all of them then gather once more
JUDGED = 32  # rays of each texel, and at least two passes of shadow rays, from which on the noise is known well enough to end
CHANGES_PER_RAY = 16  # leaves that split or merge at once: bounded work for a frame
FIRST_LOOK = 32  # rays, after which leaves are looked at: what few rays say is noise
LOOK_AGAIN = 2  # times as many rays, when leaves did not change at the last look
SHADOW_RAYS = 4  # from each texel to each set of lamps, for FIRST rays
SOON = 16  # shadow rays to what is new, before an edit is first shown
FIRST_STEPS = 2  # of the bounces, before an edit is first shown
SHADOW_COST = 0.5  # of a shadow ray, beside a ray: it ends at the first hit
MOST_SHADOW_RAYS = 4  # to each set, for a ray
SOLVED = 1e-3  # of the bounces, that may be missing
ALIKE = 3e-2  # of what solutions along other rays differ by, that may be missing


def points_of(lightmap: Lightmap) -> TilePool:
    """The points between which light bounces, where leaves of quadtrees come and go: texels of one level, whatever the leaves."""
    pool, level = lightmap.pool, 0
    while level < lightmap.options.depth and pool.uniform_texels(level + 1) <= MOST_POINTS:
        level += 1
    return TilePool(pool.scene, pool.charts, uniform_leaves(pool.charts, level))


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
        self._judged: list[tuple[int, int, ReadBack]] = []  # rays, version of the leaves
        self._progress = Progress(0, 1.0, np.zeros(3))
        self._edited, self._shown, self.drawn = False, 0, 0
        self._noise: Noise | None = None
        self._noise_of = 0  # this version of the leaves
        self._fresh: set[int] = set()  # slots whose leaves have no rays yet
        self._look_at = 0  # rays at which leaves are looked at again
        if lightmap.refinement is not None:
            lightmap.refinement.follower = self
        self.issued = 0
        self.reset()

    # -- work ----------------------------------------------------------------------------------------------------------

    def work(self, amount: int, bands: int = 1) -> Generator[None, None, int]:
        """About ``amount`` rays more of each texel, whole groups of them, in parts. Returns how many."""
        self._under_way.finish()
        count = -(-min(amount, BATCH if self.issued else FIRST) // GROUP) * GROUP
        if self._edited:
            return self._under_way.begin(self._follow_edit())
        if self._leaves_wait:
            return self._under_way.begin(self._follow_leaves(bands))
        return self._under_way.begin(self._gather_more(count, bands))

    def _gather_more(self, count: int, bands: int) -> Generator[None, None, int]:
        """So many rays more of each texel, and the light that they bring."""
        first = self.issued
        kept = min(count, max(self.hits.room(self.options.ray_memory) - self.hits.count, 0))
        yield from self.hits.trace(kept, bands)
        for direct in self._directs:
            yield from direct.shoot(self._shadow_rays(count), self._gain if direct is self.direct else None)
            direct.sum(self.lightmap.scene)
        self.issued = first + count
        if first < SYSTEM or first.bit_length() < self.issued.bit_length():  # twice as many as at the last time
            yield from self._solve(first == 0)
        else:
            yield from self.bounces.gather(self.hits, first, count, anew=False)
        self._show(self.issued)
        self._judge()
        return count

    @property
    def _leaves_wait(self) -> bool:
        """Whether leaves of quadtrees come and go, or are to be looked at."""
        refinement = self.lightmap.refinement
        return refinement is not None and self.issued >= FIRST_LOOK and (self._refining or self.issued >= self._look_at)

    @property
    def _refining(self) -> bool:
        refinement = self.lightmap.refinement
        return refinement is not None and (bool(self._fresh) or not refinement.stable)

    def _follow_leaves(self, bands: int) -> Generator[None, None, int]:
        """Send for fresh leaves the shadow rays that the others have sent, and look at all leaves once more."""
        refinement = self.lightmap.refinement
        assert refinement is not None
        if self._fresh:
            slots = np.array(sorted(self._fresh), np.int64)
            self._fresh.clear()
            self.origins.write(slots)
            yield from self.direct.shoot_tiles(slots)
            self.direct.sum(self.lightmap.scene)
            self._compose.draw(self._direct_light)
            self._judge()
        yield from refinement.look(CHANGES_PER_RAY * BATCH, bands, self.issued)
        if refinement.stable:
            self._look_at = LOOK_AGAIN * self.issued
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

    def _shadow_rays(self, count: int) -> int:
        """How many shadow rays go with so many rays more: as many as make the whole the least noisy for its cost. A cost c of
        each shadow ray, those of all sets, beside a ray: where D is the share of the deviation that d shadow rays leave and I
        that of n rays, d / n = √(D d / (I n c))."""
        if self._noise is None or not 0 < self._noise.direct < 1:
            return SHADOW_RAYS * count // FIRST
        D, I = self._noise.direct * self.direct.count, (1 - self._noise.direct) * self.issued  # noqa: E741
        ratio = np.sqrt(D / (I * SHADOW_COST * len(self.direct.sets)))
        wanted = ratio * (self.issued + count) - self.direct.count
        return int(np.clip(wanted, PASS, MOST_SHADOW_RAYS * count))

    @property
    def _gain(self) -> F64 | None:
        """What shadow rays gain in each slot as it is now, see allocate.py; None where that is not known."""
        if self._noise is None or self._noise_of != self.lightmap.version:
            return None
        return self._noise.gain[: self.lightmap.pool.tiles]

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
        self._judged.append(
            (self.issued, self.lightmap.version, self._compose.judge(self._compose.direct or self.direct.light))
        )

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
        while len(self._judged) > (0 if wait else 1):
            done, version, judged = self._judged.pop(0)
            self._noise, self._noise_of = noise_of(judged), version
            level = self._noise.level if done > GROUP else 1.0  # of one group nothing is known
            self._progress = Progress(done, level, self._progress.escaped)
        refining, refinement = self._refining, self.lightmap.refinement
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
        for *_, judged in self._judged:
            judged.take()
        self._judged.clear()
        if self.lightmap.refinement is not None:
            self.lightmap.refinement.begin_again()
        if self._fresh:
            self.origins.write(np.array(sorted(self._fresh), np.int64))
            self._fresh.clear()
        self._look_at = 0
        self.lightmap.clear()
        self.hits.forget()
        self.bounces.clear()
        for direct in self._directs:
            direct.forget()
        self._set_materials()
        self._follow_lamps()
        scene = self.lightmap.scene
        self.issued, self._edited, self._noise = 0, False, None
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

    # -- leaves that come and go, see app/lightmap/refinement.py -------------------------------------------------------

    @property
    def carried(self) -> list[tuple[Texture, Framebuffer]]:
        return []

    def options_changed(self) -> None:
        pass

    def leaves_changed(self, change: Change) -> None:
        old, new = (change.parents, change.children) if change.split else (change.children, change.parents)
        self._fresh = self._fresh - set(old.tolist()) | set(new.tolist())

    def give_up(self) -> None:
        """Rays of new leaves are one piece of work: it is done."""

    def slots_will_move(self) -> None:
        self.poll(wait=True)

    def resized(self, moves: Moves) -> None:
        now = dict(zip(moves.old.tolist(), moves.new.tolist(), strict=True))
        self._fresh = {now.get(slot, slot) for slot in self._fresh}
        self.origins.resized(moves)
        self.direct.resized(moves)
        self._compose.resized()

    # -- kept for later ------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """All rays that are kept, and what they brought."""
        self._under_way.finish()
        state = State({"progress": self._progress.measured, "issued": self.issued, "look_at": self._look_at})
        state.values |= {"edited": self._edited, "shown": self._shown, "point_level": self._point_level}
        state.values |= {"judged": [[done, version] for done, version, _ in self._judged]}
        state.arrays["fresh"] = np.array(sorted(self._fresh), np.int64)
        for nth, (*_, judged) in enumerate(self._judged):
            state.arrays[f"judged {nth}"] = np.frombuffer(judged.look(), np.float32)
        if self._noise is not None:
            state.values["noise"] = [self._noise.level, self._noise.direct, self._noise_of]
            state.arrays["gain"] = self._noise.gain
        for nth, direct in enumerate(self._directs):
            state.put(f"direct {nth}", direct.state())
        for name, part in self._kept_parts.items():
            state.put(name, part.state())
        return state

    def restore(self, state: State) -> None:
        """The light that is shown is the lightmap's."""
        if state.values["point_level"] != self._point_level:
            raise StateError("light bounced between points of another size")
        used = np.flatnonzero(self.lightmap.pool.used)
        if self.lightmap.refinement is not None:
            self.origins.write(used)
        fresh = state.array("fresh", np.int64, -1)
        if not np.isin(fresh, used).all():
            raise StateError("fresh slots hold nothing")
        scene = self.lightmap.scene
        for nth, direct in enumerate(self._directs):
            direct.restore(state.part(f"direct {nth}"), scene)
            direct.sum(scene)
        for name, part in self._kept_parts.items():
            part.restore(state.part(name))
        self._fresh, self._edited = set(fresh.tolist()), bool(state.values["edited"])
        self.issued, self._shown = int(state.values["issued"]), int(state.values["shown"])
        self._look_at, self._progress = int(state.values["look_at"]), Progress.of(state.values["progress"])
        if self._shown:
            self._compose.smooth(self.bounces.gathered, self._shown, smooth=self.options.smooth)
            self._compose.direct = self._direct_light
        self._restore_noise(state)

    def _restore_noise(self, state: State) -> None:
        """What is known of it, of the leaves of some version, and what is on its way."""
        slots, version = self.lightmap.columns * self.lightmap.rows, self.lightmap.version
        for nth, (done, of) in enumerate(state.values["judged"]):
            judged = state.array(f"judged {nth}", np.float32, 4 * slots if of == version else -1)
            self._judged.append((int(done), int(of), ReadBack.arrived(self.gpu, judged.tobytes())))
        if "noise" in state.values:
            level, direct, of = state.values["noise"]
            gain = state.array("gain", np.float64, slots if of == version else -1)
            self._noise, self._noise_of = Noise(float(level), float(direct), gain), int(of)

    @property
    def _kept_parts(self) -> dict[str, Hits | Bounces | Compose]:
        """Those that have a state of their own."""
        return {"hits": self.hits, "bounces": self.bounces, "compose": self._compose}

    @property
    def _point_level(self) -> int:
        """The level of the points' texels, which goes with the leaves that there were when this was made."""
        return -1 if self.points is self.lightmap else int(self.points.pool.leaves.level.max())

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
        for *_, judged in self._judged:
            judged.take()
        refinement = self.lightmap.refinement
        if refinement is not None and refinement.follower is self:
            refinement.follower = None
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
