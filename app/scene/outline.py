"""What a scene holds, in numbers: of a Scene exactly, of a large file that is not read as one about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from app.scene.lights import Light
from app.scene.model import F64, Material, Scene


@dataclass(frozen=True, eq=False)
class Outline:
    """Counts, and of all sides that may be lit the area [m²]; texel_area: the same, each times the square of its material's
    ``lightmap_scale``; a box around everything, lower and upper corner [m]; textures: of albedo and of emission, 0 to 2.

    exact: else triangles without area and those that are listed twice are counted too, and the box is around boxes.
    """

    name: str
    triangles: int
    sides: int
    area: float
    texel_area: float
    lower: F64
    upper: F64
    objects: int
    materials: int
    emitting_materials: int
    textures: int
    lights: tuple[Light, ...]
    cameras: tuple[str, ...]
    sky: str | None
    warnings: tuple[str, ...]
    exact: bool

    @staticmethod
    def of(scene: Scene) -> Outline:
        sides = 1 + scene.sides.astype(np.int64)
        area = scene.normals_areas[1] * sides
        scale = np.array([m.lightmap_scale for m in scene.materials])[scene.material_ids]
        lower, upper = scene.bounds
        return Outline(
            name=scene.name,
            triangles=len(scene.triangles),
            sides=int(sides.sum()),
            area=float(area.sum()),
            texel_area=float((area * scale**2).sum()),
            lower=lower,
            upper=upper,
            objects=len(scene.objects),
            materials=len(scene.materials),
            emitting_materials=sum(m.emits for m in scene.materials),
            textures=colour_textures(scene.materials, coloured=scene.colours is not None),
            lights=scene.lights,
            cameras=tuple(c.name for c in scene.cameras),
            sky=None if scene.sky is None else scene.sky.kind,
            warnings=scene.warnings,
            exact=True,
        )


def colour_textures(materials: Sequence[Material], *, coloured: bool) -> int:
    """Colour textures that texels need: of albedo, also where there are colours of vertices, and of emission."""
    albedo = coloured or any(m.albedo_texture is not None for m in materials)
    emission = any(m.emission_texture is not None and m.emits for m in materials)
    return int(albedo) + int(emission)
