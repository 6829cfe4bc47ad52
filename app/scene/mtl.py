"""Wavefront MTL: the materials of an OBJ file, wherever and however exporters write them.

Read: Kd as albedo, Ke as radiance L like glTF's emission, d or else 1 - Tr as opacity, map_Kd and, times the opacity, map_d as
pictures inside the scene's folder. File names are met in any case, with backslashes, in quotes, or as a path of another machine
whose last part lies beside the material library. The format has no flag for it, so every surface is double-sided. Albedo is 0.5
where a material is missing, or has a picture that is and no Kd.
"""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path

from app.errors import SceneError
from app.scene.images import ImageError, read_channel, read_image
from app.scene.model import F32, RGB, Material, Texture
from app.util.words import counted

WHITE: RGB = (1.0, 1.0, 1.0)
NAMES_SHOWN = 3  # of pictures that are missing
LIBRARIES = re.compile(r'"([^"]+)"|(\S.*?\.mtl)(?=\s|$)|(\S+)', re.IGNORECASE)  # names may hold blanks

Lines = dict[str, str]  # of one material, by lower-case key
Pictures = dict[tuple[str, Path, str], F32 | None]  # by key, folder and file; None where it cannot be read


def read_materials(
    path: Path, libraries: list[str], names: list[str], *, coloured: bool
) -> tuple[list[Material], list[str]]:
    """The materials of these ``names`` in order, and what of them is missing. coloured: whether all vertices have colours,
    which are the albedo of what has no material."""
    known, folders, notes = _read_libraries(path, libraries)
    pictures: Pictures = {}
    materials, unknown = [], 0
    for name in names:
        found = _named(name, known)
        unknown += found is None
        if found is None:
            default = Material(name or "no material", double_sided=True)
            materials.append(dataclasses.replace(default, albedo=WHITE) if coloured else default)
        else:
            materials.append(_material(path, folders[found], found, known[found], pictures))
    if unknown:
        instead = "the colours of their vertices are used" if coloured else "grey with albedo 0.5"
        notes.append(f"{counted(unknown, 'material is', 'materials are')} not defined: {instead}")
    lost = [f"'{file}'" for (_, _, file), pixels in pictures.items() if pixels is None]
    if lost:
        shown = ", ".join(lost[:NAMES_SHOWN]) + (", ..." if len(lost) > NAMES_SHOWN else "")
        what = counted(len(lost), "picture", "pictures")
        notes.append(f"{what} could not be read ({shown}): Kd is used, or albedo 0.5 without it")
    return materials, notes


def unquoted(text: str) -> str:
    """Without the blanks and the quotes around it."""
    text = text.strip()
    return text[1:-1] if len(text) > 1 and text[0] == text[-1] == '"' else text


def _named(name: str, known: dict[str, Lines]) -> str | None:
    """The material that is meant: of this name, or else without what may be a comment, or else in another case."""
    for wanted in (name, name.partition("#")[0].rstrip()):
        if wanted in known:
            return wanted
        alike = [k for k in known if k.casefold() == wanted.casefold()]
        if len(alike) == 1 and wanted:
            return alike[0]
    return None


def _read_libraries(path: Path, libraries: list[str]) -> tuple[dict[str, Lines], dict[str, Path], list[str]]:
    """Lines and folder of each material by its name; those of a later library count."""
    known: dict[str, Lines] = {}
    folders: dict[str, Path] = {}
    notes = []
    for line in dict.fromkeys(libraries):
        whole = _found(path.parent, path.parent, unquoted(line))
        listed = [line] if whole else [next(filter(None, groups)) for groups in LIBRARIES.findall(line)]
        for name in listed:
            found = whole or _found(path.parent, path.parent, name)
            if found is None:
                notes.append(f"material library '{name}' is missing")
                continue
            read = _read_mtl(path, found)
            known |= read
            folders |= dict.fromkeys(read, found.parent)
    return known, folders, notes


def _read_mtl(path: Path, library: Path) -> dict[str, Lines]:
    """Lines of each material by lower-case key; the first of a kind counts. Names may hold #."""
    materials: dict[str, Lines] = {}
    current: Lines = {}
    try:
        text = library.read_text("utf-8-sig", errors="replace")
    except OSError as error:
        raise SceneError(path, f"{library.name} cannot be read: {error.strerror}") from error
    for line in text.splitlines():
        key, rest = (*line.split(None, 1), "", "")[:2]
        if key.lower() == "newmtl":
            current = materials.setdefault(unquoted(rest), {})
        elif not key.startswith("#"):
            value = rest.strip() if key.lower().startswith("map_") else rest.partition("#")[0].strip()
            if value:
                current.setdefault(key.lower(), value)
    return materials


