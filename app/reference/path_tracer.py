"""Irradiance at points by path tracing; the one module that needs mitsuba, which only the extra ``peers`` installs.

    E(x) = ∫ L(x, ω) cos θ dω = π · mean of L(x, ω) over directions with density cos θ / π

L by a path of diffuse bounces. At each of its points a lamp or the sky is sampled too, and the two ways of finding light are
weighed by the balance heuristic [Veach95]; Russian roulette ends paths without bias. Mitsuba 3 intersects rays, samples lamps
and looks up textures; the scene is ours, sides and all. Works badly where light arrives only through small gaps or by way of a
lit corner.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from app.atlas.materials import look_up, texture_coordinates
from app.atlas.sides import scene_size
from app.errors import UserError
from app.scene.lights import Light
from app.scene.model import F64, RGB, Material, Scene, Texture

__all__ = ["GAP", "Tracer", "description"]

LLVM = (16, 0, 0)  # older ones end the process at minima and maxima of single floats
SIZE = 100.0  # diagonal of the scene as it is traced
GAP = 5e-6  # share of the diagonal by which rays start above their surface: 40 units in the last place at the scene's edge
RAYS = 1 << 20  # at a time
FINER, FINEST = (
    4,
    4096,
)  # pixels along each of a cut-out's, that an interpolated one is drawn with, and along the edge at most
ROULETTE = 5  # bounces, after which paths may end by chance
SURVIVES = 0.95  # at most, then
PAINT = "vertex_paint"  # the name of vertex colours in mitsuba


def description() -> str:
    """Name, version and variant. Raises UserError where no variant runs here."""
    return f"Mitsuba {mi.__version__} ({_variant()})"


class Tracer:
    """A scene to trace paths in. Raises UserError for what cannot be traced."""

    def __init__(self, scene: Scene) -> None:
        _variant()
        low, high = scene.bounds
        self._centre, self._scale = (low + high) / 2, SIZE / scene_size(scene)
        shapes = [
            shape
            for k, material in enumerate(scene.materials)
            if (scene.material_ids == k).any()
            for shape in self._shapes(scene, k, material)
        ]
        parts = {f"shape{i}": shape for i, shape in enumerate(shapes)} | _sky(scene)
        self._scene = mi.load_dict({"type": "scene"} | parts)
        lights = [light for light in scene.lights_and_sun if light.emits]
        self._lights = _Lights(lights, self._centre, self._scale) if lights else None
        self._sampler = mi.load_dict({"type": "independent"})
        self._sheer = not all(scene.materials[k].opaque for k in np.unique(scene.material_ids))

    def irradiance(self, positions: F64, normals: F64, samples: int, seed: int) -> F64:
        """(n, 3) [W/m²]: the mean of so many paths from each point (n, 3) [m] with normal (n, 3); the first directions of a
        square number of them are stratified."""
        side = int(np.sqrt(samples))
        strata = side if side * side == samples else 1
        points = mi.Point3f(((positions - self._centre) * self._scale).astype(np.float32).T)
        point_normals = mi.Normal3f(normals.astype(np.float32).T)
        out = np.empty((len(positions), 3))
        most = max(1, RAYS // samples)
        for first in range(0, len(positions), most):
            count = min(most, len(positions) - first)
            self._sampler.seed((seed * 1_000_003 + first) & 0xFFFFFFFF, count * samples)
            # numbers opaque and arrays evaluated, else each call compiles another kernel
            before, each, across = (dr.opaque(mi.UInt32, number) for number in (first, samples, strata))
            path = dr.arange(mi.UInt32, count * samples)
            x = dr.gather(mi.Point3f, points, before + path // each)
            n = dr.gather(mi.Normal3f, point_normals, before + path // each)
            corner = mi.Point2f(mi.Float(path % across), mi.Float(path // across % across))
            u = (corner + self._sampler.next_2d()) / mi.Float(across)
            dr.eval(x, n, u)
            L = _trace(self._scene, self._sampler, self._lights, x, n, u, self._sheer)
            dr.eval(L)
            for k, component in enumerate((L.x, L.y, L.z)):
                estimates = np.array(component, np.float64).reshape(count, samples)
                out[first : first + count, k] = np.pi * estimates.mean(axis=1)
        return out

    def _shapes(self, scene: Scene, k: int, material: Material) -> list[Any]:
        """Meshes of one material. What emits on both sides is two sheets with a front each, closer than rays start above them."""
        if not (material.emits and material.double_sided):
            return [self._mesh(scene, k, material, double_sided=material.double_sided)]
        return [self._mesh(scene, k, material, double_sided=False, sheet=sheet) for sheet in (1, -1)]

    def _mesh(self, scene: Scene, k: int, material: Material, *, double_sided: bool, sheet: int = 0) -> Any:
        mine = scene.material_ids == k
        corners = (scene.corners[mine] - self._centre) * self._scale
        corners += sheet * 0.5 * GAP * SIZE * scene.normals_areas[0][mine][:, None]
        order = slice(None, None, -1 if sheet < 0 else 1)
        props = mi.Properties()
        painted = scene.colours is not None and bool((scene.colours[mine] < 1).any())
        if painted and material.albedo_texture is not None:
            raise UserError(f"material {material.name}: mitsuba takes a picture or vertex colours, not both")
        reflectance = _colours(material.albedo, material.albedo_texture)
        if painted:
            reflectance = {"type": "mesh_attribute", "name": PAINT}
        bsdf: dict[str, Any] = {"type": "diffuse", "reflectance": reflectance}
        bsdf = {"type": "twosided", "bsdf": bsdf} if double_sided else bsdf
        if not material.opaque:
            bsdf = {"type": "mask", "opacity": _opacity(material), "bsdf": bsdf}
        props["bsdf"] = mi.load_dict(bsdf)
        if material.emits and not material.opaque:
            raise UserError(f"material {material.name}: paths are not traced to lamps that are not opaque")
        if material.emits:
            radiance = _colours(material.emission, material.emission_texture)
            props["emitter"] = mi.load_dict({"type": "area", "radiance": radiance})
        props["face_normals"] = True
        count = int(mine.sum())
        mesh = mi.Mesh("", vertex_count=3 * count, face_count=count, has_vertex_texcoords=True, props=props)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = corners[:, order].astype(np.float32).ravel()
        parameters["vertex_texcoords"] = _texcoords(scene, material)[mine][:, order].astype(np.float32).ravel()
        parameters["faces"] = np.arange(3 * count, dtype=np.uint32)
        parameters.update()
        if painted:
            assert scene.colours is not None
            colours = scene.colours[mine][:, order] * np.array(material.albedo, np.float32)
            mesh.add_attribute(PAINT, 3, colours.astype(np.float32).ravel())
        return mesh


class _Lights:
    """Lamps without area, and the sun, as the scene is traced: arrays of ``count``. No dataclass, or a loop would take it for its
    state. away: 1 without a place; spread: radius, or cosine of half the angle; slope: see Light."""

    def __init__(self, lights: list[Light], centre: F64, scale: float) -> None:
        def column(values: list[Any]) -> Any:
            return np.array(values, np.float32).T

        self.count = len(lights)
        strength = [np.array(s.intensity) * (1.0 if s.from_afar else scale**2) for s in lights]
        self.intensity = mi.Color3f(column(strength))
        self.position = mi.Point3f(column([(np.array(s.position) - centre) * scale for s in lights]))
        self.direction = mi.Vector3f(column([s.direction for s in lights]))
        self.away = mi.Float(column([float(s.from_afar) for s in lights]))
        self.spread = mi.Float(column([np.cos(s.angle / 2) if s.from_afar else s.radius * scale for s in lights]))
        self.slope = mi.Vector2f(column([s.slope for s in lights]))
        self.inverse_range = mi.Float(column([1 / (s.range * scale) for s in lights]))


def _variant() -> str:
    """Select a variant of mitsuba that runs here. Raises UserError."""
    if dr.has_backend(dr.JitBackend.LLVM) and dr.detail.llvm_version() >= LLVM:
        name = "llvm_ad_rgb"
    elif dr.has_backend(dr.JitBackend.CUDA):
        name = "cuda_ad_rgb"
    else:
        raise UserError(
            f"mitsuba needs LLVM {LLVM[0]} or newer: install it, or set DRJIT_LIBLLVM_PATH to the file of its library"
        )
    mi.set_variant(name)
    return name


def _sky(scene: Scene) -> dict[str, Any]:
    """The emitter that lies beyond all surfaces, without the sun; none where it is dark."""
    if scene.sky is None or not scene.sky.radiance.any():
        return {}
    radiance = scene.sky.radiance
    if radiance.shape[:2] == (1, 1):
        return {"sky": {"type": "constant", "radiance": _colours(scene.sky.scale.tolist(), None)}}
    bitmap = mi.Bitmap(np.ascontiguousarray(radiance))
    return {"sky": {"type": "envmap", "bitmap": bitmap, "mis_compensation": False}}


def _colours(factor: RGB, texture: Texture | None) -> dict[str, Any]:
    """A colour, or a picture times a factor, as mitsuba takes it."""
    if texture is None or max(factor) == 0.0:
        return {"type": "rgb", "value": [float(x) for x in factor]}
    return _picture(texture, texture.pixels * np.array(factor))


def _picture(texture: Texture, pixels: NDArray[Any]) -> dict[str, Any]:
    """Other pixels in place of a texture's own."""
    if texture.wrap[0] != texture.wrap[1]:
        raise UserError(f"texture {texture.name}: mitsuba repeats along u as along v, not {' and '.join(texture.wrap)}")
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.ascontiguousarray(pixels, np.float32)),
        "raw": True,
        "wrap_mode": texture.wrap[0],
        "filter_type": "bilinear" if texture.bilinear else "nearest",
    }


