"""The glTF reader: every feature that it claims, against numbers known by hand."""

from __future__ import annotations

import math
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scene_files import QUAD, QUAD_INDICES, QUAD_UV, png, quad_gltf, written

from app.errors import SceneError
from app.scene.gltf import load_gltf
from app.scene.gltf_materials import uv_transform
from app.scene.gltf_schema import TextureTransform
from app.scene.model import Scene


def load(folder: Path, data: bytes, name: str = "a.glb") -> Scene:
    return load_gltf(written(folder, name, data))


@pytest.mark.parametrize("name", ["a.glb", "a.gltf"])
def test_quad_as_glb_and_as_json_with_data_uri(tmp_path: Path, name: str) -> None:
    gltf = quad_gltf()
    scene = load(tmp_path, gltf.glb() if name == "a.glb" else gltf.gltf(), name)
    assert np.array_equal(scene.corners, QUAD[QUAD_INDICES.reshape(2, 3)])
    assert scene.uv0 is not None and np.array_equal(scene.uv0, QUAD_UV[QUAD_INDICES.reshape(2, 3)])
    assert scene.normals is not None and np.array_equal(scene.normals[..., 2], np.ones((2, 3)))
    assert scene.objects == ("quad",) and scene.name == "a" and scene.warnings == ()


def test_material_keeps_exact_factors_and_sampler(tmp_path: Path) -> None:
    (material,) = load(tmp_path, quad_gltf().glb()).materials
    assert material.albedo == (0.1234, 0.0019, 0.75)
    assert material.emission == (8.0, 4.0, 2.0)
    assert material.double_sided and material.name == "paint"
    texture = material.albedo_texture
    assert texture is not None and texture.wrap == ("clamp", "mirror") and not texture.bilinear
    assert np.allclose(texture.pixels[0], [[1, 0, 0], [0, 1, 0]])
    # IEC 61966-2-1 by hand: ((188/255 + 0.055) / 1.055)^2.4
    assert texture.pixels[1, 1, 0] == pytest.approx(0.502886, abs=1e-5)  # f32 power


def test_camera_is_rigid_below_a_scaled_node(tmp_path: Path) -> None:
    gltf = quad_gltf()
    gltf.json["nodes"] += [{"children": [1], "scale": [10, 10, 10], "translation": [0, 1, 0]}]
    gltf.json["scenes"] = [{"nodes": [0, 2]}]
    (camera,) = load(tmp_path, gltf.glb()).cameras
    assert np.allclose(camera.world_from_camera, [[1, 0, 0, 5], [0, 1, 0, 11], [0, 0, 1, 30], [0, 0, 0, 1]])
    assert camera.name == "eye" and camera.yfov == 0.8


TURN = [0.0, math.sin(math.pi / 4), 0.0, math.cos(math.pi / 4)]  # a quarter about +y: x to -z, z to x
PLACES: dict[str, tuple[dict[str, Any], Any, Any]] = {  # node -> normal of the quad, its corner (1, 2, 0)
    "translation": ({"translation": [1, 2, 3]}, [0, 0, 1], [2, 4, 3]),
    "rotation": ({"rotation": TURN}, [1, 0, 0], [0, 2, -1]),
    "unnormalised rotation": ({"rotation": [0, 3, 0, 3]}, [1, 0, 0], [0, 2, -1]),
    "scale": ({"scale": [2, 3, 1]}, [0, 0, 1], [2, 6, 0]),
    "all": ({"translation": [0, 0, 5], "rotation": TURN, "scale": [2, 1, 1]}, [1, 0, 0], [0, 2, 3]),
    "mirror": ({"scale": [-1, 1, 1]}, [0, 0, 1], [-1, 2, 0]),
    "mirror in z": ({"scale": [1, 1, -1]}, [0, 0, -1], [1, 2, 0]),
    "matrix": ({"matrix": [0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 7, 8, 9, 1]}, [1, 0, 0], [7, 10, 8]),
}


@pytest.mark.parametrize("name", PLACES)
def test_node_transform(tmp_path: Path, name: str) -> None:
    node, normal, corner = PLACES[name]
    gltf = quad_gltf()
    gltf.json["nodes"][0] |= node
    scene = load(tmp_path, gltf.glb())
    assert np.allclose(scene.normals_areas[0], normal)
    assert scene.normals is not None and np.allclose(scene.normals, normal, atol=1e-6)  # f32
    assert np.isclose(scene.corners.reshape(-1, 3), corner).all(axis=1).any()


def test_nodes_share_a_mesh_and_parents_move_children(tmp_path: Path) -> None:
    gltf = quad_gltf()
    gltf.json["nodes"] = [
        {"mesh": 0, "name": "a", "children": [1], "translation": [10, 0, 0]},
        {"mesh": 0, "name": "b", "translation": [0, 5, 0]},
    ]
    scene = load(tmp_path, gltf.glb().replace(b'"nodes": [0, 1]}]', b'"nodes": [0]}]   '))
    assert scene.objects == ("a", "b") and list(scene.object_ids) == [0, 0, 1, 1]
    assert np.allclose(scene.corners[2:].min(axis=(0, 1)), [10, 5, 0])


