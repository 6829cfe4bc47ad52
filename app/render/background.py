"""What is seen where no surface is: the sky and the sun's disc, or a neutral dark where a scene has none."""

from __future__ import annotations

import numpy as np

from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.lightmap.textures import upload
from app.render.camera import CameraView
from app.render.false_colour import Scale
from app.render.options import DisplayOptions
from app.render.tone_mapping import curve
from app.scene.model import F32, F64
from app.scene.sky import SUN_ANGLE, Sky


class Background:
    """Fills what the surfaces of a picture leave. Keeps the map of the last sky. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, *, linear: bool = False) -> None:
        """linear: as light, not developed for the screen; where there is no sky none is behind the surfaces then."""
        self._gpu, self._linear = gpu, linear
        self._dark = Pass(gpu, "render/background", label="background")
        self._sky: dict[str, Pass] = {}
        self._shape: F32 | None = None
        self._map: Texture | None = None

    def draw(
        self,
        target: Framebuffer,
        view: CameraView,
        aspect: float,
        sky: Sky | None,
        display: DisplayOptions,
        scale: Scale | None,
        aside_px: F64,
    ) -> None:
        """Behind all that has depth in ``target``; a sky is developed as the display has it. scale: of the false colour.
        aside_px: how far the picture is moved (2,)."""
        if sky is None:
            if not self._linear:
                self._dark.draw(target, uniforms={"u_height_px": float(target.size[1])}, depth=True)
            return
        shader, uniforms = curve(display, scale, exposed=True)
        if shader not in self._sky:
            slots = {"curve": f"render/{shader}.glsl"}
            self._sky[shader] = Pass(
                self._gpu,
                "render/sky",
                slots=slots,
                defines={"LINEAR": self._linear},
                label="background",
                vertex="render/background",
            )
        height = np.tan(view.yfov / 2)
        back = np.eye(3)
        back[:2, 2] = -2.0 * aside_px / target.size
        world_from_ndc = view.world_from_camera[:3, :3] @ np.diag([height * aspect, height, -1.0]) @ back
        towards = np.zeros(3) if sky.sun is None else sky.sun.direction
        cosine = np.cos(SUN_ANGLE / 2)
        self._sky[shader].draw(
            target,
            textures={"t_sky": self._map_of(sky)},
            uniforms=uniforms
            | {
                "u_size": target.size,
                "u_world_from_ndc": tuple(world_from_ndc.T.ravel().tolist()),
                "u_scale": tuple(sky.scale.tolist()),
                "u_sun": (*towards.tolist(), float(cosine)),
                "u_sun_radiance": tuple(sky.sun_radiance.tolist()),
            },
            depth=True,
        )

    def _map_of(self, sky: Sky) -> Texture:
        if self._map is None or self._shape is not sky.shape:
            self._forget()
            self._shape = sky.shape
            self._map = upload(self._gpu, self._shape)
            self._map.filter = (self._gpu.ctx.LINEAR, self._gpu.ctx.LINEAR)
            self._map.repeat_x = True
        return self._map

    def _forget(self) -> None:
        if self._map is not None:
            self._gpu.release_all(self._map)
        self._map = None

    def release(self) -> None:
        self._forget()


__all__ = ["Background"]
