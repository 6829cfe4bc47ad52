"""The baked GLB: read back by the own loader and by trimesh, and passed by the Khronos validator."""

from __future__ import annotations

import dataclasses
import json
import os
import struct
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
import trimesh
from bake_scenes import CELL, LIT, owners, sides_charts, sides_scene, with_second_uv_set
from khronos import validator_messages

from app.atlas.parametrize import parametrize
from app.bake import write_bake
from app.bake.gltf_materials import texture_transform
from app.bake.gltf_writer import glb_bytes
from app.bake.options import BakeOptions
from app.scene.gltf import load_gltf
from app.scene.gltf_materials import uv_transform
from app.scene.gltf_schema import TextureTransform

F32_STEP = 2.0**-23  # relative spacing of 32-bit floats


def baked(folder, scene, charts):
    """Bake with the number of each face, counted from 1, painted on its texels."""
    covers, owner = owners(charts.face_uv, charts.size)
    painted = np.repeat((owner + 1)[:, :, None], 3, axis=2).astype(np.float32)
    return write_bake(folder, scene, charts, painted, covers > 0, {"shots": 1})


def document_of(glb: bytes) -> dict:
    (length,) = struct.unpack_from("<I", glb, 12)
    return json.loads(glb[20 : 20 + length])


def named(items, name):
    return [item for item in items if item["name"] == name]


def bare_scene():
    """Without pictures, UVs, normals and cameras."""
    scene = sides_scene()
    plain = tuple(dataclasses.replace(m, albedo_texture=None, emission_texture=None) for m in scene.materials)
    return dataclasses.replace(scene, materials=plain, uv0=None, normals=None, cameras=())


SCENES = {
    "sides": sides_scene,
    "far": lambda: sides_scene((3e6, -2e6, 1e6)),
    "bare": bare_scene,
    "two UV sets": lambda: with_second_uv_set(sides_scene(), for_albedo=False),
    "second UV set": lambda: with_second_uv_set(sides_scene(), for_albedo=True),
}


@pytest.mark.parametrize("name", SCENES)
def test_khronos_validator_passes(name, tmp_path):
    scene = SCENES[name]()
    messages = validator_messages(baked(tmp_path, scene, sides_charts(scene)).scene)
    assert [m for m in messages if m["severity"] < 2] == []


def test_the_lightmap_as_a_texture_is_all_that_the_validator_does_not_know(tmp_path):
    scene = sides_scene()
    charts, options = sides_charts(scene), BakeOptions(moz_lightmap=True)
    messages = validator_messages(write_bake(tmp_path, scene, charts, *_black(charts), {}, options).scene)
    assert [m["code"] for m in messages if m["severity"] < 2] == ["IMAGE_UNRECOGNIZED_FORMAT"]


def test_khronos_validator_finds_errors(tmp_path):
    """The check itself can fail."""
    scene = sides_scene()
    glb = glb_bytes(scene, sides_charts(scene), ["missing.exr"]).replace(b'"VEC3"', b'"VEC2"', 1)
    (tmp_path / "broken.glb").write_bytes(glb)
    assert any(m["severity"] == 0 for m in validator_messages(tmp_path / "broken.glb"))


@pytest.mark.parametrize("centre", [(0.0, 0.0, 0.0), (3e6, -2e6, 1e6)])
def test_every_lit_side_comes_back_once_with_its_own_texels(centre, tmp_path):
    scene = sides_scene(centre)
    charts = sides_charts(scene)
    files = baked(tmp_path, scene, charts)
    pixels = OpenEXR.File(str(files.irradiance)).channels()["RGB"].pixels
    read = load_gltf(files.scene)
    lit = np.array([LIT[read.objects[o]] != (False, False) for o in read.object_ids])
    assert lit.sum() == len(charts.face_triangle)
    assert (~lit).sum() == 2  # the hidden square is there, without lightmap

    uv = read.uv1[lit] * charts.size
    x, y = np.floor(uv.mean(axis=1)).astype(int).T
    face = pixels[y, x, 0].astype(int) - 1  # row 0 of the image is v = 0
    assert sorted(face) == list(range(len(face)))
    order = np.where(charts.face_back[face, None], [0, 2, 1], [0, 1, 2])
    turn = np.argmin(np.linalg.norm(uv - charts.face_uv[face, :1], axis=2), axis=1)  # where corner 0 went
    came = (turn[:, None] + np.arange(3)) % 3
    rows = np.arange(len(face))[:, None]
    texel_step = F32_STEP * max(charts.size)
    np.testing.assert_allclose(uv[rows, came], charts.face_uv[face][rows, order], rtol=0, atol=texel_step)
    corners = scene.corners[charts.face_triangle[face]][rows, order]
    # 32-bit positions about the node's translation: 4 radii at most, the scene's is 1.3 m
    np.testing.assert_allclose(read.corners[lit][rows, came], corners, rtol=0, atol=F32_STEP * 5)
    facing = np.where(charts.face_back[face], -1.0, 1.0)
    np.testing.assert_allclose(read.normals_areas[0][lit][:, 2], facing, atol=1e-6)
    np.testing.assert_allclose(read.normals[lit][:, :, 2], np.repeat(facing[:, None], 3, 1))
    uv0 = scene.uv0[charts.face_triangle[face]][rows, order]
    np.testing.assert_array_equal(read.uv0[lit][rows, came], uv0)


