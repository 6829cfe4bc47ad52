"""A document is what of an open session is kept in a .glow file: its scene by name and hash, edits, settings, camera, bookmarks.

Plain values (JSON), checked when they are read: a file may come from anywhere. Materials are edited by name, so that edits find
their materials again in a scene whose file has changed. Surfaces that were added or removed are not kept. The light beside it is
``light_state``'s.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from app.errors import UserError
from app.options import Options
from app.render.camera import CameraView
from app.scene.gltf_file import first_problem
from app.scene.library import scene_names, scene_path
from app.scene.lights import Light, LightKind
from app.scene.model import Material
from app.scene.options import FileOptions
from app.scene.sky import LEAST_TURBIDITY, MOST_TURBIDITY, Sky, SkyKind, Sun
from app.session.session import Reading
from app.session.view import View

RIGID = 1e-6  # of a camera's axes, how far from orthonormal they may be
NUMBERS = ("albedo", "emission", "opacity")  # fields of a material that can be edited
HASH_AT_ONCE = 1 << 20  # bytes

Vec3 = tuple[float, float, float]
NotNegative = Annotated[float, Field(ge=0.0)]
Emitted = tuple[NotNegative, NotNegative, NotNegative]
Unit = Annotated[float, Field(ge=0.0, le=1.0)]
Angle = Annotated[float, Field(ge=0.0, le=math.pi)]


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False, strict=True)


class SunTable(Table):
    azimuth: float
    height: Annotated[float, Field(ge=0.0, le=90.0)]


class SkyTable(Table):
    """A picture is not kept here: it is that of the scene."""

    kind: SkyKind
    colour: Emitted
    strength: NotNegative
    sun: SunTable | None = None
    turbidity: Annotated[float, Field(ge=LEAST_TURBIDITY, le=MOST_TURBIDITY)]
    rotation: float = 0.0

    @model_validator(mode="after")
    def _sun_of_a_clear_sky(self) -> Self:
        if self.kind == "clear" and self.sun is None:
            raise ValueError("a clear sky needs a sun")
        return self


class LightTable(Table):
    """range: none where it does not end."""

    name: str
    kind: LightKind
    intensity: Emitted
    position: Vec3
    direction: Vec3
    inner: Angle
    outer: Angle
    range: Annotated[float, Field(gt=0.0)] | None
    radius: NotNegative
    angle: Angle
    on: bool

    @model_validator(mode="after")
    def _unit_direction(self) -> Self:
        if abs(math.hypot(*self.direction) - 1) > RIGID:
            raise ValueError("direction must have length 1")
        return self


class MaterialTable(Table):
    """What of a material was edited. index: among materials of one name."""

    name: str
    index: Annotated[int, Field(ge=0)]
    albedo: tuple[Unit, Unit, Unit] | None = None
    emission: Emitted | None = None
    opacity: Unit | None = None


class CameraTable(Table):
    """world_from_camera: rows of a rigid matrix."""

    world_from_camera: tuple[tuple[float, float, float, float], ...]
    yfov: Annotated[float, Field(gt=0.0, lt=math.pi)]
    distance: Annotated[float, Field(gt=0.0)]

    @model_validator(mode="after")
    def _rigid(self) -> Self:
        matrix = np.array(self.world_from_camera)
        if matrix.shape != (4, 4) or not np.allclose(matrix[3], (0, 0, 0, 1)):
            raise ValueError("must be a 4 by 4 matrix")
        turn = matrix[:3, :3]
        if np.abs(turn @ turn.T - np.eye(3)).max() > RIGID or np.linalg.det(turn) < 0:
            raise ValueError("must be rigid")
        return self


class SceneTable(Table):
    """Where the scene came from and how it was read. relative: to the folder of the file; digest: of the scene's file."""

    source: str
    relative: str | None = None
    digest: str | None = None
    file: dict[str, Any]
    default_light: bool
    sky: SkyTable | None = None


