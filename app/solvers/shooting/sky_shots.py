"""Sky shots light all texels from one direction of the sky after the other, by maps in parallel projection; directional lights
are such directions, too.

    ΔH_j = E_k cos θ V_kj,    Δr_j = ρ_j ΔH_j

All of the sky shoots before the first patch does. What arrives on texels is what it emits: the sums of H before and after say how
much that is. An edit shoots the difference, negative too [Chen90].

Works badly where a texel is far smaller than a pixel of the map, which is as wide as the scene; what is smaller than a pixel may
be missed.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace

import numpy as np

from app.gpu import Gpu, Pass
from app.lightmap.lightmap import Lightmap
from app.scene.lights import Light
from app.scene.model import F64
from app.scene.sky import Sky
from app.scene.sky_directions import Directions, axes_of, directions_of
from app.solvers.shooting.choose import band_of
from app.solvers.shooting.records import BATCH, OPEN
from app.util.state import State, StateError
from app.visibility.occluders import Occluders

PIXELS = 1024  # along the edge of a map
# rad, that a directional light is seen under at least where something is blended, so that several maps choose what stops there
APART = 1e-4
ROWS = 4  # texels of a direction: axes of its map, the direction, irradiance


class SkyShots:
    """On one lightmap. Whoever makes it releases it. made: shots so far."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, occluders: list[Occluders]) -> None:
        self._gpu, self._lightmap, self._occluders = gpu, lightmap, occluders
        kinds: dict[bool, dict[str, object]] = {one.sheer: {"OPACITY": True} if one.sheer else {} for one in occluders}
        pixels = {"PIXELS": PIXELS}
        self._draw = {
            sheer: Pass(gpu, "solvers/shooting/sky_map", defines=pixels | more) for sheer, more in kinds.items()
        }
        self._receive = Pass(
            gpu,
            "solvers/shooting/sky_receive",
            defines=pixels | lightmap.defines("MATERIAL_BITS", "ALBEDO_TEXTURE"),
        )
        self._items = gpu.texture((PIXELS, PIXELS * BATCH), 1, "f4")
        self._depth = gpu.depth_texture(self._items.size)
        self._target = gpu.target(self._items, depth=self._depth)
        self._shots = gpu.texture((ROWS, BATCH), 4, "f4")
        blended = any(m.blended for m in lightmap.scene.materials)
        self._apart = APART if blended else 0.0
        self._given = self._wanted = self._sky = directions_of(None)
        self._at = self.made = 0

    def begin(self, sky: Sky | None, lights: tuple[Light, ...]) -> None:
        """Nothing has been shot. Of the lights the directional ones are."""
        self._given, self._sky = directions_of(None), self._directions(sky, lights)
        self._wanted, self._at, self.made = self._sky, 0, 0

    def change(self, sky: Sky | None, lights: tuple[Light, ...]) -> None:
        """Another sky, or other directional lights: what was given is taken back, and what they give is to come, the
        strongest first."""
        given, self._sky = self._shot(), self._directions(sky, lights)
        queue = _together(Directions(given.towards, -given.irradiance), self._sky)
        order = np.argsort(-np.abs(queue.irradiance).sum(1), kind="stable")
        self._given, self._wanted, self._at = given, Directions(*(part[order] for part in queue)), 0

    def _directions(self, sky: Sky | None, lights: tuple[Light, ...]) -> Directions:
        return directions_of(sky, [replace(light, angle=max(light.angle, self._apart)) for light in lights])

    def _shot(self) -> Directions:
        """What has been given so far, less what was taken back."""
        if not self.left:
            return self._sky
        return _together(self._given, Directions(*(part[: self._at] for part in self._wanted)))

    @property
    def left(self) -> int:
        """Shots that are to come."""
        return len(self._wanted.towards) - self._at

    @property
    def share_left(self) -> float:
        """Of the light, summed over directions, that is to come."""
        power = np.abs(self._wanted.irradiance).sum(1)
        return float(power[self._at :].sum() / max(power.sum(), 1e-300))

    def state(self) -> State:
        """What was given, and what is to come."""
        arrays = {"given": np.stack(self._given), "wanted": np.stack(self._wanted)}
        return State({"at": self._at, "made": self.made}, {name: np.array(a, np.float64) for name, a in arrays.items()})

    def restore(self, state: State) -> None:
        """Go on as from a ``state`` of the same sky and lights. Raises StateError."""
        self._given, self._wanted = (
            Directions(*state.array(name, np.float64, 2, -1, 3)) for name in ("given", "wanted")
        )
        self._at, self.made = int(state.values["at"]), int(state.values["made"])
        if not 0 <= self._at <= len(self._wanted.towards):
            raise StateError(f"{self._at} of {len(self._wanted.towards)} directions")

    def shoot(self, shots: int, bands: int) -> Generator[None, None, int]:
        """The next ones, up to so many, in parts. Returns how many."""
        count = min(shots, BATCH, self.left)
        now = slice(self._at, self._at + count)
        self._write(self._wanted.towards[now], self._wanted.irradiance[now])
        self._target.clear(OPEN, depth=1.0, viewport=(0, 0, PIXELS, PIXELS * count))
        for some in self._occluders:
            casters = some.whole(PIXELS)
            self._draw[some.sheer].draw(
                self._target,
                textures=casters.textures | {"t_shots": self._shots},
                uniforms=casters.uniforms,
                mesh=casters.mesh,
                instances=count,
                depth=True,
            )
        yield
        lightmap = self._lightmap
        reads = "t_position_area", "t_normal_ids", "t_materials", "t_albedo"
        maps = {"t_items": self._items, "t_depth": self._depth, "t_shots": self._shots}
        for band in range(bands):
            self._receive.draw(
                lightmap.light_target,
                textures=lightmap.textures(*reads) | maps,
                uniforms={"u_shots": count},
                blend="add",
                scissor=band_of(lightmap.size, band, bands),
            )
            yield
        self._at += count
        self.made += count
        return count

    def _write(self, towards: F64, irradiance: F64) -> None:
        rows = np.zeros((BATCH, ROWS, 4), np.float32)
        for row, way, light in zip(rows, towards, irradiance / self._lightmap.unit, strict=False):
            row[0, :3], row[1, :3] = axes_of(way)
            row[2, :3], row[3, :3] = way, light
        self._shots.write(rows.tobytes())

    def release(self) -> None:
        self._gpu.release_all(self._target, self._items, self._depth, self._shots)


def _together(one: Directions, other: Directions) -> Directions:
    """Of both, those that are the same added up; none that gives nothing."""
    towards, which = np.unique(np.concatenate([one.towards, other.towards]), axis=0, return_inverse=True)
    irradiance = np.concatenate([one.irradiance, other.irradiance])
    summed = np.stack([np.bincount(which.ravel(), part, len(towards)) for part in irradiance.T], axis=1)
    some = np.abs(summed).sum(1) > 1e-9 * np.abs(irradiance).sum(1).max(initial=0.0)
    return Directions(towards[some], summed[some])


__all__ = ["SkyShots"]
