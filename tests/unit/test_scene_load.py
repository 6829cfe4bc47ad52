"""The front door: names, suffixes, the default camera and the ceiling light; and real files, where there are any."""

from __future__ import annotations

import dataclasses
import math
import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scene_files import quad_gltf, written

from app.errors import SceneError, UserError
from app.scene.cameras import default_camera, look_at
from app.scene.ceiling_light import with_ceiling_light
from app.scene.library import scene_names, scene_path
from app.scene.load import NO_LIGHT, load_scene
from app.scene.model import Camera, Material, Scene
from app.scene.shapes import Mesh, box, icosphere, merged, quad
from app.scene.validate import Part, validate
from app.util.background import CancelledError, Report

GREY = Material("grey")


def scene_of(*meshes: Mesh) -> Scene:
    return validate("x", "x", [Part(m.positions, m.triangles) for m in meshes], ["x"], [GREY])


def test_scenes_that_come_along() -> None:
    assert {"cornell-box", "furnace", "museum", "grotto", "two-rooms", "textured-room", "village"} <= set(scene_names())
    assert load_scene("furnace").source == scene_path("furnace")
    assert load_scene(scene_path("furnace")).name == load_scene(str(scene_path("furnace"))).name
    with pytest.raises(UserError, match="must be one of cornell-box"):
        scene_path("castle")


def test_suffix_may_be_upper_case(tmp_path: Path) -> None:
    assert len(load_scene(written(tmp_path, "A.GLB", quad_gltf().glb())).triangles) == 2


REFUSED = {
    "cornel-box": "did you mean cornell-box?",
    "furnace.tom": "there is no such file or scene",
    "castle.glb": "allowed are files .glb .gltf .obj .ply .stl .toml and the scenes cornell-box",
    ".": "is a folder",
    "": "scene: its name is empty",
    "notes.txt": "unknown format '.txt'",
    "bare": "unknown format ''",
    "a\0b\nc": "a b c: ",
    "x" * 5000: "is not a file name",
}


@pytest.mark.parametrize("source", REFUSED, ids=range(len(REFUSED)))
def test_refused_with_what_is_allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, source: str) -> None:
    monkeypatch.chdir(tmp_path)
    written(tmp_path, "notes.txt", "x")
    written(tmp_path, "bare", "x")
    with pytest.raises(SceneError) as caught:
        load_scene(source)
    assert REFUSED[source] in str(caught.value) and "\n" not in str(caught.value)


def test_near_miss_of_a_file_is_suggested(tmp_path: Path) -> None:
    written(tmp_path, "kitchen.glb", b"")
    with pytest.raises(SceneError, match=r"did you mean kitchen\.glb"):
        load_scene(tmp_path / "kitchn.glb")


def test_dark_scene_says_so_and_takes_a_ceiling_light(tmp_path: Path) -> None:
    gltf = quad_gltf()
    gltf.json["materials"][0]["emissiveFactor"] = [0, 0, 0]
    path = written(tmp_path, "dark.glb", gltf.glb())
    dark = load_scene(path)
    assert not dark.emits and dark.warnings == (NO_LIGHT,)
    lit = load_scene(path, default_light=True)
    assert lit.emits and lit.warnings == () and lit.objects == ("quad", "ceiling light")
    for corners in (lit.uv0, lit.normals):
        assert corners is not None and len(corners) == 4


def test_lit_scene_gets_no_ceiling_light() -> None:
    assert len(load_scene("furnace", default_light=True).triangles) == 12


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_ceiling_light_gives_its_ground_one_watt_per_square_metre(scale: float) -> None:
    room = scene_of(box((4 * scale, 2 * scale, 8 * scale)).flipped())
    lit = with_ceiling_light(room)
    normals, areas = lit.normals_areas
    lamp = lit.materials[lit.material_ids[-1]]
    assert np.allclose(normals[-2:], [0, -1, 0]) and not lamp.double_sided
    flux = math.pi * lamp.emission[0] * areas[-2:].sum()
    assert flux == pytest.approx(1.0 * 32 * scale**2)
    assert np.allclose(lit.corners[-1][:, 1], 0.98 * scale)  # the top is at 1, the height is 2
    assert np.allclose(np.ptp(lit.corners[-2:].reshape(-1, 3), axis=0), [scale, 0, 2 * scale])


