"""Textures averaged onto texels."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from atlas_scenes import box_room, own_cache, scene_of

from app.atlas.materials import texel_colours, texel_opacity
from app.atlas.parametrize import parametrize
from app.atlas.texels import TexelSurfaces, texel_surfaces, uniform_leaves
from app.scene import shapes
from app.scene.model import F32, Material, Scene, Texture

__all__ = ["own_cache"]

LEFT_TO_RIGHT = (0, 0, 0), (4, 0, 0), (0, 4, 0)


def _picture(
    scene: Scene, texels: int, level: int = 0
) -> tuple[F32, np.ndarray, TexelSurfaces, tuple[F32 | None, F32 | None]]:
    """Albedo and position of the texels of the last object, and everything."""
    charts = parametrize(scene, texels=texels)
    leaves = uniform_leaves(charts, level)
    surfaces = texel_surfaces(scene, charts, leaves)
    albedo, emission = texel_colours(scene, charts, leaves, surfaces)
    mine = (surfaces.face >= 0) & (scene.object_ids[charts.face_triangle[surfaces.face]] == len(scene.objects) - 1)
    assert albedo is not None and albedo.dtype == np.float32
    return albedo[mine], surfaces.position[mine], surfaces, (albedo, emission)


def _textured(texture: Texture) -> Scene:
    wall = Material("wall")
    return scene_of([box_room((6, 6, 6)), shapes.quad(*LEFT_TO_RIGHT)], [wall, Material("t", albedo_texture=texture)])


def _ramp(wrap: tuple[str, str] = ("clamp", "clamp"), **options: object) -> Texture:
    """Red grows with u, green with v (down), 256 pixels a side."""
    c = (np.arange(256) + 0.5) / 256
    pixels = np.stack(np.broadcast_arrays(c[None], c[:, None], 0.25), axis=2).astype(np.float32)
    return Texture("ramp", pixels, wrap, **options)  # type: ignore[arg-type]


def _mirrored(x: np.ndarray) -> np.ndarray:
    return 1 - np.abs(1 - np.mod(x, 2))


@pytest.mark.parametrize("texels", [400, 30_000])
def test_texels_see_the_picture_upright(texels: int) -> None:
    albedo, position, _, (_, emission) = _picture(_textured(_ramp()), texels)
    # a linear ramp's box average is its value in the middle, but for clamping at the rim: half a pixel of the mip level
    assert np.abs(albedo[:, 0] - position[:, 0] / 4).max() < 0.03
    assert np.abs(albedo[:, 1] - (1 - position[:, 1] / 4)).max() < 0.03
    assert np.allclose(albedo[:, 2], 0.25)
    assert emission is None


@pytest.mark.parametrize("bilinear", [True, False])
@pytest.mark.parametrize(
    ("wrap", "expected"),
    [("clamp", lambda x: np.clip(x, 0, 1)), ("repeat", lambda x: np.mod(x, 1)), ("mirror", _mirrored)],
)
def test_wrap_modes(wrap: str, expected: object, bilinear: bool) -> None:
    # u' = 2.3 u - 0.6, v' = v
    texture = _ramp((wrap, "clamp"), uv_transform=np.array([[2.3, 0, -0.6], [0, 1, 0]]), bilinear=bilinear)
    albedo, position, *_ = _picture(_textured(texture), 30_000)
    u = 2.3 * position[:, 0] / 4 - 0.6
    jump = np.abs(np.mod(u + 0.5, 1) - 0.5) > 0.1  # away from the seam, where a footprint spans both ends
    assert np.abs(albedo[:, 0] - expected(u))[jump].max() < 0.02  # type: ignore[operator]


@pytest.mark.parametrize("size", [(64, 64), (63, 50), (7, 129)])
@pytest.mark.parametrize("texels", [60, 1000])
def test_fine_detail_averages_to_its_mean(size: tuple[int, int], texels: int) -> None:
    rng = np.random.default_rng(5)
    pixels = rng.uniform(0, 1, (*size, 3)).astype(np.float32)
    texture = Texture("noise", pixels, uv_transform=np.array([[9.0, 0, 0], [0, 9.0, 0]]))
    albedo, *_ = _picture(_textured(texture), texels)
    assert np.abs(albedo.mean(axis=0) - pixels.mean(axis=(0, 1))).max() < 0.02  # 81 repeats against the grid


@pytest.mark.parametrize(("texels", "level"), [(40_000, 0), (600, 3)])
def test_a_checker_keeps_its_mean_and_its_corners(texels: int, level: int) -> None:
    checker = np.indices((8, 8)).sum(axis=0) % 2
    pixels = np.repeat(checker[..., None], 3, axis=2).astype(np.float32)
    fine, position, *_ = _picture(_textured(Texture("checker", pixels, bilinear=False)), texels, level)
    column, row = (position[:, 0] * 2).astype(int), ((4 - position[:, 1]) * 2).astype(int)
    inside = (np.abs(np.mod(position[:, :2] * 2, 1) - 0.5) < 0.4).all(axis=1)
    assert (fine[inside, 0] == (row + column)[inside] % 2).all()
    coarse, *_ = _picture(_textured(Texture("checker", pixels)), 60)
    assert abs(coarse.mean() - 0.5) < 0.01


def test_the_other_texture_coordinates() -> None:
    scene = _textured(_ramp())
    assert scene.uv0 is not None
    swapped = dataclasses.replace(scene, uv1=scene.uv0[..., ::-1])
    texture = dataclasses.replace(scene.materials[1].albedo_texture, texcoord=1)  # type: ignore[type-var]
    swapped = swapped.with_materials((scene.materials[0], Material("t", albedo_texture=texture)))
    albedo, position, *_ = _picture(swapped, 3000)
    assert np.abs(albedo[:, 1] - position[:, 0] / 4).max() < 0.03


def test_both_sides_show_the_same_picture() -> None:
    scene = _textured(_ramp())
    both = dataclasses.replace(scene.materials[1], double_sided=True)
    albedo, position, *_ = _picture(scene.with_materials((scene.materials[0], both)), 8000)
    assert len(position) == 2 * 24**2
    assert np.abs(albedo[:, 0] - position[:, 0] / 4).max() < 0.03


def test_one_where_there_is_no_texture_and_none_where_there_is_none_at_all() -> None:
    lamp = Material("lamp", emission=(1, 1, 1), emission_texture=_ramp())
    plain = scene_of([box_room((6, 6, 6)), shapes.quad(*LEFT_TO_RIGHT)], [Material("wall"), lamp])
    charts = parametrize(plain, texels=3000)
    leaves = uniform_leaves(charts)
    surfaces = texel_surfaces(plain, charts, leaves)
    albedo, emission = texel_colours(plain, charts, leaves, surfaces)
    assert albedo is None and emission is not None
    on_wall = plain.object_ids[charts.face_triangle[surfaces.face]] == 0
    assert (emission[on_wall & (surfaces.face >= 0)] == 1).all()
    assert emission[~on_wall & (surfaces.face >= 0)].max() < 1


@pytest.mark.parametrize("cutoff", [None, 0.5])
@pytest.mark.parametrize("texels", [400, 30_000])
def test_what_is_cut_out_lends_no_colour(texels: int, cutoff: float | None) -> None:
    """White leaves in black that is not there: texels are white, and as much of each is there as the leaves cover."""
    leaves = np.zeros((64, 64, 1), np.float32)
    leaves[8:24, 8:56] = leaves[40:56, 8:56] = 1.0
    seen = Texture("leaves", leaves.repeat(3, axis=2), bilinear=False)
    scene = _textured(seen)
    cut = dataclasses.replace(
        scene.materials[1], opacity_texture=dataclasses.replace(seen, pixels=leaves), opacity_cutoff=cutoff
    )
    scene = scene.with_materials((scene.materials[0], cut))
    albedo, *_ = _picture(scene, texels)
    assert np.abs(albedo - 1.0).max() < 1e-5
    charts = parametrize(scene, texels=texels)
    tiles = uniform_leaves(charts)
    surfaces = texel_surfaces(scene, charts, tiles)
    there = texel_opacity(scene, charts, tiles, surfaces)
    assert there is not None
    of_sheet = scene.material_ids[charts.face_triangle[surfaces.face]] == 1
    area = surfaces.area * of_sheet
    # each texel's look-ups find as much as is there to a sixteenth of what a picture's edge takes of it
    assert (area * there).sum() / area.sum() == pytest.approx(float(leaves.mean()), rel=0.03)
    assert (there[~of_sheet & (surfaces.face >= 0)] == 1).all()
