"""A scene as its file has it, in metres with +y up: by what the user says, or as a guess that is said.

glTF is in metres with +y up, so that only what no such scene looks like is taken for something else. OBJ, PLY and STL say nothing
of units or axes; the programs that write STL have +z up. Light does not depend on the unit, texels per metre and paces do.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.errors import SceneError
from app.scene.model import F64, Scene
from app.scene.options import GUESSED, UNITS, FileOptions
from app.scene.outline import Outline

WITHOUT_UNIT = {".obj", ".ply", ".stl"}  # formats that leave unit and axes open
Z_UP = {".stl"}
THOUSANDS = 1.5e3, 1e5  # all extents: of a room or a house in millimetres; nothing is 1.5 km high in metres
CHUNKY = 0.2  # the least extent beside the largest, from which on it is no range of mountains
STANDING = 1e-3  # of the height, that the floor may be off 0
FORMS = {
    "y": np.eye(3),
    "z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
}  # y-up from the file's axes


def oriented(scene: Scene, suffix: str, options: FileOptions) -> Scene:
    """The scene of a file with this suffix in metres and with +y up. SceneError where a .toml file, which says its unit itself,
    is to be taken in another."""
    if suffix == ".toml":
        for name in ("unit", "up"):
            if (asked := getattr(options, name)) != GUESSED:
                raise SceneError(scene.source or scene.name, f"--{name} {asked}: a .toml scene says it itself")
        return scene
    unit, up, notes = _found_axes(*scene.bounds, suffix, options)
    placed = _placed(scene, UNITS[unit], FORMS[up]) if (unit, up) != ("m", "y") else scene
    return dataclasses.replace(placed, warnings=(*notes, *placed.warnings)) if notes else placed


def outline_oriented(outline: Outline, suffix: str, options: FileOptions) -> Outline:
    """The outline of a file's content, as ``oriented`` would place that."""
    unit, up, notes = _found_axes(outline.lower, outline.upper, suffix, options)
    corners = UNITS[unit] * (np.stack([outline.lower, outline.upper]) @ FORMS[up].T)
    return dataclasses.replace(
        outline,
        lower=corners.min(axis=0),
        upper=corners.max(axis=0),
        area=outline.area * UNITS[unit] ** 2,
        texel_area=outline.texel_area * UNITS[unit] ** 2,
        warnings=(*notes, *outline.warnings),
    )


def _found_axes(low: F64, high: F64, suffix: str, options: FileOptions) -> tuple[str, str, list[str]]:
    """The unit and the axis that is up of what lies between two corners: those of ``options``, or guessed, which is said."""
    unit, up, notes = options.unit, options.up, list[str]()
    size = high - low
    huge = THOUSANDS[0] <= size.min() and size.max() <= THOUSANDS[1] and size.min() >= CHUNKY * size.max()
    standing = (
        huge and abs(low[2]) <= STANDING * size[2] and low[1] < -STANDING * size[1] and high[1] > STANDING * size[1]
    )
    if unit == GUESSED:
        unit = "mm" if huge and (standing or suffix in WITHOUT_UNIT) else "m"
        if unit != "m":
            notes.append(f"{size.max():.0f} across: taken as millimetres, --unit says otherwise")
    if up == GUESSED:
        up = "z" if standing or suffix in Z_UP else "y"
        if up != "y":
            why = "as programs write .stl files" if suffix in Z_UP else "since the scene stands on z = 0"
            notes.append(f"z is taken as up, {why}: --up says otherwise")
    return unit, up, notes


def _placed(scene: Scene, scale: float, turn: NDArray[Any]) -> Scene:
    """Turned about the origin, and scaled."""
    cameras = []
    for camera in scene.cameras:
        matrix = np.array(camera.world_from_camera)
        matrix[:3] = turn @ matrix[:3]
        matrix[:3, 3] *= scale
        cameras.append(dataclasses.replace(camera, world_from_camera=matrix))
    lights = []
    for light in scene.lights:
        x, y, z = (scale * (turn @ np.array(light.position))).tolist()
        u, v, w = (turn @ np.array(light.direction)).tolist()
        far, radius = scale * light.range, scale * light.radius
        lights.append(dataclasses.replace(light, position=(x, y, z), direction=(u, v, w), range=far, radius=radius))
    placing = np.eye(4)
    placing[:3, :3] = scale * turn
    return dataclasses.replace(
        scene,
        world_from_file=placing @ scene.world_from_file,
        lights=tuple(lights),
        positions=scale * (scene.positions @ turn.T),
        normals=None if scene.normals is None else (scene.normals @ turn.T).astype(np.float32),
        cameras=tuple(cameras),
    )
