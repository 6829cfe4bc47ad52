"""Gather points stand for blocks of 4×4 texels: each looks around along a few rays, traced once, for light that is unshot.

A texel has the ambient light that the points around it, of its chart, receive: what is lit late, because it turns away from the
lamps, shows from the start what it will get, and a room without lamps gets no more than comes through its door.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from app.errors import UserError
from app.gpu import Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
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
        blocks = {"BLOCK_LEVEL": BLOCK_LEVEL}
        self._find_around = Pass(gpu, "solvers/shooting/around", defines=bits | tile | blocks)
        self._see_light = Pass(gpu, "solvers/shooting/to_pass_on", defines=bits | own)
        self._smooth = Pass(gpu, "solvers/shooting/smooth_ambient", defines=tile | blocks)
        self._spread = Pass(gpu, "solvers/shooting/spread_ambient", defines=blocks)
        try:
            self._fit()
        except UserError:
            self._rays.release()
            raise

    def _fit(self) -> None:
        gpu, lightmap = self._gpu, self._lightmap
        self.columns, self.rows = (edge >> BLOCK_LEVEL for edge in lightmap.size)
        points = self.columns, self.rows
        self._ray_edge = min(RAY_EDGE, gpu.limits.max_texture // max(points))
        looks = {"BLOCK_LEVEL": BLOCK_LEVEL, "RAY_EDGE": self._ray_edge} | lightmap.defines("MATERIAL_BITS")
        traced = looks | lightmap.defines("TILE") | dict(self._rays.defines)
        self._trace = Pass(gpu, "solvers/shooting/gather_hits", defines=traced)
        self._gather = Pass(gpu, "solvers/shooting/gather_ambient", defines=looks)
        self._hits = gpu.texture((self.columns * self._ray_edge, self.rows * self._ray_edge), 1, "u4")
        self._around = gpu.texture(lightmap.size, 4, "u4")
        self._to_pass_on = gpu.texture(lightmap.size, 4, "f4")
        self._gathered, self._smoothed = gpu.texture(points, 4, "f4"), gpu.texture(points, 4, "f4")
        self._textures = self._hits, self._around, self._to_pass_on, self._gathered, self._smoothed
        self._targets = {texture: gpu.target(texture) for texture in self._textures}
        self.leaves_changed()

    @property
    def memory(self) -> int:
        """Bytes on the GPU."""
        points, texels = self.columns * self.rows, self._around.width * self._around.height
        return points * (4 * self._ray_edge**2 + 2 * 16) + 2 * 16 * texels + self._rays.memory

    def leaves_changed(self) -> None:
        """Points are elsewhere, and what rays hit is."""
        self._traced = np.zeros(self.rows, bool)
        for known in (self._gathered, self._smoothed):
            self._targets[known].clear()

    def knows(self, row: int) -> bool:
        """Whether it is known what the rays of points in a row hit."""
        return bool(self._traced[row])

    def see_light(self, first: int, rows: int) -> None:
        """See what texels have yet to pass on, those that so many rows of points stand for."""
        reads = "t_normal_ids", "t_materials", "t_albedo", "t_irradiance", "t_residual", "t_ambient"
        self._draw(self._see_light, self._to_pass_on, self._lightmap.textures(*reads), (first, rows), 1 << BLOCK_LEVEL)

    def look(self, to_come: Texture, even: Texture, first: int, rows: int) -> None:
        """Let points in so many rows look around at the light that was seen, and the texels there have the ambient light that
        they find. to_come: see to_come.frag.glsl; even: even_ambient.frag.glsl."""
        lightmap, band, edge = self._lightmap, (first, rows), 1 << BLOCK_LEVEL
        places = lightmap.textures("t_facets", *PLACES)
        pages = lightmap.textures("t_pages", "t_leaves")
        beside: dict[str, object] = {"u_pages": (float(lightmap.columns), lightmap.pool.pages_per_texel)}
        rays: dict[str, object] = {"u_rows": lightmap.size[1], "u_points": self.columns}
        if not self._traced[first : first + rows].all():
            reads = self._rays.textures | pages | lightmap.textures(*PLACES)
            self._draw(self._trace, self._hits, reads, band, self._ray_edge, rays | beside)
            self._draw(self._find_around, self._around, places | pages, band, edge, beside)
            self._traced[first : first + rows] = True
        found = {"t_hits": self._hits, "t_to_pass_on": self._to_pass_on, "t_even": even}
        self._draw(self._gather, self._gathered, found | places, band, 1, rays)
        self._draw(self._smooth, self._smoothed, {"t_gathered": self._gathered} | pages, band, 1, beside)
        found = {"t_around": self._around, "t_gathered": self._smoothed, "t_to_come": to_come}
        self._spread.draw(
            lightmap.ambient_target,
            textures=found | lightmap.textures("t_irradiance"),
            scissor=self._scissor(band, edge),
        )

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
        scissor = self._scissor(band, edge)
        program.draw(self._targets[into], textures=textures, uniforms=uniforms, scissor=scissor)

    def _scissor(self, band: tuple[int, int], edge: int) -> tuple[int, int, int, int]:
        first, rows = band
        return 0, first * edge, self.columns * edge, rows * edge

    def resize(self) -> None:
        """For a lightmap that has got another number of slots."""
        self._release_points()
        self._fit()

    def release(self) -> None:
        self._release_points()
        self._rays.release()

    def _release_points(self) -> None:
        self._gpu.release_all(*self._targets.values(), *self._textures)
