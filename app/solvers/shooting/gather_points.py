"""Gather points stand for blocks of 4×4 texels: each looks around along a few rays, traced once, for light that is unshot.

A texel has the ambient light that the points around it, of its chart, receive: what is lit late, because it turns away from the
lamps, shows from the start what it will get, and a room without lamps gets no more than comes through its door.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from app.errors import UserError
from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.solvers.shooting.point_spread import EDGE, POINT, PointSpread
from app.solvers.shooting.records import BLOCK_LEVEL
from app.visibility.rays import RayScene

RAY_EDGE = 12  # squared: rays of a point, where a texture holds what they hit of all; a texel has those of four
PLACES = "t_position_area", "t_normal_ids"  # of the lightmap


class GatherPoints:
    """Of one lightmap. Whoever makes it releases it. Raises UserError where rays cannot be traced, or memory does not do, as
    ``resize`` does, too.

    rows, columns: of points.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap) -> None:
        self._gpu, self._lightmap = gpu, lightmap
        self._rays = RayScene(gpu, lightmap.pool)
        bits, tile, own = (lightmap.defines(name) for name in ("MATERIAL_BITS", "TILE", "ALBEDO_TEXTURE"))
        self._see_light = Pass(gpu, "solvers/shooting/to_pass_on", defines=bits | own)
        self._smooth = Pass(gpu, "solvers/shooting/smooth_ambient", defines=tile | {"BLOCK_LEVEL": BLOCK_LEVEL})
        try:
            self._fit()
        except UserError:
            self._rays.release()
            raise

    def _fit(self) -> None:
        gpu, lightmap = self._gpu, self._lightmap
        self._spread = PointSpread(gpu, lightmap)
        points = self.columns, self.rows = self._spread.columns, self._spread.rows
        self._ray_edge = min(RAY_EDGE, gpu.limits.max_texture // max(points))
        looks = POINT | {"RAY_EDGE": self._ray_edge} | lightmap.defines("MATERIAL_BITS")
        traced = looks | lightmap.defines("TILE") | dict(self._rays.defines)
        self._trace = Pass(gpu, "solvers/shooting/gather_hits", defines=traced)
        self._gather = Pass(gpu, "solvers/shooting/gather_ambient", defines=looks)
        self._hits = gpu.texture((self.columns * self._ray_edge, self.rows * self._ray_edge), 1, "u4")
        self._to_pass_on = gpu.texture(lightmap.size, 4, "f4")
        self._gathered, self._smoothed = gpu.texture(points, 4, "f4"), gpu.texture(points, 4, "f4")
        self._textures = self._hits, self._to_pass_on, self._gathered, self._smoothed
        self._targets = {texture: gpu.target(texture) for texture in self._textures}
        self.leaves_changed()

    @property
    def memory(self) -> int:
        """Bytes on the GPU."""
        points, texels = self.columns * self.rows, self._to_pass_on.width * self._to_pass_on.height
        return points * (4 * self._ray_edge**2 + 2 * 16) + 16 * texels + self._spread.memory + self._rays.memory

    def leaves_changed(self) -> None:
        """Points are elsewhere, and what rays hit is."""
        self._traced = np.zeros(self.rows, bool)
        for known in (self._gathered, self._smoothed):
            self._targets[known].clear()

    def knows(self, row: int) -> bool:
        """Whether it is known what the rays of points in a row hit."""
        return bool(self._traced[row])

    def see_light(self, ambient: Texture, first: int, rows: int) -> None:
        """See what texels have yet to pass on, those that so many rows of points stand for, of this ambient light too."""
        reads = "t_normal_ids", "t_materials", "t_albedo", "t_irradiance", "t_residual"
        seen = self._lightmap.textures(*reads) | {"t_ambient": ambient}
        self._draw(self._see_light, self._to_pass_on, seen, (first, rows), EDGE)

    def look(self, even: Texture, first: int, rows: int) -> None:
        """Let points in so many rows look around at the light that was seen. even: see even_ambient.frag.glsl."""
        lightmap, band = self._lightmap, (first, rows)
        places = lightmap.textures("t_facets", *PLACES)
        beside: dict[str, object] = {"u_pages": (float(lightmap.columns), lightmap.pool.pages_per_texel)}
        rays: dict[str, object] = {"u_rows": lightmap.size[1], "u_points": self.columns}
        if not self._traced[first : first + rows].all():
            reads = self._rays.textures | lightmap.textures("t_pages", "t_leaves", *PLACES)
            self._draw(self._trace, self._hits, reads, band, self._ray_edge, rays | beside)
            self._spread.find_around(first, rows)
            self._traced[first : first + rows] = True
        found = {"t_hits": self._hits, "t_to_pass_on": self._to_pass_on, "t_even": even}
        self._draw(self._gather, self._gathered, found | places, band, 1, rays)

    def spread(self, target: Framebuffer, to_come: Texture, first: int, rows: int) -> None:
        """Let the texels of so many rows of points have the ambient light that these found, in ``target``. to_come: see
        to_come.frag.glsl. What points that have not looked yet would find, others around them tell, or it is even."""
        lightmap = self._lightmap
        beside: dict[str, object] = {"u_pages": (float(lightmap.columns), lightmap.pool.pages_per_texel)}
        found = {"t_gathered": self._gathered} | lightmap.textures("t_pages", "t_leaves")
        self._draw(self._smooth, self._smoothed, found, (first, rows), 1, beside)
        self._spread.draw(target, self._smoothed, to_come, first, rows)

    def _draw(
        self,
        program: Pass,
        into: Texture,
        textures: Mapping[str, Texture],
        band: tuple[int, int],
        edge: int,
        uniforms: Mapping[str, object] | None = None,
    ) -> None:
        """A band of rows of points, of which each is a square of so many pixels."""
        first, rows = band
        scissor = 0, first * edge, self.columns * edge, rows * edge
        program.draw(self._targets[into], textures=textures, uniforms=uniforms, scissor=scissor)

    def resize(self) -> None:
        """For a lightmap that has got another number of slots."""
        self._release_points()
        self._fit()

    def release(self) -> None:
        self._release_points()
        self._rays.release()

    def _release_points(self) -> None:
        self._spread.release()
        self._gpu.release_all(*self._targets.values(), *self._textures)
