"""Direct light of lamps without area: shadow rays to their points, or to what makes their shadows soft.

    H = Σ_k w_k V_k / (p_k n),    w = I(ω) cos θ / d² of the lamp that a ray goes to, chosen with p = w / Σ w of its set

One lamp is a set, so that another strength or colour of it costs no ray, and what changes within a texel is all the noise in its
light. Beyond so many, all others share one set, or two: of those with a place, and of those from afar.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import upload
from app.lightmap.tile_pool import Moves
from app.scene.lights import Light
from app.scene.model import F32

ALONE = 8  # lamps that are a set of their own: each takes 32 bytes a texel


@dataclass
class LightLit:
    """What is known of the light of one lamp, or of several. seen, all: see light_rays.frag.glsl. passes: of each slot."""

    lights: tuple[Light, ...]
    table: Texture
    seen: Texture
    all: Texture
    target: Framebuffer
    stream: int
    passes: NDArray[np.int64]
    passes_table: Texture

    @property
    def kept(self) -> dict[str, Texture]:
        """What shadow rays have found, by name."""
        return {"seen": self.seen, "all": self.all}

    @property
    def from_afar(self) -> bool:
        return self.lights[0].from_afar

    def knows(self, lights: tuple[Light, ...]) -> bool:
        """Whether all that is known holds for these as well, but for the strength and colour of a single one."""
        return self.lights == lights or (
            len(lights) == len(self.lights) == 1 and _shape(lights[0]) == _shape(self.lights[0])
        )

    def release(self, gpu: Gpu) -> None:
        gpu.release_all(self.target, self.seen, self.all, self.table, self.passes_table)


class PunctualLight:
    """Programs, and what they read, for lamps without area on one lightmap."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, rays: dict[str, object], a_pass: int) -> None:
        """rays: defines of visibility/rays.glsl; a_pass: shadow rays in one."""
        self._gpu, self._lightmap, self._pass = gpu, lightmap, {"PASS": a_pass}
        reads = lightmap.defines("MATERIAL_BITS", "TILE") | self._pass | rays
        self._shoot = Pass(gpu, "direct_light/light_rays", defines=reads, vertex="common/rects")
        reads = lightmap.defines("TILE") | self._pass
        self._add = Pass(gpu, "direct_light/light_sum", defines=reads, vertex="common/rects")

    def lit(self, lights: tuple[Light, ...], stream: int, passes_table: Texture) -> LightLit:
        """Of other lamps, of whose light nothing is known yet."""
        gpu, size = self._gpu, self._lightmap.size
        seen, all_ = gpu.texture(size, 4, "f4"), gpu.texture(size, 4, "f4")
        target = gpu.target(seen, all_)
        target.clear()
        rows = [_shape(lights[0])] if len(lights) == 1 else lights
        table = upload(gpu, light_rows(rows, self._lightmap))
        passes = np.zeros(self._lightmap.pool.tiles, np.int64)
        return LightLit(lights, table, seen, all_, target, stream, passes, passes_table)

    def shooting(self, lit: LightLit) -> tuple[Pass, dict[str, Texture], dict[str, Any]]:
        """The program of shadow rays, and what it reads besides origins and rays."""
        uniforms = {"u_stream": lit.stream, "u_lights": len(lit.lights)}
        return self._shoot, {"t_passes": lit.passes_table, "t_lights": lit.table}, uniforms

    def adding(self, lit: LightLit) -> tuple[Pass, dict[str, Texture], dict[str, Any]]:
        """The program that sums up, and what it reads."""
        scale = np.array(lit.lights[0].intensity) if len(lit.lights) == 1 else np.ones(3)
        textures = {"t_seen": lit.seen, "t_all": lit.all, "t_passes": lit.passes_table}
        scale = scale / self._lightmap.unit
        return self._add, textures, {"u_scale": tuple(scale.tolist()), "u_size": self._lightmap.size}

    def resized(self, lit: LightLit, moves: Moves) -> None:
        """The tile pool has got another number of slots."""
        self._gpu.release_all(lit.target)
        lit.seen, lit.all = self._lightmap.moved(lit.seen, moves), self._lightmap.moved(lit.all, moves)
        lit.target = self._gpu.target(lit.seen, lit.all)


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


__all__ = ["LightLit", "PunctualLight", "light_rows", "light_sets"]
