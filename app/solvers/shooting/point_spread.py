"""What gather points receive is spread over the texels around them: bilinear, within a chart."""

from __future__ import annotations

import functools

from app.gpu import Framebuffer, Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import NEAREST
from app.solvers.shooting.records import BLOCK_LEVEL

EDGE = 1 << BLOCK_LEVEL  # texels along the edge of the block that a point stands for
POINT = {"BLOCK_LEVEL": BLOCK_LEVEL, "NEAREST": ", ".join(map(str, NEAREST))}  # of passes that look its texel up


class PointSpread:
    """Of one lightmap, in bands of rows of points. Whoever makes it releases it. Raises GpuError.

    columns, rows: of points.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap) -> None:
        self._gpu, self._lightmap = gpu, lightmap
        self.columns, self.rows = (edge >> BLOCK_LEVEL for edge in lightmap.size)
        blocks = {"BLOCK_LEVEL": BLOCK_LEVEL}
        self._find = Pass(gpu, "solvers/shooting/around", defines=lightmap.defines("MATERIAL_BITS", "TILE") | POINT)
        self._spread = functools.cache(
            lambda foreseen: Pass(gpu, "solvers/shooting/spread_ambient", defines=blocks | {"FORESEEN": foreseen})
        )
        self._around = gpu.texture(lightmap.size, 4, "u4")
        self._target = gpu.target(self._around)

    @property
    def memory(self) -> int:
        """Bytes on the GPU."""
        return 16 * self._around.width * self._around.height

    def find_around(self, first: int, rows: int) -> None:
        """Find the points around the texels of so many rows."""
        self._find.draw(
            self._target,
            textures=self._lightmap.textures("t_facets", "t_position_area", "t_normal_ids", "t_pages", "t_leaves"),
            uniforms={"u_pages": (float(self._lightmap.columns), self._lightmap.pool.pages_per_texel)},
            scissor=self._scissor(first, rows),
        )

    def draw(
        self,
        target: Framebuffer,
        received: Texture,
        to_come: Texture,
        first: int,
        rows: int,
        *,
        foreseen: bool = False,
    ) -> None:
        """Let the texels of so many rows, around which the points are known, have what these receive as their ambient light, in
        ``target``. to_come: see common/even_ambient.glsl; foreseen: see spread_ambient.frag.glsl."""
        self._spread(foreseen).draw(
            target,
            textures={"t_around": self._around, "t_gathered": received, "t_to_come": to_come}
            | self._lightmap.textures("t_irradiance"),
            scissor=self._scissor(first, rows),
        )

    def _scissor(self, first: int, rows: int) -> tuple[int, int, int, int]:
        return 0, first * EDGE, self.columns * EDGE, rows * EDGE

    def release(self) -> None:
        self._gpu.release_all(self._target, self._around)
