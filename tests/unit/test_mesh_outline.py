"""What ``info`` says of large OBJ, PLY and STL files without reading them whole, beside what they hold."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import app.commands.info as info_module
from app.cli import run
from app.scene import shapes
from app.scene.load import load_scene
from app.scene.mesh_outline import outline_mesh
from app.scene.options import FileOptions
from app.scene.outline import Outline

LEVEL = 5  # of the ball: 20,480 triangles


@pytest.fixture(scope="module")
def ball() -> trimesh.Trimesh:
    """Not round, so that triangles differ."""
    ball = shapes.icosphere(1.0, LEVEL)
    return trimesh.Trimesh(ball.positions * (1.0, 2.0, 0.5) + (3.0, 0.0, 0.0), ball.triangles, process=False)


def obj(mesh: trimesh.Trimesh) -> str:
    """With a comment, normals' indices, names, two materials, and the second half of the faces counted backwards."""
    count = len(mesh.vertices)
    lines = ["mtllib ball.mtl", "# ball"] + [f"v {x} {y} {z}" for x, y, z in mesh.vertices] + ["vn 0 1 0", "o ball"]
    for k, corners in enumerate(mesh.faces.tolist()):
        if k % (len(mesh.faces) // 2) == 0:
            lines.append(f"usemtl {'lamp' if k else 'red'}")
        index = [c + 1 if k < len(mesh.faces) / 2 else c - count for c in corners]
        lines.append("f " + " ".join(f"{i}//1" for i in index))
    return "\n".join(lines)


def ply_of_quads(*, every: int = 1) -> bytes:
    """Squares side by side, big endian."""
    n = 100
    x, z = (axis.ravel() for axis in np.meshgrid(np.arange(n + 1), np.arange(n + 1)))
    vertices = np.column_stack([x, 0.5 * np.sin(x), z]).astype(">f4")
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    quads = np.column_stack([corner, corner + n + 1, corner + n + 2, corner + 1])
    faces = np.column_stack([np.full(len(quads), 4), quads]).astype(">i4")
    head = f"ply\nformat binary_big_endian 1.0\nelement vertex {len(vertices)}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz")
    rows = [face.tobytes() for face in faces]
    for k in set(range(len(faces))) - set(range(0, len(faces), every)):
        _, a, b, c, d = faces[k]
        rows[k : k + 1] = [np.array([[3, a, b, c], [3, a, c, d]], ">i4").tobytes()]
    triangles = len(faces) - len(range(0, len(faces), every))
    head += f"element face {len(faces) + triangles}\nproperty list int int vertex_indices\nend_header\n"
    return head.encode() + vertices.tobytes() + b"".join(rows)


FILES: dict[str, Callable[[trimesh.Trimesh], str | bytes]] = {
    "ball.obj": obj,
    "binary.ply": lambda mesh: mesh.export(file_type="ply"),
    "text.ply": lambda mesh: mesh.export(file_type="ply", encoding="ascii"),
    "returns.ply": lambda mesh: mesh.export(file_type="ply", encoding="ascii").replace(b"\n", b"\r"),
    "quads.ply": lambda mesh: ply_of_quads(),
    "mixed.ply": lambda mesh: ply_of_quads(every=3),
    "binary.stl": lambda mesh: mesh.export(file_type="stl"),
    "text.stl": lambda mesh: mesh.export(file_type="stl_ascii"),
}


def written(folder: Path, name: str, mesh: trimesh.Trimesh) -> Path:
    data = FILES[name](mesh)
    (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)
    (folder / "ball.mtl").write_text("newmtl red\nKd 0.5 0.1 0.1\nnewmtl lamp\nKe 5 5 5\n")
    return folder / name


@pytest.mark.parametrize("name", FILES)
def test_an_outline_is_about_what_the_file_holds(tmp_path: Path, ball: trimesh.Trimesh, name: str) -> None:
    path = written(tmp_path, name, ball)
    whole = Outline.of(load_scene(path, FileOptions(unit="m", up="y")))
    assert outline_mesh(path, whole.triangles + 2000) is None
    found = outline_mesh(path, whole.triangles - 2000)
    assert found is not None and not found.exact
    # of 4,096 triangles or squares among 20,000; a text's lengths vary by digits
    assert found.triangles == pytest.approx(whole.triangles, rel=0.02)
    assert found.sides == 2 * found.triangles
    assert found.area == pytest.approx(whole.area, rel=0.02)
    size = whole.upper - whole.lower
    assert np.abs([found.lower - whole.lower, found.upper - whole.upper]).max() < 0.02 * size.max()
    for field in ("name", "objects", "materials", "emitting_materials", "textures"):
        assert getattr(found, field) == getattr(whole, field), field


@pytest.mark.parametrize("damage", [lambda data: b"", lambda data: data[: len(data) // 2], lambda data: b"\x00" * 5000])
@pytest.mark.parametrize("name", ["ball.obj", "binary.ply", "binary.stl"])
def test_of_a_damaged_file_reading_says_what_is_wrong(
    tmp_path: Path, ball: trimesh.Trimesh, name: str, damage: Callable[[bytes], bytes]
) -> None:
    path = written(tmp_path, name, ball)
    path.write_bytes(damage(path.read_bytes()))
    outline_mesh(path, 100)  # raises nothing, and no warning


def test_info_does_not_read_a_large_mesh_and_says_what_is_estimated(
    tmp_path: Path, ball: trimesh.Trimesh, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file of millimetres with z up, as it is read."""
    path = written(tmp_path, "binary.stl", ball.copy().apply_scale(2000.0))

    def told_of() -> dict[str, Any]:
        assert run(["info", str(path), "--json"]) == 0
        return dict(json.loads(capsys.readouterr().out))

    read = told_of()
    monkeypatch.setitem(info_module.OUTLINES, ".stl", (outline_mesh, 1000))
    monkeypatch.setattr(info_module, "load_scene", lambda *args, **more: pytest.fail("reads it"))
    told = told_of()
    assert {"triangles", "size_m", "texels"} <= set(told["estimated"])
    assert told["size_m"] == pytest.approx(read["size_m"], rel=0.02)
    assert told["texels_per_metre"] == pytest.approx(read["texels_per_metre"], rel=0.02)
    assert any("millimetres" in warning for warning in told["warnings"])
