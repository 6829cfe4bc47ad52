"""OBJ, PLY and STL: what is read, what is missing, and broken files."""

from __future__ import annotations

import struct
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scene_files import png, written

from app.errors import SceneError
from app.scene.images import read_image
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
    assert scene.warnings == (
        "2 pictures are missing in the scene's folder ('a.png', '../b.png'): Kd is used, or albedo 0.5 without it",
    )


def test_a_picture_of_several_maps_is_read_once_and_missed_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It says of each kind of map what is used instead."""
    library = "newmtl glow\nmap_Kd a.png\nmap_Ke a.png\nmap_d a.png\nnewmtl paint\nmap_Kd ./a.png # red\nmap_Ke b.png\n"
    written(tmp_path, "room.mtl", library)
    written(tmp_path, "a.png", png([[[188, 188, 188]]]))
    read = Mock(wraps=read_image)
    monkeypatch.setattr("app.scene.mtl.read_image", read)
    missing = "1 picture is missing in the scene's folder ('b.png')"
    assert load(tmp_path, OBJ).warnings[0] == f"{missing}: Ke is used, or no light without it"
    assert read.call_count == 1
    written(tmp_path, "room.mtl", library.split("newmtl paint")[0])
    (tmp_path / "a.png").unlink()
    instead = "Kd is used, or albedo 0.5 without it; Ke is used, or no light without it; "
    instead += "d or Tr is used, or opacity 1 without them"
    assert f"{missing.replace('b', 'a')}: {instead}" in load(tmp_path, OBJ).warnings
    written(tmp_path, "a.png", b"no picture")
    assert f"1 picture could not be read ('a.png'): {instead}" in load(tmp_path, OBJ).warnings


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


CONCAVE = {  # corners of the face, area, a point of its plane that is outside of it
    "door": ([(0, 0), (1, 0), (1, 2), (2, 2), (2, 0), (3, 0), (3, 3), (0, 3)], 7.0, (1.5, 1.0)),
    "arrow": ([(0, 0), (2, -2), (0, 2), (-2, -2)], 4.0, (0.0, -1.0)),
    "keyhole": ([(0, 0), (3, 0), (3, 3), (0, 3), (0, 0), (1, 1), (1, 2), (2, 2), (2, 1), (1, 1)], 8.0, (1.5, 1.5)),
}


@pytest.mark.parametrize("name", CONCAVE)
@pytest.mark.parametrize("turned", [False, True])
def test_concave_faces_are_not_walled_up(tmp_path: Path, name: str, turned: bool) -> None:
    ring, area, outside = CONCAVE[name]
    ring = ring[::-1] if turned else ring
    lines = [f"v {x} 1 {y}\nvt {x} {y}" for x, y in ring]
    face = " ".join(f"{k}/{k}" for k in range(1, len(ring) + 1))
    square = "v 9 0 0\nv 9 1 0\nv 9 1 1\nv 9 0 1\nf -4 -3 -2 -1\nf -3 -2 -1"
    text = "\n".join(
        [*lines, f"o before\n{square}\no wall\nusemtl paint\nf {face}\no after\n{square.replace('9', '8')}"]
    )
    scene = load(tmp_path, text)
    wall = scene.object_ids == 1
    normals, areas = scene.normals_areas
    assert areas[wall].sum() == pytest.approx(area) and len(scene.triangles) == wall.sum() + 6
    assert np.allclose(normals[wall], [0, 1 if turned else -1, 0])  # as the face winds about it
    assert scene.uv0 is not None and np.allclose(scene.uv0[wall] * [1, -1] + [0, 1], scene.corners[wall][..., [0, 2]])
    assert [scene.materials[k].name for k in scene.material_ids[wall]] == ["paint"] * wall.sum()
    point = np.array([outside[0], 1.0, outside[1]])
    a, b, c = np.moveaxis(scene.corners[wall], 1, 0)
    sides = np.array([np.cross(q - p, point - p)[:, 1] for p, q in ((a, b), (b, c), (c, a))])
    assert not ((sides > 0).all(0) | (sides < 0).all(0)).any()  # the point lies in none of the triangles


TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
NAMES = {  # usemtl lines, the material library
    "with #": ("usemtl Material #25", "newmtl Material #26\nKd 0 0 0\nnewmtl Material #25\nKd 0.3 0.3 0.3"),
    "with a comment": ("usemtl paint # of the wall", "newmtl paint\nKd 0.3 0.3 0.3 # grey"),
    "tabs": ("usemtl\tpaint", "\tnewmtl\tpaint\n\t\tKd\t0.3\t0.3\t0.3"),
    "in another case": ("usemtl Paint", "newmtl PAINT\nkd 0.3 0.3 0.3"),
    "quoted": ('usemtl "my paint"', "newmtl my paint\nKd 0.3 0.3 0.3"),
    "after a byte order mark": ("usemtl paint", "\ufeffnewmtl paint\nKd 0.3 0.3 0.3"),
}


@pytest.mark.parametrize("name", NAMES)
def test_names_of_materials(tmp_path: Path, name: str) -> None:
    use, library = NAMES[name]
    written(tmp_path, "m.mtl", library)
    scene = load(tmp_path, f"\ufeffmtllib m.mtl\n{TRIANGLE}{use}\nf 1 2 3\n")
    assert scene.materials[scene.material_ids[0]].albedo == (0.3, 0.3, 0.3) and scene.warnings == ()


LIBRARY_LINES = ["a.mtl b b.mtl", '"b b.mtl" a.mtl', "B B.MTL\nmtllib A.mtl", "sub\\..\\b b.mtl a.mtl"]


@pytest.mark.parametrize("line", LIBRARY_LINES)
def test_lists_of_material_libraries(tmp_path: Path, line: str) -> None:
    (tmp_path / "sub").mkdir()
    written(tmp_path, "a.mtl", "newmtl one\nKd 0.1 0.1 0.1\n")
    written(tmp_path, "b b.mtl", "newmtl two\nKd 0.2 0.2 0.2\n")
    scene = load(tmp_path, f"mtllib {line}\n{TRIANGLE}usemtl one\nf 1 2 3\nusemtl two\nv 0 0 5\nf 1 3 4\n")
    assert [m.albedo[0] for m in scene.materials] == [0.1, 0.2] and scene.warnings == ()


@pytest.mark.parametrize(
    "file",
    [
        "TEX\\paint.PNG",
        '"tex/paint.png"',
        "C:\\old\\tex\\paint.png",
        "../tex/paint.png",
        "tex/#1.png",
        '"tex/paint.png" # red',
    ],
)
def test_pictures_are_found_however_they_are_named(tmp_path: Path, file: str) -> None:
    for folder in ("tex", "lib"):
        (tmp_path / folder).mkdir()
    place = "lib" if file.startswith("C:") else "tex"
    for name in ("paint.png", "#1.png"):
        written(tmp_path / place, name, png([[[188, 188, 188]]]))
    written(tmp_path / "lib", "m.mtl", f"newmtl paint\nmap_Kd {file}\n")
    text = f"mtllib lib/m.mtl\n{TRIANGLE}usemtl paint\nf 1/1 2/2 3/3\n"
    scene = load(tmp_path, text)
    assert scene.materials[0].albedo_texture is not None and scene.warnings == ()
    (tmp_path / place / "paint.png").unlink()
    (tmp_path / place / "#1.png").unlink()
    (note,) = load(tmp_path, text).warnings
    assert note.startswith("1 picture is missing in the scene's folder ('") and file.strip('"') in note


# A square of 4 m² in the plane y = 0, a concave polygon of 5 corners and 10 m², and a triangle of 2 m²
def test_binary_stl_that_begins_like_text_and_has_bytes_at_its_end(tmp_path: Path) -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "<f4")
    head = b"solid made by a program".ljust(80) + struct.pack("<I", 1)
    data = head + bytes(12) + corners.tobytes() + bytes(2) + b"\r\n"
    assert np.array_equal(load(tmp_path, data, "a.stl").corners[0], corners)


def test_stl_as_text_with_several_solids_and_a_mark(tmp_path: Path) -> None:
    facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 {z}\nvertex 1 0 {z}\nvertex 0 1 {z}\nendloop\nendfacet\n"
    text = "".join(f"solid {name}\n{facet.format(z=z)}endsolid {name}\n" for z, name in enumerate("ab"))
    assert len(load(tmp_path, "\ufeff" + text, "a.stl").triangles) == 2


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "latin-1"])
def test_names_in_other_encodings(tmp_path: Path, encoding: str) -> None:
    """Two names that differ in letters beyond ASCII stay two; lines end as on Windows, some go on in the next."""
    mtl = "newmtl W\u00e4nde\nKd 0.2 0.2 0.2\nnewmtl W\u00f6nde\nKd 0.3 0.3 0.3\n"
    written(tmp_path, "a.mtl", mtl.encode(encoding))
    text = f"mtllib a.mtl\n{TRIANGLE}usemtl W\u00e4nde\nf 1 2 \\\n3\nusemtl W\u00f6nde\nv 0 0 5\nf 1 3 4\n"
    scene = load(tmp_path, text.replace("\n", "\r\n").encode(encoding))
    assert [(m.name, m.albedo[0]) for m in scene.materials] == [("W\u00e4nde", 0.2), ("W\u00f6nde", 0.3)]
    assert scene.warnings == ()


def test_maps_with_options_and_of_emission(tmp_path: Path) -> None:
    lines = "newmtl a\nmap_Kd -s 2 3 1 -o 0.5 0.25 0 -clamp on -bm 0.2 a.png\nmap_Ke -imfchan r b b.png\n"
    written(tmp_path, "a.mtl", lines + "newmtl b\nKe 2 2 2\nmap_Ke a.png\nTf 0.5 0.5 0.5\n")
    for name in ("a.png", "b b.png"):
        written(tmp_path, name, png([[[188, 188, 188]]]))
    scene = load(
        tmp_path, f"mtllib a.mtl\n{TRIANGLE}vt 0 0\nusemtl a\nf 1/1 2/1 3/1\nv 0 0 5\nusemtl b\nf 1/1 3/1 4/1\n"
    )
    one, other = scene.materials
    assert one.emission == (1, 1, 1) and one.emission_texture is not None and one.emission_texture.name == "b b.png"
    assert other.emission == (2, 2, 2) and other.emission_texture is not None and other.albedo_texture is None
    texture = one.albedo_texture
    assert texture is not None and texture.wrap == ("clamp", "clamp")
    u, v = 0.3, 0.9  # v from the bottom, as in the file
    assert np.allclose(texture.uv_transform @ [u, 1 - v, 1], [2 * u + 0.5, 1 - (3 * v + 0.25)])
    assert scene.warnings == ("1 material with a filter (Tf) and without opacity (d, Tr): opaque",)
