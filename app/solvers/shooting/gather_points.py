"""Gather points stand for blocks of 4×4 texels: each looks around along a few rays, traced once, for light that is unshot.

A texel has the ambient light that the points around it, of its chart, receive: what is lit late, because it turns away from the
lamps, shows from the start what it will get, and a room without lamps gets no more than comes through its door.
"""

from __future__ import annotations

import numpy as np

from app.errors import UserError
from app.gpu import Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.solvers.shooting.records import BLOCK_LEVEL
from app.visibility.rays import RayScene

RAY_EDGE = 12  # squared: rays of a point, where a texture holds what they hit of all
PLACES = "t_position_area", "t_normal_ids"  # of the lightmap


class GatherPoints:
    """Of one lightmap. Whoever makes it releases it. Raises UserError where rays cannot be traced, or memory does not do, as
    ``resize`` does, too."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap) -> None:
        self._gpu, self._lightmap = gpu, lightmap
        self._rays = RayScene(gpu, lightmap.pool)
        self._spread = Pass(
            gpu,
            "solvers/shooting/spread_ambient",
            defines=lightmap.defines("MATERIAL_BITS", "TILE") | {"BLOCK_LEVEL": BLOCK_LEVEL},
        )
        try:
            self._fit()
        except UserError:
            self._rays.release()
            raise

    def _fit(self) -> None:
        width, height = (edge >> BLOCK_LEVEL for edge in self._lightmap.size)
        self._ray_edge = min(RAY_EDGE, self._gpu.limits.max_texture // max(width, height))
        self._make_passes()
        self._hits = self._gpu.texture((width * self._ray_edge, height * self._ray_edge), 1, "u4")
        self._hits_target = self._gpu.target(self._hits)
        self._gathered = self._gpu.texture((width, height), 4, "f4")
        self._gathered_target = self._gpu.target(self._gathered)
        self.rows = height
        self.leaves_changed()

    def _make_passes(self) -> None:
        """Those that know how many rays a point has."""
        bits, tile, own = (self._lightmap.defines(name) for name in ("MATERIAL_BITS", "TILE", "ALBEDO_TEXTURE"))
        points = {"BLOCK_LEVEL": BLOCK_LEVEL, "RAY_EDGE": self._ray_edge}
        traced = bits | tile | points | dict(self._rays.defines)
        self._trace = Pass(self._gpu, "solvers/shooting/gather_hits", defines=traced)
        self._gather = Pass(self._gpu, "solvers/shooting/gather_ambient", defines=bits | own | points)

    @property
    def memory(self) -> int:
        """Bytes on the GPU."""
        points = self._gathered.width * self._gathered.height
        return points * (4 * self._ray_edge**2 + 16) + self._rays.memory

    def leaves_changed(self) -> None:
        """Points are elsewhere, and what rays hit is."""
        self._traced = np.zeros(self.rows, bool)

    def knows(self, row: int) -> bool:
        """Whether it is known what the rays of points in a row hit."""
        return bool(self._traced[row])

    def rows_of(self, rays: int) -> int:
        """Rows of points that have about so many rays: whole tiles, one at least."""
        across = self._lightmap.pool.tile >> BLOCK_LEVEL
        return max(rays // (self._hits.width * self._ray_edge * across), 1) * across

    def look(self, to_come: Texture, first: int, rows: int) -> None:
        """Let points in so many rows look around, and the texels there have the ambient light that they find now. to_come: see
        to_come.frag.glsl."""
        lightmap, width = self._lightmap, self._gathered.width
        band = first, min(first + rows, self.rows)
        if not self._traced[slice(*band)].all():
            self._trace.draw(
                self._hits_target,
                textures=self._rays.textures | lightmap.textures("t_pages", "t_leaves", *PLACES),
                uniforms=self._rows | self._pages,
                scissor=_scissor(band, width, self._ray_edge),
            )
            self._traced[slice(*band)] = True
        self._gather.draw(
            self._gathered_target,
            textures={"t_hits": self._hits}
            | lightmap.textures("t_residual", "t_materials", "t_albedo", "t_ambient", "t_facets", *PLACES),
            uniforms=self._rows,
            scissor=_scissor(band, width, 1),
        )
        self._spread.draw(
            lightmap.ambient_target,
            textures={"t_gathered": self._gathered, "t_to_come": to_come}
            | lightmap.textures("t_pages", "t_leaves", "t_irradiance", "t_facets", *PLACES),
            uniforms=self._pages,
            scissor=_scissor(band, width, 1 << BLOCK_LEVEL),
        )

    @property
    def _rows(self) -> dict[str, object]:
        return {"u_rows": self._lightmap.size[1]}

    @property
    def _pages(self) -> dict[str, object]:
        return {"u_pages": (float(self._lightmap.columns), self._lightmap.pool.pages_per_texel)}

    def resize(self) -> None:
        """For a lightmap that has got another number of slots."""
        self._release_points()
        self._fit()

    def release(self) -> None:
        self._release_points()
        self._rays.release()

    def _release_points(self) -> None:
        self._gpu.release_all(self._hits_target, self._hits, self._gathered_target, self._gathered)


def _scissor(band: tuple[int, int], width: int, edge: int) -> tuple[int, int, int, int]:
    """A band of rows of points, of which each is a square of so many pixels."""
    return 0, band[0] * edge, width * edge, (band[1] - band[0]) * edge
