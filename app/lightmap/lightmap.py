"""A lightmap is the light on every texel, on the GPU: solvers write it, everything else reads it. textures.py says what is
where."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.gpu import Gpu, Texture, keep, take_over
from app.lightmap.options import STORAGE, LightmapOptions
from app.lightmap.refinement import Refinement
from app.lightmap.textures import LIGHT, LightTextures
from app.lightmap.tile_pool import TilePool
from app.scene.model import F32, F64, Material, Scene
from app.util.state import State, StateError

DEFAULT = LightmapOptions()
_DTYPES = {"f4": np.float32, "f2": np.float16, "f1": np.uint8}


class Lightmap(LightTextures):
    """Texel surfaces, irradiance H and pending exitance r of one scene. It is made without light. Whoever makes it releases it.

    Made from a TilePool, or at once from a scene and its charts. refinement: of its quadtrees, where leaves may come and go.
    """

    def __init__(
        self,
        gpu: Gpu,
        pool: TilePool,
        options: LightmapOptions = DEFAULT,
        *,
        textures: Mapping[str, Texture] | None = None,
    ) -> None:
        """textures: of ``pool.arrays``, where they were made before; they are the lightmap's from now on."""
        super().__init__(gpu, pool, options.storage, textures)
        self._options = options
        self.refinement = Refinement(self, options) if pool.adaptive else None
        self.clear()

    @staticmethod
    def of(gpu: Gpu, scene: Scene, charts: Charts, *, storage: str = "rgba32f") -> Lightmap:
        """With no light yet."""
        return Lightmap(gpu, TilePool(scene, charts), LightmapOptions(storage=storage))

    @property
    def options(self) -> LightmapOptions:
        """How it holds light now."""
        options = self._options if self.refinement is None else self.refinement.options
        return options.replace(storage=self.storage)

    def common_factor(self, materials: tuple[Material, ...]) -> F64:
        """(3,) by which light that is there is scaled for other emissions E': per channel, the median of E'/E, weighted with E A.
        Of all factors a, it leaves least to shoot, min Σ |E' - a E| A. 1 where a channel emits nothing."""
        before, after = (np.array([m.emission for m in ms]) for ms in (self.scene.materials, materials))
        factor = np.ones(3)
        for c in range(3):
            emits = before[:, c] > 0
            ratio, weight = after[emits, c] / before[emits, c], (before * self.pool.emission_weights)[emits, c]
            order = np.argsort(ratio)
            if weight.sum() > 0:
                factor[c] = ratio[order][np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)]
        return factor

    def set_options(self, options: LightmapOptions) -> None:
        """Hold light in another way: leaves follow by and by; with another storage it is undefined, reset the solver then."""
        self._options = options
        if self.refinement is not None:
            self.refinement.set_options(options)
        if options.storage != self.storage:
            self.set_storage(options.storage)

    @property
    def tiles(self) -> int:
        """Leaves."""
        return int(self.pool.used.sum())

    @property
    def texel_count(self) -> int:
        """Texels that cover a surface."""
        return self.pool.texel_count

    def release(self) -> None:
        if self.refinement is not None:
            self.refinement.release()
        super().release()

    # -- kept for later ------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """Light and leaves as they are. Waits for the GPU."""
        state = State({"storage": self.storage, "unit": self.unit, "version": self.version})
        keep(state, **{name: self._textures[name] for name in LIGHT})
        if self.refinement is not None:
            state.put("leaves", self.refinement.state())
        return state

    def restore(self, state: State) -> None:
        """Hold the light and the leaves of a ``state`` of the same scene. Raises StateError; the light is undefined then."""
        if state.values["storage"] != self.storage:
            raise StateError(f"light is held as {state.values['storage']}")
        if self.refinement is not None:
            self.refinement.restore(state.part("leaves"))
        take_over(state, **{name: self._textures[name] for name in LIGHT})
        self.unit, self.version = float(state.values["unit"]), int(state.values["version"])

    # -- read-back -----------------------------------------------------------------------------------------------------

    def irradiance(self, *, ambient: bool = False, whole: bool = True) -> F32:
        """H of every tile (tiles, t, t, 3) f32 [W/m²]; ``ambient``: H + a, with what is still to come, see common/ambient.glsl.
        whole: see ``refresh_ambient``. Waits for the GPU."""
        H = self.light_of(self._textures["t_irradiance"])
        return H + self.ambient(whole=whole) if ambient else H

    def ambient(self, *, whole: bool = True) -> F32:
        """a of every tile (tiles, t, t, 3) f32 [W/m²]. Waits for the GPU."""
        self.refresh_ambient(whole=whole)
        texture = self._textures["t_ambient"]
        if not self.ambient_of_each:  # as common/even_ambient.glsl
            H = self.light_of(self._textures["t_irradiance"])
            alike, over, most = np.frombuffer(texture.read(), np.float32).reshape(3, 4)[:, :3]
            alike, most = alike * np.float32(self.unit), most * np.float32(self.unit)
            return np.asarray(np.maximum(alike + np.clip(over * H, -most, most), -np.abs(H)), np.float32)
        a = self._tiles_of(texture)
        if whole:
            return a[..., :3]
        # as common/ambient.glsl
        since = self.light_of(self._textures["t_irradiance"]).sum(-1) + a[..., 3]
        total = a[..., :3].sum(-1)
        known = (a[..., 3] < 0) & (total != 0)
        share = np.where(known, np.clip(1 - since / np.where(known, total, 1), 0, 1), 1)
        return a[..., :3] * share[..., None].astype(np.float32)

    def residual(self) -> F32:
        """r of every tile (tiles, t, t, 3) f32 [W/m²]. Waits for the GPU."""
        return self.light_of(self._textures["t_residual"])

    def light_at(self, texel: tuple[int, int]) -> tuple[F64, F64]:
        """H and r [W/m²] of one texel (column, row) of the tile pool, RGB. Waits for the GPU."""
        scale = self.unit / (255 if self.storage == "fixed8" else 1)
        dtype = STORAGE[self.storage]
        raw = [self.light_target.read((*texel, 1, 1), 3, attachment=i, dtype=dtype, alignment=1) for i in (0, 1)]
        H, r = (np.frombuffer(data, _DTYPES[dtype]).astype(np.float64) * scale for data in raw)
        return H, r

    def normal_at(self, texel: tuple[int, int]) -> F64:
        """Unit normal of what lies in the middle of one texel (column, row) of the tile pool; up where nothing does."""
        column, row = texel
        tile = self.pool.tile
        slot = row // tile * self.columns + column // tile
        face = int(self.pool.surfaces.face[slot, row % tile, column % tile]) if slot < self.pool.tiles else -1
        if face < 0:
            return np.array([0.0, 1.0, 0.0])
        normal = self.scene.normals_areas[0][self.charts.face_triangle[face]]
        return np.asarray(-normal if self.charts.face_back[face] else normal, np.float64)

    def albedo(self) -> F32:
        """ρ of every texel (tiles, t, t, 3) f32; 0 where nothing is covered."""
        return self._factor([m.albedo for m in self.scene.materials], self.pool.albedo_tiles)

    def emission(self) -> F32:
        """E = πL of every texel (tiles, t, t, 3) f32 [W/m²]."""
        return self._factor([m.emission for m in self.scene.materials], self.pool.emission_tiles) * np.float32(np.pi)

    @property
    def emits(self) -> NDArray[np.bool_]:
        """(tiles, t, t) which texels do."""
        face = self.pool.surfaces.face
        of_face = np.array([m.emits for m in self.scene.materials])[self.scene.material_ids[self.charts.face_triangle]]
        return np.asarray(of_face[face] & (face >= 0))

    def emitted_power(self, slots: NDArray[np.int64]) -> F64:
        """E A of the texels of these slots, summed over RGB (n, t, t) f64 [W]."""
        pool = self.pool
        face, tint = pool.surfaces.face[slots], None if pool.emission_tiles is None else pool.emission_tiles[slots]
        exitance = self._factor([m.emission for m in self.scene.materials], tint, face) * np.float32(np.pi)
        return np.asarray(exitance.sum(-1, dtype=np.float64) * pool.surfaces.area[slots])

    def radiosity(self) -> F32:
        """B = E + ρH of every texel (tiles, t, t, 3) f32 [W/m²]. Waits for the GPU."""
        return self.emission() + self.albedo() * self.irradiance()

    def light_of(self, texture: Texture) -> F32:
        """What an RGBA texture of the tile pool holds in stored units, of every tile (tiles, t, t, 3) f32 [W/m²]. Waits for the
        GPU."""
        return self._tiles_of(texture)[..., :3]

    def _tiles_of(self, texture: Texture) -> F32:
        """The same with alpha."""
        raw = np.frombuffer(texture.read(), _DTYPES[texture.dtype]).reshape(*self.size[::-1], 4)
        scale = self.unit / (255 if texture.dtype == "f1" else 1)
        return self.pool.tiles_from_image(raw).astype(np.float32) * np.float32(scale)

    def _factor(
        self, factors: list[tuple[float, float, float]], colours: F32 | None, face: NDArray[np.int32] | None = None
    ) -> F32:
        """Of texels with these faces, by default of all; colours: of their textures."""
        face = self.pool.surfaces.face if face is None else face
        material = self.scene.material_ids[self.charts.face_triangle[face]]
        out = np.where((face >= 0)[..., None], np.array(factors, np.float32)[material], np.float32(0))
        return out if colours is None else out * colours
