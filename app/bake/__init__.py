"""A finished bake as files: ``irradiance.exr``, ``scene.glb`` and ``report.json`` in one folder, and what else is asked for.

All are written beside their final names first and then renamed, so that a bake that fails or is stopped while
writing leaves the previous files as they were.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.bake.arrange import Arranged, arranged
from app.bake.embedded import embedded_glb
from app.bake.gltf_edit import edited_glb_bytes, is_of_gltf
from app.bake.gltf_writer import glb_bytes
from app.bake.light_files import IRRADIANCE_NAME, LIGHT_NAME, page_names, write_light
from app.bake.options import BakeOptions
from app.bake.sky_file import write_sky
from app.bake.staged import Staged, remove_partials
from app.bake.web_page import find_three, web_page
from app.errors import SceneError, UserError
from app.lightmap.seams import finished
from app.scene.model import F32, Scene
from app.util.json_text import json_text

__all__ = [
    "IRRADIANCE_NAME",
    "REPORT_NAME",
    "SCENE_NAME",
    "BakeFiles",
    "check_options",
    "prepare_directory",
    "write_bake",
]

SCENE_NAME = "scene.glb"
REPORT_NAME = "report.json"
SKY_NAME = "sky.exr"
EMBEDDED_NAME = "embedded.glb"
PAGE_NAME = "index.html"
OPTIONAL = (EMBEDDED_NAME, SKY_NAME, PAGE_NAME)
ALL = (SCENE_NAME, REPORT_NAME, *OPTIONAL)  # names of a bake's files, but for those of the light


@dataclass(frozen=True)
class BakeFiles:
    """Where the files of a bake are. irradiance: its first page; more: what was asked for beside these; atlas: width and
    height of a page [texels], of so many pages; notes: what the user should know."""

    irradiance: Path
    scene: Path
    report: Path
    atlas: tuple[int, int]
    pages: int = 1
    more: tuple[Path, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def paths(self) -> list[Path]:
        return [self.irradiance, self.scene, self.report, *self.more]


def prepare_directory(directory: Path) -> Path:
    """Make ``directory`` if need be, try to write there, and remove what bakes that were killed have left half written: call it
    before a long bake. UserError if it cannot be."""
    probe = directory / f".probe.{os.getpid()}"
    try:
        directory.mkdir(parents=True, exist_ok=True)
        probe.touch()
        probe.unlink()
        remove_partials(directory, lambda name: name in ALL or LIGHT_NAME.fullmatch(name) is not None)
    except OSError as error:
        raise UserError(f"{directory}: cannot write here ({error.strerror or error})") from error
    return directory


def check_options(options: BakeOptions) -> None:
    """Raise UserError now, rather than after the work, for what cannot be written here."""
    if options.web:
        find_three(options.three)


def write_bake(
    directory: Path,
    scene: Scene,
    charts: Charts,
    irradiance: F32,
    covered: NDArray[np.bool_],
    report: Mapping[str, Any],
    options: BakeOptions | None = None,
    *,
    unedited: Scene | None = None,
) -> BakeFiles:
    """Write the lightmap, the scene that uses it and the report into ``directory``, which is made if need be.

    irradiance (H, W, 3) f32 [W/m²] over the virtual atlas, row 0 at v = 0, finite wherever ``covered`` (H, W); (H, W, 6) where it
    is followed by its direct part: then that and the rest are files of their own, too.
    unedited: the scene as it was read; of a glTF file, its document is kept then, see gltf_edit.py. In the report, numbers
    that are not finite become null, and it names all files: what an earlier one names, and is not written now, is removed.
    UserError if the folder cannot be written.
    """
    finer = irradiance.shape[0] // charts.size[1]
    assert irradiance.shape[:2] == (charts.size[1] * finer, charts.size[0] * finer), (
        f"{irradiance.shape}, {charts.size}"
    )
    assert irradiance.shape[2] in (3, 6)
    assert covered.shape == irradiance.shape[:2]
    assert np.isfinite(irradiance[covered]).all(), "irradiance that is not finite"
    options = options or BakeOptions()
    prepare_directory(directory)
    solved, solved_light = charts, finished(irradiance, covered, charts)
    placed = arranged(scene, solved, solved_light, options.padding, options.max_size)
    report = {**report, "atlas": list(placed.page_size), "pages": placed.pages}
    lightmaps, before = page_names(placed.pages), _files_before(directory)
    try:
        with Staged(directory) as staged:
            notes = _too_large(placed, options) + write_light(staged, placed.light, placed.pages, options)
            glb, of_scene = _scene_bytes(scene, unedited, placed.charts, lightmaps, options)
            notes += of_scene
            staged(SCENE_NAME).write_bytes(glb)
            if scene.sky is not None and scene.sky.emits:
                write_sky(staged(SKY_NAME), scene.sky)
            if options.embed:
                embedded = embedded_glb(scene, solved, solved_light[..., :3], report.get("exposure", 0.0))
                staged(EMBEDDED_NAME).write_bytes(embedded)
            if options.web:
                shown = staged.read(SCENE_NAME, *lightmaps, SKY_NAME)
                page = web_page(scene.name, shown, report, find_three(options.three), sky=scene.sky)
                staged(PAGE_NAME).write_text(page, encoding="utf-8")
            text = staged(REPORT_NAME)
            files = sorted(path.name for path in staged.paths)
            text.write_text(json_text(_with_notes({**report, "files": files}, notes)), encoding="utf-8")
        for name in before.difference(files):
            (directory / name).unlink(missing_ok=True)
    except OSError as error:
        raise UserError(f"{directory}: cannot write the bake ({error.strerror or error})") from error
    usual = directory / lightmaps[0], directory / SCENE_NAME, directory / REPORT_NAME
    more = tuple(path for path in staged.paths if path not in usual)
    return BakeFiles(*usual, placed.page_size, placed.pages, more, notes)


def _files_before(directory: Path) -> set[str]:
    """Names of files that the bake before has left here by its report, and which this one may not write: others are not ours."""
    try:
        names = json.loads((directory / REPORT_NAME).read_text(encoding="utf-8"))["files"]
        return {name for name in names if name in OPTIONAL or LIGHT_NAME.fullmatch(name)}
    except (OSError, ValueError, LookupError, TypeError):
        return set()


def _too_large(placed: Arranged, options: BakeOptions) -> tuple[str, ...]:
    """What to say of pages that are larger than was asked for."""
    if options.max_size is None or max(placed.page_size) <= options.max_size:
        return ()
    width, height = placed.page_size
    return (f"--max-size {options.max_size}: pages are {width} x {height} texels, as large as the largest chart",)


def _scene_bytes(
    scene: Scene, unedited: Scene | None, charts: Charts, lightmaps: Sequence[str], options: BakeOptions
) -> tuple[bytes, tuple[str, ...]]:
    """scene.glb, and what the user should know of it."""
    notes: tuple[str, ...] = ()
    if unedited is not None and is_of_gltf(scene):
        try:
            moz = options.moz_lightmap
            return edited_glb_bytes(scene, unedited, charts, lightmaps, moz_lightmap=moz), notes
        except SceneError as error:  # it was there when it was opened: the light is not lost for it
            notes = (f"{error}: {SCENE_NAME} has what light depends on, not all that the file had",)
    return glb_bytes(scene, charts, lightmaps, moz_lightmap=options.moz_lightmap), notes


def _with_notes(report: Mapping[str, Any], notes: tuple[str, ...]) -> dict[str, Any]:
    return {**report, "warnings": [*report.get("warnings", ()), *notes]} if notes else dict(report)
