"""Scenes in: a name of ``scenes/`` or a file of any known format becomes a Scene that is ready to be lit."""

from __future__ import annotations

import dataclasses
import difflib
import math
from pathlib import Path

from app.errors import SceneError
from app.scene.authored import MESH_LOADERS, load_authored
from app.scene.cameras import default_camera
from app.scene.ceiling_light import with_ceiling_light
from app.scene.colorimetry import LUMENS_PER_WATT
from app.scene.library import scene_names, scene_path
from app.scene.model import Scene
from app.scene.options import PHOTOMETRIC, FileOptions
from app.scene.orientation import oriented
from app.scene.sky import Sky
from app.util.background import Report, unheard
from app.util.words import one_line

LOADERS = {**MESH_LOADERS, ".toml": load_authored}
OWN_SKY = "the scene has a sky of its own: --sky and --sun are for scenes that have none"
NO_LIGHT = "nothing in the scene emits light: --light adds a ceiling light, --sky a sky"


def load_scene(
    source: str | Path,
    file: FileOptions | None = None,
    *,
    default_light: bool = False,
    sky: Sky | None = None,
    report: Report = unheard,
) -> Scene:
    """The Scene behind a name of ``scenes/`` or a file, with at least one camera.

    file: its unit and axes, guessed if None. sky: of a scene that has none. A scene without emitter gets ``with_ceiling_light``
    if ``default_light`` is set, else a warning that says so. report(share) is called now and then and may raise to cancel.
    SceneError if there is no such file, its format is unknown or its content unusable.
    """
    path = scene_file(source)
    try:
        suffix = path.suffix.lower()
        file = file or FileOptions()
        scene = _with_light_units(oriented(LOADERS[suffix](path, report), suffix, file), suffix, file.light_units)
    except SceneError as error:  # its reason may quote the file, line breaks and all
        raise SceneError(error.source, one_line(error.reason)) from error
    if not scene.cameras:
        scene = dataclasses.replace(scene, cameras=(default_camera(scene),))
    if sky is not None:
        scene = (
            scene.with_sky(sky)
            if scene.sky is None
            else dataclasses.replace(scene, warnings=(*scene.warnings, OWN_SKY))
        )
    if not scene.emits:
        if default_light:
            return with_ceiling_light(scene)
        scene = dataclasses.replace(scene, warnings=(*scene.warnings, NO_LIGHT))
    return scene


def _with_light_units(scene: Scene, suffix: str, units: str) -> Scene:
    """The scene of a glTF file whose lights are counted in these units. SceneError for other files."""
    if units == PHOTOMETRIC:
        return scene
    if suffix not in (".glb", ".gltf"):
        raise SceneError(
            scene.source or scene.name, f"--light-units {units}: only .glb and .gltf files have lights in units"
        )
    lights = []
    for light in scene.lights:
        factor = LUMENS_PER_WATT / (4 * math.pi if units == "watts" and not light.from_afar else 1.0)
        red, green, blue = (factor * c for c in light.intensity)
        lights.append(dataclasses.replace(light, intensity=(red, green, blue)))
    return scene.with_lights(tuple(lights))


def scene_file(source: str | Path) -> Path:
    """The file that ``source`` means; a name of the library wins unless a file of that name exists."""
    path, shown = Path(source).expanduser(), one_line(str(source))[:200]
    if not str(source).strip():
        raise SceneError("scene", f"its name is empty; {_allowed()}")
    if str(source) in scene_names() and not path.is_file():
        return scene_path(str(source))
    try:
        folder, file = path.is_dir(), path.is_file()
    except (OSError, ValueError) as error:  # a name that no file system takes
        raise SceneError(shown, f"is not a file name; {_allowed()}") from error
    if folder:
        raise SceneError(shown, f"is a folder; {_allowed()}")
    if not file:
        guesses = [*scene_names(), *(p.name for p in path.parent.glob("*") if p.suffix.lower() in LOADERS)]
        close = difflib.get_close_matches(path.name, guesses, n=3)
        hint = f"did you mean {' or '.join(close)}?" if close else _allowed()
        raise SceneError(shown, f"there is no such file or scene; {hint}")
    if path.suffix.lower() not in LOADERS:
        raise SceneError(shown, f"unknown format '{path.suffix}'; {_allowed()}")
    return path


def _allowed() -> str:
    return f"allowed are files {' '.join(sorted(LOADERS))} and the scenes {', '.join(scene_names())}"