def test_ceiling_light_of_a_flat_scene_hangs_above_it() -> None:
    flat = scene_of(Mesh(np.array([[0, 0, 0], [4, 0, 0], [0, 0, -4]], float), np.array([[0, 1, 2]]), np.zeros((3, 2))))
    assert np.allclose(with_ceiling_light(flat).corners[-1][:, 1], 1.0)


def test_ceiling_light_is_not_in_the_plane_of_a_ceiling() -> None:
    """One as thick as the light hangs below the top: the light is then in front of it."""
    roof, ceiling = quad((-2, 2, -4), (0, 0, 8), (4, 0, 0)), quad((-2, 1.98, -4), (4, 0, 0), (0, 0, 8))
    floor = quad((-2, 0, -4), (0, 0, 8), (4, 0, 0))
    lit = with_ceiling_light(scene_of(merged([roof, ceiling, floor])))
    assert np.allclose(lit.corners[-1][:, 1], 0.99 * 1.98)


def slabs(x: float, y: float, z: float, thick: float = 0.25) -> list[Mesh]:
    """A house of one room of that size, its floor at y = 0: six closed slabs, faces outwards."""
    walls = [box((thick, y, z)).moved(s * (x + thick) / 2, y / 2, 0) for s in (-1, 1)]
    walls += [box((x + 2 * thick, y, thick)).moved(0, y / 2, s * (z + thick) / 2) for s in (-1, 1)]
    plan = (x + 2 * thick, thick, z + 2 * thick)
    return [*walls, box(plan).moved(0, -thick / 2, 0), box(plan).moved(0, y + thick / 2, 0)]


def l_shape() -> Mesh:
    """A room of 12 × 12 × 3 m without its quarter at +x, +z: the middle of its box is a corner of it."""
    plan = np.array([(0, 0), (12, 0), (12, 4), (4, 4), (4, 12), (0, 12)], float)
    floor = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 5), (3, 4, 5)])
    count = len(plan)
    up = np.insert(plan, 1, 0.0, axis=1), np.insert(plan, 1, 3.0, axis=1)
    walls = [t for i in range(count) for j in [(i + 1) % count] for t in ((i, j, i + count), (j, j + count, i + count))]
    triangles = np.concatenate([floor[:, ::-1], floor + count, np.array(walls)])
    return Mesh(np.concatenate(up), triangles, np.zeros((2 * count, 2)))


