"""A glTF file with what a bake adds: all that it brought along is there still, and the light lies on the same triangles."""

from __future__ import annotations

import dataclasses
import io
import json
import struct

import numpy as np
import pytest
from khronos import validator_messages
from PIL import Image
from scene_files import QUAD, QUAD_INDICES, QUAD_UV, Gltf, written

from app.atlas.charts_cache import charts_of
from app.atlas.options import AtlasOptions
from app.bake import write_bake
from app.scene.ceiling_light import with_ceiling_light
from app.scene.load import load_scene
from app.scene.options import FileOptions


def jpeg() -> bytes:
    out = io.BytesIO()
    Image.fromarray(np.full((8, 8, 3), 120, np.uint8)).save(out, "JPEG")
    return out.getvalue()


def rich_gltf() -> Gltf:
    """A tree of nodes whose materials have all that does not change the light: a mirrored mesh, one placed three times, one that
    is posed, a lamp lit on both sides, lines, an animation and a camera."""
    gltf = Gltf()
    tangents = np.tile(np.float32([1, 0, 0, 1]), (4, 1))
    colours = np.array([[255, 128, 0, 64]] * 4, np.uint8)
    quad = {
        "POSITION": gltf.accessor(QUAD, min=QUAD.min(0).tolist(), max=QUAD.max(0).tolist()),
        "NORMAL": gltf.accessor(np.tile(np.float32([0, 0, 1]), (4, 1))),
        "TANGENT": gltf.accessor(tangents),
        "TEXCOORD_0": gltf.accessor(QUAD_UV),
        "TEXCOORD_1": gltf.accessor(1 - QUAD_UV),
        "COLOR_0": gltf.accessor(colours, normalized=True),
        "_AGE": gltf.accessor(np.arange(4, dtype=np.float32)),
    }
    bare = {"POSITION": quad["POSITION"]}
    indices = gltf.accessor(QUAD_INDICES)
    line = gltf.accessor(np.float32([[0, 0, 0], [1, 1, 1]]), min=[0, 0, 0], max=[1, 1, 1])
    moved = gltf.accessor(np.float32([[0, 0, 0.5]] * 4), min=[0, 0, 0.5], max=[0, 0, 0.5])
    times = gltf.accessor(np.float32([0, 1]), min=[0], max=[1])
    places = gltf.accessor(np.float32([[0, 0, 4], [3, 0, 4], [6, 0, 4]]))
    gltf.json |= {
        "images": [{"bufferView": gltf.view(jpeg()), "mimeType": "image/jpeg", "name": "plaster"}],
        "samplers": [{}],
        "textures": [{"source": 0, "sampler": 0}],
        "materials": [
            {
                "name": "wall",
                "pbrMetallicRoughness": {
                    "roughnessFactor": 0.25,
                    "metallicFactor": 0.0,
                    "baseColorTexture": {"index": 0},
                },
                "normalTexture": {"index": 0, "texCoord": 1, "scale": 0.5},
                "extras": {"shop": "paint"},
            },
            {"name": "lamp", "emissiveFactor": [1, 1, 1], "doubleSided": True},
            {"name": "nobody's"},
        ],
        "meshes": [
            {
                "name": "wall",
                "primitives": [{"attributes": quad, "indices": indices, "material": 0, "extras": {"a": 1}}],
            },
            {"name": "sheet", "primitives": [{"attributes": bare, "indices": indices, "material": 1}]},
            {
                "primitives": [{"attributes": bare, "indices": indices, "targets": [{"POSITION": moved}]}],
                "weights": [1],
            },
            {"primitives": [{"attributes": {"POSITION": line}, "mode": 1}]},
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.9, "znear": 0.1}}],
        "nodes": [
            {"name": "house", "children": [1, 2, 3, 4, 5, 6], "scale": [1, 1, -1], "extras": {"storey": 2}},
            {"name": "mirrored wall", "mesh": 0, "translation": [0, 0, 1]},
            {"name": "lamp", "mesh": 1, "translation": [0.2, 0.2, -2], "scale": [0.3, 0.3, 1]},
            {
                "name": "row",
                "mesh": 0,
                "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}},
            },
            {"name": "posed", "mesh": 2, "translation": [-3, 0, 0]},
            {"name": "string", "mesh": 3},
            {"name": "eye", "camera": 0, "translation": [0, 0, -8]},
        ],
        "animations": [
            {
                "name": "sway",
                "samplers": [{"input": times, "output": gltf.accessor(np.float32([[0, 0, 1], [0, 0, 1]]))}],
                "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}],
            }
        ],
        "scenes": [{"name": "street", "nodes": [0]}],
        "scene": 0,
        "extensionsUsed": ["EXT_mesh_gpu_instancing"],
        "extensionsRequired": ["EXT_mesh_gpu_instancing"],
    }
    return gltf