class Document(Table):
    """lights, sky: all of them, where they were edited. settings: as of ``settings.checked``."""

    glowtree: str
    scene: SceneTable
    settings: dict[str, Any]
    materials: list[MaterialTable] = []
    lights: list[LightTable] | None = None
    sky: SkyTable | None = None
    no_sky: bool = False
    camera: CameraTable
    bookmarks: dict[Annotated[str, Field(pattern="^[1-9]$")], CameraTable] = {}

    @property
    def edits(self) -> tuple[object, ...]:
        """What of it was made by hand and would be missed."""
        return self.materials, self.lights, self.sky, self.no_sky, self.bookmarks


def document_of(view: View, tables: Mapping[str, Options], folder: Path) -> Document:
    """Of what is open. tables: settings by name, the host's own among them. folder: that the file is for."""
    from app import __version__

    session = view.session
    came, now = session.unedited, session.edited_scene
    return Document(
        glowtree=__version__,
        scene=_scene(view, folder),
        settings={"solver": session.chosen_solver} | {name: _given(options) for name, options in tables.items()},
        materials=_edited(came.materials, now.materials),
        lights=None if now.lights == came.lights else [_light(light) for light in now.lights],
        sky=None if now.sky is came.sky or now.sky is None else _sky(now.sky),
        no_sky=now.sky is None and came.sky is not None,
        camera=_camera(view.camera),
        bookmarks={str(place): _camera(camera) for place, camera in sorted(view.bookmarks.items())},
    )


def read_document(values: Any) -> Document:
    """From plain values. Raises UserError, one line."""
    try:
        return Document.model_validate_json(values)
    except ValidationError as error:
        raise UserError(f"is no session of glowtree: {first_problem(error)}") from None


def _given(options: Options) -> dict[str, Any]:
    return {name: value for name, value in options.as_dict().items() if value is not None}


def _edited(came: tuple[Material, ...], now: tuple[Material, ...]) -> list[MaterialTable]:
    seen: dict[str, int] = {}
    edited = []
    for before, after in zip(came, now, strict=True):
        index = seen[after.name] = seen.get(after.name, -1) + 1
        changes = {name: getattr(after, name) for name in NUMBERS if getattr(after, name) != getattr(before, name)}
        if changes:
            edited.append(MaterialTable(name=after.name, index=index, **changes))
    return edited


def _light(light: Light) -> LightTable:
    values = dataclasses.asdict(light)
    return LightTable(**values | {"range": None if math.isinf(light.range) else light.range})


def _sky(sky: Sky) -> SkyTable:
    sun = None if sky.sun is None else SunTable(azimuth=sky.sun.azimuth, height=sky.sun.height)
    more = {name: getattr(sky, name) for name in ("kind", "colour", "strength", "turbidity", "rotation")}
    return SkyTable(**more, sun=sun)


def _camera(camera: CameraView) -> CameraTable:
    rows = tuple(tuple(row) for row in camera.world_from_camera.tolist())
    return CameraTable(world_from_camera=rows, yfov=camera.yfov, distance=camera.distance)


# -- the scene ---------------------------------------------------------------------------------------------------------


def _scene(view: View, folder: Path) -> SceneTable:
    session = view.session
    reading, path = session.reading, session.unedited.source
    sky = reading.sky
    return SceneTable(
        source=_source(session.source, path),
        relative=None if path is None or _library_name(path) else os.path.relpath(path.resolve(), folder.resolve()),
        digest=None if path is None else digest_of(path),
        file={} if reading.file is None else reading.file.as_dict(),
        default_light=reading.default_light,
        sky=None if sky is None or sky.image is not None else _sky(sky),
    )


def _source(source: str | Path, path: Path | None) -> str:
    return str(source) if path is None else _library_name(path) or str(path.resolve())


def _library_name(path: Path) -> str | None:
    """Of a scene that comes along."""
    known = path.stem in scene_names() and scene_path(path.stem).resolve() == path.resolve()
    return path.stem if known else None