def _opacity(material: Material) -> float | dict[str, Any]:
    """How much of a material is there, as mitsuba takes it; where it has a cutoff, of finer pixels whether they are there."""
    texture, cutoff = material.opacity_texture, material.opacity_cutoff
    if texture is None:
        return material.opacity
    pixels = texture.pixels * np.float32(material.opacity)
    finer = 1 if cutoff is None or not texture.bilinear else max(1, min(FINER, FINEST // max(pixels.shape)))
    if finer > 1:
        height, width = finer * pixels.shape[0], finer * pixels.shape[1]
        rows, columns = (np.arange(height) + 0.5) / height, (np.arange(width) + 0.5) / width
        at = np.stack(np.meshgrid(columns, rows), -1).reshape(-1, 2)
        pixels = look_up(texture, pixels, at).reshape(height, width, 1)
    if cutoff is not None:
        pixels = (pixels >= cutoff).astype(np.float32)
        texture = dataclasses.replace(texture, bilinear=False)
    return _picture(texture, pixels)


def _texcoords(scene: Scene, material: Material) -> F64:
    """(m, 3, 2), v = 0 at a picture's top."""
    used = material.textures
    if not used:
        return np.zeros((len(scene.triangles), 3, 2))
    if any((t.uv_transform != used[0].uv_transform).any() or t.texcoord != used[0].texcoord for t in used):
        raise UserError(f"material {material.name}: mitsuba takes one set of texture coordinates for all its textures")
    coordinates = texture_coordinates(scene, used[0])
    assert coordinates is not None, "a texture without coordinates"
    return coordinates


def _ray(start: Any, direction: Any, reach: Any) -> Any:
    ray: Any = mi.Ray3f(start, direction)
    ray.maxt = reach
    return ray


@dr.syntax
def _first_hit(scene: Any, sampler: Any, origin: Any, direction: Any, reach: Any, active: Any) -> Any:
    """What rays meet before they are as long as ``reach``; what is not opaque stops them by chance."""
    start, left = mi.Point3f(origin), mi.Float(reach)
    hit = scene.ray_intersect(_ray(start, direction, left), active)
    passes = active & hit.is_valid() & (sampler.next_1d(active) < hit.bsdf().eval_null_transmission(hit, active).x)
    while passes:
        start = mi.Point3f(hit.p + mi.Vector3f(direction) * (GAP * SIZE))
        left[passes] -= hit.t + GAP * SIZE
        passes &= left > 0
        further = scene.ray_intersect(_ray(start, direction, left), passes)
        hit = dr.select(passes | (left <= 0), further, hit)
        chance = sampler.next_1d(passes) < further.bsdf().eval_null_transmission(further, passes).x
        passes &= further.is_valid() & chance
    return hit


def _from_lights(
    scene: Any, sampler: Any, lights: _Lights | None, origin: Any, n: Any, active: Any, sheer: bool
) -> Any:
    """E/π of one of the lamps without area, times their number: to its point, or to one of its sphere or its disc."""
    if lights is None:
        return mi.Color3f(0)
    k = dr.minimum(mi.UInt32(sampler.next_1d(active) * lights.count), lights.count - 1)
    direction, away = dr.gather(mi.Vector3f, lights.direction, k), dr.gather(mi.Float, lights.away, k) > 0
    spread, slope = dr.gather(mi.Float, lights.spread, k), dr.gather(mi.Vector2f, lights.slope, k)
    way = dr.select(away, -direction, dr.gather(mi.Point3f, lights.position, k) - origin)
    r = dr.norm(way)
    axis = way / r
    near = dr.sqrt(1 - dr.minimum(dr.square(spread / r), 1))
    local = mi.warp.square_to_uniform_cone(sampler.next_2d(active), dr.select(away, spread, near))
    towards = mi.Frame3f(axis).to_world(local)
    along = local.z * r
    chord = along - dr.sqrt(dr.maximum(dr.square(along) - dr.square(r) + dr.square(spread), 0))
    far = dr.select(away, 4 * SIZE, dr.maximum(chord, 0))
    cone = dr.square(dr.clip(slope.y - slope.x * dr.dot(axis, direction), 0, 1))
    window = dr.maximum(1 - dr.square(dr.square(r * dr.gather(mi.Float, lights.inverse_range, k))), 0)
    E = dr.gather(mi.Color3f, lights.intensity, k) * dr.dot(n, axis)
    E *= dr.select(away, 1, cone * window / dr.square(r))
    lit = active & (dr.dot(n, axis) > 0) & (dr.dot(n, towards) > 0)
    lit &= ~(
        _first_hit(scene, sampler, origin, towards, far, lit).is_valid()
        if sheer
        else scene.ray_test(_ray(origin, towards, far), lit)
    )
    return dr.select(lit, E * (lights.count / dr.pi), 0)


@dr.syntax
def _trace(scene: Any, sampler: Any, lights: _Lights | None, x: Any, n: Any, u: Any, sheer: bool) -> Any:
    """Estimates of E/π at points x with normals n; u: what chooses the first direction; sheer: whether there is what is not
    opaque."""
    L, throughput = mi.Color3f(0), mi.Color3f(1)
    x, n, u = mi.Point3f(x), mi.Normal3f(n), mi.Point2f(u)
    bounces, active = mi.UInt32(0), mi.Bool(True)
    while active:
        origin = x + n * (GAP * SIZE)

        # A point on a lamp
        here = dr.zeros(mi.Interaction3f)
        here.p, here.n = x, n
        lamp, radiance = scene.sample_emitter_direction(here, sampler.next_2d(active), False, active)
        towards = lamp.p + lamp.n * (GAP * SIZE) - origin
        distance = dr.norm(towards)
        cosine = dr.dot(n, lamp.d)
        lit = active & (lamp.pdf > 0) & (cosine > 0) & (dr.dot(n, towards) > 0)
        if dr.hint(sheer, mode="scalar"):
            lit &= ~_first_hit(scene, sampler, origin, towards / distance, distance, lit).is_valid()
        else:
            lit &= ~scene.ray_test(_ray(origin, towards / distance, distance), lit)
        density = cosine / dr.pi
        L[lit] += throughput * radiance * density * dr.select(lamp.delta, 1.0, lamp.pdf / (lamp.pdf + density))

        L += throughput * _from_lights(scene, sampler, lights, origin, n, active, sheer)

        # A direction by its cosine
        local = mi.warp.square_to_cosine_hemisphere(u)
        direction = mi.Frame3f(n).to_world(local)
        hit = dr.zeros(mi.SurfaceInteraction3f)
        if dr.hint(sheer, mode="scalar"):
            hit = _first_hit(scene, sampler, origin, direction, 4 * SIZE, active)
        else:
            hit = scene.ray_intersect(mi.Ray3f(origin, direction), active)
        emitter = hit.emitter(scene, active)  # the sky's, where it meets nothing
        glows = active & (emitter != None)  # noqa: E711  # an array of pointers
        other = scene.pdf_emitter_direction(here, mi.DirectionSample3f(scene, hit, here), glows)
        density = local.z / dr.pi
        L[glows] += throughput * emitter.eval(hit, glows) * density / (density + other)

        # What the surface there reflects
        active &= hit.is_valid()
        front = dr.dot(hit.n, direction) < 0
        bsdf = hit.bsdf()
        active &= front | mi.has_flag(bsdf.flags(), mi.BSDFFlags.BackSide)
        throughput *= bsdf.eval_diffuse_reflectance(hit, active)
        bounces += 1
        strongest = dr.max(throughput)
        survives = dr.minimum(strongest, SURVIVES)
        chance = bounces >= ROULETTE
        active &= (strongest > 0) & (~chance | (sampler.next_1d(active) < survives))
        throughput[chance] *= dr.rcp(survives)

        x, n = mi.Point3f(hit.p), mi.Normal3f(dr.select(front, hit.n, -hit.n))
        u = sampler.next_2d(active)
    return L
