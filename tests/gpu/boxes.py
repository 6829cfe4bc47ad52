"""The Cornell box with known light, pictures of it, and what rays through their pixels meet."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray
from pictures import ray, render_image

from app.atlas.parametrize import parametrize
from app.compare.reference_light import ReferenceLight
from app.gpu import Gpu
from app.lightmap.collapse import collapse
from app.lightmap.gutter import fill_gutter
from app.lightmap.lightmap import Lightmap
from app.render.camera import CameraView
from app.render.options import DisplayOptions
from app.scene.load import load_scene
from app.scene.model import F32, F64, Scene

SIZE = (160, 120)
PLAIN = DisplayOptions(tone_map="clamp")
# One step of the 8 bits that display texels and picture are both rounded to, half a step each
STEP = 1.01 / 255


@pytest.fixture(scope="module")
def cornell() -> Scene:
    return load_scene("cornell-box")


@pytest.fixture
def box(gpu: Gpu, cornell: Scene) -> Iterator[Lightmap]:
    lightmap = Lightmap.of(gpu, cornell, parametrize(cornell, texels=4000))
    yield lightmap
    lightmap.release()


def view_of(lightmap: Lightmap) -> CameraView:
    camera = lightmap.scene.cameras[0]
    distance = float(np.linalg.norm(camera.world_from_camera[:3, 3] - lightmap.space.centre))
    return CameraView.from_camera(camera, distance)


def put(lightmap: Lightmap, name: str, tiles: F64) -> None:
    """Light (tiles, 16, 16, 3) [W/m²] into ``t_irradiance`` or ``t_residual``."""
    image = lightmap.pool.image_from_tiles(np.concatenate([tiles / lightmap.unit, tiles[..., :1] * 0], -1))
    lightmap.texture(name).write(np.ascontiguousarray(image, np.float32).tobytes())


def put_ambient(lightmap: Lightmap, a: tuple[float, float, float]) -> None:
    """The same ambient light (RGB) [W/m²] on all texels, whatever a solver finds."""
    lightmap.ambient_of = None
    lightmap.hold_ambient(of_each=False)
    lightmap.texture("t_ambient").write(np.array([*np.array(a) / lightmap.unit, *[0.0] * 9], np.float32).tobytes())


def even(lightmap: Lightmap, H: tuple[float, float, float]) -> F64:
    """The same light on every texel that covers a surface, none on the others."""
    return (lightmap.pool.surfaces.area > 0)[..., None] * np.array(H)


def picture(gpu: Gpu, lightmap: Lightmap, display: DisplayOptions = PLAIN, **more: object) -> NDArray[np.uint8]:
    view = more.pop("view", None) or view_of(lightmap)
    return render_image(gpu, lightmap, view, display, SIZE, **more)


def hits(scene: Scene, view: CameraView, pixels: NDArray[np.intp]) -> tuple[NDArray[np.intp], F64]:
    """Nearest triangle (-1: none) and position (n, 3) [m] behind pixel centres (n, 2), in float64 [Moller97]."""
    a, b, c = np.moveaxis(scene.corners, 1, 0)
    triangles, positions = [], []
    for x, y in pixels:
        ndc = (np.array([x, y]) + 0.5) / SIZE * 2 - 1
        origin, direction = ray(view, ndc[0], -ndc[1], SIZE[0] / SIZE[1])
        normal = np.cross(b - a, c - a)
        det = -normal @ direction
        from_a = origin - a
        along = np.cross(from_a, direction)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = np.einsum("ij,ij->i", c - a, along) / det
            v = -np.einsum("ij,ij->i", b - a, along) / det
            t = np.einsum("ij,ij->i", from_a, normal) / det
        t[~((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0))] = np.inf
        nearest = int(t.argmin())
        triangles.append(nearest if np.isfinite(t[nearest]) else -1)
        positions.append(origin + direction * (t[nearest] if np.isfinite(t[nearest]) else 0.0))
    return np.array(triangles), np.array(positions)


def some_pixels(rng: np.random.Generator, count: int) -> NDArray[np.intp]:
    return np.stack([rng.integers(0, SIZE[0], count), rng.integers(0, SIZE[1], count)], -1)


def light_of(lightmap: Lightmap, tiles: F32) -> ReferenceLight:
    """Irradiance (tiles, t, t, 3) of a uniform lightmap as a reference."""
    charts = lightmap.charts
    image = fill_gutter(*collapse(lightmap.pool, tiles))
    uv = charts.face_uv * (image.shape[0] // charts.size[1])
    return ReferenceLight("made", image, charts.face_triangle, charts.face_back, uv, lightmap.scene.materials)


def smooth(lightmap: Lightmap) -> F64:
    """Light that is linear in space [W/m²], on every texel that covers a surface."""
    surfaces = lightmap.pool.surfaces
    local = lightmap.space.local_from_world(surfaces.position)
    return (surfaces.area > 0)[..., None] * (2.0 + local @ np.array([[0.5, 0, 0.2], [0.1, 0.4, 0], [0, 0.2, 0.3]]))