def digest_of(path: Path) -> str | None:
    """Of a file's content; None where it cannot be read."""
    try:
        stat = path.stat()
        return _digest(path, stat.st_mtime_ns, stat.st_size)
    except OSError:
        return None


@functools.lru_cache(maxsize=8)
def _digest(path: Path, _changed: int, _size: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def found(scene: SceneTable, folder: Path) -> tuple[str | Path, str | None]:
    """Where the scene is now, by its place beside the file's folder, else by its old one; and what to say of it, where it is not
    what it was. Raises UserError where there is none."""
    if scene.source in scene_names():
        source: str | Path = scene.source
        path = scene_path(scene.source)
    else:
        places = [folder / scene.relative] if scene.relative else []
        path = next((place for place in (*places, Path(scene.source)) if place.is_file()), Path(scene.source))
        source = path
        if not path.is_file():
            raise UserError(f"its scene {scene.source} is not there")
    changed = scene.digest is not None and digest_of(path) != scene.digest
    note = (
        f"{path.name} has changed since the session was saved: edits are applied where their materials are still there"
    )
    return source, note if changed else None


def reading_of(document: Document) -> Reading:
    """How its scene was read. Raises UserError."""
    scene = document.scene
    try:
        file = FileOptions().replace(**scene.file)
    except (UserError, TypeError) as error:
        raise UserError(f"is no session of glowtree: scene.file: {error}") from None
    return Reading(file, scene.default_light, None if scene.sky is None else sky_of(scene.sky, None))


# -- put back ----------------------------------------------------------------------------------------------------------


def put_back(document: Document, view: View) -> list[str]:
    """Edit the scene that has just been opened as the document says, and look at it from there; notes of what could not be
    done."""
    session, came = view.session, view.session.unedited
    materials, notes = _put_materials(document.materials, came.materials)
    if materials != came.materials:
        session.set_materials(materials)
    if document.lights is not None:
        session.set_lights(tuple(light_of(light) for light in document.lights))
    if document.no_sky:
        session.set_sky(None)
    elif document.sky is not None:
        image = None if came.sky is None else came.sky.image
        if document.sky.kind == "image" and image is None:
            notes.append("the picture of its sky is not there: --sky gives it")
        else:
            session.set_sky(sky_of(document.sky, image))
    view.camera = camera_of(document.camera)
    view.bookmarks = {int(place): camera_of(camera) for place, camera in document.bookmarks.items()}
    return notes


def _put_materials(edits: list[MaterialTable], came: tuple[Material, ...]) -> tuple[tuple[Material, ...], list[str]]:
    materials, missing = list(came), []
    for edit in edits:
        alike = [index for index, material in enumerate(came) if material.name == edit.name]
        if not alike:
            missing.append(edit.name or "a material without name")
            continue
        index = alike[min(edit.index, len(alike) - 1)]
        changes = {name: value for name in NUMBERS if (value := getattr(edit, name)) is not None}
        materials[index] = dataclasses.replace(materials[index], **changes)
    notes = [f"the scene has no {', '.join(missing[:3])} any more: what was edited of it is lost"] if missing else []
    return tuple(materials), notes


def light_of(table: LightTable) -> Light:
    values = table.model_dump()
    return Light(**values | {"range": math.inf if table.range is None else table.range})


def sky_of(table: SkyTable, image: Any) -> Sky:
    """image: of a sky that is one."""
    values = table.model_dump(exclude={"sun"})
    sun = None if table.sun is None else Sun(table.sun.azimuth, table.sun.height)
    return Sky(**values, sun=sun, image=image if table.kind == "image" else None)


def camera_of(table: CameraTable) -> CameraView:
    return CameraView(np.array(table.world_from_camera, np.float64), table.yfov, table.distance)


__all__ = ["Document", "digest_of", "document_of", "found", "put_back", "read_document", "reading_of"]
