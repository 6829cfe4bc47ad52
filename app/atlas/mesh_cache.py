"""The visible mesh of many triangles is kept on disk: reading takes a tenth of making it.

Its weights are in the file only for rows that are a part of a triangle; those of a whole one are the identity.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np

from app.atlas.charts import Charts
from app.atlas.charts_cache import program
from app.atlas.visible_mesh import Clusters, Drawn, VisibleMesh, visible_mesh
from app.scene.model import F64, Scene
from app.util import cache

FEWEST = 1 << 16  # triangles that a file is worth: they take a third of a second
CACHE_FILES = 4  # kept, newest first: of a million triangles with shared corners a file takes 40 MB
CLUSTERS = "clusters_"  # before the names of what is theirs
PARTS = "parts"  # the rows (k,) whose weights (k, 3, 3) are kept


def kept_mesh(scene: Scene, charts: Charts, local: F64, drawn: Callable[[], Drawn] | None = None) -> VisibleMesh:
    """That of ``visible_mesh``, from the cache if it is there. drawn: gives what is drawn of the triangles, where that is being
    worked out."""
    if len(scene.triangles) < FEWEST:
        return visible_mesh(scene, charts, local, None if drawn is None else drawn())
    own = {name: getattr(charts, name) for name in ("face_triangle", "face_back", "face_uv")}
    given = {"local": local, "triangles": scene.triangles, "materials": scene.material_ids, **own}
    file = cache.entry("mesh", cache.digest(program(), given))
    found = _read(cache.read(file))
    if found is None:
        found = visible_mesh(scene, charts, local, None if drawn is None else drawn())
        cache.store(_content(found), file, CACHE_FILES)
    return found


def _content(mesh: VisibleMesh) -> cache.Arrays:
    own = {name: value for name, value in vars(mesh).items() if name not in ("weights", "clusters")}
    if mesh.weights is not None:
        own[PARTS] = np.flatnonzero((mesh.weights != np.eye(3)).any((1, 2)))
        own["weights"] = mesh.weights[own[PARTS]]
    clusters = {} if mesh.clusters is None else {CLUSTERS + name: value for name, value in vars(mesh.clusters).items()}
    return {name: np.asarray(value) for name, value in (own | clusters).items()}


def _read(data: cache.Arrays | None) -> VisibleMesh | None:
    """The mesh that a file holds; None where it holds none."""
    names = {field.name for field in dataclasses.fields(VisibleMesh)} - {"weights", "clusters"}
    if data is None or not names <= data.keys():
        return None
    clusters = {name.removeprefix(CLUSTERS): array for name, array in data.items() if name.startswith(CLUSTERS)}
    if clusters:
        clusters["fixed"] = int(clusters["fixed"])  # type: ignore[assignment]
    own = {name: data[name] for name in names}
    return VisibleMesh(**own, weights=_weights(data), clusters=Clusters(**clusters) if clusters else None)  # type: ignore[arg-type]


def _weights(data: cache.Arrays) -> F64 | None:
    """Those of all rows (n, 3, 3) of the mesh that a file holds; None where no triangle was divided."""
    if PARTS not in data:
        return None
    weights = np.tile(np.eye(3), (len(data["triangle"]), 1, 1))
    weights[data[PARTS]] = data["weights"]
    return weights
