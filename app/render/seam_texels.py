"""The display texels near seams, which show the light of both charts, a few rows of display texels at a time."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from app.atlas.seams import seam_texels
from app.gpu import Gpu, Mesh
from app.lightmap.lightmap import Lightmap
from app.lightmap.tile_pool import TilePool
from app.scene.model import F32

SEAM_FORMAT = {"in_texel": "2f", "in_other": "2f", "in_weight": "1f"}  # see render/seams.vert.glsl
Ints = NDArray[np.int64]


class DisplaySeams:
    """Where they are, in the order of their rows. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, border: int) -> None:
        self._gpu, self._lightmap, self._border = gpu, lightmap, border
        self._of_rows: dict[tuple[int, int], Mesh] = {}
        self.follow()

    def follow(self) -> None:
        """The leaves are others."""
        self.release()
        self._found = shown_at_seams(self._lightmap.pool, self._border)

    def draw(self, first: int, end: int, make: Callable[[Mesh], None]) -> None:
        """Let ``make`` draw those in some rows of the display texels."""
        lower, upper = np.searchsorted(self._found[:, 1], [first, end]).tolist()
        if lower == upper:
            return
        if (first, end) not in self._of_rows:
            some = np.ascontiguousarray(self._found[lower:upper])
            self._of_rows[first, end] = Mesh(self._gpu, some.tobytes(), SEAM_FORMAT, per_instance=True)
        make(self._of_rows[first, end])

    def release(self) -> None:
        for mesh in self._of_rows.values():
            mesh.release()
        self._of_rows.clear()


def shown_at_seams(pool: TilePool, border: int) -> F32:
    """(n, 5) instances of SEAM_FORMAT, from the lowest row up, in tiles that have a border of so many texels."""
    seams, tile = pool.charts.seams, pool.tile
    used = np.flatnonzero(pool.used)
    keys = pool.leaves.keys[used]
    order = np.argsort(keys)
    found = [np.empty((0, 5), np.float32)]
    for level in np.unique(pool.leaves.level[used]).tolist() if len(seams) else ():
        near = pool.charts.seam_texels if level == 0 else seam_texels(seams, 1 << level)
        leaf = near.texel // tile
        inside = near.texel - leaf * tile
        beside = inside < border, None, inside >= tile - border  # before, of the leaf itself, and after
        for shift in np.ndindex(3, 3):  # the leaf, or one that has the texel in its border
            mine = np.ones(len(leaf), bool)
            for axis, step in enumerate(shift):
                if (within := beside[step]) is not None:
                    mine &= within[:, axis]
            mine = np.flatnonzero(mine)
            at = leaf[mine] + np.array(shift) - 1
            key = (level << 48) | (at[:, 1] << 24) | at[:, 0]
            place = np.minimum(np.searchsorted(keys[order], key), len(keys) - 1)
            there = keys[order][place] == key
            mine, at, slot = mine[there], at[there], used[order[place[there]]]
            corner = np.stack([slot % pool.columns, slot // pool.columns], 1) * (tile + 2 * border)
            px = corner + border + near.texel[mine] - at * tile
            found.append(np.column_stack([px, near.other[mine], near.weight[mine]]).astype(np.float32))
    every = np.concatenate(found)
    return np.asarray(every[np.argsort(every[:, 1], kind="stable")])
