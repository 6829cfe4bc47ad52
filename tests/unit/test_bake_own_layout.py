"""A lightmap in the layout that the file brings along: kept to the bit, with the light where it belongs; else a reason."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from atlas_scenes import box_room, own_cache, scene_of
from numpy.typing import NDArray
from scene_files import written

from app.atlas.parametrize import parametrize
from app.atlas.texels import texel_surfaces, uniform_leaves
from app.bake.gltf_writer import glb_bytes
from app.bake.own_layout import Laid, laid_out, why_not_kept
from app.scene import shapes
from app.scene.gltf import load_gltf
from app.scene.model import F64, Material, Scene

__all__ = ["own_cache"]

GRADIENT = np.array([[0.3, 0.1, 0.0], [0.0, 0.2, 0.1], [0.1, 0.0, 0.4]])  # of irradiance [W/m²] per metre along x, y, z


def _room(uv1: NDArray[np.float64] | None = None) -> Scene:
    """A room of 4 × 3 × 5 m and a black lamp; each wall in a cell of its own of the layout, some of them mirrored."""
    lamp = shapes.quad((-0.5, 1.4, -0.5), (1, 0, 0), (0, 0, 1))
    materials = [Material("wall"), Material("lamp", (0.0, 0.0, 0.0), (5.0, 5.0, 5.0))]
    scene = scene_of([box_room(), lamp], materials)
    assert len(scene.triangles) == 14
    layout = np.zeros((14, 3, 2))
    corners, normals = scene.corners, scene.normals_areas[0]
    for k in range(6):
        axis = int(np.argmax(np.abs(normals[2 * k])))
        flat = np.delete(corners[2 * k : 2 * k + 2], axis, axis=2)
        low, high = flat.min(axis=(0, 1)), flat.max(axis=(0, 1))
        cell = (flat - low) / (high - low)
        layout[2 * k : 2 * k + 2] = (0.08 + 0.84 * cell + [k % 3, k // 3]) / [3, 2]
    return dataclasses.replace(scene, uv1=(layout if uv1 is None else uv1).astype(np.float32))


def _light(position: F64) -> F64:
    return np.asarray(2.0 + position @ GRADIENT)


def _solved(scene: Scene, texels: int) -> Laid:
    """Light that grows linearly, as texels hold it."""
    charts = parametrize(scene, texels=texels)
    leaves = uniform_leaves(charts)
    surfaces = texel_surfaces(scene, charts, leaves)
    tile, row, column = np.nonzero(surfaces.face >= 0)
    where = leaves.y[tile] * charts.tile + row, leaves.x[tile] * charts.tile + column
    image, covered = np.zeros((*charts.size[::-1], 3), np.float32), np.zeros(charts.size[::-1], bool)
    image[where], covered[where] = _light(surfaces.position[tile, row, column]), True
    return Laid(charts, image, covered)


def test_the_layout_is_kept_and_holds_the_light(tmp_path: Path) -> None:
    scene = _room()
    solved = _solved(scene, 6000)
    assert why_not_kept(scene, solved) is None
    laid = laid_out(scene, solved)
    assert laid.covered.sum() == pytest.approx(
        solved.covered.sum(), rel=0.2
    )  # rims are cut, not whole texels; tiles are whole
    leaves = uniform_leaves(laid.charts)
    surfaces = texel_surfaces(scene, laid.charts, leaves)
    tile, row, column = np.nonzero(surfaces.face >= 0)
    where = leaves.y[tile] * laid.charts.tile + row, leaves.x[tile] * laid.charts.tile + column
    off = np.abs(laid.irradiance[where] - _light(surfaces.position[tile, row, column]))
    # bilinear look-ups are exact for what is linear, but at rims, where what lies beyond repeats the last texel: half a texel
    assert off.max() <= 0.5 * np.abs(GRADIENT).sum(axis=0).max() / solved.charts.density
    assert np.median(off) < 1e-3
    back = load_gltf(written(tmp_path, "b.glb", glb_bytes(scene, laid.charts, ["x.exr"])))
    assert back.uv1 is not None and scene.uv1 is not None and len(back.triangles) == 14
    for corners, uv in zip(scene.corners[:12], scene.uv1[:12], strict=True):
        same = np.flatnonzero(np.isclose(back.corners, corners, atol=1e-6).all(axis=(1, 2)))
        assert len(same) == 1 and np.array_equal(back.uv1[same[0]], uv)


def _changed(triangle: int, uv: object) -> NDArray[np.float64]:
    layout = _room().uv1
    assert layout is not None
    changed = layout.astype(np.float64)
    changed[triangle] = uv
    return changed


AGAINST = {
    "1 of 12 triangles have no area in it": lambda: _room(_changed(3, 0.0)),
    "1 of 12 triangles have corners outside of 0 to 1": lambda: _room(
        _changed(3, [[0.9, 0.9], [1.1, 0.9], [0.9, 1.0]])
    ),
    "2 of 12 triangles have places in common with others": lambda: _room(_changed(3, _changed(0, 0.0)[8])),
    "there is none": lambda: dataclasses.replace(_room(), uv1=None),
}


@pytest.mark.parametrize("reason", AGAINST)
def test_why_it_is_not_kept(reason: str) -> None:
    scene = AGAINST[reason]()
    found = why_not_kept(scene, _solved(scene, 500))
    assert found == reason


def test_squares_of_objects_are_placed_side_by_side(tmp_path: Path) -> None:
    room = _room()
    assert room.uv1 is not None
    box = shapes.box((1.0, 0.75, 1.25))
    scene = scene_of([box_room(), box], [room.materials[0]])
    scene = dataclasses.replace(scene, uv1=np.concatenate([room.uv1[:12]] * 2))
    solved = _solved(scene, 6000)
    assert why_not_kept(scene, solved) is None
    laid = laid_out(scene, solved)
    assert laid.squares == 2
    back = load_gltf(written(tmp_path, "b.glb", glb_bytes(scene, laid.charts, ["x.exr"])))
    assert back.uv1 is not None and back.uv1.min() >= 0.0 and back.uv1.max() <= 1.0
    assert why_not_kept(back, _solved(back, 500)) is None  # in one square now
    ratio = []
    for k in range(2):  # each moved and scaled
        own, now = (
            scene.uv1[scene.object_ids == k],
            laid.charts.face_uv[scene.object_ids[laid.charts.face_triangle] == k],
        )
        side = np.ptp(now, axis=(0, 1)) / np.ptp(own, axis=(0, 1))
        assert np.allclose(now, own * side + now.min((0, 1)) - own.min((0, 1)) * side, atol=1e-3)
        ratio.append(side)
    assert np.allclose(ratio[0] / ratio[1], 4.0, rtol=0.05)  # the box is 4 times as small; whole texels


def test_what_something_stands_on_is_no_texel() -> None:
    room = _room()
    assert room.uv1 is not None
    box = shapes.box((1.0, 1.0, 1.0)).transformed(shapes.transform((0.0, -1.0, 0.0), (0.0, 0.0, 0.0), 1.0))
    scene = scene_of([box_room(), box], [room.materials[0]])
    scene = dataclasses.replace(scene, uv1=np.concatenate([room.uv1[:12]] * 2))
    solved = _solved(scene, 6000)
    assert len(solved.charts.hidden_uv)
    laid = laid_out(scene, solved)
    surfaces = texel_surfaces(scene, laid.charts, uniform_leaves(laid.charts))
    of_room = (surfaces.face >= 0) & (scene.object_ids[laid.charts.face_triangle[surfaces.face]] == 0)
    floor = surfaces.position[of_room & (np.abs(surfaces.position[..., 1] + 1.5) < 1e-6)]
    # where a corner of the box lies in a texel, light is taken beside it, from places an eighth of a texel apart
    assert len(floor) > 500 and np.abs(floor[:, [0, 2]]).max(axis=1).min() > 0.5 - 0.25 / solved.charts.density


def test_sides_of_a_sheet_have_one_place_unless_no_light_comes_to_one() -> None:
    room = _room()
    assert room.uv1 is not None
    wall = shapes.quad((0, -1, -1), (0, 1, 0), (0, 0, 1))
    scene = scene_of([box_room(), wall], [room.materials[0], Material("sheet", double_sided=True)])
    uv1 = np.concatenate([room.uv1[:12], 0.05 * np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]])])
    scene = dataclasses.replace(scene, uv1=uv1.astype(np.float32))
    solved = _solved(scene, 2000)
    assert why_not_kept(scene, solved) == "2 triangles are lit on both sides, which have one place in it"
    sheet = solved.charts.face_triangle >= 12
    for back in (False, True):
        dark = np.zeros_like(solved.covered)
        for chart in np.unique(solved.charts.face_chart[sheet & (solved.charts.face_back == back)]):
            x, y, width, height = solved.charts.chart_rects[chart]
            dark[y : y + height, x : x + width] = True
        laid = laid_out(scene, dataclasses.replace(solved, irradiance=np.where(dark[..., None], 0, solved.irradiance)))
        kept = laid.charts.face_triangle >= 12
        assert kept.sum() == 2 and (laid.charts.face_back[kept] != back).all()