def test_materials_come_back(tmp_path):
    scene = sides_scene()
    read = load_gltf(baked(tmp_path, scene, sides_charts(scene)).scene)
    assert read.warnings == ()
    for name, obj in zip(LIT, range(len(LIT)), strict=True):
        source = scene.materials[scene.material_ids[2 * obj]]
        for i in np.unique(read.material_ids[read.object_ids == read.objects.index(name)]):
            material = read.materials[i]
            assert material.name == source.name
            assert material.albedo == source.albedo
            np.testing.assert_allclose(material.emission, source.emission, rtol=1e-15)  # factor × strength
            assert material.double_sided == (source.double_sided and LIT[name] != (True, True))
            for ours, theirs in (
                (source.albedo_texture, material.albedo_texture),
                (source.emission_texture, material.emission_texture),
            ):
                assert (ours is None) == (theirs is None)
                if ours is not None:
                    # 8 bits came in and go out; the curve in between is computed in 32-bit floats
                    np.testing.assert_allclose(theirs.pixels, ours.pixels, rtol=1e-6)
                    np.testing.assert_allclose(theirs.uv_transform, ours.uv_transform, atol=1e-12)
                    assert (theirs.wrap, theirs.bilinear) == (ours.wrap, ours.bilinear)


def test_opacity_comes_back(tmp_path):
    """Of pictures the alpha, to 8 bits: beside a picture of colours, or alone."""
    scene = sides_scene()
    plaster, lamp, paper, dark = scene.materials
    coloured = plaster.albedo_texture
    alpha = dataclasses.replace(coloured, pixels=np.round(coloured.pixels[..., :1] * 255) / np.float32(255))
    given = (
        dataclasses.replace(plaster, opacity_texture=alpha, opacity_cutoff=0.25),
        dataclasses.replace(lamp, opacity_texture=alpha),
        dataclasses.replace(paper, opacity=0.25),
        dark,
    )
    scene = scene.with_materials(given)
    again = load_gltf(baked(tmp_path, scene, sides_charts(scene)).scene)
    for before in given[:3]:
        found = [material for material in again.materials if material.name == before.name]
        assert found
        for after in found:
            assert (after.opacity, after.opacity_cutoff) == (before.opacity, before.opacity_cutoff)
            assert after.albedo == pytest.approx(before.albedo)
            if before.opacity_texture is None:
                assert after.opacity_texture is None
            else:
                assert np.allclose(after.opacity_texture.pixels, before.opacity_texture.pixels, atol=1e-6)
                assert np.allclose(after.opacity_texture.uv_transform, before.opacity_texture.uv_transform)


def test_cameras_come_back(tmp_path):
    scene = sides_scene()
    read = load_gltf(baked(tmp_path, scene, sides_charts(scene)).scene)
    assert [c.name for c in read.cameras] == ["near", "same"]
    for ours, theirs in zip(scene.cameras, read.cameras, strict=True):
        assert theirs.yfov == ours.yfov
        np.testing.assert_allclose(theirs.world_from_camera, ours.world_from_camera, atol=1e-12)


def test_lightmap_scales_come_back(tmp_path):
    scene = sides_scene()
    materials = tuple(dataclasses.replace(m, lightmap_scale=1.0 + k) for k, m in enumerate(scene.materials))
    scene = scene.with_materials(materials)
    read = load_gltf(baked(tmp_path, scene, sides_charts(scene)).scene)
    expected = {m.name: m.lightmap_scale for m in materials}
    assert len(read.materials) > 1 and all(m.lightmap_scale == expected[m.name] for m in read.materials)


@pytest.mark.parametrize("moz_lightmap", [False, True])
def test_lit_materials_name_the_lightmap_and_have_no_specular_lobe(moz_lightmap):
    scene = sides_scene()
    document = document_of(glb_bytes(scene, sides_charts(scene), ["irradiance.exr"], moz_lightmap=moz_lightmap))
    assert ("MOZ_lightmap" in document["extensionsUsed"]) == moz_lightmap
    assert moz_lightmap or all("uri" not in image for image in document["images"])  # only what glTF allows
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            material = document["materials"][primitive["material"]]
            extensions = material.get("extensions", {})
            lit = LIT[mesh["name"]] != (False, False)
            assert ("TEXCOORD_1" in primitive["attributes"]) == lit
            assert ("MOZ_lightmap" in extensions) == (lit and moz_lightmap)
            assert material.get("extras") == ({"lightmap": "irradiance.exr"} if lit else None)
            assert extensions.get("KHR_materials_specular") == ({"specularFactor": 0.0} if lit else None)
            if "MOZ_lightmap" in extensions:
                extension = extensions["MOZ_lightmap"]
                image = document["images"][document["textures"][extension["index"]]["source"]]
                assert image["uri"] == "irradiance.exr"
                assert (extension["texCoord"], extension["intensity"]) == (1, 1.0)
    about = document["scenes"][0]["extras"]["lightmap"]
    assert (about["file"], about["quantity"], about["unit"]) == ("irradiance.exr", "irradiance", "W/m2")


