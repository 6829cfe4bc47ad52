"""A lightmap on several pages lights a scene as one page does."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
import pytest
from khronos import validator_messages

from app.atlas.charts_cache import charts_of
from app.atlas.options import AtlasOptions
from app.atlas.points import bilinear
from app.atlas.texels import texel_surfaces, uniform_leaves
from app.bake import write_bake
from app.bake.options import BakeOptions
from app.bake.read import read_bake, read_irradiance
from app.errors import UserError
from app.scene.load import load_scene


def document_of(path: Path) -> tuple[dict, bytes]:
    """The JSON and the binary chunk of a GLB."""
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length]), data[20 + length + 8 :]


def values(document: dict, binary: bytes, number: int) -> np.ndarray:
    accessor = document["accessors"][number]
    view = document["bufferViews"][accessor["bufferView"]]
    dtype = {5126: np.float32, 5123: np.uint16, 5125: np.uint32}[accessor["componentType"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
    return np.frombuffer(binary, dtype, accessor["count"] * width, view["byteOffset"]).reshape(-1, width)


def lit_triangles(folder: Path) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Of each lightmap file: corners (n, 3, 3) and their texture coordinates (n, 3, 2)."""
    document, binary = document_of(folder / "scene.glb")
    found: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            name = document["materials"][primitive["material"]].get("extras", {}).get("lightmap")
            if name is not None:
                index = values(document, binary, primitive["indices"])[:, 0].reshape(-1, 3)
                of = (values(document, binary, primitive["attributes"][a])[index] for a in ("POSITION", "TEXCOORD_1"))
                found.setdefault(name, []).append(tuple(of))
    return {name: tuple(map(np.concatenate, zip(*parts, strict=True))) for name, parts in found.items()}


def light_by_place(folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Places in the middles of lit triangles, the light that a renderer reads there, and whether all that it reads for that is in
    the picture: at its border there is no gutter. In an order that is the same for all layouts."""
    places, lights, insides = [], [], []
    for name, (corners, uv) in lit_triangles(folder).items():
        image = read_irradiance(folder / name)
        place = uv.mean(1) * image.shape[1::-1]
        lights.append(bilinear(image, place))
        insides.append(((place >= 0.5) & (place <= np.array(image.shape[1::-1]) - 0.5)).all(1))
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        places.append(np.concatenate([corners.mean(1), normal], axis=1))
    place, light = np.concatenate(places), np.concatenate(lights)
    order = np.lexsort(np.round(place, 4).T)
    return place[order], light[order], np.concatenate(insides)[order]


@pytest.fixture(scope="module")
def bake():
    """scene, charts, light, and where that is, of a room with many charts; at random in each texel."""
    scene, charts = charts_of(load_scene("museum"), AtlasOptions(texels=6000))
    leaves = uniform_leaves(charts)
    tile, row, column = np.nonzero(texel_surfaces(scene, charts, leaves).face >= 0)
    known = np.zeros(charts.size[::-1], bool)
    known[leaves.y[tile] * charts.tile + row, leaves.x[tile] * charts.tile + column] = True
    light = np.random.default_rng(2).uniform(1, 2, (*known.shape, 3)).astype(np.float32)
    return scene, charts, light, known


@pytest.mark.parametrize("padding", [2, 6])
def test_several_pages_light_as_one(tmp_path, bake, padding):
    write_bake(tmp_path / "one", *bake, {}, BakeOptions(exr_float=True))
    how = BakeOptions(exr_float=True, max_size=64, padding=padding, moz_lightmap=True)
    files = write_bake(tmp_path / "many", *bake, {}, how)
    assert files.pages > 2 and max(files.atlas) <= 64 and files.notes == ()
    names = [f"irradiance-{number}.exr" for number in range(1, files.pages + 1)]
    assert sorted(path.name for path in (tmp_path / "many").glob("*.exr")) == sorted(names)
    assert set(lit_triangles(tmp_path / "many")) == set(names)
    for name in names:
        assert read_irradiance(tmp_path / "many" / name).shape == (*files.atlas[::-1], 3)
    one, expected, inside = light_by_place(tmp_path / "one")
    many, got, also = light_by_place(tmp_path / "many")
    inside &= also
    assert inside.mean() > 0.8
    np.testing.assert_allclose(many, one, atol=1e-4)
    np.testing.assert_allclose(got[inside], expected[inside], rtol=2e-4)  # texture coordinates are 32-bit floats
    document, _ = document_of(files.scene)
    assert document["scenes"][0]["extras"]["lightmap"]["files"] == names
    assert {image["uri"] for image in document["images"] if "uri" in image} == set(names)
    assert json.loads(files.report.read_text())["pages"] == files.pages
    write_bake(tmp_path / "many", *bake, {})
    assert [path.name for path in (tmp_path / "many").glob("*.exr")] == ["irradiance.exr"]


def test_pages_are_standard_gltf_and_no_reference(tmp_path, bake):
    files = write_bake(tmp_path, *bake, {}, BakeOptions(max_size=64))
    assert [message for message in validator_messages(files.scene) if message["severity"] < 2] == []
    with pytest.raises(UserError, match="is a bake of several pages"):
        read_bake(tmp_path)


def test_a_chart_larger_than_a_page_is_said(tmp_path):
    scene, charts = charts_of(load_scene("cornell-box"), AtlasOptions(texels=60_000))
    light = np.ones((*charts.size[::-1], 3), np.float32)
    files = write_bake(tmp_path, scene, charts, light, light[..., 0] > 0, {}, BakeOptions(max_size=64))
    (note,) = files.notes
    assert files.pages > 1 and note.startswith("--max-size 64: pages are") and "as large as the largest chart" in note
