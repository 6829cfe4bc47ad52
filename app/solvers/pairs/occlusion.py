"""Occlusion is how two texels find whether they see each other: a file for the slot of the passes that ask, and what it reads."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from app.gpu import Gpu, Texture
from app.lightmap.lightmap import Lightmap
from app.visibility.rays import RayScene
from app.visibility.voxels import VoxelScene


@dataclass(frozen=True)
class Occlusion:
    """glsl: defines ``bool seen(int i, vec3 p, vec3 n, int j, vec3 q, vec3 m)``, of texel i at p with normal n, and sender j."""

    glsl: str
    textures: dict[str, Texture] = field(default_factory=dict)
    uniforms: dict[str, Any] = field(default_factory=dict)
    defines: dict[str, object] = field(default_factory=dict)


class Scenes:
    """What a lightmap's scene is to rays and to voxels: made when first asked for. Whoever makes it releases it."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap) -> None:
        self._gpu, self._lightmap = gpu, lightmap
        self._rays: RayScene | None = None
        self._voxels: VoxelScene | None = None

    @property
    def rays(self) -> RayScene:
        """Raises UserError where there are too many triangles."""
        self._rays = self._rays or RayScene(self._gpu, self._lightmap.pool)
        return self._rays

    def occlusion(self, name: str, cells: int) -> Occlusion:
        """By rays, or by voxels, so many along an edge."""
        if name == "rays":
            tables = {n: t for n, t in self.rays.textures.items() if n != "t_bvh_uv"}  # no place of a hit is asked for
            return Occlusion("solvers/pairs/by_rays.glsl", tables, defines=self.rays.defines)
        if self._voxels is None or self._voxels.cells != cells:
            self._drop_voxels()
            self._voxels = VoxelScene(self._gpu, self._lightmap.pool, cells)
        return Occlusion("solvers/pairs/by_voxels.glsl", self._voxels.textures, self._voxels.uniforms)

    def _drop_voxels(self) -> None:
        if self._voxels is not None:
            self._voxels.release()
            self._voxels = None

    def release(self) -> None:
        self._drop_voxels()
        if self._rays is not None:
            self._rays.release()
