"""The energy balance of gathered light: what texels absorb, and what their rays say of the light that they send out.

    emitted = absorbed + escaped + imbalance,    absorbed = Σ (1 - ρ) H A,    escaped = Σ B A (share of rays that hit nothing)

Of the sky and of directional lights, what arrives on texels is emitted; of other lamps without area, what does not has escaped.
Light is gathered, and never sent: nothing forces the books to close, so that the imbalance is an error of the solution.
"""

from __future__ import annotations

import numpy as np

from app.direct_light.shadow_rays import DirectLight
from app.gpu import Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64
from app.solvers.base import EnergyBalance
from app.solvers.gathering.hits import Hits


class Balance:
    """Of the points. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap) -> None:
        self._gpu, self._lightmap = gpu, lightmap
        reads = lightmap.defines("MATERIAL_BITS", "TILE", "ALBEDO_TEXTURE", "EMISSION_TEXTURE")
        self._sum = Pass(gpu, "solvers/gathering/balance", defines=reads)
        self._fit()

    def _fit(self) -> None:
        size = self._lightmap.columns, self._lightmap.rows
        self._tiles = [self._gpu.texture(size, 4, "f4") for _ in range(4)]
        self._target = self._gpu.target(*self._tiles)

    def measure(self, hits: Hits, direct: DirectLight, indirect: Texture) -> EnergyBalance:
        """Where all light is now, RGB [W]. Reads every texel and waits for the GPU."""
        lightmap, (lost, rays) = self._lightmap, hits.lost()
        reads = "t_position_area", "t_normal_ids", "t_materials", "t_albedo", "t_emission"
        self._sum.draw(
            self._target,
            textures=lightmap.textures(*reads) | {"t_lost": lost, "t_direct": direct.light, "t_indirect": indirect},
            uniforms={"u_unit": lightmap.unit, "u_rays": float(max(rays, 1))},
        )
        sums: list[F64] = [
            np.frombuffer(t.read(), np.float32).reshape(-1, 4).astype(np.float64).sum(0) for t in self._tiles
        ]
        area, square = sums[0][3], lightmap.space.scale**2
        absorbed, escaped, blackened = (s[:3] * lightmap.unit * square for s in sums[:3])
        sent = lightmap.sent_by_points
        escaped = escaped + sent - direct.from_points()
        emitted = lightmap.emitted + direct.from_outside() + sent
        return EnergyBalance(
            emitted=emitted,
            absorbed=absorbed + blackened,
            escaped=escaped,
            unshot=np.zeros(3) if rays else emitted,
            reflectance=sums[3][:3] / max(area, 1e-300),
            area=float(area * square),
        )

    def release(self) -> None:
        self._gpu.release_all(self._target, *self._tiles)
