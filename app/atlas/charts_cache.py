"""Charts of many triangles are kept on disk, with the triangles that were cut for them: reading takes a tenth of making them.

They are known by all that they follow from: the scene's geometry, cameras that may be within closed bodies (see enclosed.py), how
finely the scene is cut, and the program that does it. Those of which xatlas failed to make some are not kept: a machine that was
too busy for it may not be the next time.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.cuts import cut_at_contacts
from app.atlas.enclosed import cameras_inside
from app.atlas.options import AtlasOptions
from app.atlas.parametrize import parametrize
from app.atlas.seams import Seams, SeamTexels
from app.scene.model import Scene
from app.util import cache

FEWEST = 16384  # triangles that a file is worth
CACHE_FILES = 8  # kept, newest first: of a million triangles a file takes 150 MB
BY_TRIANGLE = (
    "material_ids",
    "object_ids",
    "listed",
    "uv0",
    "uv1",
    "normals",
    "colours",
)  # of a scene, that cutting changes
GEOMETRY = ("positions", "triangles", *BY_TRIANGLE)
LIBRARIES = ("numpy", "scipy", "shapely", "xatlas")
SCENE, SEAMS, NEAR = "scene_", "seams_", "near_seams_"  # before the names of what is theirs
APART = ("seams", "warnings")
NOTES = (SCENE + "warnings", "warnings")


def charts_of(
    scene: Scene,
    atlas: AtlasOptions,
    *,
    roots: bool = False,
    progress: Callable[[str, float], None] | None = None,
    waiting: Callable[[], None] | None = None,
    cut: Callable[[Scene], None] | None = None,
) -> tuple[Scene, Charts]:
    """The scene, cut where its surfaces meet, and its charts; see ``cut_at_contacts`` and ``parametrize``. Where there are many
    triangles, whose charts are not kept, waiting is called first, and cut with the scene as soon as it is cut."""
    if len(scene.triangles) < FEWEST:
        return _made(scene, atlas, roots, progress)
    file = _file(scene, atlas, roots)
    found = _read(scene, cache.read(file))
    if found is None:
        if waiting is not None:
            waiting()
        found = _made(scene, atlas, roots, progress, cut)
        if found[1].lasting:
            _ = found[1].seam_texels  # found here once, not in two threads that both need them
            cache.store(functools.partial(_content, scene, *found), file, CACHE_FILES)
    return found


def kept_notes(scene: Scene, atlas: AtlasOptions, *, roots: bool) -> tuple[str, ...] | None:
    """What was to be said when the scene was cut and its charts were made, where these are kept; else None."""
    if len(scene.triangles) < FEWEST:
        return None
    data = cache.read(_file(scene, atlas, roots), only=NOTES)
    return None if data is None else tuple(str(note) for name in NOTES for note in data[name])


def _file(scene: Scene, atlas: AtlasOptions, roots: bool) -> Path:
    return cache.entry("charts", cache.digest(program(), _given(scene, atlas, roots)))


def _made(
    scene: Scene,
    atlas: AtlasOptions,
    roots: bool,
    progress: Callable[[str, float], None] | None,
    tell: Callable[[Scene], None] | None = None,
) -> tuple[Scene, Charts]:
    report = progress or (lambda stage, share: None)
    cut = cut_at_contacts(scene, lambda share: report("cutting where surfaces meet", 0.15 * share))
    if tell is not None:
        tell(cut.scene)
    charts = parametrize(
        cut.scene,
        ends=cut.ends,
        facet=cut.facet,
        welded=cut.welded,
        uncut=len(scene.triangles),
        density=atlas.density,
        texels=atlas.texels,
        tile=atlas.tile,
        roots=roots,
        progress=lambda stage, share: report(stage, 0.15 + 0.85 * share),
    )
    return cut.scene, charts


def program(*more: Path) -> bytes:
    """This program as far as it makes charts, more of its files, and what it makes them with."""
    modules = [file.read_bytes() for file in (*sorted(Path(__file__).parent.glob("*.py")), *more)]
    return b"".join([*modules, *(version(library).encode() for library in LIBRARIES)])


def _given(scene: Scene, atlas: AtlasOptions, roots: bool) -> cache.Arrays:
    geometry = {name: value for name in GEOMETRY if (value := getattr(scene, name)) is not None}
    sides = np.array([(m.double_sided, m.opaque, m.emits, m.lightmap_scale) for m in scene.materials])
    open_to = np.array([scene.sky is not None, bool(scene.lights)])
    asked = np.array([atlas.density or 0.0, atlas.texels or 0, atlas.tile, roots], np.float64)
    return {**geometry, "sides": sides, "open_to": open_to, "cameras": cameras_inside(scene), "asked": asked}


def _content(scene: Scene, cut: Scene, charts: Charts) -> cache.Arrays:
    changed = {SCENE + name: getattr(cut, name) for name in GEOMETRY if getattr(cut, name) is not getattr(scene, name)}
    notes = {SCENE + "warnings": np.array(cut.warnings[len(scene.warnings) :], np.str_)}
    own = {field.name: getattr(charts, field.name) for field in dataclasses.fields(Charts) if field.name not in APART}
    own["warnings"] = np.array(charts.warnings, np.str_)
    seams = {SEAMS + name: value for name, value in vars(charts.seams).items()}
    seams |= {NEAR + name: value for name, value in vars(charts.seam_texels).items()}
    return {name: np.asarray(value) for name, value in (own | seams | changed | notes).items()}


def _read(scene: Scene, data: cache.Arrays | None) -> tuple[Scene, Charts] | None:
    """The answer that a file holds; None where it is none."""
    if data is None or not {field.name for field in dataclasses.fields(Charts)} - set(APART) < data.keys():
        return None
    changed, seams, near = (_named(data, prefix) for prefix in (SCENE, SEAMS, NEAR))
    warnings = (*scene.warnings, *map(str, changed.pop("warnings")))
    own = {name: _plain(array) for name, array in data.items() if not name.startswith((SCENE, SEAMS, NEAR))}
    own |= {
        "size": tuple(data["size"].tolist()),
        "seams": Seams(**seams),
        "warnings": tuple(map(str, data["warnings"])),
    }
    charts = Charts(**own)
    charts.__dict__["seam_texels"] = SeamTexels(**near)  # as if they had been asked for
    return dataclasses.replace(scene, **changed, warnings=warnings), charts  # type: ignore[arg-type]  # names are not known


def _named(data: cache.Arrays, prefix: str) -> cache.Arrays:
    """Those with this before their names, without it."""
    return {name.removeprefix(prefix): array for name, array in data.items() if name.startswith(prefix)}


def _plain(array: NDArray[Any]) -> Any:
    return array if array.ndim else array.item()
