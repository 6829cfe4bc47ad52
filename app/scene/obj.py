"""Wavefront OBJ and MTL (Wavefront Advanced Visualizer, appendix B) as a Scene.

Read: v, vt, vn, f (polygons as fans, negative indices), o, g, usemtl, mtllib; of materials Kd as albedo, Ke as radiance
L like glTF's emission, d or else 1 - Tr as opacity, map_Kd and, times the opacity, map_d as pictures inside the scene's folder.
The format has no flag for it, so every surface is double-sided. Albedo is 0.5 where a material is missing, or has a picture that
is and no Kd.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.errors import SceneError
from app.scene.images import ImageError, path_inside, read_channel, read_image
from app.scene.model import F32, RGB, Material, Scene, Texture
from app.scene.validate import Part, check_triangle_count, counted, validate

Pictures = dict[tuple[str, str], F32 | None]  # by key and file; None where it cannot be read
KINDS = {"v": 3, "vt": 2, "vn": 3}  # numbers per line that are used


@dataclass
class _Mesh:
    """What the lines say, in order; corners are ``position/texture/normal`` as written."""

    numbers: dict[str, list[list[float]]] = field(default_factory=lambda: {kind: [] for kind in KINDS})
    corners: list[str] = field(default_factory=list)  # 3 per triangle
    object_ids: list[int] = field(default_factory=list)
    material_ids: list[int] = field(default_factory=list)
    objects: dict[str, int] = field(default_factory=dict)
    materials: dict[str, int] = field(default_factory=dict)
    libraries: list[str] = field(default_factory=list)


def load_obj(path: Path) -> Scene:
    """Read an .obj file with its .mtl files. SceneError for anything that makes it unusable."""
    try:
        text = path.read_text("utf-8", errors="replace")
    except OSError as error:
        raise SceneError(path, f"cannot be read: {error.strerror}") from error
    mesh = _read_lines(path, text)
    corners = _corner_indices(path, mesh)
    values: dict[str, NDArray[Any] | None] = {}
    for column, kind in enumerate(KINDS):
        table = np.array(mesh.numbers[kind], np.float64).reshape(-1, KINDS[kind])
        bad = corners[:, column] >= len(table)
        if bad.any():
            index = int(corners[bad, column][0]) + 1
            raise SceneError(path, f"{kind} index {index} is out of range: there are {len(table)}")
        if kind == "v":
            positions = table
        elif (corners[:, column] < 0).all():
            values[kind] = None
        else:  # a corner without the value takes the row of NaN at the end
            rows = np.concatenate([table, np.full((1, table.shape[1]), np.nan)])
            values[kind] = rows[corners[:, column]].reshape(-1, 3, table.shape[1])
    uv = values["vt"]
    if uv is not None:
        uv[..., 1] = 1.0 - uv[..., 1]  # OBJ counts v from the bottom
    materials, notes = _materials(path, mesh)
    part = Part(
        positions,
        corners[:, 0].reshape(-1, 3),
        np.array(mesh.object_ids, np.int64),
        np.array(mesh.material_ids, np.int64),
        uv0=uv,
        normals=values["vn"],
    )
    return validate(path, path.stem, [part], list(mesh.objects), materials, (), notes)


def _read_lines(path: Path, text: str) -> _Mesh:
    mesh = _Mesh()
    object_name, material_name = path.stem, ""
    for number, line in enumerate(text.replace("\\\n", " ").splitlines(), 1):
        words = line.split("#", 1)[0].split()
        if not words:
            continue
        key = words[0]
        try:
            if key in KINDS:
                width = KINDS[key]
                values = [float(w) for w in words[1 : 1 + width]]
                if key == "vt" and len(values) == 1:
                    values.append(0.0)
                if len(values) < width:
                    raise ValueError(f"{key} needs {width} numbers")
                mesh.numbers[key].append(values)
            elif key == "f":
                corners = [_absolute(c, mesh) for c in words[1:]] if "-" in line else words[1:]
                for k in range(1, len(corners) - 1):
                    mesh.corners += (corners[0], corners[k], corners[k + 1])
                count = max(len(corners) - 2, 0)
                mesh.object_ids += [mesh.objects.setdefault(object_name, len(mesh.objects))] * count
                mesh.material_ids += [mesh.materials.setdefault(material_name, len(mesh.materials))] * count
            elif key in ("o", "g"):
                object_name = " ".join(words[1:]) or path.stem
            elif key == "usemtl":
                material_name = " ".join(words[1:])
            elif key == "mtllib":
                mesh.libraries.append(" ".join(words[1:]))
        except ValueError as error:
            raise SceneError(path, f"line {number}: {error}") from error
    check_triangle_count(path, len(mesh.object_ids))
    if not mesh.object_ids:
        raise SceneError(path, "no triangles")
    return mesh


def _absolute(corner: str, mesh: _Mesh) -> str:
    """A corner with its negative indices counted from the start: -1 is the value read last."""
    out = []
    for word, kind in zip(corner.split("/"), KINDS, strict=False):
        index = int(word) if word else 0
        if index < 0:
            index += len(mesh.numbers[kind]) + 1
            if index < 1:
                raise ValueError(f"{kind} index {word} is out of range: there are {len(mesh.numbers[kind])} so far")
        out.append(str(index) if word else "")
    return "/".join(out)


def _corner_indices(path: Path, mesh: _Mesh) -> NDArray[np.int64]:
    """(3m, 3) position, texture and normal index of each corner, from 0; -1 where it has none."""
    parsed: dict[str, tuple[int, ...]] = {}
    for corner in dict.fromkeys(mesh.corners):
        words = [*corner.split("/"), "", ""][:3]
        try:
            indices = tuple(int(w) - 1 if w else -1 for w in words)
        except ValueError as error:
            raise SceneError(path, f"'{corner[:40]}' is not a corner of a face") from error
        given = [i for i, w in zip(indices, words, strict=True) if w]
        if indices[0] < 0 or min(given) < 0 or max(given) >= 2**40:
            raise SceneError(path, f"'{corner[:40]}' has an index out of range")
        parsed[corner] = indices
    return np.array([parsed[c] for c in mesh.corners], np.int64)


def _materials(path: Path, mesh: _Mesh) -> tuple[list[Material], list[str]]:
    """The used materials in order, and what of them is missing."""
    known: dict[str, dict[str, str]] = {}
    notes = []
    for library in dict.fromkeys(mesh.libraries):
        found = path_inside(path.parent, library)
        if found is None:
            notes.append(f"material library '{library}' is missing")
        else:
            known |= _read_mtl(path, found)
    pictures: Pictures = {}
    materials = [_material(path, name, known.get(name), pictures) for name in mesh.materials]
    unknown = sum(name not in known for name in mesh.materials)
    if unknown:
        notes.append(f"{counted(unknown, 'material is', 'materials are')} not defined: grey with albedo 0.5")
    lost = sum(pixels is None for pixels in pictures.values())
    if lost:
        notes.append(f"{counted(lost, 'picture', 'pictures')} could not be read: Kd is used, or albedo 0.5 without it")
    return materials, notes


def _read_mtl(path: Path, library: Path) -> dict[str, dict[str, str]]:
    """Lines of each material by lower-case key; the first of a kind counts."""
    materials: dict[str, dict[str, str]] = {}
    current: dict[str, str] = {}
    try:
        text = library.read_text("utf-8", errors="replace")
    except OSError as error:
        raise SceneError(path, f"{library.name} cannot be read: {error.strerror}") from error
    for line in text.splitlines():
        key, _, rest = line.split("#", 1)[0].strip().partition(" ")
        if key.lower() == "newmtl":
            current = materials.setdefault(rest.strip(), {})
        elif rest:
            current.setdefault(key.lower(), rest.strip())
    return materials


def _material(path: Path, name: str, lines: dict[str, str] | None, pictures: Pictures) -> Material:
    material = Material(name or "no material", double_sided=True)
    if lines is None:
        return material
    if "kd" in lines:
        material = dataclasses.replace(material, albedo=_colour(path, name, "Kd", lines["kd"]))
    if "ke" in lines:
        material = dataclasses.replace(material, emission=_colour(path, name, "Ke", lines["ke"]))
    if "d" in lines:  # options before it, -halo
        material = dataclasses.replace(material, opacity=_number(path, name, "d", lines["d"].split()[-1]))
    elif "tr" in lines:
        material = dataclasses.replace(material, opacity=1.0 - _number(path, name, "Tr", lines["tr"]))
    if "map_d" in lines:
        cut_out = _picture(path, "map_d", lines["map_d"], pictures)
        material = dataclasses.replace(material, opacity_texture=cut_out)
    texture = _picture(path, "map_kd", lines["map_kd"], pictures) if "map_kd" in lines else None
    if texture is None:
        return material
    albedo = material.albedo if "kd" in lines else (1.0, 1.0, 1.0)
    return dataclasses.replace(material, albedo=albedo, albedo_texture=texture)


def _picture(path: Path, key: str, text: str, pictures: Pictures) -> Texture | None:
    """The picture of a map line; of map_d its alpha, or else its red."""
    uri = _file_of_map(text)
    if (key, uri) not in pictures:
        found = path_inside(path.parent, uri)
        try:
            if found is None:
                pictures[key, uri] = None
            elif key == "map_d":
                alpha = read_channel(found, "A")
                pictures[key, uri] = read_channel(found, "R") if alpha is None else alpha
            else:
                pictures[key, uri] = read_image(found)
        except ImageError:
            pictures[key, uri] = None
    pixels = pictures[key, uri]
    return None if pixels is None else Texture(uri, pixels)


def _number(path: Path, material: str, key: str, text: str) -> float:
    return _colour(path, material, key, text)[0]


def _colour(path: Path, material: str, key: str, text: str) -> RGB:
    words = text.split()
    try:
        values = [float(w) for w in (words if len(words) >= 3 else words[:1] * 3)][:3]
        if len(values) < 3 or not all(math.isfinite(v) for v in values):
            raise ValueError
    except ValueError as error:
        raise SceneError(path, f"material '{material}': {key} {text[:40]} must be one or three numbers") from error
    return (values[0], values[1], values[2])


def _file_of_map(text: str) -> str:
    """The file name after the options of a map line (-s 1 1 1 and the like: numbers, on or off)."""
    words = text.split()
    if not words[0].startswith("-"):
        return text
    k = 0
    while k < len(words) - 1 and words[k].startswith("-"):
        k += 1
        while k < len(words) - 1 and _is_option_value(words[k]):
            k += 1
    return " ".join(words[k:])


def _is_option_value(word: str) -> bool:
    return word in ("on", "off") or word.lstrip("-+").replace(".", "", 1).replace("e", "", 1).isdigit()
