"""The picture that a scene's first camera should see, and how different it looks by a solution's light (FLIP).

A pixel is the point of a surface behind its middle, of radiance L + ρE/π. The picture is exposed for its mean logarithm
[Reinhard02, eq. 1] as the viewer's is, by the reference alone, cut at white, and sRGB. There is one where the irradiance of so
many points is soon known: by a closed form, or by as many paths altogether as judge the random points.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.atlas.enclosed import sides_with_texels
from app.atlas.materials import colours_at, look_up, texture_coordinates
from app.atlas.points import Points, barycentric
from app.gpu import Gpu, Mesh, Pass
from app.lightmap.tile_pool import SolverSpace
from app.reference.irradiance import CACHE_FILES, ReferenceIrradiance
from app.render.camera import CameraView
from app.render.exposure import KEY
from app.render.surfaces import uniform_matrix
from app.render.tone_mapping import encode_srgb
from app.render.units import LUMINANCE
from app.scene.arrays import arrays_of
from app.scene.model import F64, Scene, Texture
from app.util import cache
from app.util.console import Tell
from app.util.tables import FLIP, missing

SIZE = (256, 192)  # pixels
VIEW_SEED = 104_729  # no path of the random points again
FORMAT = b"glowtree view 1"  # changes when the answer or its file does
VERTEX = {"in_position": "3f", "in_uv_front": "2f", "in_uv_back": "2f"}  # see render/pick.vert.glsl


@dataclass(frozen=True, eq=False)
class ReferencePicture:
    """What the camera sees by the reference's light.

    emission (height, width, 3): radiance of each pixel; lit (height, width): where points are that reflect, row by row, with
    their albedo (n, 3) and the irradiance E (n, 3) [W/m²] that they should have; noise: FLIP between two halves of the paths.
    """

    emission: F64
    lit: NDArray[np.bool_]
    points: Points
    albedo: F64
    E: F64
    noise: float | None = None

    @property
    def exposure(self) -> float:
        """By which radiance is multiplied."""
        luminance = self.albedo * self.E @ LUMINANCE / np.pi
        seen = luminance > 0
        return float(KEY / np.exp(np.log(luminance[seen]).mean())) if seen.any() else 1.0

    def by_light(self, E: F64) -> F64:
        """(height, width, 3) sRGB from 0 to 1, by irradiance (n, 3) at the points."""
        radiance = self.emission.copy()
        radiance[self.lit] += self.albedo * E / np.pi
        return encode_srgb(np.clip(radiance * self.exposure, 0.0, 1.0))

    def flip(self, E: F64) -> float | None:
        """Between the pictures by the right irradiance and by this; None where it is not finite."""
        return flip_of(self.by_light(self.E), self.by_light(E)) if np.isfinite(E).all() else None

    def as_dict(self) -> dict[str, Any]:
        """For reports."""
        height, width = self.lit.shape
        return {"size": [width, height], "lit_pixels": len(self.points), "noise": self.noise}


def flip_of(reference: F64, picture: F64) -> float:
    """See app/bench/flip.py, which only an extra can import."""
    from app.bench.flip import flip

    return flip(reference, picture)


def reference_picture(
    gpu: Gpu, scene: Scene, reference: ReferenceIrradiance, paths: int, tell: Tell
) -> ReferencePicture | None:
    """By the same reference; paths: from each of the reference's points. None where that would take too long, or FLIP is
    not installed. Raises UserError."""
    if reference.name not in ("closed-form", "path-traced") or missing(FLIP):
        return None
    shown, points = _seen(gpu, scene)
    own = points.only(_reflecting(scene, points))
    emission, lit = np.zeros((SIZE[0] * SIZE[1], 3)), np.zeros(SIZE[0] * SIZE[1], bool)
    emission[shown] = _colours(scene, points, "emission")
    lit[shown] = _reflecting(scene, points)
    image = SIZE[1], SIZE[0]
    albedo = _colours(scene, own, "albedo")
    halves = [np.tile(reference.E[:1], (len(own), 1))]
    if reference.name == "path-traced":
        halves = list(_traced(scene, own, paths * len(reference.points), tell))
    picture = ReferencePicture(emission.reshape(*image, 3), lit.reshape(image), own, albedo, np.mean(halves, axis=0))
    if len(halves) == 1:
        return picture
    noise = flip_of(*(picture.by_light(half) for half in halves))
    return ReferencePicture(picture.emission, picture.lit, own, albedo, picture.E, noise)


def _traced(scene: Scene, points: Points, paths: int, tell: Tell) -> F64:
    """(2, n, 3) irradiance by two halves of about so many paths. Raises UserError."""
    from app.reference import path_tracer as tracer

    side = max(round(np.sqrt(paths / (2 * max(len(points), 1)))), 1)
    label = FORMAT + f"{tracer.description()} {side} {VIEW_SEED}".encode()
    given = arrays_of(scene) | {"triangle": points.triangle, "back": points.back, "weights": points.weights}
    path = cache.entry("view", cache.digest(label, given))
    found = cache.read(path)
    if found is None or "halves" not in found:
        traced, place = tracer.Tracer(scene), points.positions_normals(scene)
        halves = []
        for k in range(2):
            tell("path-traced picture", k / 2)
            halves.append(traced.irradiance(*place, side * side, VIEW_SEED + k))
        found = {"halves": np.array(halves)}
        cache.store(found, path, CACHE_FILES)
    return np.asarray(found["halves"])


def _seen(gpu: Gpu, scene: Scene) -> tuple[NDArray[np.int64], Points]:
    """Pixels (n,), row by row from the top, behind which there is a surface, and the points of it."""
    space, (width, height) = SolverSpace.of(scene), SIZE
    camera = scene.cameras[0]
    away = float(np.linalg.norm(np.asarray(camera.world_from_camera)[:3, 3] - space.centre))
    clip_from_local = CameraView.from_camera(camera, away).clip_from_local(width / height, space)
    corners = space.local_from_world(scene.corners.reshape(-1, 3)).astype(np.float32)
    mesh = Mesh(gpu, np.pad(corners, ((0, 0), (0, 4))).tobytes(), VERTEX)
    ids = gpu.texture(SIZE, 2, "u4", bytes(8 * width * height))
    places = [gpu.texture(SIZE, 4, "f4") for _ in range(2)]
    depth = gpu.depth_texture(SIZE)
    target = gpu.target(ids, *places, depth=depth)
    target.clear(depth=1.0)
    uniforms = {"u_clip_from_local": uniform_matrix(clip_from_local)}
    Pass(gpu, "render/pick").draw(target, uniforms=uniforms, mesh=mesh, depth=True)
    triangle, back = np.frombuffer(ids.read(), np.uint32).reshape(height, width, 2)[::-1].reshape(-1, 2).T
    local = np.frombuffer(places[1].read(), np.float32).reshape(height, width, 4)[::-1].reshape(-1, 4)
    gpu.release_all(target, depth, *places, ids, mesh)
    shown = np.flatnonzero(triangle)
    position = space.world_from_local(local[shown, :3].astype(np.float64))
    drawn = triangle[shown].astype(np.int32) - 1
    weights = np.clip(barycentric(position, scene.corners[drawn]), 0.0, 1.0)  # as near as rounding brings them
    return shown, Points(drawn, back[shown] == 1, weights / weights.sum(axis=1, keepdims=True))


def _reflecting(scene: Scene, points: Points) -> NDArray[np.bool_]:
    """(n,) whether they lie on sides that light can reach."""
    sides = sides_with_texels(scene)
    return np.isin(2 * points.triangle.astype(np.int64) + points.back, 2 * sides.triangle.astype(np.int64) + sides.back)


def _colours(scene: Scene, points: Points, kind: str) -> F64:
    """(n, 3) ``albedo`` or ``emission`` of the surfaces at points; the back of one side has none."""
    out = np.zeros((len(points), 3))
    used = scene.material_ids[points.triangle]
    for k in np.unique(used):
        material: Any = scene.materials[k]
        mine = np.flatnonzero((used == k) & (material.double_sided | ~points.back))
        texture: Texture | None = getattr(material, f"{kind}_texture")
        out[mine] = getattr(material, kind)
        coordinates = None if texture is None else texture_coordinates(scene, texture)
        if texture is not None and coordinates is not None:
            at = np.einsum("nk,nkc->nc", points.weights[mine], coordinates[points.triangle[mine]])
            out[mine] *= look_up(texture, texture.pixels, at)
    if kind == "albedo" and scene.colours is not None:
        out *= colours_at(scene, points.triangle, points.weights)
    return out
