"""Wavefront MTL: the materials of an OBJ file, wherever and however exporters write them.

Read: Kd as albedo, Ke as radiance L like glTF's emission, d or else 1 - Tr as opacity, map_Kd, map_Ke and, times the opacity,
map_d as pictures inside the scene's folder, with their options -s, -o and -clamp. A filter Tf is only noted: programs write it
for opaque surfaces, too. File names are met in any case, with backslashes, in quotes, or as a path of another machine whose last
part lies beside the material library. The format has no flag for it, so every surface is double-sided. Albedo is 0.5 where a
material is missing, or has a picture that is and no Kd.
"""

from __future__ import annotations

import dataclasses
import math
import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from app.errors import SceneError
from app.scene.images import ImageError, file_inside, read_channel, read_image, without_pictures
from app.scene.model import F32, RGB, Material, Texture
from app.scene.text import decoded
from app.util.words import counted

WHITE: RGB = (1.0, 1.0, 1.0)
INSTEAD = {  # of the picture of a map
    "map_kd": "Kd is used, or albedo 0.5 without it",
    "map_ke": "Ke is used, or no light without it",
    "map_d": "d or Tr is used, or opacity 1 without them",
}
# Options of maps with up to three numbers, here two, and what they are unless given: offset, scale, turbulence.
PLACING = {"-o": (0.0, 0.0), "-s": (1.0, 1.0), "-t": (0.0, 0.0)}
OPTION_WORDS = {"-mm": 2}  # that follow other options; else one
LIBRARIES = re.compile(r'"([^"]+)"|(\S.*?\.mtl)(?=\s|$)|(\S+)', re.IGNORECASE)  # names may hold blanks

Lines = dict[str, str]  # of one material, by lower-case key


@dataclass(frozen=True)
class _Pictures:
    """Those of all maps inside ``root``: each that was read, as colours or as opacity; the maps of each that is lost; which of
    these is missing."""

    root: Path
    read: dict[tuple[Path, bool], F32 | None] = field(default_factory=dict)
    lost: dict[str, set[str]] = field(default_factory=dict)
    missing: set[str] = field(default_factory=set)

    def of(self, folder: Path, key: str, file: str) -> F32 | None:
        """The one of a map line in a library in ``folder``; None if there is none to read, which is noted."""
        found, opacity = _picture_file(self.root, folder, file), key == "map_d"
        if found is not None and (found, opacity) not in self.read:
            self.read[found, opacity] = _pixels(found, opacity=opacity)
        pixels = None if found is None else self.read[found, opacity]
        if pixels is None:
            self.lost.setdefault(file, set()).add(key)
        if found is None:
            self.missing.add(file)
        return pixels

    def notes(self) -> list[str]:
        """Which are lost, and what is used instead."""
        instead = "; ".join(text for key, text in INSTEAD.items() if any(key in keys for keys in self.lost.values()))
        missing, broken = ([file for file in self.lost if (file in self.missing) == kind] for kind in (True, False))
        return [f"{without_pictures(missing, broken)}: {instead}"] if self.lost else []


def read_materials(
    path: Path, libraries: list[str], names: list[str], *, coloured: bool
) -> tuple[list[Material], list[str]]:
    """The materials of these ``names`` in order, and what of them is missing. coloured: whether all vertices have colours,
    which are the albedo of what has no material."""
    known, folders, notes = _read_libraries(path, libraries)
    pictures = _Pictures(path.parent)
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
    filtered = sum(name in known and _only_filters(known[name]) for name in map(lambda n: _named(n, known), names))
    if filtered:
        notes.append(
            f"{counted(filtered, 'material', 'materials')} with a filter (Tf) and without opacity (d, Tr): opaque"
        )
    return materials, notes + pictures.notes()


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
        whole = file_inside(path.parent, path.parent, unquoted(line))
        listed = [line] if whole else [next(filter(None, groups)) for groups in LIBRARIES.findall(line)]
        for name in listed:
            found = whole or file_inside(path.parent, path.parent, name)
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
        text = decoded(library.read_bytes())
    except OSError as error:
        raise SceneError(path, f"{library.name} cannot be read: {error.strerror}") from error
    for line in text.split("\n"):
        key, rest = (*line.split(None, 1), "", "")[:2]
        if key.lower() == "newmtl":
            current = materials.setdefault(unquoted(rest), {})
        elif not key.startswith("#"):
            value = rest.strip() if key.lower().startswith("map_") else rest.partition("#")[0].strip()
            if value:
                current.setdefault(key.lower(), value)
    return materials


