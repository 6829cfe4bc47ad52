"""Textures are as sharp in the picture as they are: albedo and emission of each pixel, and the light of texels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from boxes import even, put
from numpy.typing import NDArray
from solver_scenes import UNIT_SQUARE, quads_scene, with_uv

from app.atlas.materials import look_up
from app.atlas.parametrize import parametrize
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.render.camera import CameraView
from app.render.frame import FrameRenderer
from app.render.options import DisplayOptions
from app.render.tone_mapping import encode_srgb
from app.scene.model import Material, Texture

SIZE = 64
CELLS = 16  # pixels of the texture, four of the picture each
STEP = 1.01 / 255
CHECKER = np.where(np.indices((CELLS, CELLS)).sum(0)[..., None] % 2, [0.8, 0.4, 0.1], [0.05, 0.3, 0.6]).astype(
    np.float32
)
CHECKER[:3, :7] = 0.9  # no turned or mirrored one looks like it
WAYS = {
    "nearest": Texture("nearest", CHECKER, bilinear=False),
    "bilinear": Texture("bilinear", CHECKER),
    **{
        wrap: Texture(wrap, CHECKER, (wrap, wrap), uv_transform=np.array([[2.5, 0.0, -0.7], [0.3, -1.6, 0.4]]))
        for wrap in ("repeat", "mirror", "clamp")
    },
}


def picture(gpu: Gpu, lightmap: Lightmap, **display: object) -> NDArray[np.float64]:
    """The unit square fills it, row 0 at the top."""
    eye = np.eye(4)
    eye[:3, 3] = 0.5, 0.5, 3.0
    renderer, target = FrameRenderer(gpu), gpu.target(gpu.texture((SIZE, SIZE), 4, "f1"))
    view = CameraView(eye, 2 * np.arctan(0.5 / 3), 3.0)
    renderer.render(target, (SIZE, SIZE), lightmap, view, DisplayOptions(tone_map="clamp", **display))
    read = np.frombuffer(target.read(components=3), np.uint8).reshape(SIZE, SIZE, 3)[::-1] / 255
    renderer.release()
    gpu.release_all(target)
    return read


def square(gpu: Gpu, *, colours: NDArray[np.float32] | None = None, **material: object) -> Lightmap:
    scene = replace(with_uv(quads_scene([UNIT_SQUARE], [Material("m", **material)], [0])), colours=colours)
    return Lightmap.of(gpu, scene, parametrize(scene, texels=60))


def middles() -> NDArray[np.float64]:
    """(SIZE², 2) places u, v of the picture's pixels: v = 0 is at the square's lower edge."""
    along = (np.arange(SIZE) + 0.5) / SIZE
    return np.stack(np.meshgrid(along, along[::-1]), -1).reshape(-1, 2)


def looked_up(texture: Texture) -> NDArray[np.float64]:
    """At the middles of the picture's pixels."""
    at = middles()
    at = at @ texture.uv_transform[:, :2].T + texture.uv_transform[:, 2]
    return look_up(texture, texture.pixels, at).reshape(SIZE, SIZE, -1)


@pytest.mark.parametrize("way", WAYS)
def test_a_checker_finer_than_texels_is_seen_as_it_is(gpu: Gpu, way: str) -> None:
    lightmap = square(gpu, albedo=(1.0, 0.5, 1.0), albedo_texture=WAYS[way])
    right = encode_srgb(looked_up(WAYS[way]) * [1.0, 0.5, 1.0])
    wrong = (np.abs(picture(gpu, lightmap, layer="albedo") - right) > 2 * STEP).any(-1)
    # llvmpipe places bilinear look-ups in steps of 1/256 px; a nearest one may fall to either side of an edge
    assert wrong.mean() < 0.005
    lightmap.release()


@pytest.mark.parametrize("interpolation", ["nearest", "bilinear", "bicubic"])
def test_light_falls_on_the_pixels_of_albedo_and_emission(gpu: Gpu, interpolation: str) -> None:
    glow = Texture("glow", CHECKER[:, ::-1], bilinear=False)
    L, H, ev = np.array([0.1, 0.2, 0.3]), (1.0, 0.8, 0.6), 0.5
    lightmap = square(
        gpu, albedo=(1.0, 1.0, 1.0), emission=tuple(L), albedo_texture=WAYS["nearest"], emission_texture=glow
    )
    put(lightmap, "t_irradiance", even(lightmap, H))
    seen = picture(gpu, lightmap, interpolation=interpolation, exposure=ev)
    light = looked_up(WAYS["nearest"]) * H / np.pi + looked_up(glow) * L
    assert np.abs(seen - encode_srgb(np.minimum(2**ev * light, 1.0))).max() < STEP
    lightmap.release()


