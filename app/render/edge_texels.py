"""The border texels of leaves beside leaves of another level, made a few leaves or rows of display texels at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from app.gpu import Framebuffer, Gpu, Mesh, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import QUAD_FORMAT
from app.render.edges import KINDS, Kind, unequal_edges
from app.scene.model import F64

Make = Callable[[Kind, Framebuffer, Mapping[str, object], Mapping[str, Texture]], None]
IN_A_ROW = 16  # instances whose texels are made side by side


class EdgeTexels:
    """Where they are, and the batches in which they are made. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, border: int, dtype: str) -> None:
        """dtype: of display texels."""
        self._gpu, self._lightmap, self._border, self._dtype = gpu, lightmap, border, dtype
        self._found = unequal_edges(lightmap.pool, border, np.flatnonzero(lightmap.pool.used))
        self._of_rows: dict[tuple[int, int], list[_Batch]] = {}
        self._place = Pass(gpu, "render/border", vertex="common/rects", label="edges")

    def follow(self, slots: NDArray[np.int64]) -> None:
        """The leaves in these slots are others, or have other neighbours."""
        self._forget()
        for kind, some in unequal_edges(self._lightmap.pool, self._border, slots).items():
            known = self._found[kind]
            self._found[kind] = np.concatenate([known[~np.isin(known[:, 0], slots)], some])

    def draw(self, target: Framebuffer, first: int, end: int, make: Make) -> None:
        """Those in some rows of ``target``, the display texels: let ``make`` draw them, given what to bind besides light, and
        then bring them to their places. One target after the other, since a change of it makes a rasteriser wait."""
        along = {kind: kind.along(self._lightmap.pool.tile, self._border) for kind in KINDS}
        batches = self._batches(first, end)
        for batch in batches:
            values = {"u_along": along[batch.kind], "u_border": self._border}
            make(batch.kind, batch.target, values, {"t_edges": batch.edges})
        for batch in batches:
            self._place.draw(
                target,
                textures={"t_made": batch.made, "t_edges": batch.edges},
                uniforms={"u_size": target.size, "u_along": along[batch.kind], "u_border": self._border},
                mesh=batch.mesh,
                scissor=(0, first, target.size[0], end - first),
            )

    def release(self) -> None:
        self._forget()

    def _forget(self) -> None:
        for batches in self._of_rows.values():
            for batch in batches:
                batch.release()
        self._of_rows.clear()

    def _batches(self, first: int, end: int) -> list[_Batch]:
        """Those that reach into these rows. Kept until leaves change."""
        key, tile, border = (first, end), self._lightmap.pool.tile, self._border
        if key not in self._of_rows:
            self._of_rows[key] = batches = []
            for kind, found in self._found.items():
                some = found[(found[:, 2] < end) & (found[:, 2] + tile > first)]  # none is as high as a tile
                most = IN_A_ROW * self._gpu.limits.max_texture
                for start in range(0, len(some), most):
                    part = some[start : start + most]
                    batches.append(_Batch(self._gpu, kind, part, kind.along(tile, border), border, self._dtype))
        return self._of_rows[key]


class _Batch:
    """Border texels of one kind: their instances, a texture in which they are made side by side, and their places."""

    def __init__(self, gpu: Gpu, kind: Kind, found: F64, along: int, border: int, dtype: str) -> None:
        self._gpu, self.kind = gpu, kind
        rows = -(-len(found) // IN_A_ROW)
        table = np.zeros((rows * IN_A_ROW, 4), np.float32)
        table[: len(found)] = found[:, 1:]
        self.edges = gpu.texture((IN_A_ROW, rows), 4, "f4", table.tobytes())
        self.made = gpu.texture((IN_A_ROW * along * border, rows), 4, dtype)
        self.target = gpu.target(self.made)
        upright = found[:, 4] == 0
        size = np.where(upright[:, None], (border, along), (along, border))
        row, nth = np.divmod(np.arange(len(found)), IN_A_ROW)
        places = np.column_stack([found[:, 1:3], size, nth * along * border, row]).astype(np.float32)
        self.mesh = Mesh(gpu, places.tobytes(), QUAD_FORMAT, per_instance=True)

    def release(self) -> None:
        self._gpu.release_all(self.target, self.edges, self.made, self.mesh)
