"""PLY: polygons and colours of all types, and broken files."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from scene_files import written

from app.errors import SceneError
from app.scene.images import linear_from_srgb
from app.scene.meshfile import load_meshfile
from app.scene.model import MOST_ALBEDO, Scene
from app.scene.ply import ROWS


def load(folder: Path, data: str | bytes) -> Scene:
    return load_meshfile(written(folder, "a.ply", data))


PLY_POINTS = [(0, 0, 0), (2, 0, 0), (2, 0, -2), (0, 0, -2)]
PLY_POINTS += [(9, 0, 0), (13, 0, 0), (13, 0, -4), (11, 0, -1), (9, 0, -4), (0, 0, 2)]
PLY_FACES = [(0, 1, 2, 3), (4, 5, 6, 7, 8), (0, 9, 1), (0, 1)]


def ply_of_polygons(kind: str, colours: str = "uchar") -> bytes:
    """The vertices with colours sRGB 188, 0, 255 of 255, in one of the three formats."""
    lines = ["ply", f"format {kind} 1.0", f"element vertex {len(PLY_POINTS)}"]
    lines += [f"property double {axis}" for axis in "xyz"] + [
        f"property {colours} {c}" for c in ("red", "green", "blue")
    ]
    lines += [
        f"element face {len(PLY_FACES)}",
        "property list uchar uint vertex_index",
        "property float more",
        "end_header\n",
    ]
    most = {"uchar": 255, "ushort": 65535, "float": 1.0}[colours]
    paint = [188 / 255 * most, 0, most]
    paint = paint if colours == "float" else [round(x) for x in paint]
    rows = [[*point, *paint] for point in PLY_POINTS]
    if kind == "ascii":
        text = [" ".join(map(str, row)) for row in rows] + [f"{len(f)} {' '.join(map(str, f))} 0.5" for f in PLY_FACES]
        return "\r\n".join([*lines[:-1], "end_header", *text]).encode()
    order = "<" if "little" in kind else ">"
    body = [struct.pack(f"{order}3d3{ {'uchar': 'B', 'ushort': 'H', 'float': 'f'}[colours] }", *row) for row in rows]
    body += [struct.pack(f"{order}B{len(f)}If", len(f), *f, 0.5) for f in PLY_FACES]
    return "\n".join(lines).encode() + b"".join(body)


@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("colours", ["uchar", "ushort", "float"])
def test_ply_with_polygons_of_all_sizes(tmp_path: Path, kind: str, colours: str) -> None:
    scene = load(tmp_path, ply_of_polygons(kind, colours))
    normals, areas = scene.normals_areas
    assert np.allclose(areas.sum(), 4 + 10 + 2) and np.allclose(normals[:, 1], 1)
    assert scene.colours is not None and np.allclose(scene.colours, [0.502886, 0, 0.99], atol=1e-4)


PLY_TEXT = (
    "ply\nformat ascii 1.0\nelement vertex 3\n{}element face 1\nproperty list uchar int vertex_indices\nend_header\n"
)
PLY_AXES = "property float x\nproperty float y\nproperty float z\n"
PLY_WRONG = {  # what of a triangle is replaced, and by what
    "index 99999999999 is out of range": ("3 0 1 2", "3 0 1 99999999999"),
    "index 1.7 is no whole number": ("3 0 1 2", "3 0 1 1.7"),
    "a list has 3.9 values": ("3 0 1 2", "3.9 0 1 2"),
    "its vertices have no x": ("float x", "float u"),
    "its header has no format": ("format ascii 1.0\n", ""),
    "format 'text' is unknown": ("ascii", "text"),
    "property x is of no known type: 'real'": ("float x", "real x"),
    "it has 4 more numbers than its header says": ("1 0 0", "1 0 0 7"),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("message", PLY_WRONG)
def test_a_wrong_ply_file_says_what_is_wrong(tmp_path: Path, message: str) -> None:
    text = PLY_TEXT.format(PLY_AXES) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
    assert len(load(tmp_path, text).triangles) == 1
    with pytest.raises(SceneError, match=message):
        load(tmp_path, text.replace(*PLY_WRONG[message]))


@pytest.mark.parametrize(
    ("kind", "written_as", "srgb"),
    [
        ("int", "255 188 0", (255, 188, 0)),
        ("ushort", "65535 48316 0", (255, 188, 0)),
        ("uchar", "256 188 -1", (255, 188, 0)),
        ("uchar", "1.0 0.5 0", (255, 127.5, 0)),
    ],
)
def test_ply_colours_of_all_types(tmp_path: Path, kind: str, written_as: str, srgb: tuple[float, ...]) -> None:
    axes = PLY_AXES + "".join(f"property {kind} {name}\n" for name in ("red", "green", "blue"))
    text = (
        PLY_TEXT.format(axes)
        + "".join(f"{place} {written_as}\n" for place in ("0 0 0", "1 0 0", "0 1 0"))
        + "3 0 1 2\n"
    )
    colours = load(tmp_path, text).colours
    assert colours is not None
    expected = linear_from_srgb(np.array(srgb, np.float32) / 255)
    np.testing.assert_allclose(colours[0, 0], np.minimum(expected, MOST_ALBEDO), atol=1e-4)


def test_reading_ply_polygons_of_all_sizes_can_be_stopped(tmp_path: Path) -> None:
    """It reports in the midst of their rows."""
    count = 2 * ROWS
    head = f"ply\nformat binary_big_endian 1.0\nelement vertex 4\n{PLY_AXES}element face {count}\n"
    points = struct.pack(">12f", 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0)
    faces = (struct.pack(">B3i", 3, 0, 1, 2) + struct.pack(">B4i", 4, 0, 1, 2, 3)) * (count // 2)
    data = (head + "property list uchar int vertex_indices\nend_header\n").encode() + points + faces

    def stop(share: float) -> None:
        if 0.1 < share < 0.3:
            raise InterruptedError

    with pytest.raises(InterruptedError):
        load_meshfile(written(tmp_path, "a.ply", data), stop)


def test_a_ply_file_that_ends_early_says_where(tmp_path: Path) -> None:
    data = ply_of_polygons("binary_little_endian")
    for keep, what in ((len(data) - 3, "face"), (data.index(b"end_header") + 50, "vertex")):
        with pytest.raises(SceneError, match=f"ends before its {what} elements do"):
            load(tmp_path, data[:keep])
