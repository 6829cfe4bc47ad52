"""Vertex colours of every format, and albedo that is held below 1: from the file to texels and the bake."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import trimesh
from atlas_scenes import box_room, own_cache, scene_of
from scene_files import QUAD, QUAD_INDICES, QUAD_UV, quad_gltf, written

from app.atlas.cuts import cut_at_contacts
from app.atlas.materials import texel_colours
from app.atlas.parametrize import parametrize
from app.atlas.texels import texel_surfaces, uniform_leaves
from app.bake.gltf_writer import glb_bytes
from app.reference.closed_form import no_furnace
from app.reference.patches import make_patches
from app.scene import shapes
from app.scene.arrays import arrays_of
from app.scene.ceiling_light import with_ceiling_light
from app.scene.gltf import load_gltf
from app.scene.load import load_scene
from app.scene.meshfile import load_meshfile
from app.scene.model import MOST_ALBEDO, Material, Scene, Texture
from app.scene.validate import Part, validate

__all__ = ["own_cache"]

FRACTIONS = np.array([[0.8, 0, 0.2], [0, 0.4, 0.2], [0.2, 0.2, 0.2], [0.6, 0.4, 0]], np.float32)  # of 255 and of 65535
LINEAR_188 = 0.502886  # of sRGB 188 of 255, IEC 61966-2-1 by hand


@pytest.mark.parametrize("kind", ["f4", "u1", "u2"])
@pytest.mark.parametrize("channels", [3, 4])
def test_gltf_colours_are_linear_factors(tmp_path: Path, kind: str, channels: int) -> None:
    stored = np.column_stack([FRACTIONS, np.full(4, 0.4, np.float32)])[:, :channels]
    if kind != "f4":
        stored = np.round(stored * np.iinfo(kind).max).astype(kind)
        stored = np.ascontiguousarray(stored)
    gltf = quad_gltf()
    colours = gltf.accessor(stored, normalized=kind != "f4")
    if kind == "u1" and channels == 3:  # the elements of a vertex attribute begin at multiples of 4 bytes
        gltf.json["bufferViews"][-1] |= {"byteStride": 4, "byteLength": 16}
        gltf.data = gltf.data[:-12] + np.pad(stored, ((0, 0), (0, 1))).tobytes()
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = colours
    scene = load_gltf(written(tmp_path, "a.glb", gltf.glb()))
    assert scene.colours is not None and scene.colours.dtype == np.float32 and scene.warnings == ()
    assert np.allclose(scene.colours, FRACTIONS[QUAD_INDICES.reshape(2, 3)], atol=1e-6)  # f32


def test_obj_colours_are_srgb_and_the_albedo_of_what_has_no_material(tmp_path: Path) -> None:
    text = "v 0 0 0 0.737254902 1 0\nv 1 0 0 1 1 0\nv 0 1 0 1 1 0\nusemtl unknown\nf 1 2 3\n"
    scene = load_meshfile(written(tmp_path, "a.obj", text))
    assert scene.colours is not None and scene.materials[0].albedo == (1.0, 1.0, 1.0)
    assert np.allclose(
        scene.colours[0], [[LINEAR_188, MOST_ALBEDO, 0], *[[MOST_ALBEDO, MOST_ALBEDO, 0]] * 2], atol=1e-6
    )
    assert scene.warnings[0] == "1 material is not defined: the colours of their vertices are used"
    written(tmp_path, "a.mtl", "newmtl unknown\nKd 0.5 0.5 0.5\n")
    scene = load_meshfile(
        written(tmp_path, "b.obj", "mtllib a.mtl\nv 5 5 5\n" + text.replace("f 1 2 3", "f 2 3 4\nf 1 2 3"))
    )
    assert scene.materials[0].albedo == (0.5, 0.5, 0.5) and scene.warnings == ()
    assert scene.colours is not None and scene.colours[1, 0].tolist() == [1, 1, 1]  # a vertex that has none


@pytest.mark.parametrize("of", ["vertex", "face"])
def test_ply_colours_are_srgb(tmp_path: Path, of: str) -> None:
    mesh = trimesh.Trimesh(QUAD, QUAD_INDICES.reshape(2, 3), process=False)
    colours = {f"{of}_colors": np.array([[188, 0, 0, 255], [0, 188, 0, 255], [0, 0, 188, 255], [0, 0, 0, 255]])}
    mesh.visual = trimesh.visual.ColorVisuals(mesh, **{k: v[: 4 if of == "vertex" else 2] for k, v in colours.items()})
    mesh.export(tmp_path / "a.ply")
    scene = load_meshfile(tmp_path / "a.ply")
    linear = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0]]) * LINEAR_188
    expected = linear[QUAD_INDICES.reshape(2, 3)] if of == "vertex" else np.repeat(linear[:2, None], 3, axis=1)
    assert scene.colours is not None and np.allclose(scene.colours, expected, atol=1e-6)
    assert scene.materials[0].albedo == (1.0, 1.0, 1.0) and scene.warnings == ()


def test_a_ply_file_with_a_picture_says_so_and_nothing_else(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    head = "ply\nformat ascii 1.0\ncomment TextureFile wood.png\nelement vertex 3\nproperty float x\nproperty float y\n"
    rest = "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    scene = load_scene(written(tmp_path, "a.ply", head + rest), default_light=True)
    assert scene.warnings == ("its picture is ignored: of a PLY file, only the colours of vertices and faces are read",)
    assert capfd.readouterr() == ("", "") and scene.colours is None


def _painted_room(texture: Texture | None = None) -> Scene:
    """A room of 4 m whose red grows with x, and whose green is 0.5."""
    scene = scene_of([box_room((4, 4, 4))], [Material("m", (0.8, 0.8, 0.8), albedo_texture=texture)])
    low, high = scene.bounds
    red = (scene.corners[..., 0] - low[0]) / (high[0] - low[0])
    colours = np.stack([red, np.full_like(red, 0.5), np.ones_like(red)], axis=2).astype(np.float32)
    return dataclasses.replace(scene, colours=colours)


def test_texels_have_the_colour_of_their_centroid() -> None:
    picture = Texture("grey", np.full((1, 1, 3), 0.25, np.float32))
    for texture, factor in ((None, 1.0), (picture, 0.25)):
        scene = _painted_room(texture)
        charts = parametrize(scene, texels=600)
        surfaces = texel_surfaces(scene, charts, uniform_leaves(charts))
        albedo, emission = texel_colours(scene, charts, uniform_leaves(charts), surfaces)
        there = surfaces.face >= 0
        assert albedo is not None and emission is None
        red = (surfaces.position[there][:, 0] - scene.bounds[0][0]) / 4
        assert np.allclose(albedo[there], factor * np.stack([red, red * 0 + 0.5, red * 0 + 1], 1), atol=1e-5)


def test_the_reference_the_digest_and_the_bake_have_the_colours(tmp_path: Path) -> None:
    scene = _painted_room()
    assert "colours" in arrays_of(scene) and no_furnace(scene) == "not all surfaces are alike"
    patches = make_patches(scene, 100)
    red = (patches.corners.mean(axis=1)[:, 0] - scene.bounds[0][0]) / 4
    assert np.allclose(patches.albedo[:, 0], 0.8 * red, atol=1e-6)
    back = load_gltf(written(tmp_path, "b.glb", glb_bytes(scene, parametrize(scene, texels=600), ["x.exr"])))
    low = scene.bounds[0][0]
    assert back.colours is not None and np.allclose(back.colours[..., 0], (back.corners[..., 0] - low) / 4, atol=1e-6)
    lit = with_ceiling_light(scene)
    assert lit.colours is not None and len(lit.colours) == len(lit.triangles)


WHITE, GREY = Material("white", (1.0, 1.0, 1.0)), Material("grey", (0.5, 0.5, 0.5))


def _held(materials: list[Material], colours: np.ndarray | None = None) -> Scene:
    triangles = QUAD_INDICES.reshape(2, 3)
    parts = [
        Part(QUAD + np.array([0, 0, k]), triangles, 0, k, uv0=QUAD_UV, colours=colours) for k in range(len(materials))
    ]
    return validate("f", "s", parts, ["o"], materials)


def test_nothing_reflects_all_light() -> None:
    scene = _held([WHITE, GREY, Material("brighter", (0.2, 3.0, 0.995))])
    assert [m.albedo for m in scene.materials] == [(0.99,) * 3, (0.5,) * 3, (0.2, 0.99, 0.99)]
    assert scene.warnings == ("2 materials with an albedo above 0.99: held there",)


def test_what_varies_is_held_only_where_it_is_too_bright() -> None:
    pixels = np.array([[[1, 0.995, 0.3], [0.98, 0.5, 1]]], np.float32)
    picture = Texture("p", pixels)
    scene = _held([dataclasses.replace(m, albedo_texture=picture) for m in (WHITE, GREY)])
    white, grey = scene.materials
    assert white.albedo_texture is not None and grey.albedo_texture is picture and white.albedo == (1.0, 1.0, 1.0)
    assert np.array_equal(white.albedo_texture.pixels, np.minimum(pixels, np.float32(MOST_ALBEDO)))
    colours = np.array([[1, 0.7, 0.2]] * 4, np.float32)
    scene = _held([WHITE, GREY], colours)
    assert scene.materials[0].albedo == (1.0, 1.0, 1.0) and scene.colours is not None
    assert np.allclose(scene.colours[:2], [MOST_ALBEDO, 0.7, 0.2]) and np.allclose(scene.colours[2:], [1, 0.7, 0.2])
    assert len(scene.warnings) == 1


def test_colours_out_of_range_are_clamped_and_counted() -> None:
    colours = np.array([[-1, 0.5, 0.5], [0.5, 0.5, 7], [0.5, np.nan, 0.5], [0.5, 0.5, 0.5]], np.float32)
    scene = _held([GREY], colours)
    assert scene.warnings == ("2 triangles with vertex colours outside 0 to 1: clamped",)
    assert scene.colours is not None and scene.colours[0].tolist() == [[0, 0.5, 0.5], [0.5, 0.5, 1], [0.5, 1, 0.5]]


def test_cut_triangles_keep_their_colours() -> None:
    wall = shapes.quad((0, -2, -2), (0, 3, 0), (0, 0, 4))
    scene = scene_of([box_room((4, 4, 4)), wall], [GREY, GREY])
    low = scene.bounds[0][0]
    red = ((scene.corners[..., 0] - low) / 4).astype(np.float32)
    cut = cut_at_contacts(dataclasses.replace(scene, colours=np.stack([red, red, red], axis=2))).scene
    assert len(cut.triangles) > len(scene.triangles) and cut.colours is not None
    assert np.allclose(cut.colours[..., 0], (cut.corners[..., 0] - low) / 4, atol=1e-6)
