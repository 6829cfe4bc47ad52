"""The ledger says where the energy is: what shooters gave away, where that went, and the balance of both.

    emitted = absorbed + escaped + unshot + imbalance

Before a batch shoots, what it is about to shoot is taken from the residual of its patches; the ledger then adds up how much of
that left the scene, or was lost on black sides without texels. What texels absorbed and still hold is summed tile by tile.
"""

from __future__ import annotations

import numpy as np

from app.gpu import Gpu, Pass, Texture, keep, take_over
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64
from app.solvers.base import EnergyBalance
from app.solvers.shooting.records import BATCH, LEDGER, RECORDS
from app.solvers.shooting.see import Maps
from app.solvers.shooting.shooters import ShooterBatch
from app.util.state import State


class Ledger:
    """The ledger of one lightmap. Whoever makes it releases it.

    emitted: by all lamps and the sky, RGB [W], from_sky: what of that texels got from the sky and directional lights,
    from_points: what point and spot lights have sent out; albedo: mean of all texels, RGB; area: of all texels, solver space: see
    ``weigh``. watt: watts in one stored unit of power, the lightmap's unit [W/m²] times solver area.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, shooters: ShooterBatch) -> None:
        self._gpu, self._lightmap, self._shooters = gpu, lightmap, shooters
        self.texture = gpu.texture((BATCH, LEDGER.rows), 4, "f4")
        self.target = gpu.target(self.texture)
        self._enter = Pass(gpu, "solvers/shooting/ledger", slots=RECORDS)
        reads = lightmap.defines("MATERIAL_BITS", "ALBEDO_TEXTURE")
        self._zero = {
            keeps: Pass(gpu, "solvers/shooting/zero", defines={"KEEPS": keeps} | reads, slots=RECORDS)
            for keeps in (False, True)
        }
        self._add_tiles = Pass(gpu, "solvers/shooting/tile_energy", defines=lightmap.defines("TILE") | reads)
        self.emitted, self.albedo, self.area = np.zeros(3), (0.0, 0.0, 0.0), 0.0
        self.from_sky, self.from_points = np.zeros(3), np.zeros(3)
        self._fit()

    def _fit(self) -> None:
        size = self._lightmap.columns, self._lightmap.rows
        self._tiles = [self._gpu.texture(size, 4, "f4") for _ in range(3)]
        self._tile_target = self._gpu.target(*self._tiles)

    @property
    def watt(self) -> float:
        return self._lightmap.unit * self._lightmap.space.scale**2

    def follow_emission(self) -> None:
        """See what all that emits sends out now."""
        self.emitted = self._lightmap.emitted + self.from_sky + self.from_points

    def weigh(self) -> None:
        """See what emitters send out and surfaces reflect. Waits for the GPU."""
        self.follow_emission()
        sums, _, reflectance = self.tile_sums()
        self.area = float(sums[3]) / self.watt
        self.albedo = tuple((reflectance[:3] / max(sums[3], 1e-300)).tolist())

    def take(self, overshoot: Texture, shots: int) -> None:
        """r_i -= R_i for all of the batch, before the first of them shoots, or what one gives to another would be erased. fixed8
        holds no residual below zero."""
        lightmap = self._lightmap
        reads = "t_position_area", "t_normal_ids", "t_facets", "t_materials", "t_albedo", "t_irradiance"
        self._zero[lightmap.storage != "fixed8"].draw(
            lightmap.residual_target,
            textures=lightmap.textures(*reads) | {"t_shooters": self._shooters.texture, "t_ambient": overshoot},
            uniforms={"u_size": lightmap.size},
            vertices=4,
            instances=shots,
            blend="keep",
            strip=True,
        )

    def enter(self, maps: Maps, shots: int) -> None:
        """Add to the ledger what the batch shot, and what of it left the scene."""
        self._enter.draw(
            self.target,
            textures={"t_escaped": maps.escaped, "t_shooters": self._shooters.texture},
            uniforms={"u_blocks": maps.escaped_size[1]},
            blend="add",
            viewport=(0, 0, shots, LEDGER.rows),
        )

    def tile_sums(self) -> tuple[F64, F64, F64]:
        """Absorbed and unshot power [W] and Σ ρA, RGB and in the first Σ A, as tile_energy.frag.glsl adds them per tile."""
        reads = "t_position_area", "t_normal_ids", "t_materials", "t_albedo", "t_irradiance", "t_residual"
        self._add_tiles.draw(self._tile_target, textures=self._lightmap.textures(*reads))
        sums = [np.frombuffer(t.read(), np.float32).reshape(-1, 4).astype(np.float64).sum(0) for t in self._tiles]
        return sums[0] * self.watt, sums[1] * self.watt, sums[2] * self.watt

    def balance(self) -> EnergyBalance:
        """Where all emitted energy is now, RGB [W]. Reads every texel and waits for the GPU."""
        absorbed, unshot, reflectance = self.tile_sums()
        rows = np.frombuffer(self.texture.read(), np.float32).reshape(LEDGER.rows, BATCH, 4).swapaxes(0, 1)
        entries = LEDGER.read(np.ascontiguousarray(rows))
        escaped, blackened = (entries[name].astype(np.float64).sum(0) * self.watt for name in ("escaped", "blackened"))
        return EnergyBalance(
            self.emitted,
            absorbed[:3] + blackened,
            escaped,
            unshot[:3],
            reflectance[:3] / max(absorbed[3], 1e-300),
            float(absorbed[3] / self._lightmap.unit),
        )

    def clear(self) -> None:
        """Nothing has been shot."""
        self.target.clear()

    def state(self) -> State:
        """All that was entered and weighed."""
        known = {"emitted": self.emitted, "from_sky": self.from_sky, "from_points": self.from_points}
        state = State({"albedo": list(self.albedo), "area": self.area})
        state.arrays.update({name: np.array(power, np.float64) for name, power in known.items()})
        keep(state, entries=self.texture)
        return state

    def restore(self, state: State) -> None:
        """Have entered what was entered in a ``state``. Raises StateError."""
        take_over(state, entries=self.texture)
        self.emitted, self.from_sky, self.from_points = (
            state.array(name, np.float64, 3) for name in ("emitted", "from_sky", "from_points")
        )
        red, green, blue = state.values["albedo"]
        self.albedo, self.area = (red, green, blue), float(state.values["area"])

    def resize(self) -> None:
        """For a lightmap that has got another number of slots. The ledger stays."""
        self._gpu.release_all(self._tile_target, *self._tiles)
        self._fit()

    def release(self) -> None:
        self._gpu.release_all(self._tile_target, *self._tiles, self.target, self.texture)
