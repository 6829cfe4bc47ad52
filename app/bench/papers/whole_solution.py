"""The whole solution is the light of all patches of a world, along the rays that a local set takes its form factors from.

    H = D + F ρ H

F has all patches in it, those that the observer never comes near too, and D is the direct light that the local solver has found:
what its light differs by from this comes of being local.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from app.errors import UserError
from app.gpu import Gpu, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.textures import upload
from app.render.exposure import exposure_of
from app.render.seen import seen_texels
from app.scene.model import F64
from app.solvers.local.patches import Patches
from app.solvers.local.solver import Local
from app.util.parts import run_to_end

I64 = NDArray[np.int64]
CHANGE = 1e-4  # of all light in one bounce, after which no further bounce is taken
MOST_BOUNCES = 200


@dataclass(frozen=True, eq=False)
class WholeSolution:
    """The light of each texel in order (texels, 3) [W/m²] is of all reflections. exposure: for pictures of it [EV]; factors: that
    F has."""

    direct: F64
    indirect: F64
    exposure: float
    factors: int

    @property
    def total(self) -> F64:
        return self.direct + self.indirect


def find_direct(made: Local) -> None:
    """Send all shadow rays, so that direct light is the same from the first step on."""
    for _ in made.direct.catch_up(made.options.shadow_rays):
        pass
    made.direct.sum(made.lightmap.scene)
    made.gpu.ctx.finish()


_solved: list[WholeSolution] = []  # the last one: rows of a table ask for the same


def whole_solution(made: Local) -> WholeSolution:
    """The whole solution of the direct light that there is; where it was not known yet it is written to the lightmap, and left
    there. Raises UserError where patches are squares of several texels."""
    direct = direct_light(made)
    if not (_solved and np.array_equal(_solved[0].direct, direct)):
        _solved[:] = [_solve(made, direct)]
    return _solved[0]


def _solve(made: Local, direct: F64) -> WholeSolution:
    patches, lightmap = made.patches, made.lightmap
    nodes = np.arange(patches.count)
    if not np.array_equal(patches.start[nodes], np.arange(len(patches.order))):
        raise UserError("the whole solution is of patches of one texel each")
    F = all_factors(made, nodes)
    albedo = patches.albedo(lightmap.scene.materials, lightmap.scene.material_ids, lightmap.charts.face_triangle)[nodes]
    indirect = reflected(F, albedo, direct)
    write_light(lightmap, patches, direct + indirect)
    camera = lightmap.scene.cameras[0]
    seen = seen_texels(lightmap.pool, camera.world_from_camera, camera.yfov)
    return WholeSolution(direct, indirect, exposure_of(lightmap, seen, np.zeros(3)), F.nnz)


def all_factors(made: Local, nodes: I64) -> csr_array[np.float64]:
    """The form factors F (n, n) of all patches are that of a local set which has them all."""
    missing = nodes[~made.rows.has(nodes)]
    run_to_end(made.rows.make(missing, nodes))
    made.rows.save()
    F, hit = made.set.among(nodes)
    diagonal = hit - F.sum(1)
    own = csr_array((diagonal, nodes, np.arange(len(nodes) + 1)), shape=F.shape)
    return csr_array(F + own)


def reflected(F: csr_array[np.float64], albedo: F64, direct: F64) -> F64:
    """The indirect light (n, 3) is summed bounce by bounce until one changes all light by no more than CHANGE."""
    indirect = np.zeros_like(direct)
    for _ in range(MOST_BOUNCES):
        before, indirect = indirect, np.asarray(F @ (albedo * (direct + indirect)))
        if np.abs(indirect - before).sum() <= CHANGE * (direct + indirect).sum():
            return indirect
    raise UserError(f"the whole solution has not come to rest after {MOST_BOUNCES} bounces")


# -- light of texels ---------------------------------------------------------------------------------------------------


def direct_light(made: Local) -> F64:
    """The direct light is read as (texels, 3) in order [W/m²]. Waits for the GPU."""
    raw = np.frombuffer(made.direct.light.read(), np.float32).reshape(*made.lightmap.size[::-1], 4)
    return in_order(made.patches, raw[..., :3]) * made.lightmap.unit


def shown_light(made: Local) -> F64:
    """The light of the lightmap is read as (texels, 3) in order [W/m²]. Waits for the GPU."""
    lightmap = made.lightmap
    return in_order(made.patches, lightmap.pool.image_from_tiles(lightmap.irradiance()))


def in_order(patches: Patches, image: NDArray[Any]) -> F64:
    """The texels (texels, 3) of an image of the tile pool are put in order."""
    return np.asarray(image[patches.order >> 16, patches.order & 0xFFFF, :3], np.float64)


def image_of(lightmap: Lightmap, patches: Patches, light: F64) -> NDArray[np.float32]:
    """Light (texels, 3) in order is put in its places in an image of the tile pool (height, width, 4)."""
    image = np.zeros((*lightmap.size[::-1], 4), np.float32)
    image[patches.order >> 16, patches.order & 0xFFFF, :3] = light
    return image


def write_light(lightmap: Lightmap, patches: Patches, light: F64) -> None:
    """Let the lightmap have this light (texels, 3) in order [W/m²]."""
    texture = lightmap.texture("t_irradiance")
    dtype = np.float16 if texture.dtype == "f2" else np.float32
    texture.write(image_of(lightmap, patches, light / lightmap.unit).astype(dtype).tobytes())


def texture_of(gpu: Gpu, made: Local, light: F64) -> Texture:
    """Light (texels, 3) in order becomes a texture of the tile pool. Whoever asks releases it."""
    return upload(gpu, image_of(made.lightmap, made.patches, light))
