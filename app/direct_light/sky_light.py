"""Direct light of the sky: shadow rays to where no surface is, chosen by the cosine and by the sky's own light [Veach95].

    H = U(n) Σ_k w_k V_k / Σ_k w_k,    w_k = L(ω_k) cos θ_k / p(ω_k),    p = c cos θ / π + (1 - c) p_sky(ω)

With U, what the normal would receive unoccluded, beside it there is noise only where something stands before the sky.
"""

from __future__ import annotations

from app.direct_light.lit import Draw, Kind, Lit
from app.direct_light.sky_map import irradiance_table, is_even, sky_textures
from app.gpu import Gpu, Pass, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import upload
from app.scene.model import Scene
from app.scene.sky import Sky
from app.visibility.origins import Origins

BY_COSINE = 0.5  # share of directions that are chosen by the cosine alone; all under a sky that is even


class SkyLight(Kind[Sky]):
    """The one set is the sky without its sun. gathered: its light as rays have gathered it, to be smoothed."""

    name = "sky"

    def __init__(self, gpu: Gpu, lightmap: Lightmap, rays: dict[str, object], origins: Origins) -> None:
        super().__init__(gpu, lightmap, rays, origins)
        self._shoot = Pass(gpu, "direct_light/sky_rays", defines=self.read_by_rays, vertex="common/rects")
        reads = lightmap.defines("MATERIAL_BITS", "TILE")
        self._add, self._gathered = (
            Pass(gpu, "direct_light/sky_light", defines={"GATHERED": gathered} | reads, vertex="common/rects")
            for gathered in (False, True)
        )

    def reads(self, of: Sky) -> dict[str, Texture]:
        unoccluded = upload(self.gpu, irradiance_table(of))
        unoccluded.filter = (self.gpu.ctx.LINEAR, self.gpu.ctx.LINEAR)
        return sky_textures(self.gpu, of) | {"t_unoccluded": unoccluded}

    def wanted(self, scene: Scene, known: list[Sky]) -> list[Sky]:
        return [scene.sky] if scene.sky is not None and scene.lit_by_sky and scene.sky.shines else []

    def same(self, known: Sky, wanted: Sky) -> bool:
        """Whether they are the same sky, but for its scale."""
        return known.same_shape(wanted)

    def emits(self, of: Sky, scene: Scene) -> bool:
        return True

    def place(self, of: Sky, scene: Scene) -> list[int]:
        return []

    def at(self, place: list[int], scene: Scene) -> Sky:
        if scene.sky is None:
            raise LookupError("there is no sky")
        return scene.sky

    def from_afar(self, of: Sky) -> bool | None:
        return True

    def shooting(self, lit: Lit[Sky]) -> Draw:
        textures = {name: texture for name, texture in lit.reads.items() if name != "t_unoccluded"}
        return Draw(self._shoot, textures, {"u_by_cosine": 1.0 if is_even(lit.of) else BY_COSINE})

    def adding(self, lit: Lit[Sky], scene: Scene) -> Draw:
        textures = {"t_seen": lit.found["seen"], "t_all": lit.found["all"], "t_origin_normal": self.origins.normals}
        textures["t_unoccluded"] = lit.reads["t_unoccluded"]
        return Draw(self._add, textures, {"u_scale": tuple((lit.of.scale / self.lightmap.unit).tolist())})

    def gathering(self, lit: Lit[Sky], scene: Scene) -> Draw:
        """How that light is added as rays to the sky have gathered it."""
        return self.adding(lit, scene)._replace(how=self._gathered)


__all__ = ["SkyLight"]
