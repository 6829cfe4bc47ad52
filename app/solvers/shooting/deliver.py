"""Delivering gives every texel its light of a batch, and sees to it that each shot gives away what it owns.

A patch shines from its whole polygon but sees from one point, and light is taken at the middle of each texel. Where these are as
large as what stands around them, Σ_j A_j F_ji V_ji is not what should arrive, A_i less what leaves the scene: light would come
from nothing, or be lost. Such a shot is scaled by what it would give away:

    H_j += s_i R_i F_ji V_ji,   r_j += ρ_j s_i R_i F_ji V_ji,   s_i = (1 - open_i - black_i) A_i / Σ_j A_j F_ji V_ji
"""

from __future__ import annotations

from app.gpu import Gpu, Pass
from app.lightmap.lightmap import Lightmap
from app.solvers.shooting.choose import band_of
from app.solvers.shooting.records import IN_BLOCKS, RECORDS, SHOOTER
from app.solvers.shooting.see import Maps
from app.solvers.shooting.shooters import ShooterBatch

# What leaves the scene is known from the map, within about so much of the shot: one that is off by no more is left as it is, else
# the map's error would go into direct light that is right. Where nothing leaves, all must arrive, to the last digit: in a closed
# room of high albedo errors repeat at each of a hundred bounces.
SOUND = 0.01
# A shot that texels see less than half of says too little about where its light goes: no gain is larger, and what is then left
# stays on its own patch, which reflects and shoots it again.
MOST = 2.0


class Delivery:
    """What texels see of each shot of a batch, until it is delivered. Whoever makes it releases it.

    target: F V of the first four shots and of the others, and in quadtrees how much light texels would get without any shadow.
    scaled: whether shots are.
    """

    def __init__(self, gpu: Gpu, lightmap: Lightmap, shooters: ShooterBatch) -> None:
        self._gpu, self._lightmap, self._shooters = gpu, lightmap, shooters
        self.scaled = True
        self._tile = Pass(gpu, "solvers/shooting/tile_shares", defines=lightmap.defines("TILE"))
        self._row = Pass(gpu, "solvers/shooting/row_shares")
        law = {"SOUND": SOUND, "MOST": MOST}
        self._gain = {
            scaled: Pass(gpu, "solvers/shooting/gain", defines=IN_BLOCKS | law | {"SCALED": scaled}, slots=RECORDS)
            for scaled in (False, True)
        }
        reads = lightmap.defines("MATERIAL_BITS", "ALBEDO_TEXTURE")
        shadows = {"SHADOWS": lightmap.pool.adaptive}
        self._deliver = Pass(gpu, "solvers/shooting/deliver", defines=IN_BLOCKS | reads | shadows, slots=RECORDS)
        self._keep = Pass(gpu, "solvers/shooting/keep", defines=reads, slots=RECORDS, vertex="solvers/shooting/zero")
        self._fit()

    def _fit(self) -> None:
        gpu, lightmap = self._gpu, self._lightmap
        self._seen = {name: gpu.texture(lightmap.size, 4, "f4") for name in ("t_first", "t_last")}
        if lightmap.pool.adaptive:
            self._seen["t_unoccluded"] = gpu.texture(lightmap.size, 1, "f4")
        self._tiles, self._rows = (
            {name: gpu.texture(size, 4, "f4") for name in ("t_first", "t_last")}
            for size in ((lightmap.columns, lightmap.rows), (1, lightmap.rows))
        )
        self.target, self._tile_target, self._row_target = (
            gpu.target(*textures.values()) for textures in (self._seen, self._tiles, self._rows)
        )

    def clear(self) -> None:
        """Before a batch: no texel sees anything."""
        width, height = self._used
        self.target.clear(viewport=(0, 0, width, height))

    @property
    def _used(self) -> tuple[int, int]:
        """Texels along the edges of the part of the tile pool that holds leaves."""
        lightmap = self._lightmap
        rows = -(-lightmap.pool.slots_in_use // lightmap.columns)
        return lightmap.size[0], rows * lightmap.pool.tile

    def weigh(self, maps: Maps, first: int, shots: int) -> None:
        """Write into these shooters of the batch what becomes of their shots, and the gain of each."""
        two = {name: self._seen[name] for name in ("t_first", "t_last")}
        width, height = (edge // self._lightmap.pool.tile for edge in self._used)
        self._tile.draw(
            self._tile_target,
            textures=two | self._lightmap.textures("t_position_area"),
            viewport=(0, 0, width, height),
        )
        self._row.draw(self._row_target, textures=self._tiles)
        self._gain[self.scaled].draw(
            self._shooters.target,
            textures=self._rows | {"t_escaped": maps.escaped},
            uniforms={"u_first": 0, "u_blocks": maps.escaped_size[1], "u_rows": height},
            blocks=self._shooters.blocks,
            viewport=(SHOOTER.rows - 1, first, 1, shots),
        )
        self._shooters.share()

    def draw(self, band: int = 0, bands: int = 1) -> None:
        """The light of the batch on the lightmap, or on one of so many bands of it."""
        lightmap = self._lightmap
        self._deliver.draw(
            lightmap.light_target,
            textures=self._seen | lightmap.textures("t_normal_ids", "t_materials", "t_albedo"),
            uniforms={"u_first": 0},
            blocks=self._shooters.blocks,
            blend="add",
            scissor=band_of(self._used, band, bands) or (0, 0, *self._used),
        )

    def keep(self, shots: int) -> None:
        """What of the batch no texel got, on the patches that shot it."""
        lightmap = self._lightmap
        reads = "t_position_area", "t_normal_ids", "t_facets", "t_materials", "t_albedo"
        self._keep.draw(
            lightmap.light_target,
            textures=lightmap.textures(*reads) | {"t_shooters": self._shooters.texture},
            uniforms={"u_size": lightmap.size},
            vertices=4,
            instances=shots,
            blend="add",
            strip=True,
        )

    def resize(self) -> None:
        """For a lightmap that has got another number of slots."""
        self.release()
        self._fit()

    def release(self) -> None:
        targets = self.target, self._tile_target, self._row_target
        textures = (texture for held in (self._seen, self._tiles, self._rows) for texture in held.values())
        self._gpu.release_all(*targets, *textures)
