"""Where surfaces are in the picture: depth, what lies under a pixel, and the lines drawn over it."""

from __future__ import annotations

import numpy as np
import pytest
from boxes import PLAIN, SIZE, box, cornell, even, hits, picture, put, some_pixels, view_of

from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.render.camera import CameraView
from app.render.frame import FrameRenderer
from app.render.options import DisplayOptions
from app.render.tone_mapping import encode_srgb
from app.scene.model import F64

__all__ = ["box", "cornell"]


def looking_at(eye: F64, target: F64) -> CameraView:
    """A view of the 20 cm around a target, with a level horizon."""
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross([0.0, 1.0, 0.0], back)
    right /= np.linalg.norm(right)
    world_from_camera = np.eye(4)
    world_from_camera[:3] = np.stack([right, np.cross(back, right), back, eye], axis=1)
    distance = float(np.linalg.norm(eye - target))
    return CameraView(world_from_camera, 2 * float(np.arctan(0.1 / distance)), distance)


# -- depth -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("eye", [(0.278, 0.3, 0.1), (0.278, 0.273, -0.8), (0.278, 0.2, -3.0), (0.5, 0.5, 0.4)])
def test_the_lamp_does_not_flicker_through_its_ceiling(
    gpu: Gpu, box: Lightmap, rng: np.random.Generator, eye: tuple[float, float, float]
) -> None:
    """0.1 mm between them: every pixel whose ray meets the lamp first shows it, none else."""
    lamp_centre = np.array([0.278, 0.5487, 0.2795])
    view = looking_at(np.array(eye), lamp_centre)
    image = picture(
        gpu, box, PLAIN.replace(layer="residual"), view=view, offered={"residual": box.texture("t_residual")}
    )
    bright = (image > 250).all(-1)
    pixels = some_pixels(rng, 1500)
    triangle, _ = hits(box.scene, view, pixels)
    lamp = (triangle >= 0) & (box.scene.material_ids[triangle] == [m.name for m in box.scene.materials].index("light"))
    assert 40 < lamp.sum() < 1460
    # rays that graze the lamp's edge: the rasteriser snaps corners to 1/256 pixel
    assert (bright[pixels[:, 1], pixels[:, 0]] != lamp).mean() < 0.01


def test_walls_nearer_than_the_near_plane_are_drawn(gpu: Gpu, box: Lightmap) -> None:
    put(box, "t_irradiance", even(box, (1.0, 1.0, 1.0)))
    view = view_of(box)
    back_wall = 0.5592  # z of the back wall [m]; the view looks along +z
    view.world_from_camera[:3, 3] = (0.278, 0.273, back_wall - 1e-5)
    image = picture(gpu, box, PLAIN.replace(layer="irradiance"), view=view)
    assert (np.abs(image.astype(int) - int(encode_srgb(np.array(1 / np.pi)) * 255)) <= 1).all()


# -- picking -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("samples", [1, 3])
def test_pick_agrees_with_a_ray(gpu: Gpu, box: Lightmap, rng: np.random.Generator, samples: int) -> None:
    renderer = FrameRenderer(gpu)
    target = gpu.target(gpu.texture(SIZE, 4, "f1"))
    assert renderer.pick(1, 1) is None, "nothing has been drawn yet"
    renderer.render(target, SIZE, box, view_of(box), PLAIN, samples=samples)
    pixels = some_pixels(rng, 50)
    triangle, world = hits(box.scene, view_of(box), pixels)
    for (x, y), expected, position in zip(pixels, triangle, world, strict=True):
        hit = renderer.pick(x, y)
        assert (-1 if hit is None else hit.triangle) == expected
        if hit is None or hit.texel is None:
            continue
        # single precision on a scene of radius 1
        assert np.array(hit.position) == pytest.approx(position, abs=1e-5 * box.space.scale)
        assert hit.material == box.scene.material_ids[expected]
        assert hit.tile is not None
        assert hit.tile_texel is not None
        column, row = hit.tile_texel
        texel = box.pool.surfaces.position[hit.tile, row, column]
        # a texel's centroid and a point of it: within its diagonal, twice as long where it is cut or stretched
        assert np.linalg.norm(texel - position) < 2 * np.sqrt(2) / box.charts.density
    assert (triangle >= 0).any()
    assert (triangle < 0).any()
    renderer.release()
    gpu.release_all(target)


# -- overlays ----------------------------------------------------------------------------------------------------------


def test_the_shooter_is_marked_where_it_is(gpu: Gpu, box: Lightmap, rng: np.random.Generator) -> None:
    put(box, "t_irradiance", even(box, (1.0, 1.0, 1.0)))
    renderer = FrameRenderer(gpu)
    target = gpu.target(gpu.texture(SIZE, 4, "f1"))
    renderer.render(target, SIZE, box, view_of(box), PLAIN)
    plain = picture(gpu, box)
    hit = renderer.pick(SIZE[0] // 2, SIZE[1] // 2)
    assert hit is not None
    assert hit.atlas_uv is not None
    u, v = np.floor(np.array(hit.atlas_uv) / 8) * 8
    rect = (float(u), float(v), float(u) + 8, float(v) + 8)
    assert (picture(gpu, box, PLAIN, shooter=rect) == plain).all(), "off by default"
    changed = np.argwhere((picture(gpu, box, PLAIN.replace(last_shooter=True), shooter=rect) != plain).any(-1))
    assert len(changed) > 30
    for y, x in rng.permutation(changed)[:20]:
        under = renderer.pick(x, y)
        assert under is not None
        assert under.atlas_uv is not None
        # the outline reaches up to two pixels outside, here less than two texels
        assert rect[0] - 2 <= under.atlas_uv[0] <= rect[2] + 2
        assert rect[1] - 2 <= under.atlas_uv[1] <= rect[3] + 2
    renderer.release()
    gpu.release_all(target)


@pytest.mark.parametrize("display", [PLAIN.replace(grid=True), PLAIN.replace(layer="charts")])
def test_lines_and_squares_are_there_and_do_not_hide_the_picture(
    gpu: Gpu, box: Lightmap, display: DisplayOptions
) -> None:
    put(box, "t_irradiance", even(box, (1.0, 1.0, 1.0)))
    view = view_of(box)
    view.dolly(0.4)
    plain = picture(gpu, box, display.replace(grid=False, layer="irradiance"), view=view).astype(int)
    image = picture(gpu, box, display, view=view).astype(int)
    assert 0.02 < (np.abs(image - plain).max(-1) > 8).mean()
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 10
    assert image.mean() > 60
