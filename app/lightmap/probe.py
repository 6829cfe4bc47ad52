"""A probe reads irradiance at the same places again and again, without anyone waiting for the GPU."""

from __future__ import annotations

import numpy as np

from app.atlas.points import Points, SideIndex
from app.gpu import Gpu, Pass, ReadBack
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import upload
from app.scene.model import F32, F64


class PlaceProbe:
    """Draws the irradiance at places of the virtual atlas into a texture, ``made``. Whoever makes it releases it.

    made: H + a, with what is to come, bilinear; a: 1, or 0 where no texel is near.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, places: F32) -> None:
        """places (h, w, 4): u and v [texels of level 0] of each pixel."""
        self._gpu, self._lightmap = gpu, lightmap
        self._places = upload(gpu, places)
        self.made = gpu.texture(self._places.size, 4, "f4")
        self.target = gpu.target(self.made)
        self._pass = Pass(gpu, "lightmap/probe", defines=lightmap.defines("TILE"))

    def draw(self, *, unit: float = 1.0, whole: bool = True) -> None:
        """The light as it is now, in so many W/m². whole: see ``LightTextures.refresh_ambient``."""
        lightmap = self._lightmap
        lightmap.refresh_ambient(whole=whole)
        self._pass.draw(
            self.target,
            textures={"t_points": self._places}
            | lightmap.textures("t_pages", "t_leaves", "t_position_area", "t_irradiance", "t_ambient"),
            uniforms={
                "u_unit": lightmap.unit / unit,
                "u_pages": (float(lightmap.columns), lightmap.pool.pages_per_texel),
            },
        )

    def release(self) -> None:
        self._gpu.release_all(self.target, self._places, self.made)


class Probe:
    """Of points on the surfaces of one lightmap. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, points: Points) -> None:
        self._gpu, self._count = gpu, len(points)
        charts = lightmap.charts
        face = SideIndex(charts.face_triangle, charts.face_back).of(points)
        edge = int(np.ceil(np.sqrt(len(points))))
        table = np.zeros((edge * edge, 4), np.float32)
        table[: len(points), :2] = np.einsum("nk,nkc->nc", points.weights, charts.face_uv[face])
        self._places = PlaceProbe(gpu, lightmap, table.reshape(edge, edge, 4))

    def look(self, *, whole: bool = True) -> ReadBack:
        """The light as it is now, on its way; ``irradiance`` reads it. whole: see ``LightTextures.refresh_ambient``."""
        self._places.draw(whole=whole)
        return ReadBack.of(self._gpu, self._places.target)

    def irradiance(self, looked: ReadBack) -> F64:
        """(n, 3) [W/m²]. Waits if it has not arrived."""
        pixels = np.frombuffer(looked.take(), np.float32).reshape(-1, 4)
        return pixels[: self._count, :3].astype(np.float64)

    def release(self) -> None:
        self._places.release()
