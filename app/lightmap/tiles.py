"""Tiles are leaves with their texels, cut from the scene's charts, whatever their level."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.materials import texel_colours, texel_opacity
from app.atlas.texels import Leaves, TexelSurfaces
from app.lightmap.surfaces import surfaces_of
from app.scene.model import F32, Scene

# Of a texel that is a hole all over, the share that counts as there: it holds light for pictures, which interpolate between
# texels, and none that counts in any sum.
LEAST_THERE = 1e-4


@dataclass(frozen=True, eq=False)
class Tiles:
    """n leaves, the surfaces of their texels, whose areas are what is there of them, and their albedo and emission textures
    (n, t, t, 3), None where no material has one."""

    leaves: Leaves
    surfaces: TexelSurfaces
    albedo: F32 | None
    emission: F32 | None

    def __len__(self) -> int:
        return len(self.leaves)

    @staticmethod
    def cut(
        scene: Scene,
        charts: Charts,
        leaves: Leaves,
        faces: NDArray[np.int64] | None = None,
        report: Callable[[float], None] | None = None,
    ) -> Tiles:
        """The texels of ``leaves``; faces: those that may meet them, else all are tried. report: as of ``texel_surfaces``."""
        some = charts if faces is None else charts.with_faces(faces)
        surfaces = surfaces_of(scene, some, leaves, report)
        albedo, emission = texel_colours(scene, some, leaves, surfaces)
        opacity = texel_opacity(scene, some, leaves, surfaces)
        if opacity is not None:
            surfaces = dataclasses.replace(surfaces, area=surfaces.area * np.maximum(opacity, LEAST_THERE))
        if faces is not None:
            face = np.where(surfaces.face >= 0, faces[surfaces.face], -1).astype(np.int32)
            surfaces = dataclasses.replace(surfaces, face=face)
        return Tiles(leaves, surfaces, albedo, emission)

    def only(self, which: slice | NDArray[np.bool_] | NDArray[np.int64]) -> Tiles:
        """Those of the tiles."""
        return Tiles(
            self.leaves.only(which),
            TexelSurfaces(**{f.name: getattr(self.surfaces, f.name)[which] for f in dataclasses.fields(TexelSurfaces)}),
            None if self.albedo is None else self.albedo[which],
            None if self.emission is None else self.emission[which],
        )