def test_equal_vertices_are_written_once_and_pictures_too():
    scene = sides_scene()
    charts = parametrize(scene, texels=2000)
    document = document_of(glb_bytes(scene, charts, ["irradiance.exr"]))
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            vertices = document["accessors"][primitive["attributes"]["POSITION"]]["count"]
            indices = document["accessors"][primitive["indices"]]
            assert (vertices / indices["count"], indices["componentType"]) == (4 / 6, 5123)
    assert len(named(document["images"], "picture")) == 1


def test_many_vertices_get_wide_indices():
    scene = sides_scene()
    count = 25_000  # × 3 corners with their own positions: more than 16 bits number
    corners = np.random.default_rng(1).normal(size=(3 * count, 3))
    many = dataclasses.replace(
        bare_scene(),
        positions=corners,
        triangles=np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        material_ids=np.full(count, 3, np.int32),
        object_ids=np.zeros(count, np.int32),
    )
    none = np.zeros(0, np.int32)
    charts = dataclasses.replace(
        sides_charts(scene), face_triangle=none, face_back=none.astype(bool), face_uv=np.zeros((0, 3, 2))
    )
    document = document_of(glb_bytes(many, charts, ["irradiance.exr"]))
    (primitive,) = document["meshes"][0]["primitives"]
    assert document["accessors"][primitive["indices"]]["componentType"] == 5125


def test_no_two_triangles_share_texels_and_each_stays_in_its_chart(tmp_path):
    """Real charts: what is read back from the file lies in the charts' rectangles, and nowhere twice."""
    scene = sides_scene()
    charts = parametrize(scene, texels=2000)
    read = load_gltf(write_bake(tmp_path, scene, charts, *_black(charts), {}).scene)
    written = read.uv1.any(axis=(1, 2))
    uv = read.uv1[written].astype(np.float64) * charts.size
    assert len(uv) == len(charts.face_triangle)
    covers, _ = owners(uv, charts.size, per_texel=4)
    assert covers.max() == 1
    slack = F32_STEP * max(charts.size)
    low, high = charts.chart_rects[:, :2], charts.chart_rects[:, :2] + charts.chart_rects[:, 2:]
    within = (uv.min(axis=1)[:, None] >= low - slack) & (uv.max(axis=1)[:, None] <= high + slack)
    assert (within.all(axis=2).sum(axis=1) == 1).all()


def test_trimesh_reads_the_same_geometry(tmp_path):
    scene = sides_scene((3e6, -2e6, 1e6))
    loaded = trimesh.load(baked(tmp_path, scene, sides_charts(scene)).scene)
    assert set(LIT) <= set(loaded.graph.nodes)
    twice = sum(LIT[name] == (True, True) for name in LIT)
    areas = scene.normals_areas[1].sum() * (len(LIT) + twice) / len(LIT)
    assert loaded.area == pytest.approx(areas, rel=1e-6)  # 32-bit positions
    np.testing.assert_allclose(loaded.bounds, scene.bounds, rtol=0, atol=F32_STEP * 5)


@pytest.mark.parametrize("rotation", [0.0, 0.7, -2.5, np.pi])
@pytest.mark.parametrize("scale", [(1.0, 1.0), (2.0, -0.5), (-1.0, 3.0), (0.0, 2.0), (2.0, 0.0)])
def test_texture_transform_is_the_inverse_of_reading(rotation, scale):
    read = uv_transform(TextureTransform(offset=(0.3, -4.0), rotation=rotation, scale=scale))
    again = uv_transform(TextureTransform(**texture_transform(read)))
    np.testing.assert_allclose(again, read, atol=1e-12)  # rounding only


@pytest.mark.skipif("GLOWTREE_SCENES" not in os.environ, reason="GLOWTREE_SCENES names no folder of scenes")
def test_real_scene_passes_the_validator(tmp_path):
    scene = load_gltf(Path(os.environ["GLOWTREE_SCENES"]) / "cornell-box.glb")
    charts = parametrize(scene, texels=20_000)
    messages = validator_messages(write_bake(tmp_path, scene, charts, *_black(charts), {}).scene)
    assert [m for m in messages if m["severity"] < 2] == []


def _black(charts):
    width, height = charts.size
    return np.zeros((height, width, 3), np.float32), np.zeros((height, width), bool)


def test_the_hand_made_charts_do_not_overlap():
    charts = sides_charts(sides_scene())
    covers, _ = owners(charts.face_uv, charts.size)
    assert covers.max() == 1
    assert (
        covers.sum() == len(charts.face_uv) * (CELL - 2) * (CELL - 3) / 2
    )  # triangles of legs 6, without the diagonal
