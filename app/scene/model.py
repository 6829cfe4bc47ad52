"""The scene as plain data: triangles, materials, cameras. No GL, no files.

Lengths are metres in a world with +y up. Colours are linear Rec.709. Emission is radiance L [W/(sr m²)], as in glTF;
a diffuse emitter's exitance is πL [W/m²].
"""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.scene.lights import Light
from app.scene.sky import Sky

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
RGB = tuple[float, float, float]

MOST_ALBEDO = 0.99  # of the whitest diffuser that is made, sintered PTFE; in a closed room of albedo 1 light never ends
SCALES = (1 / 16, 16.0)  # of texels along a metre, that a material may have more or fewer than others


@dataclass(frozen=True, eq=False)
class Texture:
    """An image as a material uses it.

    pixels: (h, w, 3) f32, linear Rec.709, of an opacity (h, w, 1); row 0 at the top, v = 0 at the top (glTF).
    wrap: one of ``repeat``, ``mirror``, ``clamp`` for u and v.
    uv_transform: (2, 3) f64, applied to the vertex UVs before the look-up (KHR_texture_transform).
    """

    name: str
    pixels: F32
    wrap: tuple[str, str] = ("repeat", "repeat")
    bilinear: bool = True
    texcoord: int = 0
    uv_transform: F64 = field(default_factory=lambda: np.eye(2, 3))


@dataclass(frozen=True, eq=False)
class Material:
    """A diffuse surface. A texture multiplies its factor; ``double_sided`` reflects and emits on both sides.

    Opacity is the share of the surface that is there, the rest lets light pass. With a cutoff the surface is all there where its
    opacity reaches that, and a hole elsewhere.
    """

    name: str
    albedo: RGB = (0.5, 0.5, 0.5)  # ρ [-], each in [0, 1]
    emission: RGB = (0.0, 0.0, 0.0)  # L [W/(sr m²)], each >= 0
    albedo_texture: Texture | None = None
    emission_texture: Texture | None = None
    double_sided: bool = False
    opacity: float = 1.0  # [-], in [0, 1]
    opacity_texture: Texture | None = None
    opacity_cutoff: float | None = None
    gltf: tuple[Path, int] | None = (
        None  # the file of a mesh, and its material there, whose roughness and maps a bake keeps
    )
    lightmap_scale: float = 1.0  # texels along a metre of it, over those along a metre of others, in SCALES

    @property
    def opaque(self) -> bool:
        """Whether no light passes anywhere; ``validate`` drops textures and cutoffs that let none pass."""
        return self.opacity >= 1.0 and self.opacity_texture is None

    @property
    def blended(self) -> bool:
        """Whether light passes by a share, and not where it is cut out."""
        return not self.opaque and self.opacity_cutoff is None

    @property
    def textures(self) -> list[Texture]:
        return [t for t in (self.albedo_texture, self.emission_texture, self.opacity_texture) if t is not None]

    @property
    def emits(self) -> bool:
        return max(self.emission) > 0.0


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole. ``world_from_camera`` is (4, 4) f64, rigid, looking along -z with +y up; yfov in radians."""

    name: str
    world_from_camera: F64
    yfov: float


@dataclass(frozen=True, eq=False)
class Scene:
    """What every loader makes and everything else reads.

    positions (n, 3) f64, triangles (m, 3) i32 counter-clockwise from the front, material_ids and object_ids (m,) i32
    into ``materials`` and ``objects`` (names). Per corner, where the file has them: uv0, uv1 (m, 3, 2) f32 with v = 0
    at the top, normals (m, 3, 3) f32 unit (kept for export; light transport uses geometric normals), colours (m, 3, 3)
    f32, linear Rec.709, in [0, 1], which multiply the albedo. What of the light is reflected is nowhere above MOST_ALBEDO.
    listed (m,) i32: the number of the triangle in its file that each is, or is a piece of, among all that the loader lists; -1
    for those that no file has. world_from_file (4, 4): from the file's axes and unit.
    ``warnings`` are one-line counted repairs and omissions. sky: what is seen where no surface is; None is black. lights: lamps
    without area. exposure: EV by which its picture is brighter than automatic exposure has it. Every value is finite, every index
    in range, every triangle has an area: ``validate`` guarantees it.
    """

    name: str
    positions: F64
    triangles: I32
    material_ids: I32
    object_ids: I32
    objects: tuple[str, ...]
    materials: tuple[Material, ...]
    cameras: tuple[Camera, ...] = ()
    uv0: F32 | None = None
    uv1: F32 | None = None
    normals: F32 | None = None
    colours: F32 | None = None
    listed: I32 | None = None
    world_from_file: F64 = field(default_factory=lambda: np.eye(4))
    warnings: tuple[str, ...] = ()
    source: Path | None = None
    sky: Sky | None = None
    lights: tuple[Light, ...] = ()
    exposure: float = 0.0

    @functools.cached_property
    def corners(self) -> F64:
        """(m, 3, 3) f64: the corner positions of each triangle."""
        return self.positions.take(self.triangles, axis=0)

    @functools.cached_property
    def normals_areas(self) -> tuple[F64, F64]:
        """Unit geometric normals (m, 3) and areas (m,) [m²] of the triangles."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        cross = np.cross(b - a, c - a)
        length = np.linalg.norm(cross, axis=1)
        return cross / length[:, None], length / 2

    @functools.cached_property
    def used(self) -> NDArray[np.bool_]:
        """(n,) which of the positions are corners of triangles."""
        used = np.zeros(len(self.positions), bool)
        used[self.triangles] = True
        return used

    @functools.cached_property
    def bounds(self) -> tuple[F64, F64]:
        """Lower and upper corner of the box around all triangles [m]."""
        columns = [column[self.used] for column in self.positions.T]
        return np.array([column.min() for column in columns]), np.array([column.max() for column in columns])

    @property
    def emits(self) -> bool:
        """Whether any triangle has an emitting material, or light comes from the sky or a lamp without area."""
        of_materials = np.array([material.emits for material in self.materials], bool)
        return self.lit_by_sky or self.lit_by_lights or bool(of_materials[self.material_ids].any())

    @property
    def lit_by_sky(self) -> bool:
        """Whether light comes from the sky."""
        return self.sky is not None and self.sky.emits

    @property
    def lights_and_sun(self) -> tuple[Light, ...]:
        """Lamps without area; before them the sun, which is one of them."""
        sun = None if self.sky is None else self.sky.sun_light
        return self.lights if sun is None else (sun, *self.lights)

    @property
    def lit_by_lights(self) -> bool:
        """Whether light comes from lamps without area."""
        return any(light.emits for light in self.lights)

    @property
    def open_to_lights(self) -> bool:
        """Whether there is a sky, or a lamp without area, on or off: light may come from beyond all surfaces."""
        return self.sky is not None or bool(self.lights)

    @property
    def sides(self) -> NDArray[np.bool_]:
        """(m,) whether the triangle also reflects and emits at its back."""
        return np.array([m.double_sided for m in self.materials], bool)[self.material_ids]

    def with_materials(self, materials: tuple[Material, ...]) -> Scene:
        return dataclasses.replace(self, materials=materials)

    def with_sky(self, sky: Sky | None) -> Scene:
        return dataclasses.replace(self, sky=sky)

    def with_lights(self, lights: tuple[Light, ...]) -> Scene:
        return dataclasses.replace(self, lights=lights)
