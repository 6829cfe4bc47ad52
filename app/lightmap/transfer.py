"""Light moves with the leaves of a lightmap: it is pushed down to children and pulled up to parents [Coombe03, 4.2]."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from app.gpu import Framebuffer, Gpu, Mesh, Pass, Texture
from app.lightmap.quadtree import Change
from app.lightmap.textures import QUAD_FORMAT, LightTextures, quads
from app.scene.model import F32

LIFTED_COLUMNS = 32  # tiles side by side among those that are lifted


class LightTransfer:
    """The passes that push and pull the light of one lightmap."""

    def __init__(self, gpu: Gpu, lightmap: LightTextures) -> None:
        self._gpu, self._lightmap = gpu, lightmap
        names = ("MATERIAL_BITS", "ALBEDO_TEXTURE", "EMISSION_TEXTURE")
        self._lift, self._push, self._pull = (
            Pass(gpu, f"lightmap/{name}", defines=lightmap.defines(*names, *more), vertex="common/rects")
            for name, *more in (("lift",), ("push", "TILE"), ("pull",))
        )

    def apply(self, change: Change, carried: Sequence[tuple[Texture, Framebuffer]] = ()) -> None:
        """Bring the lightmap's textures up to date with its tile pool, where ``change`` has just been made; and other light on
        the same texels that is ``carried`` along, as H is."""
        gpu, lightmap, split = self._gpu, self._lightmap, change.split
        tile, half = lightmap.pool.tile, lightmap.pool.tile // 2
        old, new = (change.parents, change.children) if split else (change.children, change.parents)
        lifted, nth = np.unique(old, return_inverse=True)
        rows = -(-len(lifted) // LIFTED_COLUMNS)
        size = (LIFTED_COLUMNS * tile, rows * tile)
        place = np.arange(len(lifted))
        aside = np.stack([place % LIFTED_COLUMNS, place // LIFTED_COLUMNS], 1) * tile
        out = quads(aside, tile, lightmap.pool.corners(lifted))
        if split:
            into, how = quads(lightmap.pool.corners(new), tile, aside[nth] + change.corner * half), self._push
        else:
            into, how = quads(lightmap.pool.corners(new) + change.corner * half, half, aside[nth]), self._pull
        lights = [(lightmap.texture("t_irradiance"), lightmap.light_target), *carried]
        copies = []
        for light, _ in lights:
            copy = [gpu.texture(size, 4, "f4"), gpu.texture(size, 4, "f4"), gpu.texture(size, 1, "f4")]
            target = gpu.target(*copy)
            self._draw(
                self._lift, target, out, lightmap.textures("t_position_area", "t_residual") | {"t_irradiance": light}
            )
            gpu.release_all(target)
            copies.append(copy)
        lightmap.write_tiles(np.unique(np.concatenate([old, new])))
        for (_, target), copy in zip(lights, copies, strict=True):
            names = ("t_lifted_irradiance", "t_lifted_kept", "t_lifted_area")
            textures = dict(zip(names, copy, strict=True))
            self._draw(how, target, into, textures | (lightmap.textures("t_position_area") if split else {}))
            gpu.release_all(*copy)

    def _draw(self, how: Pass, target: Framebuffer, rects: F32, textures: dict[str, Texture]) -> None:
        mesh = Mesh(self._gpu, rects.tobytes(), QUAD_FORMAT, per_instance=True)
        materials = self._lightmap.textures("t_normal_ids", "t_materials", "t_albedo", "t_emission")
        uniforms = {"u_size": target.size, "u_unit": self._lightmap.unit}
        uniforms |= {"u_signed": self._lightmap.storage != "fixed8"}
        how.draw(target, textures=textures | materials, uniforms=uniforms, mesh=mesh)
        self._gpu.release_all(mesh)
