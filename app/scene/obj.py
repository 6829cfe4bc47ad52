"""Wavefront OBJ (Wavefront Advanced Visualizer, appendix B) as a Scene; its materials are read in ``mtl``.

Read: v (six numbers: a position and a colour in sRGB), vt, vn, f (negative indices; polygons as fans, by ear clipping where they
are concave), o, g, usemtl, mtllib. Names go to the end of their line.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.errors import SceneError
from app.scene.images import linear_from_srgb
from app.scene.model import Scene
from app.scene.mtl import read_materials, unquoted
from app.scene.polygons import with_ears_clipped
from app.scene.text import decoded
from app.scene.validate import Part, check_triangle_count, validate
from app.util.background import Report, share_of, unheard

KINDS = {"v": 3, "vt": 2, "vn": 3}  # numbers per line that are used
NAMED = ("o", "g", "usemtl", "mtllib")
OFTEN = 1 << 14  # lines between two reports


@dataclass
class _Mesh:
    """What the lines say, in order; corners are ``position/texture/normal`` as written, polygons as fans."""

    numbers: dict[str, list[float]] = field(default_factory=lambda: {kind: [] for kind in KINDS})  # one after the other
    colours: dict[int, list[float]] = field(default_factory=dict)  # by position
    corners: list[str] = field(default_factory=list)  # 3 per triangle
    fans: list[int] = field(default_factory=list)  # triangles of each face
    object_ids: list[int] = field(default_factory=list)  # of each face
    material_ids: list[int] = field(default_factory=list)
    objects: dict[str, int] = field(default_factory=dict)
    materials: dict[str, int] = field(default_factory=dict)
    libraries: list[str] = field(default_factory=list)


def load_obj(path: Path, report: Report = unheard) -> Scene:
    """Read an .obj file with its .mtl files. report: as of ``load_meshfile``. SceneError for anything that makes it unusable."""
    try:
        text = decoded(path.read_bytes())
    except OSError as error:
        raise SceneError(path, f"cannot be read: {error.strerror}") from error
    mesh = _read_lines(path, text, share_of(report, 0.0, 0.5))
    report(0.5)
    corners = _corner_indices(path, mesh)
    report(0.6)
    fans = np.array(mesh.fans, np.int64)
    object_ids, material_ids = (
        np.repeat(np.array(ids, np.int64), fans) for ids in (mesh.object_ids, mesh.material_ids)
    )
    values: dict[str, NDArray[Any] | None] = {}
    for column, kind in enumerate(KINDS):
        table = np.array(mesh.numbers[kind], np.float64).reshape(-1, KINDS[kind])
        bad = corners[:, column] >= len(table)
        if bad.any():
            index = int(corners[bad, column][0]) + 1
            raise SceneError(path, f"{kind} index {index} is out of range: there are {len(table)}")
        if kind == "v":
            positions = table
            corners, of = with_ears_clipped(positions, corners, fans)
            object_ids, material_ids = object_ids[of], material_ids[of]
        elif (corners[:, column] < 0).all():
            values[kind] = None
        else:  # a corner without the value takes the row of NaN at the end
            rows = np.concatenate([table, np.full((1, table.shape[1]), np.nan)])
            values[kind] = rows[corners[:, column]].reshape(-1, 3, table.shape[1])
    uv = values["vt"]
    if uv is not None:
        uv[..., 1] = 1.0 - uv[..., 1]  # OBJ counts v from the bottom
    coloured = 0 < len(mesh.colours) == len(positions)
    materials, notes = read_materials(path, mesh.libraries, list(mesh.materials), coloured=coloured)
    part = Part(
        positions,
        corners[:, 0].reshape(-1, 3),
        object_ids,
        material_ids,
        uv0=uv,
        normals=values["vn"],
        colours=_colours(mesh),
    )
    rest = share_of(report, 0.7, 1.0)
    return validate(path, path.stem, [part], list(mesh.objects), materials, (), notes, report=rest)


def _read_lines(path: Path, text: str, report: Report) -> _Mesh:
    mesh = _Mesh()
    object_name, material_name = path.stem, ""
    lines = text.replace("\\\n", " ").split("\n")
    for number, line in enumerate(lines, 1):
        if number % OFTEN == 1:
            report(number / len(lines))
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        key = words[0]
        if key in NAMED:
            name = unquoted((*line.split(None, 1), "")[1])
        try:
            if key in KINDS:
                width = KINDS[key]
                values = [float(w) for w in words[1 : 1 + width]]
                if key == "vt" and len(values) == 1:
                    values.append(0.0)
                if len(values) < width:
                    raise ValueError(f"{key} needs {width} numbers")
                if key == "v" and len(words) > 6:
                    mesh.colours[len(mesh.numbers[key]) // width] = [float(w) for w in words[4:7]]
                mesh.numbers[key] += values
            elif key == "f":
                corners = [_absolute(c, mesh) for c in words[1:]] if "-" in line else words[1:]
                for k in range(1, len(corners) - 1):
                    mesh.corners += (corners[0], corners[k], corners[k + 1])
                if len(corners) > 2:
                    mesh.fans.append(len(corners) - 2)
                    mesh.object_ids.append(mesh.objects.setdefault(object_name, len(mesh.objects)))
                    mesh.material_ids.append(mesh.materials.setdefault(material_name, len(mesh.materials)))
            elif key in ("o", "g"):
                object_name = name or path.stem
            elif key == "usemtl":
                material_name = name
            elif key == "mtllib":
                mesh.libraries.append(name)
        except ValueError as error:
            raise SceneError(path, f"line {number}: {error}") from error
    check_triangle_count(path, len(mesh.corners) // 3)
    if not mesh.fans:
        raise SceneError(path, "no triangles")
    return mesh


def _absolute(corner: str, mesh: _Mesh) -> str:
    """A corner with its negative indices counted from the start: -1 is the value read last."""
    out = []
    for word, kind in zip(corner.split("/"), KINDS, strict=False):
        index = int(word) if word else 0
        if index < 0:
            count = len(mesh.numbers[kind]) // KINDS[kind]
            index += count + 1
            if index < 1:
                raise ValueError(f"{kind} index {word} is out of range: there are {count} so far")
        out.append(str(index) if word else "")
    return "/".join(out)


def _corner_indices(path: Path, mesh: _Mesh) -> NDArray[np.int64]:
    """(3m, 3) position, texture and normal index of each corner, from 0; -1 where it has none."""
    number = {corner: k for k, corner in enumerate(dict.fromkeys(mesh.corners))}
    parsed = []
    for corner in number:
        words = [*corner.split("/"), "", ""][:3]
        try:
            indices = [int(w) - 1 if w else -1 for w in words]
        except ValueError as error:
            raise SceneError(path, f"'{corner[:40]}' is not a corner of a face") from error
        given = [i for i, w in zip(indices, words, strict=True) if w]
        if indices[0] < 0 or min(given) < 0 or max(given) >= 2**40:
            raise SceneError(path, f"'{corner[:40]}' has an index out of range")
        parsed.append(indices)
    which = np.fromiter(map(number.__getitem__, mesh.corners), np.int64, len(mesh.corners))
    return np.array(parsed, np.int64)[which]


def _colours(mesh: _Mesh) -> NDArray[np.float32] | None:
    """(n, 3) linear Rec.709 of the positions, NaN where one has none; None if none has any."""
    if not mesh.colours:
        return None
    srgb = np.full((len(mesh.numbers["v"]) // KINDS["v"], 3), np.nan, np.float32)
    srgb[list(mesh.colours)] = list(mesh.colours.values())
    return linear_from_srgb(srgb)
