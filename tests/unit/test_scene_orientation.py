"""Units and axes of files: what is said, and what is guessed because no scene in metres looks like it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from scene_files import QUAD, QUAD_INDICES, quad_gltf, written

from app.bake.read import read_bake
from app.cli import build_parser
from app.errors import SceneError
from app.options import from_flags
from app.scene.load import load_scene
from app.scene.options import FileOptions

ROOM = [4000.0, 5000.0, 3000.0]


def _box(folder: Path, name: str, size: list[float], low: list[float]) -> Path:
    """A box of triangles in a file of any format."""
    mesh = trimesh.creation.box(size)
    mesh.apply_translation(np.array(low) + np.array(size) / 2)
    path = folder / name
    if path.suffix != ".glb":
        mesh.export(path)
        return path
    gltf = quad_gltf(np.asarray(mesh.vertices, np.float32), np.asarray(mesh.faces, np.uint16).ravel())
    gltf.json["meshes"][0]["primitives"][0]["attributes"] = {"POSITION": 0}
    gltf.json["materials"] = [{}]
    return written(folder, name, gltf.glb())


CENTRED, CORNER, SUNK = [-2000.0, -2500.0, 0.0], [0.0, 0.0, 0.0], [-200.0, -200.0, -200.0]
GUESSES: dict[
    str, tuple[str, list[float], list[float], list[float], int]
] = {  # file, size, low corner; size read, guesses
    "STL of a room in millimetres": ("a.stl", ROOM, SUNK, [4, 3, 5], 2),
    "STL of a room in metres": ("a.stl", [4, 5, 3], [0, 0, 0], [4, 3, 5], 1),
    "OBJ that stands on z = 0": ("a.obj", ROOM, CENTRED, [4, 3, 5], 2),
    "OBJ that stands on both": ("a.obj", ROOM, CORNER, [4, 5, 3], 1),
    "PLY that stands on y = 0": ("a.ply", [4000, 3000, 5000], [-2000, 0, -2500], [4, 3, 5], 1),
    "PLY in metres on z = 0": ("a.ply", [4, 5, 3], [-2, -2.5, 0], [4, 5, 3], 0),
    "OBJ of a terrain": ("a.obj", [4000, 300, 4000], [-2000, 0, -2000], [4000, 300, 4000], 0),
    "OBJ of a game, in inches or so": ("a.obj", [1472, 450, 830], [-800, -400, -10], [1472, 450, 830], 0),
    "OBJ of a planet": ("a.obj", [2e5, 2e5, 2e5], [-1e5, -1e5, -1e5], [2e5, 2e5, 2e5], 0),
    "glTF that stands on z = 0": ("a.glb", ROOM, CENTRED, [4, 3, 5], 2),
    "glTF that stands on y = 0": ("a.glb", [4000, 3000, 5000], [-2000, 0, -2500], [4000, 3000, 5000], 0),
    "glTF in metres on z = 0": ("a.glb", [4, 5, 3], [-2, -2.5, 0], [4, 5, 3], 0),
}


@pytest.mark.parametrize("name", GUESSES)
def test_guessed_where_plain_and_said(tmp_path: Path, name: str) -> None:
    file, size, low, read, guesses = GUESSES[name]
    scene = load_scene(_box(tmp_path, file, size, low), default_light=True)
    box = scene.corners[scene.object_ids == 0].reshape(-1, 3)
    assert np.allclose(np.ptp(box, axis=0), read, rtol=1e-6)
    assert len([w for w in scene.warnings if "says otherwise" in w]) == guesses, scene.warnings
    a, b, c = np.moveaxis(scene.corners[scene.object_ids == 0], 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0.0  # faces still face outwards


SAID: dict[str, tuple[dict[str, Any], list[float]]] = {
    "m": ({"unit": "m", "up": "y"}, ROOM),
    "cm": ({"unit": "cm", "up": "y"}, [40, 50, 30]),
    "in": ({"unit": "in", "up": "z"}, [101.6, 76.2, 127]),
    "ft": ({"unit": "ft", "up": "z"}, [1219.2, 914.4, 1524]),
}


@pytest.mark.parametrize("name", SAID)
def test_what_is_said_counts(tmp_path: Path, name: str) -> None:
    options, size = SAID[name]
    scene = load_scene(_box(tmp_path, "a.stl", ROOM, CENTRED), FileOptions(**options))
    assert np.allclose(np.ptp(scene.corners.reshape(-1, 3), axis=0), size)
    assert not any("says otherwise" in w for w in scene.warnings)


def test_cameras_and_normals_turn_too(tmp_path: Path) -> None:
    path = written(tmp_path, "a.glb", quad_gltf().glb())
    scene = load_scene(path, FileOptions(unit="cm", up="z"))
    assert (
        scene.normals is not None
        and np.allclose(scene.normals, [0, 1, 0])
        and np.allclose(scene.normals_areas[0], [0, 1, 0])
    )
    pose = scene.cameras[0].world_from_camera
    assert np.allclose(pose[:3, 3], [0.005, 0.03, -0.01]) and np.allclose(
        pose[:3, :3], [[1, 0, 0], [0, 0, 1], [0, -1, 0]]
    )
    assert np.allclose(
        scene.corners, 0.01 * np.stack([QUAD[:, 0], QUAD[:, 2], -QUAD[:, 1]], 1)[QUAD_INDICES.reshape(2, 3)]
    )


@pytest.mark.parametrize("kind", ["stl", "obj", "glb"])
def test_the_unit_of_an_authored_scene_is_that_of_its_meshes(tmp_path: Path, kind: str) -> None:
    _box(tmp_path, f"a.{kind}", [3000, 1000, 2000], [0, 0, 0])
    text = f'[scene]\nunit = "mm"\n[[mesh]]\nfile = "a.{kind}"\ntranslate = [500, 0, 0]\nscale = 2\n'
    scene = load_scene(written(tmp_path, "a.toml", text))
    unit = 1.0 if kind == "glb" else 1e-3  # glTF has a unit of its own
    assert np.allclose(scene.bounds, [[0.5, 0, 0], [0.5 + 6000 * unit, 2000 * unit, 4000 * unit]])
    assert not any("says otherwise" in w for w in scene.warnings)
    with pytest.raises(SceneError, match=r"--unit cm: a \.toml scene says it itself"):
        load_scene(tmp_path / "a.toml", FileOptions(unit="cm"))


def test_every_command_that_opens_a_scene_has_the_flags() -> None:
    for words in ("view", "shot a.stl -o a.png", "bake a.stl -o b", "info a.stl", "bench frames"):
        flags = build_parser().parse_args([*words.split(), "--unit", "mm", "--up", "z"])
        assert from_flags(FileOptions, flags) == FileOptions(unit="mm", up="z")


def test_a_bake_is_read_as_it_was_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = _box(tmp_path, "scene.glb", ROOM, CENTRED)
    written(tmp_path, "irradiance.exr", b"")
    seen: list[Any] = []
    monkeypatch.setattr("app.bake.read.load_scene", lambda *given: seen.append(load_scene(*given)) or seen[0])
    with pytest.raises(Exception, match="no second texture coordinates"):
        read_bake(path.parent)
    assert np.allclose(np.ptp(seen[0].corners.reshape(-1, 3), axis=0), ROOM)