def _material(path: Path, folder: Path, name: str, lines: Lines, pictures: _Pictures) -> Material:
    material = Material(name or "no material", double_sided=True)
    if "kd" in lines:
        material = dataclasses.replace(material, albedo=_colour(path, name, "Kd", lines["kd"]))
    if "ke" in lines:
        material = dataclasses.replace(material, emission=_colour(path, name, "Ke", lines["ke"]))
    if "d" in lines:  # options before it, -halo
        material = dataclasses.replace(material, opacity=_number(path, name, "d", lines["d"].split()[-1]))
    elif "tr" in lines:
        material = dataclasses.replace(material, opacity=1.0 - _number(path, name, "Tr", lines["tr"]))
    textures = {key: _texture(folder, key, lines[key], pictures) for key in INSTEAD if key in lines}
    if "map_d" in textures:
        material = dataclasses.replace(material, opacity_texture=textures["map_d"])
    if textures.get("map_ke") is not None:
        emission = material.emission if "ke" in lines else WHITE
        material = dataclasses.replace(material, emission=emission, emission_texture=textures["map_ke"])
    if textures.get("map_kd") is not None:
        albedo = material.albedo if "kd" in lines else WHITE
        material = dataclasses.replace(material, albedo=albedo, albedo_texture=textures["map_kd"])
    return material


def _only_filters(lines: Lines) -> bool:
    """Whether a material says what light it lets pass by its filter alone."""
    words = [] if "d" in lines or "tr" in lines else lines.get("tf", "").split()
    return bool(words) and any(word.replace(".", "", 1).isdigit() and float(word) != 1.0 for word in words)


def _texture(folder: Path, key: str, text: str, pictures: _Pictures) -> Texture | None:
    """The picture of a map line."""
    file, options = _map_options(text)
    pixels = pictures.of(folder, key, file)
    if pixels is None:
        return None
    (across, up), (right, above) = (_numbers(options, option) for option in ("-s", "-o"))
    # u across + right, and so of v, which counts from the bottom there, from the top here
    placing = np.array([[across, 0.0, right], [0.0, up, 1.0 - up - above]])
    wrap = "clamp" if options.get("-clamp") == ["on"] else "repeat"
    return Texture(file, pixels, wrap=(wrap, wrap), uv_transform=placing)


def _numbers(options: dict[str, list[str]], option: str) -> tuple[float, float]:
    """The first two numbers of an option, or as many as there are."""
    given, (first, second) = [float(word) for word in options.get(option, [])], PLACING[option]
    return (given[0] if given else first, given[1] if len(given) > 1 else second)


def _picture_file(root: Path, folder: Path, file: str) -> Path | None:
    """The picture as it is named in ``folder`` or in the scene's, or without its own folders; or else without what may be a
    comment. None if there is none."""
    for name in dict.fromkeys((file, unquoted(file.partition("#")[0]))):
        last = re.split(r"[/\\:]", name)[-1]
        for place, part in ((folder, name), (root, name), (folder, last), (root, last)):
            found = file_inside(root, place, part)
            if found is not None:
                return found
    return None


def _pixels(file: Path, *, opacity: bool) -> F32 | None:
    """Its colours, or as opacity its alpha, or else its red. None if it cannot be read."""
    try:
        if not opacity:
            return read_image(file)
        alpha = read_channel(file, "A")
        return read_channel(file, "R") if alpha is None else alpha
    except ImageError:
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


def _map_options(text: str) -> tuple[str, dict[str, list[str]]]:
    """The file name of a map line, and the options before it with their words."""
    words, options, k = text.split(), dict[str, list[str]](), 0
    if not words[0].startswith("-"):
        return unquoted(text), {}
    while k < len(words) - 1 and words[k].startswith("-"):
        option, start = words[k].lower(), k + 1
        k = start
        if option in PLACING:
            while k < min(start + 3, len(words) - 1) and _is_number(words[k]):
                k += 1
        else:
            k = min(start + OPTION_WORDS.get(option, 1), len(words) - 1)
        options[option] = words[start:k]
    return unquoted(" ".join(words[k:])), options


def _is_number(word: str) -> bool:
    try:
        return math.isfinite(float(word))
    except ValueError:
        return False
