"""Texel pairs: every texel gathers from every other, or from what stands for windows of them [Kahl22].

    H_i = Σ_j B_j F_ij V_ij,   B = E + ρH,   F_ij = cosθ_i cosθ_j A_j / (π r²), close by that of a square [Lambert1760; Baum89]

These are the modes of RTRad, for comparison and teaching; gathering is what came of them. Where RTRad has constants there is the
thing itself: a sender has the area of what it stands for, F close by is a closed form and not cut off, emitters receive as all
texels do, and chance differs from texel to texel and from bounce to bounce. Light from outside is a part of each bounce.
Quadratic modes say what they will cost, and stop wherever they are.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator, Mapping
from typing import Any

import numpy as np

from app.errors import UserError
from app.gpu import Framebuffer, Gpu, Pass, Texture, keep, take_over
from app.lightmap.lightmap import Lightmap
from app.scene.lights import Light
from app.scene.model import F64, Material
from app.scene.sky import Sky
from app.solvers.base import EnergyBalance, Inspection, Progress
from app.solvers.pairs.books import Books
from app.solvers.pairs.bounce import Bounce
from app.solvers.pairs.gather import Area
from app.solvers.pairs.occlusion import Scenes
from app.solvers.pairs.options import PairsOptions, check
from app.solvers.pairs.outside import Outside
from app.solvers.pairs.pace import PART, Pace
from app.util.parts import is_running, run_to_end
from app.util.state import State

PIECE = 0.1  # seconds of a bounce that are one piece of work: a solve looks at its clock in between
LONG = 2.0  # seconds of a bounce, from which on it is said beforehand


class Pairs:
    """Gathers the light of one lightmap, pair by pair. Whoever makes it releases it. Raises UserError, also for quadtrees.

    issued: whole bounces.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, options: PairsOptions) -> None:
        if lightmap.pool.adaptive:
            raise UserError("--solver pairs: texels gather from texels of one size; not with --adaptive")
        check(options, lightmap.texel_count)
        self._gpu, self._lightmap, self.options = gpu, lightmap, options
        self._scenes, self._pace, self._books = Scenes(gpu, lightmap), Pace(gpu), Books(lightmap)
        self._outside = Outside(gpu, lightmap, self._scenes)
        self._show = Pass(gpu, "common/copy")
        self._light = [
            gpu.texture(lightmap.size, 4, "f4") for _ in range(2)
        ]  # of the last bounce, and the one under way
        self._targets = [gpu.target(texture) for texture in self._light]
        self._shown: tuple[Texture, Framebuffer] | None = None
        self._bounce: Bounce | None = None
        self._rest: Iterator[None] | None = None  # of the bounce under way
        self._piece: Generator[None, None, int] | None = None
        self._note: str | None = None
        self.issued = 0
        self.reset()

    # -- work ----------------------------------------------------------------------------------------------------------

    def work(self, amount: int, bands: int = 1) -> Generator[None, None, int]:
        """A part of a bounce, or the rest of it, in smaller parts; returns 1 where the bounce is whole then."""
        self._finish()
        self._pace.seconds = PART / bands
        self._piece = self._some()
        return self._piece

    def _some(self) -> Generator[None, None, int]:
        end = time.perf_counter() + PIECE
        self._rest = self._rest or self._one_bounce()
        for _ in self._rest:
            yield
            if time.perf_counter() >= end:
                return 0
        self._rest = None
        return 1

    def _one_bounce(self) -> Iterator[None]:
        yield from self._outside.find()
        target = self._targets[1]
        yield from self._begin_bounce().run(
            target,
            self._light[0],
            self._books.mean_sent,
            self.issued,
            begin=lambda: self._outside.write(target),
            show=self._show_area,
        )
        self._light.reverse()
        self._targets.reverse()
        width, height = self._lightmap.size
        self._books.enter(
            np.frombuffer(self._light[0].read(), np.float32).reshape(height, width, 4), self._outside.sent
        )
        self.issued += 1
        self._measure()

    def _begin_bounce(self) -> Bounce:
        """What bounces by the options as they are."""
        if self._bounce is None:
            self._bounce = Bounce(self._gpu, self._lightmap, self._scenes, self.options, self._pace)
        return self._bounce

    def _show_area(self, area: Area) -> None:
        """What a band has received, in the lightmap."""
        if self._shown is None or self._shown[0] is not self._lightmap.texture("t_irradiance"):
            self._forget_shown()
            irradiance = self._lightmap.texture("t_irradiance")
            self._shown = irradiance, self._gpu.target(irradiance)
        textures = {"t_source": self._light[1]}
        self._show.draw(self._shown[1], textures=textures, uniforms={"u_offset_px": (0, 0)}, viewport=area)

    def _forget_shown(self) -> None:
        if self._shown is not None:
            self._gpu.release_all(self._shown[1])
            self._shown = None

    def _finish(self) -> None:
        """End the piece of work that is under way, if any; the bounce waits. Of its own parts this asks nothing."""
        if self._piece is not None and not is_running(self._piece):
            self._piece.close()
            self._piece = None

    def _drop_bounce(self) -> None:
        """Forget what there is of the bounce under way: it would mix two solutions."""
        self._finish()
        self._rest = None
        if self._bounce is not None:
            self._bounce.at = None

    # -- how far it is -------------------------------------------------------------------------------------------------

    def _measure(self) -> None:
        """What the last bounce has changed."""
        change = self._books.change
        self._progress = Progress(self.issued, change, self._books.escaped, change <= self.options.change)

    def poll(self, *, wait: bool = False) -> Progress:
        """How far whole bounces have come: what the last one changed, over all that is received."""
        if wait:
            self._finish()
        now = self._progress
        return Progress(now.done, now.remaining, now.escaped, now.converged, note=self._cost)

    @property
    def _cost(self) -> str | None:
        """What a bounce takes, where it is long; None before that is known, and of short ones."""
        if self._bounce is None or self._note is not None:
            return self._note
        seconds = self._bounce.foreseen
        if seconds is None or seconds < LONG:
            return None
        once = f", and once {self._bounce.kept_pairs:,} pairs to keep" if self._bounce.kept else ""
        rays = "a ray for each that face each other" if self.options.occlusion == "rays" else self.options.occlusion
        rays = "a ray each" if self.options.senders == "directional" else rays
        self._note = f"a bounce takes about {seconds:,.0f} s: {self._bounce.pairs:,} pairs, {rays}{once}"
        return self._note

    def settle(self) -> Progress:
        """End the work under way; what is left of a bounce waits, for it may take minutes."""
        return self.poll(wait=True)

    def energy(self) -> EnergyBalance:
        """Where all light is after the last whole bounce, RGB [W]; see books.py."""
        self._finish()
        return self._books.balance(begun=self.issued > 0)

    # -- beginning, and other options ----------------------------------------------------------------------------------

    def reset(self) -> None:
        """Forget all light."""
        self._drop_bounce()
        self._lightmap.clear()
        self._outside.change()
        for target in self._targets:
            target.clear()
        self._books.begin()
        self.issued = 0
        self._progress = Progress(0, 1.0 if self._lightmap.scene.emits else 0.0, np.zeros(3))
        self._progress = self._judged(self._progress.remaining)

    def _judged(self, remaining: float) -> Progress:
        now = self._progress
        return Progress(now.done, remaining, now.escaped, remaining <= self.options.change)

    def set_options(self, options: PairsOptions) -> None:
        """Use other knobs from the next bounce on; the light that is there stays, and is where it begins. Raises UserError."""
        check(options, self._lightmap.texel_count)
        same = options.replace(change=self.options.change) == self.options
        self.options = options
        if same:
            self._progress = self._judged(self._progress.remaining)
            return
        self._drop_bounce()
        self._forget_bounce()
        self._progress = self._judged(self._left)

    def set_observer(self, position: F64) -> None:
        """The light is the same wherever it is seen from."""

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        """Other albedos and emissions: bounces go on from the light that is there."""
        self._lightmap.set_materials(materials)
        if not self.issued:
            self.reset()
            return
        self._drop_bounce()
        self._progress = self._judged(self._left)

    def set_sky(self, sky: Sky | None) -> None:
        """Another sky: bounces go on from the light that is there."""
        self._lightmap.set_sky(sky)
        self._follow_outside()

    def set_lights(self, lights: tuple[Light, ...]) -> None:
        """Other lamps without area, as ``set_sky``."""
        self._lightmap.set_lights(lights)
        self._follow_outside()

    def _follow_outside(self) -> None:
        self._outside.change()
        if not self.issued:
            self.reset()
            return
        self._drop_bounce()
        self._progress = self._judged(self._left)

    @property
    def _left(self) -> float:
        """What remains where nothing is known of it."""
        return 1.0 if self._lightmap.scene.emits or self._books.received.any() else 0.0

    def _forget_bounce(self) -> None:
        if self._bounce is not None:
            self._bounce.release()
            self._bounce = None
        self._pace.forget()
        self._note = None

    # -- kept for later ------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """Bounces that are whole, and what there is of the one under way."""
        self._finish()
        state = State({"progress": self._progress.measured, "issued": self.issued})
        keep(state, received=self._light[0], under_way=self._light[1])
        state.put("outside", self._outside.state())
        state.arrays |= {"before": self._books.before, "books": self._books.received}
        state.arrays["books_outside"] = self._books.outside
        if self._bounce is not None:
            state.put("bounce", self._bounce.state())
        return state

    def restore(self, state: State) -> None:
        """Where a bounce is under way it goes on with the next piece of work."""
        take_over(state, received=self._light[0], under_way=self._light[1])
        shape = self._books.received.shape
        self._books.before, self._books.received = (state.array(n, np.float32, *shape) for n in ("before", "books"))
        self._books.outside = state.array("books_outside", np.float64, 2, 3)
        self.issued = int(state.values["issued"])
        self._progress = Progress.of(state.values["progress"])
        self._progress = self._judged(self._progress.remaining)
        self._outside.restore(state.part("outside"))
        bounce = state.part("bounce")
        if bounce.values:
            self._begin_bounce().restore(bounce)

    # -- what there is to see ------------------------------------------------------------------------------------------

    @property
    def foreseen(self) -> float | None:
        """Seconds that a bounce takes; None before enough of it was measured."""
        return None if self._bounce is None else self._bounce.foreseen

    @property
    def pairs(self) -> int:
        """That a bounce looks at; 0 before the first."""
        return 0 if self._bounce is None else self._bounce.pairs

    @property
    def resolved(self) -> Mapping[str, Any]:
        """Edge of the windows [texels]."""
        return {} if self._bounce is None else {"window": self._bounce.senders.window}

    @property
    def layers(self) -> Mapping[str, Texture]:
        return {}

    def inspect(self, texel: tuple[int, int] | None = None, *, images: bool = False) -> Inspection:
        """What a bounce costs and how far it is; of a texel, how much of its view is known: Σ F V, 1 in a closed room."""
        facts = {}
        if (bounce := self._bounce) is not None:
            facts = {"Pairs in a bounce": f"{bounce.pairs:,}", "Window": f"{bounce.senders.window} texels"}
            if (seconds := self.foreseen) is not None:
                facts["Seconds in a bounce"] = f"{seconds:.1f}"
            if self._rest is not None:
                facts["This bounce"] = f"{bounce.share:.0%}"
            if bounce.kept is not None:
                facts["Kept pairs"] = f"{bounce.kept.memory / 2**20:.1f} MiB"
        if texel is None or not self.issued:
            return Inspection(facts=facts)
        sums = np.frombuffer(self._targets[0].read((*texel, 1, 1), 4, dtype="f4", alignment=1), np.float32)
        return Inspection(facts=facts, texel_facts={"Form factors, summed up": f"{sums[3]:.3f}"})

    def passes(self, amount: int) -> dict[str, Callable[[], None]]:
        """Each part of a bounce by itself, to be timed: here the first piece of it."""
        return {"bounce": lambda: self._first_piece()}

    def _first_piece(self) -> None:
        self._drop_bounce()
        run_to_end(self.work(1))

    def warm_up(self) -> Iterator[None]:
        """The first piece of a bounce: it draws with every program."""
        self._first_piece()
        yield

    def release(self) -> None:
        self._drop_bounce()
        self._forget_bounce()
        self._forget_shown()
        self._outside.release()
        self._scenes.release()
        self._gpu.release_all(*self._targets, *self._light)


__all__ = ["Pairs"]
