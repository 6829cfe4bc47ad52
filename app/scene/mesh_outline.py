"""What a large OBJ, PLY or STL file holds, about: its faces are counted by their lines or by its header, and area and extents
are those of some of them. A file that is not as expected has no outline: whoever reads it whole says why."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.scene.meshfile import PICTURE, TEXTURE_LINE
from app.scene.model import F64, Material
from app.scene.mtl import read_materials, unquoted
from app.scene.outline import Outline, colour_textures
from app.scene.ply import COLOURS, ORDERS, Element, header
from app.scene.text import decoded

COLOUR_NAMES = [names[0] for names in COLOURS]
SOME = 4096  # faces and vertices that are looked at, of each
BLOCK = 1 << 26  # bytes in work at a time
LONGEST = 1 << 12  # bytes of a line, or of two facets in text
HEADER_BYTES = 1 << 16  # of a PLY file
LARGEST_FACE = 64  # corners of those that are looked at, of PLY files with faces of all sizes
IN_A_ROW = 8  # such faces that make sense: the last is one, even where the first ones only seemed to be
STL_HEADER, STL_BYTES = 84, 50  # of a binary file, and of each of its triangles
GOLDEN = (5**0.5 - 1) / 2
VERTEX = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)")

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class _Found:
    """How many faces a file has, the corners (k, 3) of some of them, and some of its vertices (n, 3). known: the number of its
    triangles, if it is."""

    faces: int
    rings: Sequence[F64]
    points: F64
    known: int | None = None

    @property
    def triangles(self) -> int:
        return round(self.faces * self._some / max(len(self.rings), 1)) if self.known is None else self.known

    @property
    def _some(self) -> int:
        """The triangles of those that are looked at."""
        return sum(max(len(ring) - 2, 0) for ring in self.rings)

    def outline(
        self, path: Path, materials: Sequence[Material], *, objects: int = 1, coloured: bool, warnings: Sequence[str]
    ) -> Outline:
        sums = [np.cross(ring[1:-1] - ring[0], ring[2:] - ring[0]).sum(axis=0) for ring in self.rings]
        area = float(np.sum([np.linalg.norm(s) / 2 for s in sums])) / max(self._some, 1) * self.triangles
        points = np.concatenate([self.points, *self.rings])
        return Outline(
            name=path.stem,
            triangles=self.triangles,
            sides=2 * self.triangles,  # all materials of these formats have two
            area=2 * area,
            texel_area=2 * area,
            lower=points.min(axis=0),
            upper=points.max(axis=0),
            objects=objects,
            materials=len(materials),
            emitting_materials=sum(m.emits for m in materials),
            textures=colour_textures(materials, coloured=coloured),
            lights=(),
            cameras=(),
            sky=None,
            warnings=tuple(warnings),
            exact=False,
        )


def outline_mesh(path: Path, most: int) -> Outline | None:
    """Of an .obj, .ply or .stl file with more than about so many triangles; None where it has no more, or cannot be read so."""
    try:
        if path.stat().st_size == 0:
            return None
        return OUTLINES[path.suffix.lower()](path, np.memmap(path, np.uint8, "r"), most)
    except (OSError, ValueError, IndexError, KeyError):  # what a broken file leads to
        return None


# -- OBJ ---------------------------------------------------------------------------------------------------------------


def _obj(path: Path, data: Bytes, most: int) -> Outline | None:
    starts = _lines(data)
    first, second = data[starts], data[np.minimum(starts + 1, len(data) - 1)]
    blank = (second == ord(" ")) | (second == ord("\t"))
    faces, vertices = starts[(first == ord("f")) & blank], starts[(first == ord("v")) & blank]
    rings, line = [], _words
    for at in _spread(faces):
        before = int(np.searchsorted(vertices, at))
        index = [int(word.split(b"/")[0]) for word in line(data, at)[1:]]
        places = [vertices[i - 1 if i > 0 else before + i] for i in index]
        rings.append(np.array([line(data, place)[1:4] for place in places], np.float64))
    some = [line(data, at) for at in _spread(vertices)]
    found = _Found(len(faces), rings, np.array([words[1:4] for words in some], np.float64))
    if found.triangles <= most:
        return None
    named = {
        key: list(dict.fromkeys(_names(data, starts[first == ord(key[0])], key)))
        for key in ("o", "g", "usemtl", "mtllib")
    }
    coloured = all(len(words) > 6 for words in some)
    materials, notes = read_materials(path, named["mtllib"], named["usemtl"] or [""], coloured=coloured)
    objects = max(len(named["o"] + named["g"]), 1)
    return found.outline(path, materials, objects=objects, coloured=coloured, warnings=notes)


def _names(data: Bytes, starts: Ints, key: str) -> Iterator[str]:
    """What stands behind a key in the lines that begin with it."""
    for at in starts.tolist():
        word, _, name = decoded(_line(data, at)).partition(" ")
        if word == key:
            yield unquoted(name)


# -- PLY ---------------------------------------------------------------------------------------------------------------


def _ply(path: Path, data: Bytes, most: int) -> Outline | None:
    head = data[:HEADER_BYTES].tobytes()
    kind, elements, body = header(head)
    vertex, face = elements[:2]
    if (vertex.name, face.name) != ("vertex", "face") or face.count <= most / 2:
        return None
    last = len(elements) == 2
    found = (
        _ply_text(data, body, vertex, face) if kind == "ascii" else _ply_binary(data, body, kind, vertex, face, last)
    )
    if found.triangles <= most:
        return None
    coloured = any(name in COLOUR_NAMES for element in (vertex, face) for name, _, _ in element.properties)
    notes = [PICTURE] if TEXTURE_LINE in head[:body] else []
    return found.outline(path, [Material(path.stem)], coloured=coloured, warnings=notes)


def _ply_binary(data: Bytes, body: int, kind: str, vertex: Element, face: Element, last: bool) -> _Found:
    """last: whether nothing follows the faces."""
    order = ORDERS[kind]
    corners = next(name for name, _, counted in face.properties if counted is not None)
    layout = vertex.dtype(order)
    begin = body + vertex.count * layout.itemsize
    vertices = data[body:begin].view(layout)
    faces = None
    for length in (3, 4):  # of all alike
        shape = face.dtype(order, length)
        end = begin + face.count * shape.itemsize
        if end <= len(data):
            some = data[begin:end].view(shape)[_spread(np.arange(face.count))]
            if (some[f"{corners} length"] == length).all():
                faces = list(some[corners].astype(np.int64))
    if faces is None and not last:
        raise ValueError("faces of all sizes before something else")
    known = None
    if faces is None:
        fixed = face.dtype(order, 0).itemsize
        corner = face.dtype(order, 1).itemsize - fixed
        known = (len(data) - begin - fixed * face.count) // corner - 2 * face.count
        faces = _faces_of_all_sizes(data, begin, order, face, vertex.count)
    xyz = [vertices[name] for name in "xyz"]
    points = np.stack([axis[_spread(np.arange(len(vertices)))] for axis in xyz], axis=1).astype(np.float64)
    rings = [np.stack([axis[ring] for axis in xyz], axis=1).astype(np.float64) for ring in faces]
    return _Found(face.count, rings, points, known)


def _faces_of_all_sizes(data: Bytes, begin: int, order: str, face: Element, vertices: int) -> list[Ints]:
    """Corners of those that follow on places evenly among the bytes from ``begin`` on. ValueError where few are found."""
    (nth,) = [k for k, (_, _, counted) in enumerate(face.properties) if counted]
    sizes = [int(kind[1]) for _, kind, _ in face.properties]
    (_, kind, counted), before, after = face.properties[nth], sum(sizes[:nth]), sum(sizes[nth + 1 :])
    wide = int(str(counted)[1])

    def row(at: int) -> tuple[Ints, int] | None:
        """The corners in a row that begins there, and where the next one does; None where it makes no sense."""
        first = at + before + wide
        length = int(data[first - wide : first].view(f"{order}{counted}")[0])
        if not 3 <= length <= LARGEST_FACE:
            return None
        end = first + length * sizes[nth]
        corners = data[first:end].view(order + kind).astype(np.int64)
        return (corners, end + after) if corners.min() >= 0 and corners.max() < vertices else None

    def next_face(at: int) -> Ints | None:
        for start in range(at, at + before + wide + LARGEST_FACE * sizes[nth] + after):
            found = row(start)
            for _ in range(IN_A_ROW - 1):
                found = found and row(found[1])
            if found:
                return found[0]
        return None

    faces = list[Ints]()
    room = (IN_A_ROW + 1) * (before + wide + LARGEST_FACE * sizes[nth] + after)
    for tried, at in enumerate(np.linspace(begin, max(len(data) - room, begin), SOME).astype(np.int64).tolist()):
        found = next_face(at)
        if found is not None:
            faces.append(found)
        elif tried > 2 * len(faces) + LARGEST_FACE:
            raise ValueError("few of its faces are found")
    return faces


def _ply_text(data: Bytes, body: int, vertex: Element, face: Element) -> _Found:
    starts = _lines(data[body:]) + body
    vertices, faces = starts[: vertex.count], starts[vertex.count : vertex.count + face.count]
    columns = [[name for name, _, _ in vertex.properties].index(axis) for axis in "xyz"]

    def place(at: int) -> list[float]:
        words = _words(data, at)
        return [float(words[column]) for column in columns]

    rings = []
    for at in _spread(faces):
        words = _words(data, at)
        rings.append(np.array([place(int(vertices[int(word)])) for word in words[1 : 1 + int(words[0])]]))
    return _Found(len(faces), rings, np.array([place(at) for at in _spread(vertices)]))


# -- STL ---------------------------------------------------------------------------------------------------------------


def _stl(path: Path, data: Bytes, most: int) -> Outline | None:
    count = int(data[STL_HEADER - 4 : STL_HEADER].view("<u4")[0]) if len(data) > STL_HEADER else 0
    if len(data) == STL_HEADER + count * STL_BYTES:
        layout = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("more", "<u2")])
        corners = data[STL_HEADER:].view(layout)["corners"][_spread(np.arange(count))].astype(np.float64)
        found = _Found(count, list(corners), np.empty((0, 3)))
    else:
        found = _stl_text(data)
    if found.triangles <= most:
        return None
    return found.outline(path, [Material("grey")], coloured=False, warnings=())


def _stl_text(data: Bytes) -> _Found:
    """By what a facet takes in the file."""
    rings, taken = [], []
    for at in np.linspace(0, max(len(data) - LONGEST, 0), SOME).astype(np.int64).tolist():
        text = data[at : at + LONGEST].tobytes()
        first = text.find(b"endfacet")
        second = text.find(b"endfacet", first + 1)
        corners = VERTEX.findall(text[first:second])
        if 0 <= first < second and len(corners) == 3:
            rings.append(np.array(corners, np.float64))
            taken.append(second - first)
    return _Found(round(len(data) / float(np.mean(taken))) if taken else 0, rings, np.empty((0, 3)))


# -- lines -------------------------------------------------------------------------------------------------------------


def _lines(data: Bytes) -> Ints:
    """Where each line begins; they end in \\n, or all in \\r where the first ones do."""
    end = ord("\n" if (data[:HEADER_BYTES] == ord("\n")).any() else "\r")
    ends = [np.flatnonzero(data[at : at + BLOCK] == end) + at for at in range(0, len(data), BLOCK)]
    starts = np.concatenate([[0], *ends]) + np.r_[0, np.ones(sum(map(len, ends)), np.int64)]
    return np.asarray(starts[starts < len(data)], np.int64)


def _line(data: Bytes, at: int) -> bytes:
    return data[at : at + LONGEST].tobytes().replace(b"\r", b"\n").partition(b"\n")[0]


def _words(data: Bytes, at: int) -> list[bytes]:
    return _line(data, at).partition(b"#")[0].split()


def _spread(places: Ints) -> list[Any]:
    """Some of these, evenly among all, in no period that the order of a mesh may have: places of the golden ratio."""
    if len(places) > SOME:
        places = places[np.sort(np.arange(SOME) * GOLDEN % 1.0 * len(places)).astype(np.int64)]
    return list(places.tolist())


OUTLINES: dict[str, Callable[[Path, Bytes, int], Outline | None]] = {".obj": _obj, ".ply": _ply, ".stl": _stl}
