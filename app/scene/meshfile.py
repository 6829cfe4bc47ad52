"""Meshes without materials: PLY and STL through trimesh, as one double-sided object; OBJ goes to ``obj``.

The albedo is the colour of the vertices or faces (sRGB) where a file has any, else 0.5.
"""

from __future__ import annotations

import io
import logging
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from app.errors import SceneError
from app.scene.images import linear_from_srgb
from app.scene.model import F32, Material, Scene
from app.scene.obj import load_obj
from app.scene.validate import Part, validate
from app.util.background import Report, share_of, unheard

TEXTURE_LINE, HEADER_BYTES = b"comment TextureFile", 4096
PICTURE = "its picture is ignored: of a PLY file, only the colours of vertices and faces are read"


@np.errstate(all="ignore")
def load_meshfile(path: Path, report: Report = unheard) -> Scene:
    """Read an .obj, .ply or .stl file. report(share) is called now and then and may raise to cancel. SceneError for anything that
    makes it unusable."""
    if path.suffix.lower() == ".obj":
        return load_obj(path, report)
    report(0.0)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise SceneError(path, f"cannot be read: {error.strerror}") from error
    meshes = _read(path, data)
    report(0.4)
    parts = [
        Part(np.asarray(m.vertices, np.float64), np.asarray(m.faces, np.int64), colours=_colours(m)) for m in meshes
    ]
    if all(part.colours is not None for part in parts):
        material = Material("colours", albedo=(1.0, 1.0, 1.0), double_sided=True)
    else:
        material = Material("grey", double_sided=True)
    notes = [PICTURE] if TEXTURE_LINE in data[:HEADER_BYTES] else []
    rest = share_of(report, 0.5, 1.0)
    return validate(path, path.stem, parts, [path.stem], [material], warnings=notes, report=rest)


def _read(path: Path, data: bytes) -> list[trimesh.Trimesh]:
    """Every mesh in the file, exactly as stored."""
    kind = path.suffix.lower().removeprefix(".")
    if kind == "stl":
        data = _checked_stl(path, data)
    log = logging.getLogger("trimesh")
    level = log.level
    try:
        log.setLevel(logging.CRITICAL)  # what it would say of a PLY file's picture is said here
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numpy's remarks on text that ends early; what is missing shows below
            scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False, validate=False)
            meshes = [g for g in scene.geometry.values() if isinstance(g, trimesh.Trimesh)]
            for mesh in meshes:
                _ = mesh.vertices, mesh.faces, _colours(mesh)
            return meshes
    except Exception as error:  # trimesh's parsers raise whatever the broken bytes lead to
        reason = " ".join(str(error).split())[:120]
        raise SceneError(path, f"not a readable {kind.upper()} file ({type(error).__name__}: {reason})") from error
    finally:
        log.setLevel(level)


def _colours(mesh: trimesh.Trimesh) -> F32 | None:
    """Linear Rec.709 per vertex (n, 3) or corner (m, 3, 3); None if the file has none."""
    visual: Any = mesh.visual
    if visual.kind not in ("vertex", "face"):
        return None
    srgb = visual.vertex_colors if visual.kind == "vertex" else visual.face_colors
    linear = linear_from_srgb(np.asarray(srgb[:, :3], np.float32) / np.float32(255))
    return linear if visual.kind == "vertex" else np.repeat(linear[:, None], 3, axis=1)


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
