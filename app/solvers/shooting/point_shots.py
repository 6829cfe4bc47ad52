"""Point shots light all texels from a point or spot light: each by a map of half of all directions, as a patch has it.

    ΔH_j = I(ω) w(d) cos θ_j / d² V_j,    Δr_j = ρ_j ΔH_j

with no area and no form factor. A point light shoots twice, to both sides of a plane that is no wall's; a spot, whose light stays
on one side, once. One with a radius shoots from places in its sphere, such that they fill its disc evenly from wherever it is
seen. All of them shoot before the first patch does; an edit shoots the difference, negative too [Chen90].
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from app.direct_light.punctual import light_rows
from app.gpu import Framebuffer, Gpu, Mesh
from app.lightmap.lightmap import Lightmap
from app.scene.lights import Light
from app.scene.model import F64
from app.scene.sky_directions import axes_of
from app.solvers.shooting.ledger import Ledger
from app.solvers.shooting.options import ShootingOptions
from app.solvers.shooting.receive import Receive
from app.solvers.shooting.receivers import Receivers
from app.solvers.shooting.records import BATCH, BLOCK_ROWS, SHOOTER
from app.solvers.shooting.see import See
from app.solvers.shooting.shooters import ShooterBatch
from app.util.state import State, StateError
from app.visibility.occluders import Occluders

PLACES = 32  # in the sphere of a light with a radius
ASIDE = np.array([0.5319, 0.7023, 0.4733]) / np.linalg.norm([0.5319, 0.7023, 0.4733])  # a direction that no wall has
GOLDEN = (5**0.5 - 1) / 2
# solver space: the radius that any light has at least where something is blended, so that several maps choose what stops there
APART = 1e-5
LEAST = 1e-9  # of the strongest, that a difference has to be

Sources = dict[Light, F64]  # intensity of each, RGB [W/sr], by the light without it


class PointShots:
    """On one lightmap. Whoever makes it releases it. flux: that was sent out so far, less what was taken back, RGB [W]."""

    def __init__(
        self,
        gpu: Gpu,
        lightmap: Lightmap,
        occluders: list[Occluders],
        receivers: Receivers,
        shooters: ShooterBatch,
        ledger: Ledger,
    ) -> None:
        self._gpu, self._lightmap, self._occluders = gpu, lightmap, occluders
        self._receivers, self._shooters, self._ledger = receivers, shooters, ledger
        self._lights = gpu.texture((4, BATCH), 4, "f4")
        blended = any(m.blended for m in lightmap.scene.materials)
        self._apart = APART * lightmap.space.scale if blended else 0.0
        self._see: See | None = None
        self._given: Sources = {}
        self._queue: list[tuple[Light, F64, F64]] = []  # see _queue_of
        self._at = 0

    def set_options(self, options: ShootingOptions, resolution: int) -> None:
        """Use other knobs from the next shot on."""
        if self._see is not None:
            self._see.release()
        self._see = See(self._gpu, self._occluders, self._shooters, options, resolution, lights=self._lights)
        self._receive = Receive(self._gpu, self._lightmap, self._receivers, self._shooters, self._see, options)

    def begin(self, lights: tuple[Light, ...]) -> None:
        """Nothing has been shot."""
        self._given, self._queue, self._at = {}, [], 0
        self.change(lights)

    def change(self, lights: tuple[Light, ...]) -> None:
        """Other lights: the difference to what was given is to come, the strongest first."""
        self._given = self._shot()
        wanted = sources_of(lights, self._apart)
        change = {s: wanted.get(s, np.zeros(3)) - self._given.get(s, np.zeros(3)) for s in {**self._given, **wanted}}
        power = {source: float(np.abs(i).sum()) * source.solid_angle for source, i in change.items()}
        least = LEAST * max(
            (float(np.abs(i).sum()) * s.solid_angle for s, i in {**self._given, **wanted}.items()), default=0
        )
        some = [source for source in change if power[source] > least]
        self._queue = _queue_of({source: change[source] for source in sorted(some, key=lambda source: -power[source])})
        self._at = 0

    def _shot(self) -> Sources:
        """What has been given so far; of a source whose other half is still to come all."""
        given = dict(self._given)
        for source, intensity, _ in self._queue[: self._at]:
            given[source] = given.get(source, np.zeros(3)) + intensity * _half(source)
        return {source: intensity for source, intensity in given.items() if intensity.any()}

    @property
    def left(self) -> int:
        """Shots that are to come."""
        return len(self._queue) - self._at

    @property
    def flux(self) -> F64:
        return np.asarray(sum((s.solid_angle * intensity for s, intensity in self._shot().items()), np.zeros(3)))

    def state(self) -> State:
        """What was given, and what is to come."""
        given = [[asdict(source), intensity.tolist()] for source, intensity in self._given.items()]
        queue = [[asdict(source), intensity.tolist(), axis.tolist()] for source, intensity, axis in self._queue]
        return State({"given": given, "queue": queue, "at": self._at})

    def restore(self, state: State) -> None:
        """Go on as from a ``state``. Raises StateError."""
        known: dict[Light, Light] = {}  # the two halves of a light are of the same one
        self._given = {_light(source, known): np.array(intensity) for source, intensity in state.values["given"]}
        self._queue = [
            (_light(source, known), np.array(intensity), np.array(axis))
            for source, intensity, axis in state.values["queue"]
        ]
        self._at = int(state.values["at"])
        if not 0 <= self._at <= len(self._queue):
            raise StateError(f"{self._at} of {len(self._queue)} shots")

    def shoot(self, shots: int, bands: int) -> Generator[None, None, int]:
        """The next ones, up to so many, in parts. Returns how many; whole lights, so that what was given is known."""
        count = min(max(shots, 2), BATCH, self.left)
        if count < self.left and self._queue[self._at + count - 1][0] is self._queue[self._at + count][0]:
            count -= 1
        self._write(self._queue[self._at : self._at + count])
        assert self._see is not None
        for first, some in self._see.groups(count):
            self._see.draw(first, some)
            yield
            for band in range(bands):
                self._receive.draw(first, some, band, bands)
                yield
            self._see.add_escaped(first, some)
        self._ledger.enter(self._see.maps, count)
        self._at += count
        return count

    def replay(self, target: Framebuffer, meshes: Mapping[bool, Mesh], bands: int) -> Generator[None, None, None]:
        """Add to a target, on some receivers only, all that was given so far, in parts."""
        again = _queue_of(self._shot())
        assert self._see is not None
        for first in range(0, len(again), BATCH):
            some = again[first : first + BATCH]
            self._write(some)
            for start, count in self._see.groups(len(some)):
                self._see.draw(start, count)
                yield
                for band in range(bands):
                    self._receive.draw_into(target, start, count, meshes=meshes, band=band, bands=bands, in_place=False)
                    yield

    def _write(self, shots: list[tuple[Light, F64, F64]]) -> None:
        """As the shooters of the batch. Their axes are so long that all of the scene is nearer than FAR in them."""
        space, unit = self._lightmap.space, self._lightmap.unit
        records = np.zeros(BATCH, SHOOTER.dtype)
        for record, (source, intensity, axis), nth in zip(records, shots, range(BATCH), strict=False):
            origin = space.local_from_world(np.array(source.position))
            x, y = axes_of(axis)
            scale = min(2.0 / (1.0 + float(np.linalg.norm(origin))), 1.0)
            record["origin"] = record["centre"] = origin
            record["normal"], record["edge_u"], record["edge_v"] = scale * axis, x, y
            record["area"] = source.solid_angle * _half(source)
            record["exitance"] = intensity / (unit * space.scale**2)
            record["patch_x"], record["signed_size"] = nth, 1
        self._shooters.texture.write(SHOOTER.write(records, BLOCK_ROWS))
        self._shooters.share()
        rows = np.zeros((BATCH, 4, 4), np.float32)
        rows[: len(shots)] = light_rows([source for source, *_ in shots], self._lightmap)
        rows[..., 2, :3] = 1.0  # the shooter has its intensity
        self._lights.write(rows.tobytes())

    def release(self) -> None:
        if self._see is not None:
            self._see.release()
        self._gpu.release_all(self._lights)


def sources_of(lights: tuple[Light, ...], least: float) -> Sources:
    """Points that shoot for these lights, and with what intensity; those at the same place added up. least: radius of each, at
    least [m]."""
    found: Sources = {}
    for light in lights:
        if light.from_afar or not light.emits:
            continue
        radius = max(light.radius, least)
        places = np.array(light.position) + radius * (_in_a_ball(PLACES) if radius > 0 else np.zeros((1, 3)))
        for x, y, z in places.tolist():
            source = replace(light, name="", intensity=(1.0, 1.0, 1.0), position=(x, y, z), radius=0.0)
            found[source] = found.get(source, np.zeros(3)) + np.array(light.intensity) / len(places)
    return found


def _queue_of(sources: Sources) -> list[tuple[Light, F64, F64]]:
    """The shots of these: source, intensity, axis of the map."""
    return [
        (source, intensity, axis)
        for source, intensity in sources.items()
        for axis in ((np.array(source.direction),) if source.kind == "spot" else (ASIDE, -ASIDE))
    ]


def _light(values: dict[str, Any], known: dict[Light, Light]) -> Light:
    """The light of these fields: the same one as before, where it is known."""
    fields: dict[str, Any] = {name: tuple(of) if isinstance(of, list) else of for name, of in values.items()}
    light = Light(**fields)
    return known.setdefault(light, light)


def _half(source: Light) -> float:
    """The share of a light that a shot of it sends out."""
    return 1.0 if source.kind == "spot" else 0.5


def _in_a_ball(count: int) -> F64:
    """(count, 3) places in a ball of radius 1, as dense as 1 / √(1 - r²): their shadows on any plane fill a disc evenly. So many
    of them lie within r: 2/π (asin r - r √(1 - r²))."""
    nth = np.arange(count) + 0.5
    r = np.linspace(0.0, 1.0, 1025)
    within = 2 / np.pi * (np.arcsin(r) - r * np.sqrt(1 - r**2))
    radius = np.interp(nth * GOLDEN % 1, within, r)
    up, turn = 1 - 2 * nth / count, 2 * np.pi * GOLDEN * nth
    level = np.sqrt(1 - up**2)
    return np.asarray(radius[:, None] * np.stack([level * np.cos(turn), up, level * np.sin(turn)], axis=1))


__all__ = ["PointShots", "sources_of"]
