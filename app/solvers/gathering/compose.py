"""Composing writes the light that is shown, direct and indirect, and says how noisy it is.

Indirect light is known on points, and smoothed among them by as much as it is noisy; texels that are finer, where quadtrees are,
interpolate it. Direct light is known on every texel.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from app.direct_light.shadow_rays import DirectLight
from app.gpu import Framebuffer, Gpu, Pass, ReadBack, Texture, glsl_constant, keep, take_over
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64, Scene
from app.util.state import State
from app.visibility.origins import Origins
from app.visibility.rays import RayScene

RADIUS = 4  # of the window that indirect light is smoothed over, in points
SKY_RAYS = int(glsl_constant("direct_light/sky_light.frag.glsl", "SKY_RAYS"))


class Compose:
    """Of one lightmap, with its points. Whoever makes it releases it.

    indirect: of the points [stored units], a: variance of the mean of RGB. variance: of H of the lightmap, of the mean of RGB.
    direct: the direct light that was drawn last.
    """

    def __init__(
        self, gpu: Gpu, lightmap: Lightmap, origins: Origins, points: Lightmap, at: Origins, rays: RayScene
    ) -> None:
        """origins: of the lightmap's texels; at: of the points."""
        self._gpu, self._lightmap, self._origins, self._points, self._at = gpu, lightmap, origins, points, at
        reads = lightmap.defines("MATERIAL_BITS", "TILE")
        self._finer = points is not lightmap
        tile = lightmap.defines("TILE")
        self._aim = Pass(gpu, "solvers/gathering/pilot", defines=tile)
        self._smooth = {
            radius: Pass(gpu, "solvers/gathering/smooth", defines={"RADIUS": radius} | tile) for radius in (RADIUS, 0)
        }
        self._pilot = gpu.texture(points.size, 2, "f4")
        self._pilot_target = gpu.target(self._pilot)
        self._compose = Pass(gpu, "solvers/gathering/compose", defines={"FINER": self._finer} | reads)
        self._judge = Pass(gpu, "solvers/gathering/noise", defines=lightmap.defines("TILE"))
        self.indirect = gpu.texture(points.size, 4, "f4")
        self._indirect_target = gpu.target(self.indirect)
        self._target: Framebuffer | None = None
        self._of: Texture | None = None
        self.direct: Texture | None = None
        self._sky: tuple[Texture, Texture] | None = None  # direct light with a sky's smoothed; the sky's alone
        self._sky_targets: tuple[Framebuffer, Framebuffer] | None = None
        self._walls = self._look_for_walls(rays)
        self._windows = self._open_windows()
        self._fit()

    def _look_for_walls(self, rays: RayScene) -> Texture:
        """What stands between points, see walls.frag.glsl."""
        walls = self._gpu.texture(self._points.size, 2, "f1")
        target = self._gpu.target(walls)
        look = Pass(
            self._gpu,
            "solvers/gathering/walls",
            defines=self._points.defines("MATERIAL_BITS", "TILE") | dict(rays.defines),
        )
        known = self._at.textures | self._points.textures("t_pages") | dict(rays.textures)
        unread = "t_bvh_uv", "t_facets", "t_normal_ids"
        textures = {name: texture for name, texture in known.items() if name not in unread}
        look.draw(target, textures=textures, uniforms=self._places)
        self._gpu.release_all(target)
        return walls

    def _open_windows(self) -> dict[str, Texture]:
        """Which points the window around each one reaches, and where they are: see window.glsl."""
        gpu, points = self._gpu, self._points
        around = gpu.texture((3 * points.columns, 3 * points.rows), 2, "u4")
        reach = gpu.texture(points.size, 4, "u4")
        places = points.textures("t_pages", "t_leaves")
        for name, texture, reads, defines in (
            ("tiles_beside", around, {}, ("TILE",)),
            (
                "reach",
                reach,
                {"t_origin_normal": self._at.normals, "t_walls": self._walls},
                ("MATERIAL_BITS", "TILE"),
            ),
        ):
            target = gpu.target(texture)
            look = Pass(gpu, f"solvers/gathering/{name}", defines=points.defines(*defines))
            look.draw(target, textures=places | reads, uniforms=self._places)
            gpu.release_all(target)
        return {"t_reach": reach, "t_tiles_beside": around}

    def _fit(self) -> None:
        self.variance = self._gpu.texture(self._lightmap.size, 1, "f4")
        self._noise = self._gpu.texture((self._lightmap.columns, self._lightmap.rows), 4, "f4")
        self._noise_target = self._gpu.target(self._noise)

    def smooth(self, gathered: Texture, rays: int, *, smooth: bool) -> None:
        """Bring ``indirect`` up to date with what so many rays of each point have gathered."""
        self._smooth_into(self._indirect_target, gathered, max(rays, 1), RADIUS if smooth else 0, None)

    def _smooth_into(self, target: Framebuffer, gathered: Texture, rays: int, radius: int, blend: str | None) -> None:
        textures = {"t_gathered": gathered} | self._windows
        uniforms = {"u_rays": float(rays)}
        self._aim.draw(self._pilot_target, textures=textures, uniforms=uniforms)
        textures |= {"t_pilot": self._pilot}
        self._smooth[radius].draw(target, textures=textures, uniforms=uniforms, blend=blend)

    def smoothed_sky(self, direct: DirectLight, scene: Scene) -> Texture:
        """Direct light, where texels are the points, with that of the sky smoothed as indirect light is: both come from all
        around."""
        if not scene.lit_by_sky or self._finer:
            return direct.light
        if self._sky is None or self._sky_targets is None:
            self._sky = self._gpu.texture(self._points.size, 4, "f4"), self._gpu.texture(self._points.size, 4, "f4")
            self._sky_targets = self._gpu.target(self._sky[0]), self._gpu.target(self._sky[1])
        if not direct.apart(scene, *self._sky_targets):
            return direct.light
        self._smooth_into(self._sky_targets[0], self._sky[1], SKY_RAYS, RADIUS, "add")
        return self._sky[0]

    def draw(self, direct: Texture) -> None:
        """Write H of the lightmap, the direct light and ``indirect``."""
        lightmap, self.direct = self._lightmap, direct
        if (irradiance := lightmap.texture("t_irradiance")) is not self._of:
            self._forget_target()
            self._target, self._of = self._gpu.target(irradiance, self.variance), irradiance
        assert self._target is not None
        textures, uniforms = {"t_direct": direct, "t_indirect": self.indirect}, {}
        if self._finer:
            textures |= {"t_own_leaves": lightmap.texture("t_leaves"), "t_own_normal": self._origins.normals}
            textures |= {"t_origin_normal": self._at.normals, "t_walls": self._walls}
            textures |= self._points.textures("t_pages", "t_leaves")
            uniforms = self._places | {"u_point": 0.5 ** float(self._points.pool.leaves.level.max())}
        self._compose.draw(self._target, textures=textures, uniforms=uniforms)

    @property
    def _places(self) -> dict[str, Any]:
        return {"u_pages": (float(self._points.columns), self._points.pool.pages_per_texel)}

    def judge(self, direct: Texture) -> ReadBack:
        """How noisy each tile is, on its way: see noise.frag.glsl."""
        textures = self._lightmap.textures("t_position_area", "t_irradiance")
        textures |= {"t_variance": self.variance, "t_direct": direct}
        self._judge.draw(self._noise_target, textures=textures)
        return ReadBack.of(self._gpu, self._noise_target)

    def state(self) -> State:
        """How noisy the light is that was drawn last."""
        state = State()
        keep(state, variance=self.variance)
        return state

    def restore(self, state: State) -> None:
        """Know what is in a ``state``. Raises StateError."""
        take_over(state, variance=self.variance)

    def resized(self) -> None:
        """The tile pool has got another number of slots."""
        self.direct = None
        self._forget_target()
        self._gpu.release_all(self._noise_target, self._noise, self.variance)
        self._fit()

    def _forget_target(self) -> None:
        if self._target is not None:
            self._gpu.release_all(self._target)
        self._target = self._of = None

    def release(self) -> None:
        self._forget_target()
        self._gpu.release_all(self._noise_target, self._noise, self.variance, self._indirect_target, self.indirect)
        self._gpu.release_all(self._pilot_target, self._pilot, self._walls)
        if self._sky is not None and self._sky_targets is not None:
            self._gpu.release_all(*self._sky_targets, *self._sky)
        self._gpu.release_all(*self._windows.values())


@dataclass(frozen=True, eq=False)
class Noise:
    """level: the mean standard deviation over all surfaces, over the mean irradiance [-]; the mean, since the RMS is that of the
    few texels next to lamps. direct: which share of it more shadow rays would bring down. gain (slots,): that of each tile,
    see allocate.py."""

    level: float
    direct: float
    gain: F64


def noise_of(judged: ReadBack) -> Noise:
    """The noise of the light that is shown, as noise.frag.glsl has summed it up."""
    tiles: F64 = np.frombuffer(judged.take(), np.float32).reshape(-1, 4).astype(np.float64)
    deviation, light, direct, _ = tiles.sum(0).tolist()
    return Noise(deviation / light if light > 0 else 0.0, direct / deviation if deviation > 0 else 0.0, tiles[:, 2])
