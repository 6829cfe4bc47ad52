"""The light of a reference at any point of an open scene's surfaces: a flat lightmap, and where each side lies in it.

A bake belongs to a scene if its triangles are those of the scene; how both are unfolded and how finely they are cut may differ.
It may also hold insides of closed bodies that have no texels in the scene.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from app.atlas.enclosed import sides_with_texels
from app.atlas.points import Points, SideIndex, barycentric, bilinear
from app.atlas.sides import lit_sides, scene_size
from app.bake.read import Bake
from app.errors import UserError
from app.lightmap.tile_pool import TilePool
from app.scene.model import F32, F64, I32, Material, Scene

Ints = NDArray[np.int64]

SAME_PLACE = 1e-5  # of the scene's size, between two corners: files hold 32-bit floats
CANDIDATES = 8  # triangles that may lie in one place
SAME_COLOUR = 1e-4  # between two albedos, or relative between two emissions
LOST_AREA = 1e-4  # share of the surface that may lack a partner: slivers that a file's rounding flattens


@dataclass(frozen=True, eq=False)
class ReferenceLight:
    """image (h, w, 3) f32: irradiance [W/m²]; of each side triangle (f,), back (f,) and uv (f, 3, 2) [texels of the image].

    materials: those that it was solved with, by the scene's numbers. name: for people. texels: that cover a surface, and unshot:
    share of the emitted power; None where they are not known.
    """

    name: str
    image: F32
    triangle: I32
    back: NDArray[np.bool_]
    uv: F64
    materials: tuple[Material, ...]
    texels: int | None = None
    unshot: float | None = None

    @functools.cached_property
    def _sides(self) -> SideIndex:
        return SideIndex(self.triangle, self.back)

    def at(self, points: Points) -> F64:
        """(n, 3) [W/m²], bilinear."""
        side = self._sides.of(points)
        return bilinear(self.image, np.einsum("nk,nkc->nc", points.weights, self.uv[side]))

    def on_tiles(self, pool: TilePool, slots: Ints) -> F32:
        """At the middles of all texels of these slots (n, t, t, 3) [W/m²]; 0 where nothing is covered."""
        face = pool.surfaces.face[slots]
        covered = face >= 0
        on, scene = face[covered], pool.scene
        triangle = pool.charts.face_triangle[on]
        weights = barycentric(pool.surfaces.position[slots][covered], scene.corners[triangle])
        out = np.zeros((*face.shape, 3), np.float32)
        out[covered] = self.at(Points(triangle, pool.charts.face_back[on], weights))
        return out

    def other_materials(self, materials: tuple[Material, ...]) -> list[str]:
        """Names of those that are not as they were when it was solved."""
        pairs = zip(self.materials, materials, strict=True)
        return [now.name for then, now in pairs if not _alike(then, now)]


def light_of_bake(bake: Bake, scene: Scene) -> ReferenceLight:
    """Raises UserError where the bake is of another scene."""
    triangle, back, theirs = _partners(bake, scene)
    assert bake.scene.uv1 is not None
    size = np.array(bake.irradiance.shape[1::-1], np.float64)
    order = np.where(back[:, None], [0, 2, 1], [0, 1, 2])  # a back is written as it is seen
    uv = np.take_along_axis(_turned(bake.scene.uv1[theirs.triangle], theirs.turn), order[..., None], axis=1) * size
    uv[theirs.nearby] = uv[theirs.nearby].mean(axis=1, keepdims=True)
    materials = list(scene.materials)
    used, first = np.unique(scene.material_ids[triangle], return_index=True)
    for mine, their in zip(used, bake.scene.material_ids[theirs.triangle[first]], strict=True):
        materials[mine] = bake.scene.materials[their]
    texels, unshot = bake.report.get("texels"), bake.report.get("residual")
    return ReferenceLight(
        name=f"bake {bake.folder.resolve().name}",
        image=bake.irradiance,
        triangle=triangle,
        back=back,
        uv=uv,
        materials=tuple(materials),
        texels=texels if isinstance(texels, int) else None,
        unshot=unshot if isinstance(unshot, float) else None,
    )


@dataclass(frozen=True, eq=False)
class _Partners:
    """(f,) each: the bake's triangle; how often its corners are to be turned; whether it only lies nearby."""

    triangle: Ints
    turn: Ints
    nearby: NDArray[np.bool_]


def _partners(bake: Bake, scene: Scene) -> tuple[I32, NDArray[np.bool_], _Partners]:
    """Triangle and side of the scene (f,), and which triangles of the bake they are: with the same corners, in the same order as
    seen from that side. Raises UserError."""
    lit = sides_with_texels(scene)
    triangle, back = lit.triangle, lit.back
    order = np.where(back[:, None], [0, 2, 1], [0, 1, 2])
    mine = np.take_along_axis(scene.corners[triangle], order[..., None], axis=1)
    theirs = bake.scene.corners
    count = min(CANDIDATES, len(theirs))
    near = cKDTree(theirs.mean(axis=1)).query(mine.mean(axis=1), count)[1].reshape(len(mine), count)
    slack = SAME_PLACE * scene_size(scene)
    found, turn = np.full(len(mine), -1), np.zeros(len(mine), np.int64)
    for k in range(count):
        for turns in range(3):
            left = np.flatnonzero(found < 0)
            corners = np.roll(theirs[near[left, k]], -turns, axis=1)
            same = np.abs(corners - mine[left]).max(axis=(1, 2)) <= slack
            found[left[same]], turn[left[same]] = near[left[same], k], turns
    nearby = found < 0
    area = scene.normals_areas[1][triangle]
    lost, total = area[nearby].sum(), area.sum()
    most, given = (x.normals_areas[1][lit_sides(x).triangle].sum() for x in (scene, bake.scene))
    other = f"{bake.folder}: is of another scene"
    if lost > LOST_AREA * total:
        raise UserError(f"{other}: {lost / total:.1%} of the surfaces of {scene.name} are not in it")
    if given - most > LOST_AREA * total:
        raise UserError(f"{other}: it has surfaces that {scene.name} has not")
    return triangle, back, _Partners(np.where(nearby, near[:, 0], found), turn, nearby)


def _turned(corners: NDArray[Any], turn: Ints) -> F64:
    """(f, 3, k) with the corners of each turned so often."""
    return np.take_along_axis(corners.astype(np.float64), ((np.arange(3) + turn[:, None]) % 3)[..., None], axis=1)


def _alike(one: Material, other: Material) -> bool:
    """Whether the factors are, as far as a file keeps them; pictures are not looked at."""
    albedo = np.abs(np.subtract(one.albedo, other.albedo)).max() <= SAME_COLOUR
    brightest = max(*one.emission, *other.emission)
    return bool(albedo and np.abs(np.subtract(one.emission, other.emission)).max() <= SAME_COLOUR * brightest)
