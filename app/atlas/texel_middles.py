"""Texels in the shape of an L, around the corner of a hole or of a chart, have their centroid beside the surface that they cover:
inside the box that stands in the hole, say, where all is dark.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from app.scene.model import F64

MISSING = 1e-3  # of a texel's square, from which on its centroid may lie beside what it covers
FLAT = 1e-6  # over its area, that the normals of a flat texel add up to less
EDGE = 1e-6  # of a triangle's height: what lies so near to its edge is inside

I64 = NDArray[np.int64]


def along(tangents: F64, off: F64) -> tuple[F64, F64]:
    """How many of each of two tangents (2, n, 3) make vectors (n, 3) of their plane, (n,) each."""
    one, other = tangents
    dot = np.einsum("nk,nk->n", one, other)
    squared = (one**2).sum(1), (other**2).sum(1)
    by = np.einsum("nk,nk->n", off, one), np.einsum("nk,nk->n", off, other)
    over = squared[0] * squared[1] - dot**2
    return (by[0] * squared[1] - by[1] * dot) / over, (by[1] * squared[0] - by[0] * dot) / over


def beside_the_surface(middle: F64, face: I64, uv: F64, leaf: I64, pair_face: I64, pair_leaf: I64) -> NDArray[np.bool_]:
    """(n,) whether places in the atlas, middle (n, 2), lie on none of the faces uv (f, 3, 2) that their leaf meets. face (n,): of
    the largest share there; leaf (n,); pair_face, pair_leaf (p,): the faces that leaves meet."""
    out = ~_inside(uv[face], middle)
    asked = np.flatnonzero(out)
    order = np.argsort(pair_leaf, kind="stable")
    first, last = (np.searchsorted(pair_leaf[order], leaf[asked], side) for side in ("left", "right"))
    nth = np.repeat(np.arange(len(asked)), last - first)
    pair = order[np.arange(len(nth)) - np.repeat(np.cumsum(last - first) - (last - first), last - first) + first[nth]]
    on_one = _inside(uv[pair_face[pair]], middle[asked[nth]])
    out[asked[nth[on_one]]] = False
    return out


def _inside(triangles: F64, places: F64) -> NDArray[np.bool_]:
    """(n,) whether places (n, 2) lie in triangles (n, 3, 2)."""
    a, b = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    d = places - triangles[:, 0]
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    second = (d[:, 0] * b[:, 1] - d[:, 1] * b[:, 0]) / area
    third = (a[:, 0] * d[:, 1] - a[:, 1] * d[:, 0]) / area
    return np.asarray((second >= -EDGE) & (third >= -EDGE) & (second + third <= 1 + EDGE))
