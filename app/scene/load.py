"""Scenes in: a name of ``scenes/`` or a file of any known format becomes a Scene that is ready to be lit."""

from __future__ import annotations

import dataclasses
import difflib
import math
from pathlib import Path

import numpy as np

from app.errors import SceneError
from app.scene.authored import MESH_LOADERS, load_authored
from app.scene.cameras import default_camera
from app.scene.library import scene_names, scene_path
from app.scene.lights import LUMENS_PER_WATT
from app.scene.model import Material, Scene
from app.scene.options import PHOTOMETRIC, FileOptions
from app.scene.orientation import oriented
from app.scene.sky import Sky
from app.scene.validate import one_line

LOADERS = {**MESH_LOADERS, ".toml": load_authored}
LIGHT_SHARE = 0.25  # the ceiling light's edges, of the scene's extents
LIGHT_GAP = 0.01  # below the top, of the scene's height
SAME_PLANE = 1e-4  # of the scene's height, that surfaces of one plane may be apart
MEAN_IRRADIANCE = 1.0  # W/m² that the ceiling light alone would give the whole ground plan
NO_LIGHT = "nothing in the scene emits light: --light adds a ceiling light, --sky a sky"


def load_scene(
    source: str | Path, file: FileOptions | None = None, *, default_light: bool = False, sky: Sky | None = None
) -> Scene:
    """The Scene behind a name of ``scenes/`` or a file, with at least one camera.

    file: its unit and axes, guessed if None. sky: of a scene that has none. A scene without emitter gets ``with_ceiling_light``
    if ``default_light`` is set, else a warning that says so.
    SceneError if there is no such file, its format is unknown or its content unusable.
    """
    path = scene_file(source)
    try:
        suffix = path.suffix.lower()
        file = file or FileOptions()
        scene = _with_light_units(oriented(LOADERS[suffix](path), suffix, file), suffix, file.light_units)
    except SceneError as error:  # its reason may quote the file, line breaks and all
        raise SceneError(error.source, one_line(error.reason)) from error
    if not scene.cameras:
        scene = dataclasses.replace(scene, cameras=(default_camera(scene),))
    if scene.sky is None and sky is not None:
        scene = scene.with_sky(sky)
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


def with_ceiling_light(scene: Scene) -> Scene:
    """The scene with a one-sided, downward square of light under the top of its bounding box.

    Its edges are a quarter of the box's, it hangs 1 % of the height below the top, and its radiance L follows from
    πL·A_light = E·A_ground with E = 1 W/m²: what falls on a floor of the box's size is then about as much as in the
    Cornell box, whatever the unit. A scene flatter or narrower than a hundredth of its size is lit as if it were that
    thick, and one without height from a quarter of its size above. Where the scene has a surface in the square's own plane, a
    ceiling as thick as that, it hangs lower, a gap below that: of two surfaces in one place, either might be seen.
    """
    low, high = scene.bounds
    size = high - low
    largest = float(size.max())
    flat = size[1] < 0.01 * largest
    width, depth = (float(max(s, 0.01 * largest)) for s in (size[0], size[2]))
    y = high[1] + 0.25 * largest if flat else high[1] - LIGHT_GAP * size[1]
    u, v = LIGHT_SHARE * width / 2, LIGHT_SHARE * depth / 2
    x, z = (low[0] + high[0]) / 2, (low[2] + high[2]) / 2
    near, far = scene.corners.min(1), scene.corners.max(1)
    under = (near[:, 0] < x + u) & (far[:, 0] > x - u) & (near[:, 2] < z + v) & (far[:, 2] > z - v)
    level = under & (far[:, 1] - near[:, 1] <= SAME_PLANE * size[1])
    while (level & (np.abs(near[:, 1] - y) <= SAME_PLANE * size[1])).any() and y - low[1] > size[1] / 2:
        y -= LIGHT_GAP * size[1]
    corners = np.array([(x - u, y, z - v), (x + u, y, z - v), (x + u, y, z + v), (x - u, y, z + v)])
    radiance = MEAN_IRRADIANCE / (math.pi * LIGHT_SHARE**2)
    light = Material("ceiling light", albedo=(0.0, 0.0, 0.0), emission=(radiance, radiance, radiance))
    first = len(scene.positions)
    triangles = np.array([(first, first + 1, first + 2), (first, first + 2, first + 3)], np.int32)
    down = np.broadcast_to(np.array([0.0, -1.0, 0.0], np.float32), (2, 3, 3))
    square = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float32)[[(0, 1, 2), (0, 2, 3)]]

    def extended(
        values: np.ndarray[tuple[int, ...], np.dtype[np.float32]] | None, new: np.ndarray
    ) -> np.ndarray | None:
        return None if values is None else np.concatenate([values, new])

    return dataclasses.replace(
        scene,
        positions=np.concatenate([scene.positions, corners]),
        triangles=np.concatenate([scene.triangles, triangles]),
        material_ids=np.append(scene.material_ids, [len(scene.materials)] * 2).astype(np.int32),
        object_ids=np.append(scene.object_ids, [len(scene.objects)] * 2).astype(np.int32),
        objects=(*scene.objects, "ceiling light"),
        materials=(*scene.materials, light),
        uv0=extended(scene.uv0, square),
        uv1=extended(scene.uv1, square),
        normals=extended(scene.normals, down),
        colours=extended(scene.colours, np.ones((2, 3, 3), np.float32)),
    )


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
