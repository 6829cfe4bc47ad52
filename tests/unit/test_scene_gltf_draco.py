"""glTF compressed with Draco: read where DracoPy is installed, else refused with the way out."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scene_files import QUAD, QUAD_INDICES, QUAD_UV, Gltf, quad_gltf, written

from app.errors import SceneError
from app.scene.gltf import load_gltf
from app.scene.model import Scene

COLOURS = np.array([[255, 0, 0], [0, 51, 0], [0, 0, 255], [255, 255, 255]], np.uint8)


def load(folder: Path, gltf: Gltf) -> Scene:
    return load_gltf(written(folder, "a.glb", gltf.glb()))


def _compressed(data: bytes) -> Gltf:
    """The quad, whose accessors are left to Draco: TEXCOORD_0, POSITION and a colour, in the order of DracoPy's numbers."""
    gltf = quad_gltf()
    for accessor in gltf.json["accessors"]:
        del accessor["bufferView"]
    primitive = gltf.json["meshes"][0]["primitives"][0]
    colour = {"componentType": 5121, "normalized": True, "count": 4, "type": "VEC3"}
    gltf.json["accessors"].append(colour)
    attributes = {"POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 4}
    primitive["attributes"] = attributes
    numbers = {"COLOR_0": 0, "TEXCOORD_0": 1, "POSITION": 2}
    primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": gltf.view(data), "attributes": numbers}}
    gltf.json["extensionsUsed"] = ["KHR_draco_mesh_compression"]
    gltf.json["materials"][0]["pbrMetallicRoughness"] = {"baseColorFactor": [0.5, 0.5, 0.5, 1]}
    return gltf


@pytest.fixture(scope="module")
def quad() -> bytes:
    draco = pytest.importorskip("DracoPy")
    options: dict[str, Any] = {"quantization_bits": 20, "preserve_order": True}
    encoded: bytes = draco.encode(
        QUAD,
        QUAD_INDICES.reshape(2, 3).astype(np.uint32),
        colors=COLOURS,
        tex_coord=QUAD_UV.astype(np.float64),
        **options,
    )
    return encoded


@pytest.mark.parametrize("required", [False, True])
def test_read(tmp_path: Path, quad: bytes, required: bool) -> None:
    gltf = _compressed(quad)
    if required:
        gltf.json["extensionsRequired"] = ["KHR_draco_mesh_compression"]
    scene = load(tmp_path, gltf)
    step = 2.0 / (1 << 19)  # of 20 bits over the longest edge
    triangles = QUAD_INDICES.reshape(2, 3)
    assert np.allclose(scene.corners, QUAD[triangles], atol=step)
    assert scene.uv0 is not None and np.allclose(scene.uv0, QUAD_UV[triangles], atol=1e-3)  # 11 bits or so by default
    assert scene.colours is not None and np.allclose(scene.colours, COLOURS[triangles] / 255, atol=1e-6)
    assert scene.warnings == ()


def test_uncompressed_data_beside_it_are_enough(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    gltf = quad_gltf()
    draco = {"bufferView": gltf.view(b"nothing"), "attributes": {"POSITION": 0}}
    gltf.json["meshes"][0]["primitives"][0]["extensions"] = {"KHR_draco_mesh_compression": draco}
    assert np.array_equal(load(tmp_path, gltf).corners, QUAD[QUAD_INDICES.reshape(2, 3)])


def test_without_dracopy_it_is_said_how(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "DracoPy", None)
    with pytest.raises(
        SceneError, match=r"compressed with Draco .*; install .*pip install 'glowtree\[draco\]', or write"
    ):
        load(tmp_path, _compressed(b"whatever"))


def test_broken(tmp_path: Path, quad: bytes) -> None:
    cases: list[tuple[bytes, dict[str, int], str]] = [
        (quad[:40], {}, "mesh 0 primitive 0: Draco cannot read it"),
        (b"x" * 90, {}, "mesh 0 primitive 0: Draco cannot read it"),
        (quad, {"POSITION": 7}, "mesh 0 primitive 0: Draco has no attribute 7, its POSITION"),
        (quad, {"POSITION": 1}, "accessor 0 is VEC3: its compressed data are not"),
    ]
    for data, numbers, reason in cases:
        gltf = _compressed(data)
        primitive = gltf.json["meshes"][0]["primitives"][0]
        primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"] |= numbers
        with pytest.raises(SceneError, match=reason):
            load(tmp_path, gltf)
