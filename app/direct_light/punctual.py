"""Direct light of lamps without area, and of the sun, which is one: shadow rays to their points, or to what makes their shadows
soft.

    H = Σ_k w_k V_k / (p_k n),    w = I(ω) cos θ / d² of the lamp that a ray goes to, chosen with p = w / Σ w of its set

One lamp is a set, so that another strength or colour of it costs no ray, and what changes within a texel is all the noise in its
light. Beyond so many, all others share one set, or two: of those with a place, and of those from afar.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from app.direct_light.lit import PASS, Draw, Kind, Lit
from app.gpu import Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import upload
from app.scene.lights import Light
from app.scene.model import F32, Scene
from app.visibility.origins import Origins

ALONE = 8  # lamps that are a set of their own: each takes 32 bytes a texel

Lights = tuple[Light, ...]


class PunctualLight(Kind[Lights]):
    """Sets of lights."""

    name = "lights"

    def __init__(self, gpu: Gpu, lightmap: Lightmap, rays: dict[str, object], origins: Origins) -> None:
        super().__init__(gpu, lightmap, rays, origins)
        self._shoot = Pass(gpu, "direct_light/light_rays", defines=self.read_by_rays, vertex="common/rects")
        reads = lightmap.defines("TILE") | {"PASS": PASS}
        self._add = Pass(gpu, "direct_light/light_sum", defines=reads, vertex="common/rects")

    def reads(self, of: Lights) -> dict[str, Texture]:
        rows = [_shape(of[0])] if len(of) == 1 else of
        return {"t_lights": upload(self.gpu, light_rows(rows, self.lightmap))}

    def wanted(self, scene: Scene, known: list[Lights]) -> list[Lights]:
        return light_sets(scene.lights_and_sun)

    def same(self, known: Lights, wanted: Lights) -> bool:
        """Whether they are the same lights, but for the strength and colour of a single one."""
        return known == wanted or (len(known) == len(wanted) == 1 and _shape(known[0]) == _shape(wanted[0]))

    def emits(self, of: Lights, scene: Scene) -> bool:
        return any(light.emits for light in of)

    def place(self, of: Lights, scene: Scene) -> list[int]:
        return [scene.lights_and_sun.index(light) for light in of]

    def at(self, place: list[int], scene: Scene) -> Lights:
        return tuple(scene.lights_and_sun[nth] for nth in place)

    def from_afar(self, of: Lights) -> bool | None:
        return of[0].from_afar

    def shooting(self, lit: Lit[Lights]) -> Draw:
        return Draw(self._shoot, lit.reads, {"u_lights": len(lit.of)})

    def adding(self, lit: Lit[Lights], scene: Scene) -> Draw:
        scale = (np.array(lit.of[0].intensity) if len(lit.of) == 1 else np.ones(3)) / self.lightmap.unit
        textures = {"t_seen": lit.found["seen"], "t_all": lit.found["all"]}
        return Draw(self._add, textures, {"u_scale": tuple(scale.tolist())})


def light_sets(lights: Sequence[Light]) -> list[tuple[Light, ...]]:
    """The sets of those that send light, or that do when they are on."""
    shining = [light for light in lights if max(light.intensity) > 0.0]
    rest = [light for light in shining[ALONE:] if light.on]
    groups = (tuple(light for light in rest if light.from_afar is afar) for afar in (False, True))
    return [(light,) for light in shining[:ALONE]] + [group for group in groups if group]


def light_rows(lights: Sequence[Light], lightmap: Lightmap) -> F32:
    """(n, 4, 4) f32 as common/light.glsl has them; intensities [W/m²], of a distance of 1 in the solver space."""
    space, rows = lightmap.space, np.zeros((len(lights), 4, 4), np.float32)
    for row, light in zip(rows, lights, strict=True):
        row[0] = *space.local_from_world(np.array(light.position)), light.from_afar
        row[1] = *light.direction, 2 * math.sin(light.angle / 4) ** 2 if light.from_afar else light.radius / space.scale
        row[2, :3] = np.array(light.intensity) / (1.0 if light.from_afar else space.scale**2)
        row[2, 3] = space.scale / light.range
        row[3, :2] = light.slope
    return rows


def _shape(light: Light) -> Light:
    """Of the same light wherever it falls, but for its strength and colour."""
    return replace(light, name="", intensity=(1.0, 1.0, 1.0), on=True)


__all__ = ["PunctualLight", "light_rows", "light_sets"]
