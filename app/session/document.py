"""A document is what of an open session is kept in a .glow file: its scene by name and hash, edits, settings, camera, bookmarks.

Plain values (JSON), checked when they are read: a file may come from anywhere. Materials are edited by name, so that edits find
their materials again in a scene whose file has changed. The light beside it is ``light_state``'s.
"""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from app.errors import UserError
from app.options import Options
from app.render.camera import CameraView
from app.scene.area_lamps import AreaLamp, Key, Moved, Surfaces, keys_of, with_surfaces
from app.scene.gltf_file import first_problem
from app.scene.images import ImageError
from app.scene.library import scene_names, scene_path
from app.scene.lights import Light
from app.scene.model import Material, Scene
from app.scene.options import FileOptions
from app.scene.sky import Sky, Sun
from app.scene.sky_image import read_sky_image
from app.session.document_tables import (
    AreaLampTable,
    CameraTable,
    Document,
    FileTable,
    KeyTable,
    LightTable,
    MaterialTable,
    MovedTable,
    ScaleTable,
    SceneTable,
    SkyTable,
    SunTable,
)
from app.session.session import Reading
from app.session.versions import Version
from app.session.view import View
from app.util.words import one_line

NO_PICTURE = "the picture of its sky is not there, --sky gives it"
NUMBERS = ("albedo", "emission", "opacity")  # fields of a material that can be edited


def document_of(view: View, tables: Mapping[str, Options], folder: Path) -> Document:
    """Of what is open. tables: settings by name, the host's own among them. folder: that the file is for."""
    from app import __version__

    session = view.session
    came, now = session.read, session.edited_scene
    return Document(
        glowtree=__version__,
        scene=_scene(view, folder),
        settings={"solver": session.chosen_solver} | {name: _given(options) for name, options in tables.items()},
        area_lamps=[_area_lamp(lamp) for lamp in session.asked_surfaces.lamps],
        removed=[_key(key) for key in session.asked_surfaces.removed],
        moved=[MovedTable(key=_key(moved.key), shift=moved.shift) for moved in session.asked_surfaces.moved],
        scales=[_scale(key, scale) for key, scale in session.asked_surfaces.scales],
        materials=_edited(session.unedited.materials, now.materials),
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
    edited = []
    for (_, index), before, after in zip(keys_of(came), came, now, strict=True):
        changes = {name: getattr(after, name) for name in NUMBERS if getattr(after, name) != getattr(before, name)}
        if changes:
            edited.append(MaterialTable(name=after.name, index=index, **changes))
    return edited


def _light(light: Light) -> LightTable:
    values = dataclasses.asdict(light)
    return LightTable(**values | {"range": None if math.isinf(light.range) else light.range})


def _area_lamp(lamp: AreaLamp) -> AreaLampTable:
    values = {field.name: getattr(lamp, field.name) for field in dataclasses.fields(lamp)}
    return AreaLampTable(**values | {"of": None if lamp.of is None else _key(lamp.of)})


def _key(key: Key) -> KeyTable:
    return KeyTable(name=key[0], index=key[1])


def _scale(key: Key, scale: float) -> ScaleTable:
    return ScaleTable(name=key[0], index=key[1], lightmap_scale=scale)


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
        relative=None if path is None or _library_name(path) else _beside(path, folder),
        digest=None if path is None else digest_of(path),
        file={} if reading.file is None else reading.file.as_dict(),
        default_light=reading.default_light,
        sky=None if sky is None else _sky(sky).model_copy(update={"picture": _picture(sky, folder)}),
    )


def _picture(sky: Sky, folder: Path) -> FileTable | None:
    path = sky.path
    if path is None:
        return None
    return FileTable(source=str(path.resolve()), relative=_beside(path, folder), digest=digest_of(path))


def _beside(path: Path, folder: Path) -> str:
    return os.path.relpath(path.resolve(), folder.resolve())


def _source(source: str | Path, path: Path | None) -> str:
    return str(source) if path is None else _library_name(path) or str(path.resolve())


def _library_name(path: Path) -> str | None:
    """The name of the library's scene whose file this is; None where it is another file."""
    known = path.stem in scene_names() and scene_path(path.stem).resolve() == path.resolve()
    return path.stem if known else None


def digest_of(path: Path) -> str | None:
    """The digest of a file's content; None where it cannot be read."""
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
        source = path = _place(scene, folder)
        if not path.is_file():
            raise UserError(f"its scene {scene.source} is not there")
    note = (
        f"{path.name} has changed since the session was saved: edits are applied where their materials are still there"
    )
    return source, note if _changed(scene, path) else None


def _place(file: FileTable, folder: Path) -> Path:
    """Where a file is now, or was."""
    places = [folder / file.relative] if file.relative else []
    return next((place for place in (*places, Path(file.source)) if place.is_file()), Path(file.source))


def _changed(file: FileTable, path: Path) -> bool:
    return file.digest is not None and digest_of(path) != file.digest


