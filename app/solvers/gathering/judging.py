"""Judging says how noisy the light that is shown is, a piece of work late, and so how many shadow rays are worth their cost."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from app.direct_light.lit import PASS
from app.direct_light.shadow_rays import DirectLight
from app.gpu import Gpu, ReadBack, Texture
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64
from app.solvers.gathering.compose import Compose, Noise, noise_of
from app.solvers.gathering.hits import GROUP
from app.util.state import State

FIRST = 8  # rays of each texel at first
SHADOW_RAYS = 4  # from each texel to each set of lamps, for FIRST rays
SHADOW_COST = 0.5  # of a shadow ray, beside a ray: it ends at the first hit
MOST_SHADOW_RAYS = 4  # to each set, for a ray


class Judging:
    """Of one lightmap. Nothing is known of its noise at first, nor after ``forget``."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, compose: Compose) -> None:
        self._gpu, self._lightmap, self._compose = gpu, lightmap, compose
        self._judged: list[tuple[int, int, ReadBack]] = []  # rays, version of the leaves
        self._noise: Noise | None = None
        self._noise_of = 0  # this version of the leaves

    def ask(self, rays: int, direct: Texture) -> None:
        """Let the GPU say it of so many rays of each texel, and of the direct light that is shown."""
        self._judged.append((rays, self._lightmap.version, self._compose.judge(direct)))

    def arrived(self, *, wait: bool) -> Iterator[tuple[int, float]]:
        """Rays, and how noisy their light is, of each answer but the last; with ``wait`` of that, too."""
        while len(self._judged) > (0 if wait else 1):
            done, version, judged = self._judged.pop(0)
            self._noise, self._noise_of = noise_of(judged), version
            yield done, self._noise.level if done > GROUP else 1.0  # of one group nothing is known

    def shadow_rays(self, more: int, rays: int, direct: DirectLight) -> int:
        """How many shadow rays go with so many ``more`` rays than there are: as many as make the whole the least noisy for its
        cost. A cost c of each shadow ray, those of all sets, beside a ray: where D is the share of the deviation that d shadow
        rays leave and I that of n rays, d / n = √(D d / (I n c))."""
        if self._noise is None or not 0 < self._noise.direct < 1:
            return SHADOW_RAYS * more // FIRST
        D, I = self._noise.direct * direct.count, (1 - self._noise.direct) * rays  # noqa: E741
        ratio = np.sqrt(D / (I * SHADOW_COST * len(direct.sets)))
        wanted = ratio * (rays + more) - direct.count
        return int(np.clip(wanted, PASS, MOST_SHADOW_RAYS * more))

    @property
    def gain(self) -> F64 | None:
        """What shadow rays gain in each slot as it is now, see allocate.py; None where that is not known."""
        if self._noise is None or self._noise_of != self._lightmap.version:
            return None
        return self._noise.gain[: self._lightmap.pool.tiles]

    def forget(self) -> None:
        """All light is gone."""
        for *_, judged in self._judged:
            judged.take()
        self._judged.clear()
        self._noise = None

    # -- kept for later ------------------------------------------------------------------------------------------------

    def keep(self, state: State) -> None:
        """Put into the solver's state what is known of the noise, and what is on its way."""
        state.values["judged"] = [[done, version] for done, version, _ in self._judged]
        for nth, (*_, judged) in enumerate(self._judged):
            state.arrays[f"judged {nth}"] = np.frombuffer(judged.look(), np.float32)
        if self._noise is not None:
            state.values["noise"] = [self._noise.level, self._noise.direct, self._noise_of]
            state.arrays["gain"] = self._noise.gain

    def restore(self, state: State) -> None:
        """Know what is in such a state. Raises StateError."""
        slots, version = self._lightmap.columns * self._lightmap.rows, self._lightmap.version
        for nth, (done, of) in enumerate(state.values["judged"]):
            judged = state.array(f"judged {nth}", np.float32, 4 * slots if of == version else -1)
            self._judged.append((int(done), int(of), ReadBack.arrived(self._gpu, judged.tobytes())))
        if "noise" in state.values:
            level, direct, of = state.values["noise"]
            gain = state.array("gain", np.float64, slots if of == version else -1)
            self._noise, self._noise_of = Noise(float(level), float(direct), gain), int(of)


__all__ = ["FIRST", "SHADOW_RAYS", "Judging"]