def test_gpu_instances(tmp_path: Path) -> None:
    gltf = quad_gltf()
    moves, sizes = np.array([[0, 0, 0], [5, 0, 0]], np.float32), np.array([[1, 1, 1], [-2, 2, 2]], np.float32)
    attributes = {"TRANSLATION": gltf.accessor(moves), "SCALE": gltf.accessor(sizes)}
    gltf.json["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    scene = load(tmp_path, gltf.glb())
    normals, areas = scene.normals_areas
    assert np.allclose(areas, [1, 1, 4, 4]) and np.allclose(normals, [0, 0, 1])
    assert np.allclose(scene.bounds, [[0, 0, 0], [5, 4, 0]])


MODES = {
    "strip": (5, [0, 1, 3, 2], [[0, 1, 3], [1, 2, 3]]),
    "fan": (6, [0, 1, 2, 3], [[0, 1, 2], [0, 2, 3]]),
}


@pytest.mark.parametrize("name", MODES)
def test_primitive_modes(tmp_path: Path, name: str) -> None:
    mode, indices, triangles = MODES[name]
    gltf = quad_gltf(indices=np.array(indices, np.uint8))
    gltf.json["meshes"][0]["primitives"][0]["mode"] = mode
    scene = load(tmp_path, gltf.glb())
    assert np.allclose(scene.normals_areas[0], [0, 0, 1])
    found = {frozenset(map(tuple, t)) for t in scene.corners}
    assert found == {frozenset(map(tuple, QUAD[t])) for t in triangles}


@pytest.mark.parametrize("kind", ["u1", "u2", "u4"])
def test_index_types_and_none(tmp_path: Path, kind: str) -> None:
    assert len(load(tmp_path, quad_gltf(indices=QUAD_INDICES.astype(kind)).glb()).triangles) == 2
    gltf = quad_gltf(positions=QUAD[[0, 1, 2, 3]])
    primitive = gltf.json["meshes"][0]["primitives"][0]
    del primitive["indices"], primitive["attributes"]["NORMAL"], primitive["attributes"]["TEXCOORD_0"]
    primitive["attributes"]["POSITION"] = gltf.accessor(QUAD[:3])
    assert len(load(tmp_path, gltf.glb()).triangles) == 1


@pytest.mark.parametrize(("kind", "one"), [("u1", 255), ("u2", 65535), ("i1", 127), ("i2", 32767)])
def test_normalized_texture_coordinates(tmp_path: Path, kind: str, one: int) -> None:
    gltf = quad_gltf()
    uv = gltf.accessor((QUAD_UV * one).astype(kind), normalized=True)
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uv
    scene = load(tmp_path, gltf.glb())
    assert scene.uv0 is not None and np.array_equal(scene.uv0, QUAD_UV[QUAD_INDICES.reshape(2, 3)])


def test_signed_normalized_values_end_at_minus_one(tmp_path: Path) -> None:
    gltf = quad_gltf()
    uv = gltf.accessor(np.array([[-128, -127], [-64, 0], [127, 1], [0, 0]], np.int8), normalized=True)
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uv
    scene = load(tmp_path, gltf.glb())
    expected = np.array([[-1, -1], [-64 / 127, 0], [1, 1 / 127]], np.float32)
    assert scene.uv0 is not None and np.array_equal(scene.uv0[0], expected)


def test_interleaved_and_sparse_accessors(tmp_path: Path) -> None:
    gltf = quad_gltf()
    mixed = np.concatenate([QUAD, QUAD_UV], axis=1)
    view = gltf.view(mixed.tobytes(), byteStride=20)
    gltf.json["accessors"][0] |= {"bufferView": view, "byteOffset": 0}
    gltf.json["accessors"][1] |= {"bufferView": view, "byteOffset": 12}
    spots, values = gltf.view(np.array([2], np.uint8).tobytes()), gltf.view(np.array([9, 9, 0], np.float32).tobytes())
    gltf.json["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": spots, "componentType": 5121},
        "values": {"bufferView": values},
    }
    scene = load(tmp_path, gltf.glb())
    assert np.allclose(scene.corners[0], [[0, 0, 0], [1, 0, 0], [9, 9, 0]])
    assert scene.uv0 is not None and np.array_equal(scene.uv0[0], QUAD_UV[:3])


def test_texture_transform_is_the_specifications_example() -> None:
    """Offset (0, 1), a quarter turn, scale 0.5: "only the lower left quadrant of the source image, rotated"."""
    matrix = uv_transform(TextureTransform(offset=(0, 1), rotation=math.pi / 2, scale=(0.5, 0.5)))
    used = np.array([(u, v, 1.0) for u in (0, 1) for v in (0, 1)]) @ matrix.T
    assert np.allclose([used.min(axis=0), used.max(axis=0)], [[0.0, 0.5], [0.5, 1.0]])


