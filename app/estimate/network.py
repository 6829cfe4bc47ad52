"""What comes back of light that leaves nodes, from node to node, bounce after bounce.

    v = s + K ρ v        v_i = s_i + 1/L Σ_l ρ_l v(i, l)     over the L links of node i, rays that are even in cos θ dω / π

The end of a link is no node: of those that are helpers the nearest one stands for it that node i sees. So no light comes through
a wall, however near the nodes behind it are, and what is dark stays dark to the last bit. Links without one are shared among the
others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from app.estimate.ray_gather import CANDIDATES
from app.reference.metrics import DARK
from app.scene.model import F32, F64

ASIDE = 0.2  # radii of the scene that a node counts as farther away, for each unit between two normals
OCTAVE = 0.1  # for each doubling of the irradiance: other light has other errors, and comes from elsewhere
BOUNCES = 1000  # after which what is left is left out: of albedo 0.99, 4e-5 of it
SMALL = 1e-4  # of the largest value: bounces that add less are left out


class Neighbours:
    """Finds candidates among nodes at positions (n, 3), in the solver space, with normals (n, 3) and irradiance (n,)."""

    def __init__(self, position: F64, normal: F64, light: F64) -> None:
        self._count, self._dark = len(position), DARK * max(float(light.mean()), 1e-300)
        self._tree = cKDTree(self._features(position, normal, light))

    def of(self, position: F64, normal: F64, light: F64) -> F32:
        """(m, CANDIDATES) nodes, nearest first, -1 where there are no more."""
        found = self._tree.query(self._features(position, normal, light), k=list(range(1, CANDIDATES + 1)))[1]
        return np.where(found < self._count, found, -1).astype(np.float32)

    def _features(self, position: F64, normal: F64, light: F64) -> F64:
        octaves = np.log2(np.maximum(light, self._dark))
        return np.concatenate([position, ASIDE * normal, OCTAVE * octaves[:, None]], axis=1)


@dataclass(frozen=True, eq=False)
class Network:
    """Links of nodes. node (n, l): what stands for the end of each, -1 for none; albedo (n, l, 3) there. Only the last
    ``helpers`` of them stand for ends, and ``node`` counts these."""

    node: NDArray[np.int64]
    albedo: F64
    helpers: int

    def with_bounces(self, source: F64) -> F64:
        """(n, k, 3): v of sources s (n, k, 3)."""
        count, links = self.node.shape
        known = self.node >= 0
        albedo = self.albedo * known[..., None]
        kept = albedo.sum(1)
        albedo *= np.divide(self.albedo.sum(1), kept, out=np.zeros_like(kept), where=kept > 0)[:, None] / links
        out = np.empty_like(source)
        for colour in range(3):
            entries = albedo[..., colour].ravel(), np.maximum(self.node, 0).ravel(), np.arange(count + 1) * links
            matrix, first = csr_array(entries, shape=(count, self.helpers)), count - self.helpers
            total = _neumann(matrix[first:], source[first:, :, colour])
            out[..., colour] = source[..., colour] + matrix @ total
        return out


def _neumann(matrix: csr_array, source: F64) -> F64:
    """Σ M^k s."""
    total = bounce = source
    for _ in range(BOUNCES):
        bounce = np.asarray(matrix @ bounce)
        total = total + bounce
        if np.abs(bounce).max(initial=0.0) <= SMALL * np.abs(total).max(initial=0.0):
            break
    return total
