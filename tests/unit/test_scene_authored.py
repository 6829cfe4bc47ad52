"""TOML scenes: the format, its errors, and every scene that comes along."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from scene_files import png, quad_gltf, written

from app.errors import SceneError
from app.scene import shapes
from app.scene.authored import load_authored
from app.scene.grotto import Grotto, fractal_noise
from app.scene.library import scene_names
from app.scene.load import load_scene
from app.scene.model import F64, Scene

PAINT = '[[material]]\nname = "paint"\nalbedo = 0.25\n'
FLOOR = '[[quad]]\nmaterial = "paint"\norigin = [0, 0, 0]\nedge_u = [2, 0, 0]\nedge_v = [0, 0, -3]\n'
ROOM = PAINT + FLOOR


def load(folder: Path, text: str) -> Scene:
    return load_authored(written(folder, "room.toml", text))


def volume(scene: Scene) -> float:
    """What a closed surface encloses [m³], positive if it faces outwards."""
    a, b, c = np.moveaxis(scene.corners, 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def test_quad_faces_along_u_cross_v_in_its_unit(tmp_path: Path) -> None:
    scene = load(tmp_path, '[scene]\nname = "Room"\nunit = "cm"\n' + ROOM)
    assert scene.name == "Room" and scene.materials[0].albedo == (0.25, 0.25, 0.25)
    normals, areas = scene.normals_areas
    assert np.allclose(normals, [0, 1, 0]) and areas.sum() == pytest.approx(6e-4)
    assert not scene.sides.any() and not scene.emits and scene.cameras == ()


def test_a_material_has_its_lightmap_scale(tmp_path: Path) -> None:
    assert load(tmp_path, ROOM).materials[0].lightmap_scale == 1
    assert load(tmp_path, PAINT + "lightmap_scale = 2\n" + FLOOR).materials[0].lightmap_scale == 2
    with pytest.raises(SceneError, match="lightmap_scale"):
        load(tmp_path, PAINT + "lightmap_scale = 0\n" + FLOOR)


def test_exitance_is_pi_times_radiance(tmp_path: Path) -> None:
    lamps = '[[material]]\nname = "a"\nexitance = 2\n[[material]]\nname = "b"\nemission = [1, 2, 3]\n'
    a, b, _ = load(tmp_path, lamps + ROOM).materials
    assert a.emission == (2 / math.pi,) * 3 and b.emission == (1.0, 2.0, 3.0)


@pytest.mark.parametrize(("inside", "sign"), [("false", 1), ("true", -1)])
def test_box_is_closed_and_faces_out_or_in(tmp_path: Path, inside: str, sign: int) -> None:
    box = f'[[box]]\nmaterial = "paint"\ncenter = [5, 5, 5]\nsize = [1, 2, 3]\nrotate_y = 30\ninside = {inside}\n'
    assert volume(load(tmp_path, PAINT + box)) == pytest.approx(6.0 * sign)


def test_box_turns_from_z_to_x_and_leaves_faces_out(tmp_path: Path) -> None:
    box = (
        '[[box]]\nmaterial = "paint"\ncenter = [0, 0, 0]\nsize = [1, 1, 4]\nrotate_y = 90\nwithout = ["top", "front"]\n'
    )
    scene = load(tmp_path, PAINT + box)
    assert len(scene.triangles) == 8 and np.allclose(scene.bounds, [[-2, -0.5, -0.5], [2, 0.5, 0.5]])
    found = {tuple(np.round(n).astype(int) + 0) for n in scene.normals_areas[0]}
    assert found == {(0, -1, 0), (0, 0, 1), (0, 0, -1), (-1, 0, 0)}  # without +y, and without +z turned to +x


def test_textures(tmp_path: Path) -> None:
    written(tmp_path, "p.png", png([[[0, 0, 0], [255, 255, 255]]]))
    materials = (
        '[[material]]\nname = "a"\ntexture = { pattern = "checker", colors = [0.1, [0, 0.3, 0]], repeat = [4, 2] }\n'
        '[[material]]\nname = "b"\nalbedo = 0.5\ntexture = { image = "p.png" }\n'
    )
    a, b, _ = load(tmp_path, materials + ROOM).materials
    assert a.albedo == (1.0, 1.0, 1.0) and a.albedo_texture is not None and not a.albedo_texture.bilinear
    assert np.allclose(a.albedo_texture.pixels[:, :, 1], [[0.1, 0.3], [0.3, 0.1]])
    assert np.array_equal(a.albedo_texture.uv_transform, [[4, 0, 0], [0, 2, 0]])
    assert b.albedo == (0.5, 0.5, 0.5) and b.albedo_texture is not None and b.albedo_texture.pixels.shape == (1, 2, 3)


def test_mesh_is_scaled_turned_and_moved_in_this_order(tmp_path: Path) -> None:
    written(tmp_path, "quad.glb", quad_gltf().glb())  # 1 × 2 in the plane z = 0, faces +z
    mesh = '[[mesh]]\nfile = "quad.glb"\nscale = [-2, 1, 1]\nrotate = [0, 90, 0]\ntranslate = [0, 5, 0]\n'
    scene = load(tmp_path, PAINT + mesh)
    assert np.allclose(scene.bounds, [[0, 5, 0], [0, 7, 2]]) and np.allclose(scene.normals_areas[0], [1, 0, 0])
    assert scene.materials[scene.material_ids[0]].name == "paint" and scene.materials[scene.material_ids[0]].emits
    painted = load(tmp_path, PAINT + mesh + 'material = "paint"\nname = "sign"\n')
    assert set(painted.material_ids) == {0} and painted.objects == ("sign: quad",)


def test_camera_looks_at_its_target(tmp_path: Path) -> None:
    camera = '[[camera]]\nname = "c"\nposition = [0, 1, 5]\ntarget = [3, 1, 5]\nyfov_deg = 90\n'
    (made,) = load(tmp_path, ROOM + camera).cameras
    assert made.yfov == pytest.approx(math.pi / 2)
    assert np.allclose(made.world_from_camera, [[0, 0, -1, 0], [0, 1, 0, 1], [1, 0, 0, 5], [0, 0, 0, 1]])


ERRORS = {
    "not toml": ("[[", "room.toml: not TOML"),
    "unknown key": (ROOM + "colour = 1\n", "quad.0.colour: Extra inputs are not permitted"),
    "unknown table": (ROOM + "[[sphere]]\nradius = 1\n", "sphere: Extra inputs are not permitted"),
    "missing": ('[[quad]]\nmaterial = "paint"\n', "quad.0: give either origin, edge_u and edge_v, or corners"),
    "both": (ROOM + "corners = [[0,0,0],[1,0,0],[1,1,0],[0,1,0]]\n", "quad.0: give either origin"),
    "type": (ROOM.replace("0.25", '"dark"'), "material.0.albedo"),
    "range": (ROOM.replace("0.25", "1.25"), "material.0.albedo.0: Input should be less than or equal to 1"),
    "two numbers": (ROOM.replace("0.25", "[1, 1]"), "material.0.albedo.2: Field required"),
    "nan": (ROOM.replace("[2, 0, 0]", "[nan, 0, 0]"), "quad.0.edge_u.0: Input should be a finite number"),
    "material": (FLOOR, "quad.0: there is no material 'paint' (materials: none)"),
    "same name": (PAINT + ROOM, "two materials have the same name"),
    "two lights": (PAINT + "emission = 1\nexitance = 1\n" + FLOOR, "material.0: give either emission or exitance"),
    "pattern": (PAINT + 'texture = { pattern = "checker" }\n' + FLOOR, "material.0.texture: pattern needs two colors"),
    "picture": (PAINT + 'texture = { image = "../p.png" }\n' + FLOOR, "there is no picture '../p.png'"),
    "broken picture": (PAINT + 'texture = { image = "room.toml" }\n' + FLOOR, "'room.toml' is not a readable picture"),
    "no mesh file": (ROOM + '[[mesh]]\nfile = "none.obj"\n', "mesh.0.file: there is no file 'none.obj'"),
    "mesh kind": (ROOM + '[[mesh]]\nfile = "room.toml"\n', "mesh.0.file: 'room.toml' is none of .glb"),
    "box size": (ROOM + '[[box]]\nmaterial = "paint"\ncenter = [0,0,0]\nsize = [1, 0, 1]\n', "box.0.size.1"),
    "kind": (ROOM + '[[procedural]]\nkind = "castle"\n', "procedural.0"),
    "parameter": (ROOM + '[[procedural]]\nkind = "grotto"\nlength = 1\n', "procedural.0.grotto.length"),
    "slot": (ROOM + '[[procedural]]\nkind = "grotto"\nsubdivisions = 2\n', "there is no material 'rock'"),
    "camera": (ROOM + '[[camera]]\nname = "c"\nposition = [0,0,0]\ntarget = [0,0,0]\n', "must differ"),
    "unit": ('[scene]\nunit = "furlong"\n' + ROOM, "scene.unit"),
    "exposure": ("[scene]\nexposure = 20\n" + ROOM, "scene.exposure"),
    "nothing": ("", "no triangles"),
    "flat": (ROOM.replace("[2, 0, 0]", "[0, 0, 0]"), "no triangle has an area"),
}


@pytest.mark.parametrize("name", ERRORS)
def test_error_names_file_key_and_reason_in_one_line(tmp_path: Path, name: str) -> None:
    text, reason = ERRORS[name]
    with pytest.raises(SceneError) as caught:
        load(tmp_path, text)
    message = str(caught.value)
    assert "room.toml: " in message and reason in message and "\n" not in message


def test_not_utf8_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match="not TOML"):
        load_authored(written(tmp_path, "room.toml", b"name = '\xff'"))


DISC = 32 * math.sin(2 * math.pi / 64)  # area of a regular polygon of 64 sides in the unit circle
SOLIDS = {  # mesh, volume, relative tolerance
    "box": (shapes.box((1, 2, 3)), 6.0, 1e-12),
    "cylinder": (shapes.cylinder(1.0, 2.0, 64), 2.0 * DISC, 1e-12),
    "cone": (shapes.lathe([(0, 0), (1, 0), (0, 3)], 64), DISC, 1e-12),
    "icosahedron": (shapes.icosphere(1.0, 0), 4 / 3 * math.pi * 0.605461, 1e-6),  # its share of the sphere, 6 digits
    "sphere": (shapes.icosphere(1.0, 4), 4 / 3 * math.pi, 3e-3),  # 5120 flat facets enclose 0.2 % less
}


@pytest.mark.parametrize("name", SOLIDS)
def test_solids_are_closed_and_face_outwards(name: str) -> None:
    mesh, expected, tolerance = SOLIDS[name]
    a, b, c = np.moveaxis(mesh.positions[mesh.triangles], 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(expected, rel=tolerance)
    assert np.linalg.norm(np.cross(b - a, c - a).sum(axis=0)) < 1e-12  # closed: areas balance, up to rounding


def test_noise_is_the_same_everywhere() -> None:
    points = np.array([[0.3, 0.7, -1.2], [100.5, -3.25, 8.0]])
    # Regression values: another hash would silently change the cave, and with it every picture of it.
    assert np.allclose(fractal_noise(points, 5), [-0.1467459372044254, 0.15576254845752072], atol=1e-12)
    assert np.abs(fractal_noise(np.random.default_rng(1).uniform(-9, 9, (1000, 3)), 1)).max() < 1.0


def first_fronts(scene: Scene, eye: F64, directions: F64) -> np.ndarray:
    """(n,) 1 where the first triangle along a ray shows its front, -1 its back, 0 where nothing is hit [Möller97]."""
    a, b, c = np.moveaxis(scene.corners, 1, 0)
    e1, e2, s = b - a, c - a, eye - a
    q = np.cross(s, e1)
    out = np.zeros(len(directions), int)
    for i, d in enumerate(directions):
        p = np.cross(d, e2)
        det = np.einsum("ij,ij->i", e1, p)
        det = np.where(det == 0.0, np.inf, det)
        u, v = np.einsum("ij,ij->i", s, p) / det, q @ d / det
        t = np.einsum("ij,ij->i", e2, q) / det
        # Rays through an edge must hit one of its triangles in spite of rounding.
        hit = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1.0 + 1e-9) & (t > 0.0)
        if hit.any():
            nearest = np.flatnonzero(hit)[np.argmin(t[hit])]
            out[i] = 1 if det[nearest] > 0.0 else -1
    return out


def sphere_of_rays(count: int) -> F64:
    """Even directions on the Fibonacci sphere."""
    z = 1.0 - (2.0 * np.arange(count) + 1.0) / count
    angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)


@pytest.mark.parametrize("name", scene_names())
def test_authored_scene_is_sound_and_lit(name: str) -> None:
    scene = load_scene(name)
    assert scene.warnings == () and scene.emits
    assert scene.cameras[0].name == ("square" if name == "village" else "main")
    assert len(set(scene.objects)) == len(scene.objects)
    assert set(scene.material_ids) == set(range(len(scene.materials)))
    for material in scene.materials:
        assert max(material.albedo) <= 0.8 or material.albedo_texture is not None  # plausible paint


@pytest.mark.parametrize("name", [n for n in scene_names() if n not in ("cornell-box", "village", "living-room")])
def test_authored_room_is_closed_and_shows_only_fronts(name: str) -> None:
    scene = load_scene(name)
    rays = sphere_of_rays(min(4000, 6_000_000 // len(scene.triangles)))  # 4000: 3 millisteradian each
    for camera in scene.cameras:
        assert (first_fronts(scene, camera.world_from_camera[:3, 3], rays) == 1).all()


def test_cornell_box_is_open_in_front_only() -> None:
    scene = load_scene("cornell-box")
    empty = np.array(["block" not in scene.objects[i] for i in scene.object_ids])
    eye = np.array([0.278, 0.27, 0.28])
    rays = sphere_of_rays(600)
    fronts = first_fronts(dataclasses.replace(scene, triangles=scene.triangles[empty]), eye, rays)
    at_front = eye + rays * (eye[2] / np.maximum(-rays[:, 2], 1e-9))[:, None]
    # The opening as measured: 552.8 mm wide at the floor, 556 mm at the ceiling, 548.8 mm high.
    width = 0.5528 + (0.556 - 0.5528) * at_front[:, 1] / 0.5488
    opening = (rays[:, 2] < 0.0) & (at_front[:, 0] > 0.0) & (at_front[:, 0] < width)
    opening &= (at_front[:, 1] > 0.0) & (at_front[:, 1] < 0.5488)
    assert np.array_equal(fronts == 0, opening) and not (fronts == -1).any()
    lamp = scene.materials[scene.material_ids[2]]
    assert lamp.emission == (17.0, 12.0, 4.0)
    assert scene.normals_areas[1][2:4].sum() == pytest.approx(0.130 * 0.105)
    assert np.allclose(scene.normals_areas[0][2:4], [0, -1, 0])


def test_cornell_cameras_view_is_filled_by_the_opening() -> None:
    camera = load_scene("cornell-box").cameras[0]
    assert np.allclose(camera.world_from_camera[:3, 3], [0.278, 0.273, -0.8])
    assert np.allclose(camera.world_from_camera[:3, 2], [0, 0, -1])  # looks along +z
    assert camera.yfov == pytest.approx(2 * math.atan(12.5 / 35), abs=1e-5)


def test_furnace_walls_are_all_alike() -> None:
    scene = load_scene("furnace")
    (material,) = scene.materials
    assert material.albedo == (0.5,) * 3 and material.emission == pytest.approx((1 / math.pi,) * 3)
    assert volume(scene) == pytest.approx(-1.0)


@pytest.mark.parametrize(("name", "least", "most"), [("museum", 3_000, 10_000), ("grotto", 20_000, 60_000)])
def test_procedural_scene_has_the_size_it_is_meant_for(name: str, least: int, most: int) -> None:
    assert least <= len(load_scene(name).triangles) <= most


def test_dripstones_reach_into_the_rock_at_floor_and_ceiling() -> None:
    cave = Grotto(kind="grotto", subdivisions=2, stalagmites=12, crystals=0)
    roots = {name: mesh.positions[0] for name, _, mesh in cave.pieces()}
    standing = np.array([p for name, p in roots.items() if name.startswith("stalagmite")])
    hanging = np.array([p for name, p in roots.items() if name.startswith("stalactite")])
    assert len(standing) == 12 and len(hanging) == 6
    assert (standing[:, 1] < cave.floor(standing[:, 0], standing[:, 2])).all()
    assert (hanging[:, 1] > cave.ceiling(hanging[:, 0], hanging[:, 2])).all()
