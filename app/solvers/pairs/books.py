"""The books of a bounce say what it changed, and where the light is: read back whole, once a bounce.

Jacobi's H_n = F B_{n-1} balances by itself where F is symmetric, A_i F_ij = A_j F_ji:

    emitted = Σ (1 - ρ) H_n A  +  Σ B_{n-1} (1 - Σ_j F V) A  +  Σ ρ (H_n - H_{n-1}) A  +  imbalance
              absorbed            escaped                       unshot

What no texel is seen to get counts as escaped: what leaves the scene, what ends on black sides, and in a closed room the error of
the form factors, either way. Light from outside is emitted, too, and escapes where no texel receives it.
"""

from __future__ import annotations

import numpy as np

from app.lightmap.lightmap import Lightmap
from app.scene.model import F32, F64
from app.solvers.base import EnergyBalance

Light = F32  # (height, width, 4) of the tile pool: H [stored units], Σ_j F V


class Books:
    """Of one lightmap. received, before: by texels in the last bounce and the one before it, (tiles, t, t, 4). outside: of the
    last bounce, see Outside.sent: other lamps come into the books with the light that they give."""

    def __init__(self, lightmap: Lightmap) -> None:
        self._lightmap = lightmap
        self.begin()

    def begin(self) -> None:
        """Nothing has been received."""
        shape = (*self._lightmap.pool.surfaces.face.shape, 4)
        self.received = self.before = np.zeros(shape, np.float32)
        self.outside = np.zeros((2, 3))

    def enter(self, image: Light, outside: F64) -> None:
        """What a bounce has come to, with this light from outside."""
        self.before, self.received = self.received, self._lightmap.pool.tiles_from_image(image)
        self.outside = outside

    @property
    def _area(self) -> F64:
        return self._lightmap.pool.surfaces.area[..., None]

    @property
    def change(self) -> float:
        """Σ |change of what a tile receives| over what all receive [-]; 0 where nothing is received. By tiles, so that the noise
        of chance is no change."""
        tiles = ((self.received - self.before)[..., :3] * self._area).sum((1, 2))
        total = float((self.received[..., :3] * self._area).sum())
        return float(np.abs(tiles).sum()) / total if total != 0 else float(np.abs(tiles).sum())

    @property
    def mean_sent(self) -> float:
        """B̄ over all surfaces, mean of RGB [stored units]."""
        B = self._sent(self.received)
        return float((B * self._area).sum() / max(3 * float(self._area.sum()), 1e-300)) / self._lightmap.unit

    @property
    def escaped(self) -> F64:
        """Power that no texel was seen to get of what the last bounce sent, RGB [W]."""
        return np.asarray((self._sent(self.before) * (1 - self.received[..., 3:]) * self._area).sum((0, 1, 2)))

    def _sent(self, light: F32) -> F64:
        """B [W/m²] of texels that have received so much."""
        lightmap = self._lightmap
        return lightmap.emission() + lightmap.albedo() * light[..., :3].astype(np.float64) * lightmap.unit

    def balance(self, *, begun: bool) -> EnergyBalance:
        """Where all light is, RGB [W]. begun: whether there was a bounce."""
        sent, arrived = self.outside
        lightmap, area = self._lightmap, self._area
        rho = lightmap.albedo().astype(np.float64)
        H, change = (
            x[..., :3].astype(np.float64) * lightmap.unit for x in (self.received, self.received - self.before)
        )
        emitted, nothing = lightmap.emitted + sent, np.zeros(3)
        return EnergyBalance(
            emitted=emitted,
            absorbed=((1 - rho) * H * area).sum((0, 1, 2)),
            escaped=self.escaped + sent - arrived if begun else nothing,
            unshot=(rho * change * area).sum((0, 1, 2)) if begun else emitted,
            reflectance=(rho * area).sum((0, 1, 2)) / max(float(area.sum()), 1e-300),
            area=float(area.sum()),
        )
