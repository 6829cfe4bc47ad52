"""The textures of a lightmap hold, on the GPU, what lies where in the tile pool, and the light of its texels.

Tile pool textures hold the leaf tiles of t×t texels side by side [Coombe03, 4.2]:

    t_position_area  RGBA32F  centroid p (solver space), area A (solver space; 0 = nothing here)
    t_normal_ids     RG32UI   unit normal (octahedral, 2×snorm16), facet << MATERIAL_BITS | material (facet from 1)
    t_irradiance     storage  H [W/m²]: light received so far, so that radiosity B = E + ρH at any ρ, also 0
    t_residual       storage  r [W/m²]: exitance that is still pending, where a solver has such a term: not yet shot
    t_ambient        RGBA32F  a: what the rest of the solve will about add to H, and pictures and bakes show with it; an even one
                              of 3×1 for all, see common/even_ambient.glsl, unless it is known of each
    t_albedo, t_emission      only where a material has such a texture: the factor is in the material table

and tables: t_pages and t_leaves (where a place of the virtual atlas is in the tile pool, and what its slots hold), t_facets,
t_materials.
The solver space is centred on the scene and scaled by its half diagonal, so answers do not depend on unit or origin. H and r
are stored relative to the largest exitance, which keeps half floats in range and is what 8-bit fixed point needs. Where a solver
sums them, the a of H holds Σ P F V, the power that a texel got, and the a of r what it would have got without occluders, Σ P F.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from app.gpu import Framebuffer, Gpu, Mesh, Pass, Texture
from app.lightmap.options import STORAGE
from app.lightmap.tile_pool import Array, Moves, SolverSpace, TilePool
from app.scene.lights import Light
from app.scene.model import F32, F64, Material
from app.scene.sky import Sky

LOOKED_AT = 8192  # texels, to find what lamps without area give at most
LIGHT = ("t_irradiance", "t_residual")
EVEN_AMBIENT = (3, 1)  # size of an ambient term for all texels
FORESEEN_EDGE = 4
NEAREST = (5, 6, 9, 10, 1, 2, 4, 7, 8, 11, 13, 14, 0, 3, 12, 15)  # texels of such a block, row by row, from its middle
QUAD_FORMAT = {"in_rect": "4f", "in_from": "2f"}  # see common/rects.vert.glsl
BYTES = {"f4": 4, "u4": 4, "f2": 2, "f1": 1}


class LightTextures:
    """The textures, and targets that draw into them.

    columns, rows: of the tile pool in tiles; size: in texels; unit: W/m² per stored unit of H and r; version: counts changes of
    the leaves; ambients: counts ambient terms that took the place of quite another one, of all texels at once. ambient_of: of a
    solver that makes an ambient term, see ``refresh_ambient``; foresee: shows the irradiance of each block of FORESEEN_EDGE
    texels along an edge [stored units], a texture, as what is to come until that solver knows better.
    """

    def __init__(self, gpu: Gpu, pool: TilePool, storage: str, textures: Mapping[str, Texture] | None) -> None:
        """textures: of ``pool.arrays``, where they were made before; they are these from now on."""
        self.gpu, self.pool, self.scene, self.charts = gpu, pool, pool.scene, pool.charts
        self.space: SolverSpace = pool.space
        self._textures = dict(textures or {name: upload(gpu, array) for name, array in pool.arrays.items()})
        self._emit = Pass(gpu, "lightmap/emit", defines=self.defines("MATERIAL_BITS", "EMISSION_TEXTURE"))
        self._textures["t_ambient"] = gpu.texture(EVEN_AMBIENT, 4, "f4")
        self.ambient_target = gpu.target(self._textures["t_ambient"])
        self.ambient_of: Callable[[bool, bool], None] | None = None
        self.foresee: Callable[[Texture], None] | None = None
        self.version = self.ambients = 0
        self._targets: list[Framebuffer] = []
        self.set_storage(storage)

    # -- what passes bind ----------------------------------------------------------------------------------------------

    def defines(self, *names: str) -> dict[str, object]:
        """Those shader defines that follow from the scene: look-ups exist only where a texture does."""
        values: dict[str, object] = {
            "TILE": self.pool.tile,
            "MATERIAL_BITS": self.pool.material_bits,
            "ALBEDO_TEXTURE": "t_albedo" in self._textures,
            "EMISSION_TEXTURE": "t_emission" in self._textures,
        }
        return {name: values[name] for name in names}

    def texture(self, name: str) -> Texture:
        return self._textures[name]

    def textures(self, *names: str) -> dict[str, Texture]:
        """The named textures, to bind; ``t_albedo`` and ``t_emission`` are left out where the scene has none."""
        optional = {"t_albedo", "t_emission"}
        return {n: self._textures[n] for n in names if n in self._textures or n not in optional}

    def refresh_ambient(self, *, whole: bool = True, wait: bool = False) -> None:
        """Have the ambient term of the light as it is, before it is read; if not ``whole``, as much of it as a frame has time
        for. wait: also for what is first made in the background."""
        if self.ambient_of is not None:
            self.ambient_of(whole, wait)

    def hold_ambient(self, *, of_each: bool = True) -> None:
        """Have an ambient term of each texel from now on, or an even one: none yet where it was the other. Raises GpuError; that
        of before stays then."""
        if of_each != self.ambient_of_each:
            self.take_ambient(*self.make_ambient(of_each=of_each))

    def make_ambient(self, *, of_each: bool = True) -> tuple[Texture, Framebuffer]:
        """An ambient term to be taken later, none yet. Raises GpuError."""
        texture = self.gpu.texture(self.size if of_each else EVEN_AMBIENT, 4, "f4")
        target = self.gpu.target(texture)
        target.clear()
        return texture, target

    def take_ambient(self, texture: Texture, target: Framebuffer) -> None:
        """Have this ambient term from now on, the lightmap's own."""
        self.gpu.release_all(self.ambient_target, self._textures["t_ambient"])
        self._textures["t_ambient"], self.ambient_target = texture, target

    @property
    def ambient_of_each(self) -> bool:
        """Whether the ambient term is one of each texel."""
        return self._textures["t_ambient"].size != EVEN_AMBIENT

    @property
    def light_target(self) -> Framebuffer:
        """Attachment 0: irradiance, 1: residual."""
        return self._targets[0]

    @property
    def residual_target(self) -> Framebuffer:
        return self._targets[1]

    # -- light ---------------------------------------------------------------------------------------------------------

    def set_storage(self, storage: str) -> None:
        """Choose how H and r are stored (a key of STORAGE). What they hold then is undefined: clear."""
        self.gpu.release_all(*self._targets, *(self._textures.pop(name) for name in LIGHT if name in self._textures))
        self.storage = storage
        for name in LIGHT:
            self._textures[name] = self.gpu.texture(self.size, 4, STORAGE[self.storage])
        self._make_targets()

    def _make_targets(self) -> None:
        irradiance, residual = self._textures["t_irradiance"], self._textures["t_residual"]
        self._targets = [self.gpu.target(irradiance, residual), self.gpu.target(residual)]
        self._targets[1].color_mask = (True, True, True, False)  # of alpha, see receive.frag.glsl

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        """Use other albedos and emissions (factors; textures stay) from now on. The light stays as it is: clear, or edit."""
        self.scene = self.scene.with_materials(materials)
        self._textures["t_materials"].write(self.pool.material_table(self.scene).tobytes())

    def set_sky(self, sky: Sky | None) -> None:
        """Have another sky from now on. The light stays as it is."""
        self.scene = self.scene.with_sky(sky)

    def set_lights(self, lights: tuple[Light, ...]) -> None:
        """Have other lamps without area from now on. The light stays as it is."""
        self.scene = self.scene.with_lights(lights)

    def clear(self) -> None:
        """H = 0, r = E: nothing has been shot [Coombe03, 3]."""
        strongest = max((np.pi * max(m.emission) for m in self.scene.materials), default=0.0)
        if self.scene.sky is not None:
            strongest = max(strongest, self.scene.sky.most_irradiance)
        self.unit = max(strongest, self._strongest_light) or 1.0
        self.light_target.clear()
        self.ambient_target.clear()
        self._emit.draw(
            self.residual_target,
            textures=self.textures("t_position_area", "t_normal_ids", "t_materials", "t_emission"),
            uniforms={"u_unit": self.unit},
        )

    @property
    def _strongest_light(self) -> float:
        """About the most that a texel receives of one lamp without area, in any colour [W/m²], as some of them say: of a point at
        most half of what it sends out, over the texel's area."""
        lights = [light for light in self.scene.lights if light.emits]
        if not lights:
            return 0.0
        surfaces = self.pool.surfaces
        some = np.flatnonzero(surfaces.area.ravel() > 0)
        some = some[:: max(len(some) // LOOKED_AT, 1)]
        position, normal = (of.reshape(-1, 3)[some].astype(np.float64) for of in (surfaces.position, surfaces.normal))
        most = 2 * np.pi / surfaces.area.ravel()[some]
        return max(
            float(np.minimum(light.irradiance(position, normal).max(1), max(light.intensity) * most).max())
            if not light.from_afar
            else max(light.intensity)
            for light in lights
        )

    @property
    def emitted(self) -> F64:
        """Power that the scene's surfaces send out, RGB [W]: Σ E A."""
        weights = self.pool.emission_weights
        return np.asarray(np.pi * (np.array([m.emission for m in self.scene.materials]) * weights).sum(0))

    @property
    def sent_by_points(self) -> F64:
        """Power that point and spot lights send out, RGB [W]."""
        return np.asarray(sum((light.flux for light in self.scene.lights if not light.from_afar), np.zeros(3)))

    # -- leaves that come and go ---------------------------------------------------------------------------------------

    def write_tiles(self, slots: NDArray[np.int64]) -> None:
        """Take over these slots of the tile pool, and the tables that follow. Their light stays as it is."""
        edge = self.pool.tile
        for name, tiles in self.pool.tile_arrays(slots).items():
            texture = self._textures[name]
            for slot, tile in zip(slots.tolist(), tiles, strict=True):
                texture.write(np.ascontiguousarray(tile).tobytes(), viewport=(*self.pool.corner(slot), edge, edge))
        self._follow(slots)

    def _follow(self, slots: NDArray[np.int64]) -> None:
        """Take over what follows from the leaves; other ones than before are in these slots."""
        tables = self._textures
        tables["t_leaves"] = write_table(self.gpu, tables["t_leaves"], self.pool.slot_tables["t_leaves"])
        tables["t_pages"] = write_pages(self.gpu, tables["t_pages"], self.pool, slots)
        self.version += 1

    def resize(self, moves: Moves) -> None:
        """Take over a tile pool that has got another number of slots. The light goes with its leaves."""
        self.gpu.release_all(*self._targets)
        of_each = self.ambient_of_each
        for name in (*self.pool.tile_arrays(np.empty(0, np.int64)), *LIGHT, *(["t_ambient"] if of_each else [])):
            self._textures[name] = self.moved(self._textures[name], moves)
        self._make_targets()
        if of_each:
            self.gpu.release_all(self.ambient_target)
            self.ambient_target = self.gpu.target(self._textures["t_ambient"])
        self._follow(moves.new)

    def moved(self, texture: Texture, moves: Moves) -> Texture:
        """With the texels of all leaves where they are now, and nothing in new slots, in place of the texture."""
        pool, kind = self.pool, {"INTEGER": texture.dtype == "u4"}
        empty = bytes(self.size[0] * self.size[1] * texture.components * BYTES[texture.dtype])
        fresh = self.gpu.texture(self.size, texture.components, texture.dtype, empty)
        target = self.gpu.target(fresh)
        whole, rest = (pool.tile * part for part in divmod(moves.staying, pool.columns))  # rows, and a part of one
        staying = [(0, 0, self.size[0], whole, 0, 0), (0, whole, rest, pool.tile, 0, whole)]
        moved = quads(pool.corners(moves.new), pool.tile, pool.corners(moves.old))
        rects = np.concatenate([np.array(staying, np.float32), moved])
        mesh = Mesh(self.gpu, rects.tobytes(), QUAD_FORMAT, per_instance=True)
        Pass(self.gpu, "lightmap/move", defines=kind, vertex="common/rects").draw(
            target, textures={"t_source": texture}, uniforms={"u_size": self.size}, mesh=mesh
        )
        self.gpu.release_all(target, mesh, texture)
        return fresh

    @property
    def columns(self) -> int:
        return self.pool.columns

    @property
    def rows(self) -> int:
        return self.pool.rows

    @property
    def size(self) -> tuple[int, int]:
        return self.pool.size

    @property
    def memory(self) -> dict[str, int]:
        """Bytes on the GPU, by texture."""
        return {n: t.width * t.height * t.components * BYTES[t.dtype] for n, t in self._textures.items()}

    def release(self) -> None:
        self.gpu.release_all(*self._targets, self.ambient_target, *self._textures.values())


def upload(gpu: Gpu, array: Array) -> Texture:
    """(height, width, components) as a texture of the same type."""
    height, width, components = array.shape
    dtype = {"float32": "f4", "float16": "f2", "uint32": "u4"}[array.dtype.name]
    return gpu.texture((width, height), components, dtype, np.ascontiguousarray(array))


def write_table(gpu: Gpu, texture: Texture, table: Array) -> Texture:
    """The table (height, width, components) in place of what the texture holds: the same texture, or another of its size."""
    if texture.size != table.shape[1::-1]:
        gpu.release_all(texture)
        return upload(gpu, table)
    texture.write(np.ascontiguousarray(table).tobytes())
    return texture


def write_pages(gpu: Gpu, texture: Texture, pool: TilePool, slots: NDArray[np.int64]) -> Texture:
    """The page table after leaves came into these slots: the same texture, or another where pages are of another level now."""
    pages = pool.slot_tables["t_pages"]
    if texture.size != pages.shape[1::-1]:
        return write_table(gpu, texture, pages)
    for rect, block in pool.page_blocks(slots):
        texture.write(block.tobytes(), viewport=rect)
    return texture


def quads(corner: NDArray[np.int64], edge: int, source: NDArray[np.int64]) -> F32:
    """(n, 6) f32 instances of QUAD_FORMAT: squares at ``corner`` (n, 2) that come from ``source`` (n, 2) [texels]."""
    return np.column_stack([corner, np.full((len(corner), 2), edge), source]).astype(np.float32)