@pytest.mark.parametrize("way", [None, "nearest"])
def test_colours_of_corners_are_as_sharp_as_their_triangles(gpu: Gpu, way: str | None) -> None:
    """Linear in each triangle, with and without a texture that they multiply."""
    corners = np.array([(1.0, 0.2, 0.2), (0.2, 1.0, 0.2), (0.2, 0.2, 1.0), (0.8, 0.8, 0.8)], np.float32)
    texture = None if way is None else WAYS[way]
    lightmap = square(gpu, albedo=(0.9,) * 3, albedo_texture=texture, colours=corners[[(0, 1, 2), (0, 2, 3)]])
    u, v = middles().T[..., None]
    a, b, c, d = corners
    colour = np.where(u > v, a + (u - v) * (b - a) + v * (c - a), a + u * (c - a) + (v - u) * (d - a))
    right = encode_srgb(0.9 * colour.reshape(SIZE, SIZE, 3) * (1.0 if texture is None else looked_up(texture)))
    wrong = np.abs(picture(gpu, lightmap, layer="albedo") - right) > STEP
    assert not wrong[(u != v).reshape(SIZE, SIZE)].any()
    lightmap.release()


def test_what_is_cut_out_is_sharp_and_shows_what_lies_behind(gpu: Gpu) -> None:
    """As sharp as its texture, and nothing of it where it is not."""
    holes = np.zeros((CELLS, CELLS, 1), np.float32)
    holes[::3, ::2] = 1.0
    board = replace(WAYS["nearest"], pixels=CHECKER[::-1].copy())
    cut = Material("cut", (1.0,) * 3, albedo_texture=board, opacity_texture=Texture("holes", holes, bilinear=False))
    materials = [
        Material("wall", (1.0,) * 3, albedo_texture=WAYS["nearest"], double_sided=True),
        replace(cut, opacity_cutoff=0.5, double_sided=True),
    ]
    near = 1e-3  # so that both squares fill the picture
    behind_the_eye = UNIT_SQUARE[::-1] + np.array([0, 0, 4])  # a side that nothing lies before has no texels
    quads = [UNIT_SQUARE, UNIT_SQUARE + np.array([0, 0, near]), behind_the_eye]
    scene = with_uv(quads_scene(quads, [*materials, Material("other")], range(3)))
    lightmap = Lightmap.of(gpu, scene, parametrize(scene, texels=300))
    there = looked_up(Texture("holes", holes, bilinear=False))[..., :1] > 0.5
    right = encode_srgb(np.where(there, looked_up(board), looked_up(WAYS["nearest"])))
    assert np.abs(picture(gpu, lightmap, layer="albedo") - right).max() < STEP
    lightmap.release()


def test_far_away_a_checker_is_its_mean(gpu: Gpu) -> None:
    """A pixel of the picture is 4 × 4 of the texture: its mip level, not any one of them."""
    fine = np.tile(np.array([[[1.0] * 3, [0.0] * 3], [[0.0] * 3, [1.0] * 3]], np.float32), (2 * SIZE, 2 * SIZE, 1))
    lightmap = square(gpu, albedo=(0.8, 0.8, 0.8), albedo_texture=Texture("fine", fine))
    assert np.abs(picture(gpu, lightmap, layer="albedo") - encode_srgb(np.array(0.4))).max() < STEP
    lightmap.release()


def test_light_that_is_exchanged_and_the_layer_of_it_are_as_before(gpu: Gpu) -> None:
    """Irradiance knows no texture."""
    lightmap, plain = square(gpu, albedo_texture=WAYS["nearest"]), square(gpu)
    for one in (lightmap, plain):
        put(one, "t_irradiance", even(one, (1.0, 0.8, 0.6)))
    assert np.array_equal(*(picture(gpu, one, layer="irradiance") for one in (lightmap, plain)))
    lightmap.release()
    plain.release()
