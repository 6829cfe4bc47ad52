"""Rays find what they meet first in textures that hold the scene's triangles under a tree of boxes: see visibility/rays.glsl.

All is in the solver space (radius 1), in tables of ENTRIES_A_ROW entries a row:

    t_bvh_nodes      RGBA32UI  two or four texels a node: boxes and names of both children, see bvh_table.py
    t_bvh_triangles  RGBA32F   three texels a slot: the corners; a of the first: the triangle in the scene, of the second: its row
                               in t_sheer, from 1, where it is not opaque, see opacity.py
    t_bvh_uv         RGBA32F   three texels a slot: place in the virtual atlas [texels of level 0] of each corner, on the front
                               and on the back; -1 where that side has no texels
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from weakref import WeakKeyDictionary

import numpy as np

from app.atlas.charts import corner_places
from app.errors import UserError
from app.gpu import Gpu, Texture, glsl_constant
from app.lightmap.textures import BYTES
from app.lightmap.tile_pool import MAX_FACETS, TilePool
from app.scene.model import F32, F64
from app.visibility.bvh import Bvh
from app.visibility.bvh_cache import FEWEST, bvh_of
from app.visibility.bvh_table import Words, node_table
from app.visibility.opacity import Sheer, sheer_triangles

TELL_SECONDS = 0.05  # between two looks at a tree that another thread builds
ENTRIES_A_ROW = 1 << int(glsl_constant("visibility/rays.glsl", "ROW_BITS"))


class RayScene:
    """The triangles of a tile pool on the GPU, for rays. Whoever makes it releases it.

    textures: to bind, by name; a program that knows no places of hits does without t_bvh_uv. defines: of visibility/rays.glsl.
    Raises UserError where there are more triangles than a float counts.
    """

    def __init__(self, gpu: Gpu, pool: TilePool) -> None:
        corners = corners_of(pool)
        if len(corners) > MAX_FACETS:
            raise UserError(f"{len(corners)} triangles: rays can be traced among {MAX_FACETS}")
        self.bvh = tree_of(pool)
        self._gpu = gpu
        triangles = np.zeros((len(corners), 3, 4), np.float32)
        triangles[..., :3] = corners[self.bvh.order]
        triangles[:, 0, 3] = self.bvh.order
        sheer = sheer_triangles(pool.scene)
        rows = np.zeros(len(corners))
        rows[sheer] = 1 + np.arange(len(sheer))
        triangles[:, 1, 3] = rows[self.bvh.order]
        nodes, grid = node_table(self.bvh)
        tables: dict[str, F32 | Words] = {
            "t_bvh_nodes": nodes,
            "t_bvh_triangles": triangles,
            "t_bvh_uv": places_of(pool)[self.bvh.order],
        }
        self.textures: dict[str, Texture] = {name: _uploaded(gpu, table) for name, table in tables.items()}
        self.defines: dict[str, object] = {"STACK": self.bvh.depth, "BOX_GRID": grid}
        if len(sheer):
            self.textures |= Sheer(gpu, pool, sheer).textures
            self.defines["OPACITY"] = True

    @property
    def memory(self) -> int:
        """Bytes on the GPU."""
        return sum(BYTES[t.dtype] * t.components * t.width * t.height for t in self.textures.values())

    def release(self) -> None:
        self._gpu.release_all(*self.textures.values())


class _Tree:
    """The tree of one tile pool, as soon as it is there; whoever holds the lock builds it. share: of it that is done."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.share = 0.0
        self.bvh: Bvh | None = None


_TREES: WeakKeyDictionary[TilePool, _Tree] = WeakKeyDictionary()
_LOCK = threading.Lock()  # of the dictionary


def tree_of(pool: TilePool, tell: Callable[[float], None] | None = None) -> Bvh:
    """The tree of ``corners_of(pool)``, built or read from the cache once for each pool, by whoever asks first: any thread may,
    others wait. tell: is given the share that is done, now and then; what it raises ends the work, or the waiting."""
    tree, hear = _known(pool), tell or (lambda share: None)

    def say(share: float) -> None:
        tree.share = share
        hear(share)

    while not tree.lock.acquire(timeout=TELL_SECONDS):
        hear(tree.share)
    try:
        if tree.bvh is None:
            tree.bvh = bvh_of(corners_of(pool), say)
        return tree.bvh
    finally:
        tree.lock.release()


def tree_is_near(pool: TilePool) -> bool:
    """Whether ``tree_of`` gives it at once: it is there, or has so few triangles that no frame waits for it."""
    return _known(pool).bvh is not None or len(pool.scene.triangles) < FEWEST


def _known(pool: TilePool) -> _Tree:
    with _LOCK:
        return _TREES.setdefault(pool, _Tree())


def corners_of(pool: TilePool) -> F64:
    """(n, 3, 3) corners of the scene's triangles in the solver space, rounded as the GPU holds them."""
    local = pool.space.local_from_world(pool.scene.positions)
    return local.astype(np.float32).astype(np.float64)[pool.scene.triangles]


def places_of(pool: TilePool) -> F32:
    """(n, 3, 4): see corner_places, of the scene's triangles."""
    return corner_places(pool.charts, len(pool.scene.triangles)).astype(np.float32)


def _uploaded(gpu: Gpu, table: F32 | Words) -> Texture:
    """Entries (n, texels, 4) in rows of ENTRIES_A_ROW, the last one filled up."""
    count, texels, _ = table.shape
    rows = max(1, -(-count // ENTRIES_A_ROW))
    filled = np.zeros((rows * ENTRIES_A_ROW, texels, 4), table.dtype)
    filled[:count] = table
    dtype = "u4" if table.dtype == np.uint32 else "f4"
    return gpu.texture((ENTRIES_A_ROW * texels, rows), 4, dtype, filled.tobytes())