def reading_of(document: Document, folder: Path) -> tuple[Reading, str | None]:
    """How its scene was read; and what to say of the picture of its sky, where that is not what it was. Raises UserError."""
    scene = document.scene
    try:
        file = FileOptions().replace(**scene.file)
    except (UserError, TypeError) as error:
        raise UserError(f"is no session of glowtree: scene.file: {error}") from None
    if scene.sky is None or scene.sky.kind != "image":
        return Reading(file, scene.default_light, sky_of(scene.sky, None)), None
    if scene.sky.picture is None:
        return Reading(file, scene.default_light), NO_PICTURE
    path = _place(scene.sky.picture, folder)
    try:
        picture = Sky("image", image=read_sky_image(path), name=path.name, path=path)
    except ImageError as error:
        return Reading(file, scene.default_light), f"{NO_PICTURE}: {path}: {one_line(str(error))}"
    note = f"{path.name}, the picture of its sky, has changed since the session was saved"
    changed = _changed(scene.sky.picture, path)
    return Reading(file, scene.default_light, sky_of(scene.sky, picture)), note if changed else None


def version_of(document: Document) -> Version:
    """What it makes of the scene that is read, before that is cut."""
    surfaces = surfaces_of(document)

    def make(scene: Scene) -> Scene:
        lights = scene.lights if document.lights is None else tuple(light_of(light) for light in document.lights)
        return with_surfaces(scene, surfaces).with_lights(lights).with_sky(_sky_then(document, scene.sky))

    return Version(surfaces, make)


def surfaces_of(document: Document) -> Surfaces:
    """That were added, removed and moved, and are cut more or less finely."""
    return Surfaces(
        tuple(area_lamp_of(lamp) for lamp in document.area_lamps),
        tuple(_key_of(key) for key in document.removed),
        tuple(Moved(_key_of(moved.key), moved.shift) for moved in document.moved),
        tuple((_key_of(scale), scale.lightmap_scale) for scale in document.scales),
    )


def _sky_then(document: Document, came: Sky | None) -> Sky | None:
    """The sky of a scene that came with that one."""
    if document.no_sky:
        return None
    if document.sky is None or not _can_be(document.sky, came):
        return came
    return sky_of(document.sky, came)


def _can_be(table: SkyTable, came: Sky | None) -> bool:
    """Whether what it takes is there, where a scene came with that sky."""
    return table.kind != "image" or (came is not None and came.image is not None)


# -- put back ----------------------------------------------------------------------------------------------------------


def put_back(document: Document, view: View) -> list[str]:
    """Edit the scene that has just been opened as the document says, and look at it from there; notes of what could not be
    done."""
    session, came = view.session, view.session.read
    notes = _missing(document, came.materials)
    materials, more = _put_materials(document.materials, session.unedited.materials)
    if materials != session.unedited.materials:
        session.set_materials(materials)
    notes += more
    if document.lights is not None:
        session.set_lights(tuple(light_of(light) for light in document.lights))
    if document.no_sky:
        session.set_sky(None)
    elif document.sky is not None:
        if _can_be(document.sky, came.sky):
            session.set_sky(sky_of(document.sky, came.sky))
        elif document.scene.sky is None:
            notes.append(NO_PICTURE)
    view.camera = camera_of(document.camera)
    view.bookmarks = {int(place): camera_of(camera) for place, camera in document.bookmarks.items()}
    return notes


def _missing(document: Document, came: tuple[Material, ...]) -> list[str]:
    """What to say of surfaces that are not there to be copied, removed, moved or cut more finely."""
    known, surfaces = set(keys_of(came)), surfaces_of(document)
    copied = [lamp.of for lamp in surfaces.lamps if lamp.of is not None]
    asked = [*copied, *surfaces.removed, *(moved.key for moved in surfaces.moved)]
    asked += [key for key, _ in surfaces.scales if key[0] not in {lamp.name for lamp in surfaces.lamps}]
    names = list(dict.fromkeys(name or "a material without name" for name, _ in set(asked) - known))
    what = "what was made of its surfaces is lost"
    return [f"the scene has no {', '.join(names[:3])} any more: {what}"] if names else []


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


def area_lamp_of(table: AreaLampTable) -> AreaLamp:
    values = {field.name: getattr(table, field.name) for field in dataclasses.fields(AreaLamp)}
    return AreaLamp(**values | {"of": None if table.of is None else _key_of(table.of)})


def _key_of(table: KeyTable) -> Key:
    return table.name, table.index


def sky_of(table: SkyTable | None, came: Sky | None) -> Sky | None:
    """came: one with the picture, where it is of that kind."""
    if table is None:
        return None
    values = table.model_dump(exclude={"sun", "picture"})
    sun = None if table.sun is None else Sun(table.sun.azimuth, table.sun.height)
    picture = (
        {} if came is None or table.kind != "image" else {"image": came.image, "name": came.name, "path": came.path}
    )
    return Sky(**values | picture, sun=sun)


def camera_of(table: CameraTable) -> CameraView:
    return CameraView(np.array(table.world_from_camera, np.float64), table.yfov, table.distance)


__all__ = ["Document", "digest_of", "document_of", "found", "put_back", "read_document", "reading_of", "version_of"]
