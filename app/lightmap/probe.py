"""A probe reads irradiance at the same points again and again, without anyone waiting for the GPU."""

from __future__ import annotations

import numpy as np

from app.atlas.points import Points, SideIndex
from app.gpu import Gpu, Pass, ReadBack
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64


class Probe:
    """Of one lightmap. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, points: Points) -> None:
        self._gpu, self._lightmap, self._count = gpu, lightmap, len(points)
        charts = lightmap.charts
        face = SideIndex(charts.face_triangle, charts.face_back).of(points)
        edge = int(np.ceil(np.sqrt(len(points))))
        table = np.zeros((edge * edge, 4), np.float32)
        table[: len(points), :2] = np.einsum("nk,nkc->nc", points.weights, charts.face_uv[face])
        self._points = gpu.texture((edge, edge), 4, "f4", table.tobytes())
        self._made = gpu.texture((edge, edge), 4, "f4")
        self._target = gpu.target(self._made)
        self._pass = Pass(gpu, "lightmap/probe", defines=lightmap.defines("TILE"))

    def look(self, *, whole: bool = True) -> ReadBack:
        """The light as it is now, on its way; ``irradiance`` reads it. whole: see ``LightTextures.refresh_ambient``."""
        lightmap = self._lightmap
        lightmap.refresh_ambient(whole=whole)
        self._pass.draw(
            self._target,
            textures={"t_points": self._points}
            | lightmap.textures("t_pages", "t_leaves", "t_position_area", "t_irradiance", "t_ambient"),
            uniforms={
                "u_unit": lightmap.unit,
                "u_pages": (float(lightmap.columns), lightmap.pool.pages_per_texel),
            },
        )
        return ReadBack.of(self._gpu, self._target)

    def irradiance(self, looked: ReadBack) -> F64:
        """(n, 3) [W/m²]. Waits if it has not arrived."""
        pixels = np.frombuffer(looked.take(), np.float32).reshape(-1, 4)
        return pixels[: self._count, :3].astype(np.float64)

    def release(self) -> None:
        self._gpu.release_all(self._target, self._points, self._made)