def _lamp(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    corners = scene.corners[-2:].reshape(-1, 3)
    return corners.min(0), corners.max(0)


def test_ceiling_light_hangs_in_the_room_not_in_the_slab_over_it() -> None:
    low, high = _lamp(with_ceiling_light(scene_of(*slabs(5, 3, 4))))
    assert low[1] == high[1] == pytest.approx(0.99 * 3) and np.allclose((low + high)[[0, 2]], 0)
    assert np.allclose((high - low)[[0, 2]], [1.25, 1])


def test_ceiling_light_is_clear_of_what_hangs_from_the_ceiling() -> None:
    beam = box((8, 0.4, 0.2)).moved(0, 2.8, 0.1)
    low, _ = _lamp(with_ceiling_light(scene_of(*slabs(8, 3, 4), beam)))
    assert low[1] == pytest.approx(0.99 * 2.6)


def test_ceiling_light_hangs_in_the_room_where_the_camera_is() -> None:
    upper = [mesh.moved(0, 3.5, 0) for mesh in slabs(5, 3, 4)]
    house = scene_of(*slabs(5, 3, 4), *upper)
    for floor in (0.0, 3.5):
        camera = Camera("here", look_at((2, floor + 1.6, 1), (0, floor + 1, 0)), 1.0)
        assert _lamp(with_ceiling_light(dataclasses.replace(house, cameras=(camera,))))[0][1] == pytest.approx(
            floor + 2.97
        )


def test_ceiling_light_of_an_object_hangs_above_it() -> None:
    assert _lamp(with_ceiling_light(scene_of(icosphere(1.0, 2))))[0][1] > 1.1


def test_default_camera_and_ceiling_light_are_in_a_room_of_two_wings() -> None:
    scene = scene_of(l_shape())
    camera = default_camera(scene)
    eye, forward = camera.world_from_camera[:3, 3], -camera.world_from_camera[:3, 2]
    low, high = _lamp(with_ceiling_light(scene))
    assert high[0] - low[0] > 0.5
    for x, y, z in (eye, eye + 8 * forward, low, high):
        assert 0 < x < 12 and 0 < y < 3 and 0 < z < 12 and (x < 4 or z < 4)


def test_default_camera_stands_in_a_closed_room_beside_what_is_none() -> None:
    """The house is a wing of a larger scene: its middle is in the open."""
    house = [mesh.moved(-6, 0, -6) for mesh in slabs(8, 3, 6)]
    garden = box((20, 0.1, 20)).moved(0, -0.3, 0)
    eye = default_camera(scene_of(*house, garden, box((1, 4, 1)).moved(8, 2, 8))).world_from_camera[:3, 3]
    assert (np.abs(eye - [-6, 1.5, -6]) < [4, 1.5, 3]).all()


def looks_at_all(scene: Scene) -> bool:
    """Whether the default camera has every corner in its field of view (taken as a cone)."""
    camera = default_camera(scene)
    eye, forward = camera.world_from_camera[:3, 3], -camera.world_from_camera[:3, 2]
    to = scene.corners.reshape(-1, 3) - eye
    cosine = to @ forward / np.linalg.norm(to, axis=1)
    return bool((cosine >= math.cos(camera.yfov / 2) - 1e-9).all())


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_default_camera_sees_a_whole_object_from_outside(scale: float) -> None:
    for mesh in (box((1, 2, 3)), icosphere(1.0, 2)):
        assert looks_at_all(scene_of(Mesh(mesh.positions * scale + 7, mesh.triangles, mesh.uv)))


@pytest.mark.parametrize(("size", "axis"), [((4, 2, 8), 2), ((8, 2, 4), 0)])
def test_default_camera_stands_at_the_end_of_a_room(size: tuple[float, float, float], axis: int) -> None:
    camera = default_camera(scene_of(box(size).flipped()))
    eye, forward = camera.world_from_camera[:3, 3], -camera.world_from_camera[:3, 2]
    assert abs(forward[axis]) == pytest.approx(1.0)
    assert eye[axis] * forward[axis] == pytest.approx(-3.6)  # 5 % of 8 m before the wall at -4


def test_default_camera_looks_around_furniture_in_the_middle() -> None:
    room, table = box((4, 4, 8)).flipped(), box((2, 2, 2)).moved(0, -1, 0)
    eye = default_camera(scene_of(room, table)).world_from_camera[:3, 3]
    assert (np.abs(eye) < [2, 2, 4]).all()


def test_default_camera_looks_into_an_open_room() -> None:
    camera = default_camera(scene_of(box((4, 3, 5), without=("front",)).flipped()))
    eye, forward = camera.world_from_camera[:3, 3], -camera.world_from_camera[:3, 2]
    assert np.allclose(forward, [0, 0, -1]) and eye[2] > 2.5


REAL = os.environ.get("GLOWTREE_SCENES")
REAL_FILES = sorted(Path(REAL).glob("*.*")) if REAL else []


@pytest.mark.skipif(not REAL, reason="GLOWTREE_SCENES names no folder of real scenes")
@pytest.mark.parametrize("path", [p for p in REAL_FILES if p.suffix in (".glb", ".gltf", ".obj")], ids=lambda p: p.name)
def test_real_scene_loads(path: Path) -> None:
    scene = load_scene(path)
    normals, areas = scene.normals_areas
    assert len(scene.triangles) > 0 and np.isfinite(normals).all() and (areas > 0).all() and scene.cameras


@pytest.mark.parametrize("name", ["a.obj", "a.glb", "a.ply", "a.stl", "a.toml"])
def test_reading_says_how_far_it_is_and_ends_where_it_is_stopped(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("app.scene.obj.OFTEN", 16)
    ball = icosphere(1.0, 2)
    for kind in ("obj", "glb", "ply", "stl"):
        trimesh.Trimesh(ball.positions, ball.triangles).export(tmp_path / f"a.{kind}")
    (tmp_path / "a.toml").write_text('[[mesh]]\nfile = "a.obj"\n')
    told: list[float] = []
    load_scene(tmp_path / name, report=told.append)
    assert told == sorted(told) and 0.0 <= told[0] < 0.1 and 0.8 < told[-1] <= 1.0 and len(told) > 4

    def stop_at(last: float) -> Report:
        def stop(share: float) -> None:
            if share >= last:
                raise CancelledError

        return stop

    for last in told[::3]:
        with pytest.raises(CancelledError):
            load_scene(tmp_path / name, report=stop_at(last))
