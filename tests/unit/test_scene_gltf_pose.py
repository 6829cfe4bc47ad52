"""Skins and morph targets of glTF: vertices where the file puts them, against places known by hand."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scene_files import QUAD, QUAD_INDICES, Gltf, quad_gltf, written

from app.errors import SceneError
from app.scene.gltf import load_gltf
from app.scene.model import Scene

TRIANGLES = QUAD_INDICES.reshape(2, 3)
QUARTER = [0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4)]  # about +z: x to y, y to -x


def load(folder: Path, gltf: Gltf) -> Scene:
    return load_gltf(written(folder, "a.glb", gltf.glb()))


def _skinned(joints: list[int], weights: Any, places: list[dict[str, Any]], **skin: Any) -> Gltf:
    """The quad, whose vertices hang on one of two joints each, below a node that must have no effect."""
    gltf = quad_gltf()
    attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["JOINTS_0"] = gltf.accessor(np.array([[j, 1 - j, 0, 0] for j in joints], np.uint8))
    attributes["WEIGHTS_0"] = gltf.accessor(np.array(weights, np.float32))
    gltf.json["nodes"] = [{"mesh": 0, "skin": 0, "translation": [7, 7, 7]}, {"camera": 0}, *places]
    gltf.json["scenes"] = [{"nodes": [0, 1, 2]}]
    gltf.json["skins"] = [{"joints": [3, 2], **skin}]
    return gltf


def test_a_skin_follows_its_joints_and_not_its_node(tmp_path: Path) -> None:
    places = [{"children": [3], "scale": [0.01] * 3}, {"translation": [100, 200, 0], "rotation": QUARTER}]
    bind = np.eye(4, dtype=np.float32)
    bind[:3, :3] *= 100
    bind[3, :3] = [-50, 0, 0]  # stored by columns: the mesh is 100 times as small, and moved by -50 along x then
    gltf = _skinned([0, 0, 0, 1], [[1, 0, 0, 0]] * 2 + [[0.25, 0.25, 0, 0], [0, 0, 0, 0]], places)
    gltf.json["skins"][0]["inverseBindMatrices"] = gltf.accessor(np.stack([bind.ravel()] * 2))
    scene = load(tmp_path, gltf)
    # first joint: 0.01 · (100 + R(100 p - 50, 0)); second: 0.01 · (100 p - 50)
    first = np.stack([1 - QUAD[:, 1], 2 + QUAD[:, 0] - 0.5, QUAD[:, 2]], axis=1)
    second = QUAD - [0.5, 0, 0]
    expected = np.array([first[0], first[1], (first[2] + second[2]) / 2, first[3]])
    assert np.allclose(scene.corners, expected[TRIANGLES], atol=1e-6)
    assert scene.warnings == () and scene.normals is not None and np.allclose(scene.normals[0, 0], [0, 0, 1])


def test_a_mirroring_joint_keeps_the_front(tmp_path: Path) -> None:
    scene = load(tmp_path, _skinned([1] * 4, [[1, 0, 0, 0]] * 4, [{"scale": [-1, 1, 1], "children": [3]}, {}]))
    assert np.allclose(scene.normals_areas[0], [0, 0, 1]) and scene.corners[..., 0].min() == -1
    assert scene.normals is not None and np.allclose(scene.normals, [0, 0, 1])


def test_a_skin_without_joints_in_the_scene_is_said(tmp_path: Path) -> None:
    gltf = _skinned([0] * 4, [[1, 0, 0, 0]] * 4, [{}, {"translation": [1, 0, 0]}])
    scene = load(tmp_path, gltf)
    assert scene.warnings == ("1 skinned mesh without joints in the scene: shown without pose",)
    assert np.allclose(scene.corners, (QUAD + 7)[TRIANGLES])


@pytest.mark.parametrize(
    ("joint", "many", "reason"), [(2, 1, "joint 2 is out of range: there are 2"), (0, 2, "2 joints and 1 ")]
)
def test_broken_skins(tmp_path: Path, joint: int, many: int, reason: str) -> None:
    gltf = _skinned([joint if joint < 2 else 0] * 4, [[1, 0, 0, 0]] * 4, [{"children": [3]}, {}])
    if joint == 2:
        attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"]
        attributes["JOINTS_0"] = gltf.accessor(np.full((4, 4), 2, np.uint16))
    else:
        gltf.json["skins"][0]["inverseBindMatrices"] = gltf.accessor(np.eye(4, dtype=np.float32).reshape(1, 16))
    with pytest.raises(SceneError, match=reason):
        load(tmp_path, gltf)


@pytest.mark.parametrize("where", ["mesh", "node"])
def test_morph_targets_by_their_weights(tmp_path: Path, where: str) -> None:
    gltf = quad_gltf()
    up, out = np.zeros((4, 3), np.float32), np.zeros((4, 3), np.float32)
    up[2] = [0, 4, 0]
    out[:] = [0, 0, 2]
    tilt = np.tile(np.array([0, 2, 1], np.float32), (4, 1))
    targets = [{"POSITION": gltf.accessor(up)}, {"POSITION": gltf.accessor(out), "NORMAL": gltf.accessor(tilt)}]
    gltf.json["meshes"][0]["primitives"][0]["targets"] = targets
    gltf.json["meshes"][0]["weights"] = [0.5, 1] if where == "mesh" else [1, 1]
    if where == "node":
        gltf.json["nodes"][0]["weights"] = [0.5, 1]
        gltf.json["nodes"].append({"mesh": 0, "weights": [0, 0]})
        gltf.json["scenes"] = [{"nodes": [0, 1, 2]}]
    scene = load(tmp_path, gltf)
    assert np.allclose(scene.corners[:2], (QUAD + [0, 0, 2] + 0.5 * up)[TRIANGLES])
    assert scene.normals is not None and np.allclose(scene.normals[:2], np.array([0, 1, 1]) / math.sqrt(2))
    if where == "node":
        assert np.allclose(scene.corners[2:], QUAD[TRIANGLES])  # the same mesh, another pose


def test_a_morph_target_of_another_mesh_is_refused(tmp_path: Path) -> None:
    gltf = quad_gltf()
    gltf.json["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": gltf.accessor(np.zeros((3, 3), np.float32))}]
    gltf.json["meshes"][0]["weights"] = [1]
    with pytest.raises(SceneError, match="mesh 0 primitive 0: a morph target has 3 POSITION for 4"):
        load(tmp_path, gltf)
