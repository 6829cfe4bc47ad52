"""Sources of light from outside are what shoots and is no surface: points, and directions from which light comes.

A point light with a radius is many points, such that they fill its disc evenly from wherever it is seen; the sun, and a
directional light with an angle, are some directions within their disc; the sky is a stratified set of directions.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from app.lightmap.lightmap import Lightmap
from app.scene.lights import Light
from app.scene.model import F64, Scene
from app.scene.sky_directions import Directions, disc_directions, sky_directions
from app.solvers.shooting.records import BATCH

PLACES = 32  # in the sphere of a light with a radius
ASIDE = np.array([0.5319, 0.7023, 0.4733]) / np.linalg.norm([0.5319, 0.7023, 0.4733])  # a direction that no wall has
GOLDEN = (5**0.5 - 1) / 2
# solver space and rad: the radius and angle that any light has at least where something is blended, so that several maps choose
# what stops there
APART = 1e-5
APART_ANGLE = 1e-4
SKY = "sky"  # name of the directions of the sky: they shoot in the order in which some of the first are spread over all of it
POINTS, SUNS = "points", "suns"
KINDS = POINTS, SUNS, SKY
# places along the edge of a texel that a shot looks at where something is blended: 128 in all of one light
BLENDED_EDGE = {POINTS: 2, SUNS: 4}
LEAST = 1e-9  # of the strongest, that a difference has to be

# What each source sends out, RGB: intensity of a point [W/sr], irradiance of a direction [W/m²]; by the light without it
Sources = dict[Light, F64]


@dataclass(frozen=True, eq=False)
class OutsideShot:
    """A shot of a source. light: as Sources have it. axis: of its map, where the source is a point. flux: what it sends out, RGB
    [W]; of a direction what would meet the box around the scene."""

    source: Light
    light: F64
    axis: F64
    flux: F64

    @property
    def kind(self) -> str:
        """One of KINDS: a point, a direction of the sun or of a directional light, or one of the sky."""
        return POINTS if not self.source.from_afar else SKY if self.source.name == SKY else SUNS

    @property
    def place(self) -> int:
        """Which of the places or directions of its light it is, from 1; 0: the only one; -1: of the sky."""
        return -1 if self.source.name == SKY else int(self.source.name or 0)

    @property
    def sharp(self) -> bool:
        """Whether it is the only one of its light, which casts sharp shadows."""
        return self.place == 0

    @property
    def gives(self) -> bool:
        """Whether it gives light, or takes some back."""
        return bool(self.light.sum() > 0)

    def is_like(self, other: OutsideShot) -> bool:
        """Whether both may be of one batch: of a kind, as sharp, and both give light, or take it back."""
        return self.kind == other.kind and self.sharp == other.sharp and self.gives == other.gives

    @property
    def values(self) -> list[Any]:
        return [asdict(self.source), self.light.tolist(), self.axis.tolist(), self.flux.tolist()]

    @staticmethod
    def of(values: list[Any], known: dict[Light, Light]) -> OutsideShot:
        """With these ``values``; known: see light_of."""
        source, *arrays = values
        light, axis, flux = (np.array(array, np.float64).reshape(3) for array in arrays)
        return OutsideShot(light_of(source, known), light, axis, flux)


def light_of(values: dict[str, Any], known: dict[Light, Light]) -> Light:
    """The light of these fields: the same one as before, where it is known; both halves of a point are of one."""
    fields: dict[str, Any] = {name: tuple(of) if isinstance(of, list) else of for name, of in values.items()}
    light = Light(**fields)
    return known.setdefault(light, light)


def sources_of(scene: Scene, lightmap: Lightmap) -> Sources:
    """Of all light from outside; those at the same place, or in the same direction, added up."""
    blended = any(m.blended for m in scene.materials)
    radius, angle = (APART * lightmap.space.scale, APART_ANGLE) if blended else (0.0, 0.0)
    lights = [light for light in scene.lights_and_sun if light.emits]
    found: Sources = {}
    for light in lights:
        if light.from_afar:
            _add(found, _directions(disc_directions(replace(light, angle=max(light.angle, angle)))))
        else:
            _add(found, _points(replace(light, radius=max(light.radius, radius))))
    if scene.sky is not None:
        _add(found, _directions(sky_directions(scene.sky), SKY))
    return found


def places_edge(kind: str, scene: Scene) -> int:
    """Places along the edge of a texel that each of many shots of a light looks at."""
    return BLENDED_EDGE[kind] if any(m.blended for m in scene.materials) else 1


def _add(found: Sources, more: Iterable[tuple[Light, F64]]) -> None:
    for source, light in more:
        found[source] = found.get(source, np.zeros(3)) + light


def _points(light: Light) -> Iterable[tuple[Light, F64]]:
    places = np.array(light.position) + light.radius * (_in_a_ball(PLACES) if light.radius > 0 else np.zeros((1, 3)))
    for nth, (x, y, z) in enumerate(places.tolist(), 1):
        name = str(nth) if len(places) > 1 else ""
        source = replace(light, name=name, intensity=(1.0, 1.0, 1.0), position=(x, y, z), radius=0.0)
        yield source, np.array(light.intensity) / len(places)


def _directions(directions: Directions, name: str = "") -> Iterable[tuple[Light, F64]]:
    for nth, ((x, y, z), light) in enumerate(
        zip((-directions.towards).tolist(), directions.irradiance, strict=True), 1
    ):
        which = name or (str(nth) if len(directions.towards) > 1 else "")
        yield Light(which, "directional", direction=(x, y, z)), light


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


# -- shots -----------------------------------------------------------------------------------------------------------------


def shots_of(sources: Sources, box: F64) -> list[OutsideShot]:
    """The shots of sources, the strongest first. A point light shoots twice, to both sides of a plane that is no wall's; a spot,
    whose light stays on one side, once. box (3,): size of the scene [m]."""
    faces = np.array([box[1] * box[2], box[2] * box[0], box[0] * box[1]])
    shots = [
        OutsideShot(source, light, axis, light * _spread(source, faces))
        for source, light in sources.items()
        for axis in _axes(source)
    ]
    power = np.array([np.abs(shot.flux).sum() for shot in shots])
    of_sky = np.array([shot.kind == SKY for shot in shots], bool)
    if of_sky.any():
        power[of_sky] = power[of_sky].mean()
    return [shots[nth] for nth in np.argsort(-power, kind="stable")]


def in_turns(shots: list[OutsideShot]) -> list[OutsideShot]:
    """Shots of a difference in turns, some that give light and some that take it back, each the strongest first: until either
    ends, the sum of all that is given stays within a batch of what it is to be. Else a sky would be taken away before another one
    is there, and where a lamp is dragged, which changes both again and again, all would be dark, or brighter with each move,
    until it is let go."""
    gives, takes = ([shot for shot in shots[::-1] if shot.gives is wanted] for wanted in (True, False))
    more, queue = max(0.0, -sum(float(shot.flux.sum()) for shot in shots)), list[OutsideShot]()
    while gives and takes:
        of = gives if more <= 0 else takes
        run = [of.pop()]
        more += float(run[0].flux.sum())
        while of and run[0].is_like(of[-1]):
            whole = of[-1].source is not run[-1].source
            if whole and (len(run) >= BATCH or (of is takes and more <= 0)):
                break
            run.append(of.pop())
            more += float(run[-1].flux.sum())
        queue += run
    return queue + gives[::-1] + takes[::-1]


def _axes(source: Light) -> tuple[F64, ...]:
    if source.kind == "point":
        return ASIDE, -ASIDE
    return (-np.array(source.direction) if source.from_afar else np.array(source.direction),)


def _spread(source: Light, faces: F64) -> float:
    """Power of a shot over its light: solid angle [sr] of a point, of a direction the area that the box shows to it [m²]."""
    if source.from_afar:
        return float(np.abs(source.direction) @ faces)
    return source.solid_angle * share_of_shot(source)


def share_of_shot(source: Light) -> float:
    """The share of a source that a shot of it sends out."""
    return 0.5 if source.kind == "point" else 1.0


def difference(wanted: Sources, given: Sources) -> Sources:
    """What is to come where so much was given; nothing that makes no difference."""
    both, dark = {**given, **wanted}, np.zeros(3)
    change = {source: wanted.get(source, dark) - given.get(source, dark) for source in both}
    most = {
        afar: max((np.abs(both[s]).sum() for s in both if s.from_afar is afar), default=0.0) for afar in (False, True)
    }
    return {source: light for source, light in change.items() if np.abs(light).sum() > LEAST * most[source.from_afar]}


__all__ = [
    "OutsideShot",
    "Sources",
    "difference",
    "in_turns",
    "light_of",
    "places_edge",
    "share_of_shot",
    "shots_of",
    "sources_of",
]
