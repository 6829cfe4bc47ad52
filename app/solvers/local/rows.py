"""Rows of the form-factor matrix are what the rays of patches hit, traced once, when a patch first needs its row.

    F_ij = n_ij / N,    n_ij of the N rays of node i hit node j

A row is the places in the order of texels (patches.py) of what its rays hit: they give n_ij for a patch and for a cluster of any
level. Rays start all over the node, and are well spread over the hemisphere whatever texel each of them starts from. Rows are
kept in memory up to a budget, and on disk for the next time.
"""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.errors import UserError
from app.gpu import Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import upload
from app.solvers.local.patches import Patches
from app.util import cache
from app.visibility.origins import Origins
from app.visibility.rays import RayScene

I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
FORMAT = b"glowtree rows 3"  # changes when rays start elsewhere, or rows are held otherwise
CACHE_FILES = 8  # kept, newest first
BYTES = 4  # for each ray
ROWS_OF_A_NODE = 2  # of the set: what enters while it moves needs its row before another is forgotten
LOST = np.iinfo(np.int32).max  # the place of no texel: of what lost rays hit
AT_ONCE = 1 << 16  # rays, of one draw


class Rows:
    """Of one lightmap's patches. Whoever makes it releases it.

    rays: N. made: rows so far; from_disk: of these, those that were there. traced: rays so far.
    Raises UserError where memory does not hold the rows of ``least`` nodes.
    """

    def __init__(
        self,
        gpu: Gpu,
        lightmap: Lightmap,
        rays: RayScene,
        origins: Origins,
        patches: Patches,
        count: int,
        mebibytes: int,
        least: int,
    ) -> None:
        """count: of rays of each node; least: nodes of the local set, which need as many rows again while it moves."""
        self._gpu, self._lightmap, self._scene, self._origins = gpu, lightmap, rays, origins
        self._patches, self.rays = patches, count
        self.made = self.from_disk = self.traced = 0
        self.set_memory(mebibytes, least)
        self._row = np.full(len(patches), -1, np.int32)  # of each node
        self._nodes = np.empty(0, np.int64)  # of each row
        self._hits = np.empty((0, count), np.int32)
        self._kept = 0  # rows that are on disk
        self._weights = np.concatenate([[0.0], np.cumsum(patches.texel_area)])
        self._trace = Pass(
            gpu,
            "solvers/local/rows",
            defines=lightmap.defines("MATERIAL_BITS", "TILE") | dict(rays.defines),
        )
        self.places = self._upload_places()
        self._file = cache.entry("rows", self._digest())
        self._read()

    def set_memory(self, mebibytes: int, least: int) -> None:
        """Keep so many at most. Raises UserError."""
        self._most = rows_in(mebibytes, self.rays, least)

    def _digest(self) -> str:
        """Of all that rows follow from."""
        patches, pool = self._patches, self._lightmap.pool
        return cache.digest(
            FORMAT,
            {
                "corners": pool.scene.corners,
                "sides": pool.scene.sides,
                "order": patches.order,
                "start": patches.start,
                "rays": np.array([self.rays]),
            },
        )

    def _upload_places(self) -> Texture:
        """t_places, R32UI: the place in the order of each texel of the tile pool."""
        width, height = self._lightmap.size
        table = np.full((height, width, 1), LOST, np.uint32)
        order = self._patches.order
        table[order >> 16, order & 0xFFFF, 0] = np.arange(len(order))
        return upload(self._gpu, table)

    # -- rows ----------------------------------------------------------------------------------------------------------

    def has(self, nodes: I64) -> NDArray[np.bool_]:
        """(n,) whether their rows are there."""
        return np.asarray(self._row[nodes] >= 0)

    def of(self, nodes: I64) -> I32:
        """(n, N) i32: the place of what each ray of a node hit, LOST where it hit nothing that has texels."""
        assert self.has(nodes).all(), "rows are made before they are asked for"
        return self._hits[self._row[nodes]]

    @property
    def memory(self) -> int:
        """Bytes of memory."""
        return int(self._hits.nbytes)

    def make(self, nodes: I64, needed: I64) -> Generator[None, None, None]:
        """The rows of these nodes, in parts. needed: nodes whose rows stay where memory ends."""
        self.make_room(len(nodes), needed)
        at_once = max(AT_ONCE // self.rays, 1)
        for first in range(0, len(nodes), at_once):
            some = nodes[first : first + at_once]
            hits = self._traced(some)
            yield
            self._keep(some, hits)

    def _keep(self, nodes: I64, hits: I32) -> None:
        if self.made + len(nodes) > len(self._hits):
            room = np.empty(
                (min(max(2 * len(self._hits), 1024, self.made + len(nodes)), self._most), self.rays), np.int32
            )
            room[: self.made] = self._hits[: self.made]
            self._hits = room
        rows = slice(self.made, self.made + len(nodes))
        self._hits[rows] = hits
        self._nodes = np.concatenate([self._nodes[: self.made], nodes])
        self._row[nodes] = np.arange(rows.start, rows.stop)
        self.made += len(nodes)

    def make_room(self, more: int, needed: I64) -> None:
        """Forget rows that nobody needs where there is no memory for so many more."""
        if self.made + more <= self._most:
            return
        keep = np.isin(self._nodes, needed)
        self._row[self._nodes] = -1
        self._nodes, self._hits = self._nodes[keep], self._hits[: self.made][keep]
        self.made = self._kept = len(self._nodes)
        self._row[self._nodes] = np.arange(self.made)

    def _traced(self, nodes: I64) -> I32:
        """(n, N) what their rays hit."""
        patches, count = self._patches, self.rays
        start = upload(self._gpu, patches.order[self.starts(nodes)].astype(np.uint32)[..., None])
        found = self._gpu.texture((count, len(nodes)), 1, "u4")
        target = self._gpu.target(found)
        lightmap, pool = self._lightmap, self._lightmap.pool
        textures = self._origins.textures | dict(self._scene.textures) | lightmap.textures("t_pages", "t_leaves")
        self._trace.draw(
            target,
            textures=textures | {"t_starts": start, "t_places": self.places},
            uniforms={"u_rows": lightmap.size[1], "u_pages": (float(pool.columns), pool.pages_per_texel)},
        )
        hits = np.frombuffer(found.read(), np.int32).reshape(len(nodes), count)
        self._gpu.release_all(target, found, start)
        self.traced += hits.size
        return hits

    def starts(self, nodes: I64) -> I64:
        """(n, N) the place of the texel from which each ray of a node starts: all over its area."""
        patches = self._patches
        share = (np.arange(self.rays) + 0.5) / self.rays
        low, high = self._weights[patches.start[nodes]], self._weights[patches.end[nodes]]
        at = np.searchsorted(self._weights, low[:, None] + share * (high - low)[:, None], side="right") - 1
        return np.asarray(np.clip(at, patches.start[nodes][:, None], patches.end[nodes][:, None] - 1))

    # -- on disk -------------------------------------------------------------------------------------------------------

    def _read(self) -> None:
        data = cache.read(self._file)
        if data is None or set(data) != {"nodes", "hits"}:
            return
        nodes, hits = data["nodes"], data["hits"]
        whole = (
            nodes.dtype == np.int64
            and hits.dtype == np.int32
            and hits.shape == (len(nodes), self.rays)
            and len(np.unique(nodes)) == len(nodes)
            and (len(nodes) == 0 or (0 <= nodes.min() and nodes.max() < len(self._row)))
            and (len(nodes) == 0 or hits.min() >= 0)
            and ((hits < len(self._patches.order)) | (hits == LOST)).all()
        )
        if whole:
            self._keep(nodes[: self._most], hits[: self._most])
            self.from_disk = self._kept = self.made

    def save(self) -> None:
        """Keep the rows on disk, if there are more of them than there were."""
        if self.made > self._kept:
            own: cache.Arrays = {"nodes": self._nodes[: self.made], "hits": self._hits[: self.made]}
            cache.store(own, self._file, CACHE_FILES)
            self._kept = self.made

    @property
    def file(self) -> Path:
        """Where they are kept."""
        return self._file

    def release(self) -> None:
        self.save()
        self._gpu.release_all(self.places)


def rows_in(mebibytes: int, rays: int, least: int) -> int:
    """How many rows of so many rays are in that memory. Raises UserError where a local set of ``least`` nodes needs more."""
    most = mebibytes * 2**20 // (rays * BYTES)
    needed = ROWS_OF_A_NODE * least
    if most < needed:
        raise UserError(
            f"--row-memory {mebibytes}: {needed} rows of {rays} rays take {-(-needed * rays * BYTES // 2**20)} MiB"
        )
    return most