def test_texture_uses_the_second_coordinates_where_the_transform_says_so(tmp_path: Path) -> None:
    gltf = quad_gltf()
    info = gltf.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]
    info["extensions"] = {"KHR_texture_transform": {"texCoord": 1, "scale": [3, 1]}}
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = gltf.accessor(QUAD_UV * np.float32(0.5))
    scene = load(tmp_path, gltf.glb())
    texture = scene.materials[0].albedo_texture
    assert texture is not None and texture.texcoord == 1 and texture.uv_transform[0, 0] == 3.0
    assert scene.uv1 is not None and scene.uv1.max() == 0.5


def test_picture_in_a_file_beside_and_never_outside(tmp_path: Path) -> None:
    folder = tmp_path / "scene"
    folder.mkdir()
    red = png([[[255, 0, 0]]])
    written(folder, "red paint.png", red)
    written(tmp_path, "secret.png", red)
    for uri, readable in [
        ("red%20paint.png", True),
        ("Red Paint.PNG", True),
        ("../secret.png", False),
        (str(tmp_path / "secret.png"), False),
    ]:
        gltf = quad_gltf()
        gltf.json["images"] = [{"uri": uri}]
        scene = load(folder, gltf.glb())
        assert (scene.materials[0].albedo_texture is not None) == readable
        assert any(f"1 picture is missing in the scene's folder ('{uri}')" in w for w in scene.warnings) != readable
        gltf.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = [1, 1, 1, 1]  # stands for the picture
        assert load(folder, gltf.glb()).materials[0].albedo[1] == (1.0 if readable else 0.5)


def test_262_thousand_triangles_load_in_under_two_seconds(tmp_path: Path) -> None:
    across, down = 513, 257
    x, z = np.meshgrid(np.arange(across), np.arange(down))
    positions = np.stack([x, np.sin(x + z), z], axis=2).reshape(-1, 3).astype(np.float32)
    a = (np.arange(down - 1)[:, None] * across + np.arange(across - 1)).reshape(-1)
    quads = np.stack([a, a + across, a + 1, a + 1, a + across, a + across + 1], axis=1)
    gltf = quad_gltf()
    primitive = gltf.json["meshes"][0]["primitives"][0]
    primitive["attributes"] = {"POSITION": gltf.accessor(positions)}
    primitive["indices"] = gltf.accessor(quads.reshape(-1).astype(np.uint32))
    path = written(tmp_path, "large.glb", gltf.glb())
    start = time.process_time()  # not the clock on the wall: other tests may run beside this one
    scene = load_gltf(path)
    assert len(scene.triangles) == 262_144
    assert time.process_time() - start < 2.0


def test_of_variants_the_default_is_read(tmp_path: Path) -> None:
    gltf = quad_gltf()
    gltf.json["materials"].append({"name": "other", "pbrMetallicRoughness": {"baseColorFactor": [0.3, 0.3, 0.3, 1]}})
    gltf.json["extensionsRequired"] = gltf.json["extensionsUsed"] = ["KHR_materials_variants"]
    gltf.json["extensions"] = {"KHR_materials_variants": {"variants": [{"name": "worn"}]}}
    mappings = {"mappings": [{"material": 1, "variants": [0]}]}
    gltf.json["meshes"][0]["primitives"][0]["extensions"] = {"KHR_materials_variants": mappings}
    scene = load(tmp_path, gltf.glb())
    assert scene.materials[scene.material_ids[0]].name == "paint" and scene.warnings == ()


@pytest.mark.parametrize(
    ("extras", "scale"), [({"lightmap_scale": 2, "more": [1]}, 2.0), ({}, 1.0), ("any", 1.0), ([1], 1.0)]
)
def test_extras_of_a_material_have_its_lightmap_scale(tmp_path: Path, extras: Any, scale: float) -> None:
    gltf = quad_gltf()
    gltf.json["materials"][0]["extras"] = extras
    assert load(tmp_path, gltf.glb()).materials[0].lightmap_scale == scale


@pytest.mark.parametrize("scale", [0, -1, 100, "two"])
def test_a_lightmap_scale_that_is_none_is_one_line(tmp_path: Path, scale: Any) -> None:
    gltf = quad_gltf()
    gltf.json["materials"][0]["extras"] = {"lightmap_scale": scale}
    with pytest.raises(SceneError, match="lightmap_scale"):
        load(tmp_path, gltf.glb())


@pytest.mark.parametrize(
    ("mode", "alpha", "said"), [("BLEND", 0.5, True), ("MASK", 0.5, True), ("OPAQUE", 0.5, False), ("BLEND", 1, False)]
)
def test_alpha_of_vertices_is_noted(tmp_path: Path, mode: str, alpha: float, said: int) -> None:
    gltf = quad_gltf()
    gltf.json["materials"][0]["alphaMode"] = mode
    colours = np.array([[1, 1, 1, alpha]] * 4, np.float32)
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = gltf.accessor(colours)
    notes = load(tmp_path, gltf.glb()).warnings
    assert notes == (("1 primitive with alpha of vertices: not seen through",) if said else ())


def test_instances_may_have_values_of_their_own_alone(tmp_path: Path) -> None:
    gltf = quad_gltf()
    attributes = {"_ID": gltf.accessor(np.array([0], np.float32))}
    gltf.json["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
    assert len(load(tmp_path, gltf.glb()).triangles) == 2
