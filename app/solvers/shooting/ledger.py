"""The ledger says where the energy is: what shooters gave away, where that went, and the balance of both.

    emitted = absorbed + escaped + unshot + imbalance

Before a batch shoots, what it is about to shoot is taken from the residual of its patches; the ledger then adds up how much of
that left the scene, or was lost on black sides without texels. What texels absorbed and still hold is summed tile by tile. A
direction of the sky sends out what its map shows of sides with texels: all that misses them is none of the scene's.
"""

from __future__ import annotations

import numpy as np

from app.gpu import Gpu, Pass, Texture, keep, take_over
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64
from app.solvers.base import EnergyBalance
from app.solvers.shooting.records import BATCH, LEDGER, RECORDS
from app.solvers.shooting.shooters import ShooterBatch
from app.util.state import State

KNOWN = "lamps", "directions", "points", "to_come"  # RGB [W]


class Ledger:
    """The ledger of one lightmap. Whoever makes it releases it.

    emitted: by all lamps, and from outside, RGB [W]; of that lamps: by those with an area; directions: what has come from the sky
    and directional lights, as far as it is known; points: what point and spot lights have sent out; to_come: about what of either
    is still to come; foreseen: of that what the picture shows as ambient light: nothing while lights replace others, which
    lit other places, nor of a kind that has yet to begin. estimated: whether to_come is not known for sure. ahead: what is
    foreseen besides, over what has come from directions: where nobody has heard yet how much that is. albedo: mean of all texels,
    RGB; area: of all texels, solver space: see ``weigh``. watt: watts in one stored unit of power, the lightmap's unit
    [W/m²] times solver area.
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
        self._enter_directions = Pass(gpu, "solvers/shooting/ledger_directions", slots=RECORDS)
        self.lamps, self.albedo, self.area = np.zeros(3), (0.0, 0.0, 0.0), 0.0
        self.directions = self.points = self.to_come = self.foreseen = np.zeros(3)
        self.estimated, self.ahead = False, 0.0
        self._fit()

    def _fit(self) -> None:
        size = self._lightmap.columns, self._lightmap.rows
        self._tiles = [self._gpu.texture(size, 4, "f4") for _ in range(3)]
        self._tile_target = self._gpu.target(*self._tiles)

    @property
    def watt(self) -> float:
        return self._lightmap.unit * self._lightmap.space.scale**2

    @property
    def emitted(self) -> F64:
        return np.asarray(self.lamps + self.directions + self.points + self.to_come)

    def share(self, power: float) -> float:
        """Power [stored units · solver area] as a share of what is emitted; 0 where nothing is."""
        emitted = float(self.emitted.sum())
        return power * self.watt / emitted if emitted > 0 else 0.0

    def capped(self, share: float) -> float:
        """A share of what is emitted, while some of that is still estimated, and may come to nothing: all is unshot then."""
        return min(share, 1.0) if self.emitted.sum() > 0 else 1.0

    def follow_emission(self) -> None:
        """See what lamps with an area send out now."""
        self.lamps = self._lightmap.emitted

    def weigh(self) -> None:
        """See what lamps with an area send out and surfaces reflect. Waits for the GPU."""
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

    def enter(self, escaped: Texture, shots: int) -> None:
        """Add to the ledger what the batch shot. escaped: pieces of what of it left the scene, of each shot as many rows."""
        self._enter.draw(
            self.target,
            textures={"t_escaped": escaped, "t_shooters": self._shooters.texture},
            uniforms={"u_blocks": escaped.height // BATCH},
            blend="add",
            viewport=(0, 0, shots, LEDGER.rows),
        )

    def enter_directions(self, sent: Texture, shots: int, sample: float) -> None:
        """Add to the ledger what so many directions of the batch sent out. sent: samples of their maps that show sides with
        texels, in pieces, of each shot as many rows; sample: area of one, solver space."""
        self._enter_directions.draw(
            self.target,
            textures={"t_sent": sent, "t_shooters": self._shooters.texture},
            uniforms={"u_blocks": sent.height // BATCH, "u_sample": sample},
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
        entered = self._entered("escaped", "blackened", "directions")
        escaped, blackened, self.directions = (power * self.watt for power in entered)
        return EnergyBalance(
            self.emitted,
            absorbed[:3] + blackened,
            escaped,
            unshot[:3] + self.to_come,
            reflectance[:3] / max(absorbed[3], 1e-300),
            float(absorbed[3] / self._lightmap.unit),
            estimated=self.estimated,
        )

    def escaped(self) -> F64:
        """What has left the scene, RGB [stored units · solver area]. Waits for the GPU."""
        return self._entered("escaped")[0]

    def _entered(self, *names: str) -> list[F64]:
        """Sums of powers in LEDGER, each RGB [stored units · solver area]. Waits for the GPU."""
        rows = np.frombuffer(self.texture.read(), np.float32).reshape(LEDGER.rows, BATCH, 4).swapaxes(0, 1)
        entries = LEDGER.read(np.ascontiguousarray(rows))
        return [entries[name].astype(np.float64).sum(0) for name in names]

    def clear(self) -> None:
        """Nothing has been shot."""
        self.target.clear()
        self.directions = self.points = self.to_come = self.foreseen = np.zeros(3)

    def state(self) -> State:
        """All that was entered and weighed."""
        known = {name: getattr(self, name) for name in KNOWN}
        state = State({"albedo": list(self.albedo), "area": self.area})
        state.arrays.update({name: np.array(power, np.float64) for name, power in known.items()})
        keep(state, entries=self.texture)
        return state

    def restore(self, state: State) -> None:
        """Have entered what was entered in a ``state``. Raises StateError."""
        take_over(state, entries=self.texture)
        for name in KNOWN:
            setattr(self, name, state.array(name, np.float64, 3))
        red, green, blue = state.values["albedo"]
        self.albedo, self.area = (red, green, blue), float(state.values["area"])

    def resize(self) -> None:
        """For a lightmap that has got another number of slots. The ledger stays."""
        self._release_tiles()
        self._fit()

    def release(self) -> None:
        self._release_tiles()
        self._gpu.release_all(self.target, self.texture)

    def _release_tiles(self) -> None:
        self._gpu.release_all(self._tile_target, *self._tiles)
