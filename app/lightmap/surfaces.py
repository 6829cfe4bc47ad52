"""The surfaces of texels as solvers take them: each on the face that it shows most of. Where there are many, they are kept on
disk: reading takes a tenth of cutting them.

A file holds what the scene and its charts do not say, of texels that cover nothing too: to read it is to copy it. Normals are
those of faces.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.charts_cache import program
from app.atlas.texels import Leaves, TexelSurfaces, texel_surfaces
from app.scene.model import F32, F64, I32, Scene
from app.util import cache
from app.util.ahead import ahead

FOLD = 1e-4  # of a texel's width: further off the plane of its leading face, a mean of faces is off the surface
BLOCK = 1 << 15  # texels in work at a time
FEWEST = 1 << 18  # texels that a file is worth: they take half a second
CACHE_FILES = 4  # kept, newest first: of two million texels a file takes 160 MB
KEPT = ("face", "cut", "area", "position", "leading")


def surfaces_of(
    scene: Scene, charts: Charts, leaves: Leaves, report: Callable[[float], None] | None = None
) -> TexelSurfaces:
    """Those of leaves, from the cache or as ``texel_surfaces`` and ``on_their_faces`` make them."""
    if len(leaves) * charts.tile**2 < FEWEST:
        return on_their_faces(scene, charts, texel_surfaces(scene, charts, leaves, report))
    file = cache.entry("texels", cache.digest(program(Path(__file__)), _given(scene, charts, leaves)))
    found = _read(scene, charts, cache.read(file))
    if found is None:
        found = on_their_faces(scene, charts, texel_surfaces(scene, charts, leaves, report))
        cache.store(_content(found), file, CACHE_FILES)
    return found


def on_their_faces(scene: Scene, charts: Charts, surfaces: TexelSurfaces) -> TexelSurfaces:
    """Texels that fold over several faces, put onto the one that they show most of, with its normal. Their mean lies inside or
    outside of the surface, where the surface itself would hide it."""
    normals, origins = face_normals(scene, charts), scene.corners[charts.face_triangle, 0]
    faces, area = surfaces.face.reshape(-1), surfaces.area.reshape(-1)
    position, leading = (places.reshape(-1, 3) for places in (surfaces.position, surfaces.leading))

    def folded(first: int) -> NDArray[np.int64]:
        texels = first + np.flatnonzero(faces[first : first + BLOCK] >= 0)
        face = faces[texels]
        height = np.abs(np.einsum("nk,nk->n", position[texels] - origins[face], normals[face]))
        return np.asarray(texels[height > FOLD * np.sqrt(area[texels])])

    positions = position.copy()
    for texels in ahead(folded, range(0, len(faces), BLOCK)):
        positions[texels] = leading[texels]
    return dataclasses.replace(
        surfaces, position=positions.reshape(surfaces.position.shape), normal=_normals_of(normals, surfaces.face)
    )


def _normals_of(normals: F64, face: I32) -> F32:
    """(n, t, t, 3) those of faces, 0 where there is none."""
    return np.append(normals, np.zeros((1, 3)), axis=0).astype(np.float32).take(face, axis=0, mode="wrap")


def face_normals(scene: Scene, charts: Charts) -> F64:
    """(f, 3) unit, towards the lit side."""
    return np.asarray(scene.normals_areas[0][charts.face_triangle] * np.where(charts.face_back, -1.0, 1.0)[:, None])


def _given(scene: Scene, charts: Charts, leaves: Leaves) -> cache.Arrays:
    """All that the surfaces follow from."""
    own = ("face_triangle", "face_back", "face_uv", "hidden_uv", "hidden_face")
    cut = {name: getattr(charts, name) for name in own}
    return {"positions": scene.positions, "triangles": scene.triangles, **cut, **vars(leaves)} | {
        "tile": np.array(charts.tile)
    }


def _content(surfaces: TexelSurfaces) -> cache.Arrays:
    return {name: getattr(surfaces, name) for name in KEPT}


def _read(scene: Scene, charts: Charts, data: cache.Arrays | None) -> TexelSurfaces | None:
    """The surfaces that a file holds; None where it holds none."""
    if data is None or not set(KEPT) <= data.keys():
        return None
    return TexelSurfaces(
        **{name: data[name] for name in KEPT}, normal=_normals_of(face_normals(scene, charts), data["face"])
    )