def _material(path: Path, folder: Path, name: str, lines: Lines, pictures: Pictures) -> Material:
    material = Material(name or "no material", double_sided=True)
    if "kd" in lines:
        material = dataclasses.replace(material, albedo=_colour(path, name, "Kd", lines["kd"]))
    if "ke" in lines:
        material = dataclasses.replace(material, emission=_colour(path, name, "Ke", lines["ke"]))
    if "d" in lines:  # options before it, -halo
        material = dataclasses.replace(material, opacity=_number(path, name, "d", lines["d"].split()[-1]))
    elif "tr" in lines:
        material = dataclasses.replace(material, opacity=1.0 - _number(path, name, "Tr", lines["tr"]))
    if "map_d" in lines:
        cut_out = _texture(path.parent, folder, "map_d", lines["map_d"], pictures)
        material = dataclasses.replace(material, opacity_texture=cut_out)
    texture = _texture(path.parent, folder, "map_kd", lines["map_kd"], pictures) if "map_kd" in lines else None
    if texture is None:
        return material
    albedo = material.albedo if "kd" in lines else WHITE
    return dataclasses.replace(material, albedo=albedo, albedo_texture=texture)


def _texture(root: Path, folder: Path, key: str, text: str, pictures: Pictures) -> Texture | None:
    """The picture of a map line; of map_d its alpha, or else its red."""
    file = _file_of_map(text)
    if (key, folder, file) not in pictures:
        pictures[key, folder, file] = _pixels(root, folder, key, file)
    pixels = pictures[key, folder, file]
    return None if pixels is None else Texture(file, pixels)


def _pixels(root: Path, folder: Path, key: str, file: str) -> F32 | None:
    """The picture as it is named in ``folder`` or in the scene's, or without its own folders; None if there is none to read."""
    last = re.split(r"[/\\:]", file)[-1]
    for place, name in ((folder, file), (root, file), (folder, last), (root, last)):
        found = _found(root, place, name)
        if found is not None:
            try:
                if key != "map_d":
                    return read_image(found)
                alpha = read_channel(found, "A")
                return read_channel(found, "R") if alpha is None else alpha
            except ImageError:
                return None
    return None


def _found(root: Path, folder: Path, name: str) -> Path | None:
    """The file that a path from ``folder`` means, in any case, or None if there is none inside ``root``."""
    text = name.replace("\\", "/").strip()
    if not text or "\0" in text or ":" in text or text.startswith("/"):
        return None
    try:
        inside, at = root.resolve(), folder.resolve()
        for part in text.split("/"):
            step = (at / part).resolve()
            if not step.exists():
                alike = [entry for entry in sorted(at.iterdir()) if entry.name.casefold() == part.casefold()]
                step = alike[0] if alike else step
            at = step
            if not at.is_relative_to(inside):
                return None
        return at if at.is_file() else None
    except OSError:  # a name too long for the file system, or a file where a folder should be
        return None


def _number(path: Path, material: str, key: str, text: str) -> float:
    return _colour(path, material, key, text)[0]


def _colour(path: Path, material: str, key: str, text: str) -> RGB:
    words = text.split()
    try:
        values = [float(w) for w in (words if len(words) >= 3 else words[:1] * 3)][:3]
        if len(values) < 3 or not all(math.isfinite(v) for v in values):
            raise ValueError
    except ValueError as error:
        raise SceneError(path, f"material '{material}': {key} {text[:40]} must be one or three numbers") from error
    return (values[0], values[1], values[2])


def _file_of_map(text: str) -> str:
    """The file name after the options of a map line (-s 1 1 1 and the like: numbers, on or off)."""
    words = text.split()
    if not words[0].startswith("-"):
        return unquoted(text)
    k = 0
    while k < len(words) - 1 and words[k].startswith("-"):
        k += 1
        while k < len(words) - 1 and _is_option_value(words[k]):
            k += 1
    return unquoted(" ".join(words[k:]))


def _is_option_value(word: str) -> bool:
    return word in ("on", "off") or word.lstrip("-+").replace(".", "", 1).replace("e", "", 1).isdigit()
