"""The border texels of leaves beside leaves of another level, made a few leaves or rows of display texels at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from app.atlas.lightmap import Lightmap
from app.gpu import Framebuffer, Gpu, Mesh, Pass, Texture
from app.render.edges import KINDS, Kind, unequal_edges
from app.scene.model import F64

Make = Callable[[Kind, Framebuffer, Mapping[str, object], Mapping[str, Texture]], None]
Scissor = tuple[int, int, int, int]
BORDER_FORMAT = {"in_rect": "4f", "in_from": "3f"}
IN_A_ROW = 16  # instances whose texels are made side by side


class EdgeTexels:
    """Where they are, and the batches in which they are made. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, border: int) -> None:
        self._gpu, self._lightmap, self._border = gpu, lightmap, border
        self._found = unequal_edges(lightmap.nodes, border, np.flatnonzero(lightmap.nodes.used))
        self._of_rows: dict[tuple[int, int], list[Batch]] = {}
        self._place = Pass(gpu, "render/border", label="edges")

    def follow(self, slots: NDArray[np.int64]) -> None:
        """The leaves in these slots are others, or have other neighbours."""
        self._forget()
        for kind, some in unequal_edges(self._lightmap.nodes, self._border, slots).items():
            known = self._found[kind]
            self._found[kind] = np.concatenate([known[~np.isin(known[:, 0], slots)], some])

    def of_rows(self, first: int, end: int) -> list[Batch]:
        """Those that reach into these rows of display texels. Kept until leaves change."""
        key = first, end
        if key not in self._of_rows:
            bordered = self._lightmap.nodes.tile + 2 * self._border
            self._of_rows[key] = self._batches(
                lambda found: (found[:, 2] < end) & (found[:, 2] + bordered > first)  # more than any is high
            )
        return self._of_rows[key]

    def of_slots(self, slots: NDArray[np.int64]) -> list[Batch]:
        """Those of these slots. Whoever asks releases them."""
        return self._batches(lambda found: np.isin(found[:, 0], slots))

    def draw(self, target: Framebuffer, make: Make, some: Iterable[tuple[list[Batch], Scissor | None]]) -> None:
        """Let ``make`` draw the texels of these batches, given what to bind besides light, and then bring them to their places in
        ``target``, inside of the scissor: one target after another, since a change of it makes a rasteriser wait."""
        along = {kind: kind.along(self._lightmap.nodes.tile, self._border) for kind in KINDS}
        placed = [(batch, scissor) for batches, scissor in some for batch in batches]
        for batch, _ in placed:
            values = {"u_along": along[batch.kind], "u_border": self._border}
            make(batch.kind, batch.target, values, {"t_edges": batch.edges})
        for batch, scissor in placed:
            self._place.draw(
                target,
                textures={"t_made": batch.made},
                uniforms={"u_size": target.size, "u_along": along[batch.kind]},
                mesh=batch.mesh,
                scissor=scissor,
            )

    def release(self) -> None:
        self._forget()

    def _forget(self) -> None:
        for batches in self._of_rows.values():
            for batch in batches:
                batch.release()
        self._of_rows.clear()

    def _batches(self, which: Callable[[F64], NDArray[np.bool_]]) -> list[Batch]:
        some = [(kind, self._found[kind][which(self._found[kind])]) for kind in KINDS]
        tile, border = self._lightmap.nodes.tile, self._border
        return [Batch(self._gpu, kind, found, kind.along(tile, border), border) for kind, found in some if len(found)]


class Batch:
    """Border texels of one kind: their instances, a texture in which they are made side by side, and their places."""

    def __init__(self, gpu: Gpu, kind: Kind, found: F64, along: int, border: int) -> None:
        self._gpu, self.kind = gpu, kind
        rows = -(-len(found) // IN_A_ROW)
        table = np.zeros((rows * IN_A_ROW, 4), np.float32)
        table[: len(found)] = found[:, 1:]
        self.edges = gpu.texture((IN_A_ROW, rows), 4, "f4", table.tobytes())
        self.made = gpu.texture((IN_A_ROW * along * border, rows), 4, "f1")
        self.target = gpu.target(self.made)
        upright = found[:, 4] == 0
        size = np.where(upright[:, None], (border, along), (along, border))
        row, nth = np.divmod(np.arange(len(found)), IN_A_ROW)
        places = np.column_stack([found[:, 1:3], size, nth * along * border, row, upright]).astype(np.float32)
        self.mesh = Mesh(gpu, places.tobytes(), BORDER_FORMAT, per_instance=True)

    def release(self) -> None:
        self._gpu.release_all(self.target, self.edges, self.made, self.mesh)
