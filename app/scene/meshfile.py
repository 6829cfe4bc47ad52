"""Meshes without materials: PLY, and STL through trimesh, as one double-sided object; OBJ goes to ``obj``.

The albedo is the colour of the vertices or faces (sRGB) where a file has any, else 0.5.
"""

from __future__ import annotations

import io
import warnings
from pathlib import Path

import numpy as np
import trimesh

from app.errors import SceneError
from app.scene.model import Material, Scene
from app.scene.obj import load_obj
from app.scene.ply import read_ply
from app.scene.validate import Part, validate
from app.util.background import Report, share_of, unheard

TEXTURE_LINE, HEADER_BYTES = b"comment TextureFile", 4096
TEXT_BYTES = 1024  # of a text file, within which its first triangle begins
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
    part = read_ply(path, data, share_of(report, 0.0, 0.4)) if path.suffix.lower() == ".ply" else _read_stl(path, data)
    report(0.4)
    if part.colours is not None:
        material = Material("colours", albedo=(1.0, 1.0, 1.0), double_sided=True)
    else:
        material = Material("grey", double_sided=True)
    notes = [PICTURE] if TEXTURE_LINE in data[:HEADER_BYTES] else []
    rest = share_of(report, 0.5, 1.0)
    return validate(path, path.stem, [part], [path.stem], [material], warnings=notes, report=rest)


def _read_stl(path: Path, data: bytes) -> Part:
    """All triangles in the file, exactly as stored."""
    data = _checked_stl(path, data)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # numpy's remarks on text that ends early; what is missing shows below
            scene = trimesh.load_scene(io.BytesIO(data), file_type="stl", process=False, validate=False)
            meshes = [g for g in scene.geometry.values() if isinstance(g, trimesh.Trimesh)]
            triangles = np.concatenate([np.empty((0, 3, 3)), *(mesh.triangles for mesh in meshes)])
    except Exception as error:  # trimesh's parser raises whatever the broken bytes lead to
        reason = " ".join(str(error).split())[:120]
        raise SceneError(path, f"not a readable STL file ({type(error).__name__}: {reason})") from error
    return Part(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))


def _checked_stl(path: Path, data: bytes) -> bytes:
    """Binary STL of the length that its header promises, or text; SceneError if neither."""
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else 0
    need = 84 + 50 * count  # header, then 50 bytes a triangle
    if len(data) >= 84 and len(data) == need:
        return data
    text = data.removeprefix(b"\xef\xbb\xbf").lstrip()
    if text[:5].lower() == b"solid" and (
        len(data) < max(need, 84) or count == 0 or b"facet" in text[:TEXT_BYTES].lower()
    ):
        return text.decode("utf-8", "replace").encode()
    if len(data) < 84 or len(data) < need:
        raise SceneError(path, f"not a readable STL file: {len(data)} of {max(need, 84)} bytes are there")
    return data[:need]