def baked(folder, path, *, file=None, light=False, edit=lambda scene: scene):
    """The scene as it is lit, its charts, and the files of a bake of it, in which irradiance is the number of the face."""
    read = load_scene(path, file)
    scene, charts = charts_of(with_ceiling_light(read) if light else read, AtlasOptions(texels=3000))
    black = np.zeros((charts.size[1], charts.size[0], 3), np.float32)
    files = write_bake(folder / "out", edit(scene), charts, black, black[..., 0] > 0, {}, unedited=scene)
    return scene, charts, files


def document_of(path) -> tuple[dict, bytes]:
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length]), data[28 + length :]


def picture(document, binary, number) -> bytes:
    view = document["bufferViews"][document["images"][number]["bufferView"]]
    return binary[view["byteOffset"] :][: view["byteLength"]]


@pytest.fixture
def rich(tmp_path):
    return written(tmp_path, "rich.glb", rich_gltf().glb())


@pytest.mark.parametrize("file", [None, FileOptions(unit="mm", up="z")])
def test_light_lies_on_the_same_triangles(tmp_path, rich, file):
    scene, charts, files = baked(tmp_path, rich, file=file, light=True)
    back = load_scene(files.scene, FileOptions(unit="m", up="y"))
    place = (back.uv1 * charts.size).mean(1)
    size = np.ptp(scene.corners, axis=(0, 1)).max()
    middle = scene.corners.mean(1)[charts.face_triangle]
    near = np.linalg.norm(charts.face_uv.mean(1)[:, None] - place, axis=2) < 1e-3  # texels
    near &= np.linalg.norm(middle[:, None] - back.corners.mean(1), axis=2) < 1e-6 * size
    facing = np.where(charts.face_back, -1, 1)[:, None]
    normal = facing * scene.normals_areas[0][charts.face_triangle]
    near &= np.einsum("fx,tx->ft", normal, back.normals_areas[0]) > 0.999
    assert (near.sum(1) == 1).all()
    found = near.argmax(1)
    shading = facing * scene.normals[charts.face_triangle].mean(1)
    np.testing.assert_allclose(back.normals[found].mean(1), shading, atol=1e-5)
    assert {"ceiling light", "house", "row 1", "row 3", "posed"} <= {
        node.get("name") for node in document_of(files.scene)[0]["nodes"]
    }


def test_all_that_the_file_had_is_there(tmp_path, rich):
    _, _, files = baked(tmp_path, rich)
    before, binary_before = document_of(rich)
    after, binary = document_of(files.scene)
    assert picture(after, binary, 0) == picture(before, binary_before, 0)
    assert [node["name"] for node in after["nodes"][:7]] == [node["name"] for node in before["nodes"]]
    assert after["nodes"][0] == before["nodes"][0]
    assert after["scenes"][0]["name"] == "street" and after["scenes"][0]["nodes"] == [0]
    assert after["cameras"] == before["cameras"]
    assert after["animations"][0]["name"] == "sway"
    wall = after["materials"][0]
    assert wall["pbrMetallicRoughness"] == before["materials"][0]["pbrMetallicRoughness"]
    assert wall["extras"] == {"shop": "paint", "lightmap": "irradiance.exr"}
    assert wall["normalTexture"] == {"index": 0, "texCoord": 2, "scale": 0.5}  # TEXCOORD_1 is the lightmap's
    assert after["materials"][2] == before["materials"][2]
    primitive = after["meshes"][after["nodes"][1]["mesh"]]["primitives"][0]
    assert set(primitive["attributes"]) == {
        *("POSITION", "NORMAL", "TANGENT", "COLOR_0", "_AGE"),
        *("TEXCOORD_0", "TEXCOORD_1", "TEXCOORD_2"),
    }
    assert primitive["extras"] == {"a": 1}
    colour = after["accessors"][primitive["attributes"]["COLOR_0"]]
    assert colour["type"] == "VEC4"  # with its alpha
    (string,) = [node for node in after["nodes"] if node.get("name") == "string"]
    assert after["meshes"][string["mesh"]]["primitives"][0]["mode"] == 1
    assert "extensionsRequired" not in after and "EXT_mesh_gpu_instancing" not in after["extensionsUsed"]
    serious = [message for message in validator_messages(files.scene) if message["severity"] < 2]
    assert serious == []


