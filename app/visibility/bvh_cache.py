"""Trees of many triangles are kept on disk, under a digest of the triangles: to read one takes a hundredth of building it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.scene.model import F64
from app.util import cache
from app.visibility.bvh import Bvh, build_bvh

FORMAT = b"glowtree bvh 1"  # changes when build_bvh makes other trees, or Bvh holds them otherwise
FEWEST = 4096  # triangles that a file is worth: the tree of fewer is built within two frames
CACHE_FILES = 16  # kept, newest first: of a million triangles a file takes 30 MB

HELD = {"nodes": "float32 3", "order": "int32 1", "cost": "float64 0", "depth": "int64 0"}  # types and dimensions


def bvh_of(corners: F64, tell: Callable[[float], None] | None = None) -> Bvh:
    """The tree of ``build_bvh``, which see, read from the cache where it is there."""
    if len(corners) < FEWEST:
        return build_bvh(corners, tell)
    file = cache.entry("bvh", cache.digest(FORMAT, {"corners": corners}))
    bvh = _read(file, len(corners))
    if bvh is None:
        bvh = build_bvh(corners, tell)
        cache.store({name: np.asarray(value) for name, value in vars(bvh).items()}, file, CACHE_FILES)
    return bvh


def _read(file: Path, count: int) -> Bvh | None:
    """A tree of so many triangles, or None where there is no such file or it holds none."""
    data = cache.read(file)
    if data is None or {name: f"{array.dtype} {array.ndim}" for name, array in data.items()} != HELD:
        return None
    bvh = Bvh(data["nodes"], data["order"], float(data["cost"]), int(data["depth"]))
    return bvh if _is_tree(bvh, count) else None


def _is_tree(bvh: Bvh, count: int) -> bool:
    """Whether every triangle is in one slot, every slot in one leaf, and every node but the first below one that comes before it:
    a ray that walks it comes to an end."""
    if bvh.nodes.shape[1:] != (4, 4) or not np.isfinite(bvh.nodes).all():
        return False
    reference, counts = (bvh.nodes[:, row::2, 3].astype(np.int64) for row in (0, 1))
    leaf = counts > 0
    inner = ~leaf & (reference >= 0)
    by_slot = np.argsort(reference[leaf])
    ends = counts[leaf][by_slot].cumsum()
    return bool(
        np.array_equal(np.sort(bvh.order), np.arange(count))
        and np.array_equal(reference[leaf][by_slot], ends - counts[leaf][by_slot])
        and ends[-1:].sum() == count
        and np.array_equal(np.sort(reference[inner]), np.arange(1, len(bvh.nodes)))
        and (reference > np.arange(len(bvh.nodes))[:, None])[inner].all()
        and bvh.depth == _depth(reference, inner)
    )


def _depth(reference: NDArray[np.int64], inner: NDArray[np.bool_]) -> int:
    """The number of levels of inner nodes: the stack of a ray holds as many."""
    depth, nodes = 0, np.arange(1)
    while len(nodes):
        depth, nodes = depth + 1, reference[nodes][inner[nodes]]
    return depth
