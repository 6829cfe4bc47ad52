"""The solution beside a reference: its error, measured at random points a few times a second while it is being solved.

    relative RMS = √(mean (H - R)²) / mean R      local error = |H - R| / |R|, of which median and 90 % are quantiles

over the points where the reference R is not dark; see app/reference/metrics.py. No frame waits for a measurement: it is
asked for in one and read some frames later.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

from app.atlas.points import Points
from app.compare.reference_light import ReferenceLight
from app.compare.reference_texels import ReferenceTexels
from app.gpu import Gpu, ReadBack
from app.lightmap.lightmap import Lightmap
from app.lightmap.probe import Probe
from app.lightmap.tile_pool import TilePool
from app.reference.metrics import DARK, PointErrors, lit_points, point_errors
from app.scene.model import F32
from app.util.rows import Rows

POINTS = 4096
POINTS_SEED = 3
SECONDS = 0.25  # between two measurements, at least
FRAMES = 3  # after which a measurement has arrived: drivers keep two or three frames on their way


@dataclass(frozen=True, eq=False)
class PreparedReference:
    """A reference with what is looked up once: random points to measure at, and its light on the texels of a tile pool,
    None for those of a quadtree."""

    light: ReferenceLight
    points: Points
    pool: TilePool
    tiles: F32 | None


class Comparison:
    """Compares one lightmap with a reference. Whoever makes it releases it.

    light: the reference; error: the last one measured; errors: rows of it over work and seconds; lit: points that are measured.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, prepared: PreparedReference) -> None:
        """Points that are dark in the reference are left out."""
        light, points = prepared.light, prepared.points
        values = light.at(points)
        lit = lit_points(values)
        self.light, self.lit = light, int(lit.sum())
        self.dark = DARK * float(values.mean())
        self._reference = values[lit]
        self._probe = Probe(gpu, lightmap, points.only(lit))
        self.texels = ReferenceTexels(gpu, lightmap, light, prepared.tiles if prepared.pool is lightmap.pool else None)
        self.error: PointErrors | None = None
        self._asked: tuple[ReadBack, int, float, object] | None = None
        self._frames, self._due = 0, 0.0
        self.begin()

    def notes(self, lightmap: Lightmap) -> list[str]:
        """What to bear in mind when the error is read."""
        notes, others = [], self.light.other_materials(lightmap.scene.materials)
        if others:
            notes.append(f"the reference was solved with other materials: {', '.join(others)}")
        if self.light.texels is not None and self.light.texels < lightmap.texel_count:
            texels = f"{self.light.texels:,} texels are fewer than the {lightmap.texel_count:,} here"
            notes.append(f"the reference's {texels}: the error may be its own")
        return notes

    def begin(self) -> None:
        """Solving begins again: another curve begins."""
        self.errors = Rows(("work", "seconds", "rms", "median"))
        self._measured: object = None
        self._state: object = None  # at the last call of ``measure``

    def measure(self, work: int, seconds: float, state: object, *, wait: bool = False) -> bool:
        """Once per frame: read what was asked for, and ask anew if it is time. work, seconds: of the solve so far; state: what
        the light depends on, compared with what was measured last. Whether all that is to be known is known; with ``wait``
        it is."""
        if self._asked is not None:
            self._frames += 1
            if wait or self._frames >= FRAMES:
                self._take()
        rests, self._state = state == self._state, state
        if self._asked is None and state != self._measured and (wait or time.perf_counter() >= self._due):
            self._asked = self._probe.look(whole=wait or rests), work, seconds, state
            self._frames, self._due = 0, time.perf_counter() + SECONDS
            if wait:
                self._take()
        return self._asked is None and state == self._measured

    def _take(self) -> None:
        assert self._asked is not None
        looked, work, seconds, self._measured = self._asked
        self._asked = None
        self.error = point_errors(self._probe.irradiance(looked), self._reference)
        self.errors.append(work, seconds, self.error.rms, self.error.median)

    def release(self) -> None:
        if self._asked is not None:
            self._asked[0].take()
        self._probe.release()
        self.texels.release()