def test_edits_are_written_and_nothing_else_changes(tmp_path, rich):
    def edit(scene):
        wall, lamp, *rest = scene.materials
        lamp = dataclasses.replace(lamp, emission=(8.0, 4.0, 2.0))
        wall = dataclasses.replace(wall, albedo=(0.2, 0.3, 0.4), lightmap_scale=2.0)
        return scene.with_materials((wall, lamp, *rest))

    _, _, files = baked(tmp_path, rich, edit=edit)
    wall, lamp, *_ = document_of(files.scene)[0]["materials"]
    assert wall["pbrMetallicRoughness"]["baseColorFactor"] == [0.2, 0.3, 0.4, 1.0]
    assert wall["pbrMetallicRoughness"]["roughnessFactor"] == 0.25
    assert wall["extras"]["lightmap_scale"] == 2.0 and "lightmap" in wall["extras"]
    assert lamp["emissiveFactor"] == [1.0, 0.5, 0.25]
    assert lamp["extensions"]["KHR_materials_emissive_strength"] == {"emissiveStrength": 8.0}


def test_meshes_of_a_scene_written_by_hand_keep_their_looks(tmp_path, rich):
    """Roughness, normal map with its picture byte for byte, and smooth normals, turned as the mesh is."""
    scene = tmp_path / "street.toml"
    scene.write_text(
        f'[[mesh]]\nfile = "{rich.name}"\nrotate = [0, 90, 0]\n'
        '[[material]]\nname = "lamp of mine"\nemission = 5\n'
        '[[quad]]\nmaterial = "lamp of mine"\ncorners = [[0, 9, 0], [1, 9, 0], [1, 9, 1], [0, 9, 1]]\n'
    )
    read, _, files = baked(tmp_path, scene)
    document, binary = document_of(files.scene)
    wall = next(m for m in document["materials"] if m["name"] == "wall")
    surface, bumps = wall["pbrMetallicRoughness"], wall["normalTexture"]
    assert (surface["roughnessFactor"], surface["metallicFactor"], bumps["scale"]) == (0.25, 0.0, 0.5)
    source = document["textures"][bumps["index"]]["source"]
    assert picture(document, binary, source) == jpeg() and document["images"][source]["mimeType"] == "image/jpeg"
    assert bumps["texCoord"] == 2, "TEXCOORD_1 is the lightmap's"
    mesh = next(p for m in document["meshes"] for p in m["primitives"] if document["materials"][p["material"]] is wall)
    assert "TEXCOORD_2" in mesh["attributes"]
    of_wall = np.array([m.name == "wall" for m in read.materials])[read.material_ids]
    assert np.allclose(np.abs(read.normals[of_wall]), (1, 0, 0), atol=1e-6), "along z before"
    serious = {message["code"] for message in validator_messages(files.scene) if message["severity"] < 2}
    assert serious <= {"MESH_PRIMITIVE_GENERATED_TANGENT_SPACE"}, "readers make the tangents"


def test_light_is_kept_where_the_file_is_another_by_now(tmp_path, rich):
    scene = load_scene(rich)
    scene, charts = charts_of(scene, AtlasOptions(texels=1000))
    black = np.zeros((charts.size[1], charts.size[0], 3), np.float32)
    other = rich_gltf()
    other.json["nodes"][1]["translation"] = [5, 0, 0]
    written(tmp_path, "rich.glb", other.glb())
    files = write_bake(tmp_path / "out", scene, charts, black, black[..., 0] > 0, {"warnings": []}, unedited=scene)
    (note,) = files.notes
    assert "has other triangles than when it was opened" in note
    assert json.loads(files.report.read_text())["warnings"] == [note]
    assert len(load_scene(files.scene).triangles) >= len(scene.triangles)
