"""OBJ, PLY and STL: what is read, what is missing, and broken files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scene_files import png, written

from app.errors import SceneError
from app.scene.meshfile import load_meshfile
from app.scene.model import Scene

OBJ = """\
mtllib room.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vn 0 0 1
o lamp
usemtl glow
f 1/1/1 2/2/1 3/3/1 4/4/1
o wall
usemtl paint
v 0 0 2
f -1//1 1//1 2//1
"""
MTL = """\
newmtl glow
Kd 0.1234 0.2 0.0019
Ke 3 2.5 1
newmtl paint
map_Kd -s 2 2 1 -clamp on my paint.png
"""


def load(folder: Path, text: str | bytes, name: str = "room.obj") -> Scene:
    return load_meshfile(written(folder, name, text))


def test_obj_with_materials(tmp_path: Path) -> None:
    written(tmp_path, "room.mtl", MTL)
    written(tmp_path, "my paint.png", png([[[188, 188, 188]]]))
    scene = load(tmp_path, OBJ)
    glow, paint, unmapped = scene.materials
    assert (glow.name, glow.albedo, glow.emission) == ("glow", (0.1234, 0.2, 0.0019), (3.0, 2.5, 1.0))
    assert paint.albedo == (1.0, 1.0, 1.0) and unmapped.albedo == pytest.approx((0.5029,) * 3, abs=1e-4)  # sRGB 188
    assert glow.double_sided and paint.double_sided
    assert scene.objects == ("lamp", "wall") and list(scene.object_ids) == [0, 0, 1]
    assert np.array_equal(scene.corners[2], [[0, 0, 2], [0, 0, 0], [1, 0, 0]])  # -1 is the vertex read last
    assert scene.uv0 is not None and np.array_equal(scene.uv0[0], [[0, 1], [1, 1], [1, 0]])  # v = 0 at the top
    assert scene.normals is not None and np.array_equal(scene.normals[0], [[0, 0, 1]] * 3)
    # The wall has a texture but no coordinates.
    assert scene.warnings == ("1 textured triangle without texture coordinates: the picture's mean colour is used",)


def test_obj_without_its_material_file(tmp_path: Path) -> None:
    scene = load(tmp_path, OBJ)
    assert [m.albedo for m in scene.materials] == [(0.5, 0.5, 0.5)] * 2
    assert scene.warnings[0] == "material library 'room.mtl' is missing"
    assert scene.warnings[1] == "2 materials are not defined: grey with albedo 0.5"


def test_obj_without_its_pictures(tmp_path: Path) -> None:
    written(tmp_path, "room.mtl", "newmtl glow\nKd 0.2 0.2 0.2\nmap_Kd a.png\nnewmtl paint\nmap_Kd ../b.png\n")
    scene = load(tmp_path, OBJ)
    assert [m.albedo for m in scene.materials] == [(0.2, 0.2, 0.2), (0.5, 0.5, 0.5)]
    assert scene.warnings == ("2 pictures could not be read: Kd is used, or albedo 0.5 without it",)


@pytest.mark.parametrize("kind", ["ply", "stl", "obj"])
def test_every_triangle_arrives(tmp_path: Path, kind: str) -> None:
    sphere = trimesh.creation.icosphere(2)
    path = tmp_path / f"sphere.{kind}"
    sphere.export(path)
    scene = load_meshfile(path)
    assert len(scene.triangles) == 320 and all(m.double_sided for m in scene.materials)
    # A closed surface that faces outwards encloses a positive volume; files hold 32-bit floats or 8 digits.
    a, b, c = np.moveaxis(scene.corners, 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(sphere.volume, rel=1e-6)


REFUSED = {
    "garbage.obj": ("hello world\n", "no triangles"),
    "empty.obj": ("", "no triangles"),
    "points.obj": ("v 0 0 0\nv 1 0 0\n", "no triangles"),
    "nan.obj": ("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not a finite number"),
    "inf.obj": ("v 1e999 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not a finite number"),
    "index.obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "v index 4 is out of range: there are 3"),
    "zero.obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "'0' has an index out of range"),
    "back.obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -4 1 2\n", "line 4: v index -4 is out of range"),
    "uv.obj": ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/2 3/3\n", "vt index 1 is out of range: there are 0"),
    "word.obj": ("v 0 0 zero\n", "line 1: could not convert"),
    "short.obj": ("v 0 0\n", "line 1: v needs 3 numbers"),
    "corner.obj": ("v 0 0 0\nf a b c\n", "'a' is not a corner"),
    "empty.stl": ("", "not a readable STL file: 0 of 84 bytes"),
    "cut.stl": (bytes(80) + b"\x02\0\0\0" + bytes(50), "134 of 184 bytes"),
    "solid.stl": ("solid\nendsolid\n", "no triangles"),
    "empty.ply": ("", "not a readable PLY file"),
    "text.ply": ("ply\n", "not a readable PLY file"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(tmp_path: Path, name: str) -> None:
    content, reason = REFUSED[name]
    with pytest.raises(SceneError) as caught:
        load(tmp_path, content, name)
    assert reason in str(caught.value) and "\n" not in str(caught.value)


def test_bad_colour_names_material_and_key(tmp_path: Path) -> None:
    written(tmp_path, "room.mtl", "newmtl glow\nKe 1 x 2\n")
    with pytest.raises(SceneError, match="material 'glow': Ke 1 x 2 must be one or three numbers"):
        load(tmp_path, OBJ)


@pytest.mark.parametrize("kind", ["ply", "stl", "obj"])
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_fuzz(tmp_path: Path, kind: str, data: st.DataObject) -> None:
    content = bytearray(OBJ.encode() if kind == "obj" else trimesh.creation.box().export(file_type=kind))
    for _ in range(data.draw(st.integers(1, 5))):
        at = data.draw(st.integers(1, len(content) - 1))
        if data.draw(st.integers(0, 5)):
            content[at] = data.draw(st.integers(0, 255))
        else:
            del content[at + 1 :]
    try:
        scene = load(tmp_path, bytes(content), f"fuzz.{kind}")
    except SceneError:
        return
    assert len(scene.triangles) > 0 and np.isfinite(scene.normals_areas[0]).all()
