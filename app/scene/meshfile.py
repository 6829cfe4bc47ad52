"""Meshes without materials: PLY and STL through trimesh, as one grey, double-sided object; OBJ goes to ``obj``.

Albedo 0.5; colours of vertices and faces have no effect. Lengths are taken as metres, axes as they are.
"""

from __future__ import annotations

import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from app.errors import SceneError
from app.scene.model import Material, Scene
from app.scene.obj import load_obj
from app.scene.validate import Part, validate


@np.errstate(all="ignore")
def load_meshfile(path: Path) -> Scene:
    """Read an .obj, .ply or .stl file. SceneError for anything that makes it unusable."""
    if path.suffix.lower() == ".obj":
        return load_obj(path)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise SceneError(path, f"cannot be read: {error.strerror}") from error
    parts = [Part(positions, triangles) for positions, triangles in _read(path, data)]
    return validate(path, path.stem, parts, [path.stem], [Material("grey", double_sided=True)])


def _read(path: Path, data: bytes) -> list[tuple[NDArray[Any], NDArray[Any]]]:
    """Vertices and faces of every mesh in the file, exactly as stored."""
    kind = path.suffix.lower().removeprefix(".")
    if kind == "stl":
        data = _checked_stl(path, data)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numpy's remarks on text that ends early; what is missing shows below
            scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False, validate=False)
            meshes = [g for g in scene.geometry.values() if isinstance(g, trimesh.Trimesh)]
            return [(np.asarray(m.vertices, np.float64), np.asarray(m.faces, np.int64)) for m in meshes]
    except Exception as error:  # trimesh's parsers raise whatever the broken bytes lead to
        reason = " ".join(str(error).split())[:120]
        raise SceneError(path, f"not a readable {kind.upper()} file ({type(error).__name__}: {reason})") from error


def _checked_stl(path: Path, data: bytes) -> bytes:
    """Binary STL of the length that its header promises, or text; SceneError if neither."""
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else 0
    need = 84 + 50 * count  # header, then 50 bytes a triangle
    if len(data) >= 84 and len(data) == need:
        return data
    if data.lstrip()[:5].lower() == b"solid":
        return data.decode("utf-8", "replace").encode()
    if len(data) < 84 or len(data) < need:
        raise SceneError(path, f"not a readable STL file: {len(data)} of {max(need, 84)} bytes are there")
    return data[:need]
