"""PLY (Turk 1994, The PLY polygon file format): its header, and vertices and polygons of it as a Part of a Scene.

Text, or bytes in either order. Polygons of any number of corners, as fans, or by ear clipping where they are concave. Colours are
those of vertices or else of faces, sRGB.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.errors import SceneError
from app.scene.images import linear_from_srgb
from app.scene.model import F32, F64
from app.scene.polygons import fan_corners, with_ears_clipped
from app.scene.validate import Part, check_triangle_count

TYPES = {
    **{name: "i1" for name in ("char", "int8")},
    **{name: "u1" for name in ("uchar", "uint8")},
    **{name: "i2" for name in ("short", "int16")},
    **{name: "u2" for name in ("ushort", "uint16")},
    **{name: "i4" for name in ("int", "int32")},
    **{name: "u4" for name in ("uint", "uint32")},
    **{name: "f4" for name in ("float", "float32")},
    **{name: "f8" for name in ("double", "float64")},
}
ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
CORNERS = "vertex_indices", "vertex_index"
COLOURS = ("red", "green", "blue"), ("diffuse_red", "diffuse_green", "diffuse_blue"), ("r", "g", "b")
END = re.compile(rb"(?:^|[\r\n])end_header[ \t]*(?:\r\n|\r(?!\n)|\n)")

I64 = NDArray[np.int64]


@dataclass(frozen=True)
class Element:
    """Its name, how many there are, and its properties: name, type, and of a list the type of its length."""

    name: str
    count: int
    properties: tuple[tuple[str, str, str | None], ...]

    def dtype(self, order: str, length: int = 0) -> np.dtype[np.void]:
        """As it lies in a binary file, with lists of that length."""
        fields: list[tuple[str, str] | tuple[str, str, int]] = []
        for name, kind, counted in self.properties:
            if counted is None:
                fields.append((name, order + kind))
            else:
                fields += [(f"{name} length", order + counted), (name, order + kind, length)]
        return np.dtype(fields)


@dataclass(frozen=True, eq=False)
class Column:
    """A property of all elements of a kind: its values, and of lists their lengths (n,), one list after the other."""

    values: NDArray[Any]
    lengths: I64 | None = None


@dataclass(frozen=True, eq=False)
class _Text:
    """The numbers of a text file, of which each takes one place."""

    numbers: F64

    @staticmethod
    def size(kind: str) -> int:
        return 1

    def __len__(self) -> int:
        return len(self.numbers)

    def length(self, place: int, kind: str) -> int:
        return int(self.numbers[place])

    def at(self, places: I64, kind: str) -> NDArray[Any]:
        """Those that begin there."""
        return np.asarray(self.numbers[places].astype(kind))

    def grid(self, first: int, kind: str, shape: tuple[int, int], step: int) -> NDArray[Any]:
        """The first, and others after it in as many columns, rows so far apart."""
        size = self.numbers.itemsize
        return np.ndarray(shape, np.float64, self.numbers, first * size, (step * size, size)).astype(kind)


@dataclass(frozen=True, eq=False)
class _Binary:
    """The bytes of a binary file, and their order."""

    data: NDArray[np.uint8]
    order: str

    @staticmethod
    def size(kind: str) -> int:
        return int(kind[1])

    def __len__(self) -> int:
        return len(self.data)

    def length(self, place: int, kind: str) -> int:
        return int.from_bytes(
            self.data[place : place + int(kind[1])].tobytes(), "little" if self.order == "<" else "big"
        )

    def at(self, places: I64, kind: str) -> NDArray[Any]:
        """As of text."""
        size = int(kind[1])
        taken = self.data[places[:, None] + np.arange(size)]
        return np.asarray(taken.reshape(-1).view(self.order + kind).astype(kind))

    def grid(self, first: int, kind: str, shape: tuple[int, int], step: int) -> NDArray[Any]:
        """As of text."""
        return np.ndarray(shape, self.order + kind, self.data, first, (step, int(kind[1]))).astype(kind)


def header(data: bytes) -> tuple[str, list[Element], int]:
    """The format, the elements in their order, and where the body begins. ValueError, KeyError or IndexError where it is none."""
    end = END.search(data)
    if not data.startswith(b"ply") or end is None:
        raise ValueError("it has no header")
    kind, elements = "", list[Element]()
    for words in map(str.split, data[: end.start()].decode("ascii", "replace").splitlines()):
        if words[:1] == ["format"]:
            kind = words[1]
        elif words[:1] == ["element"]:
            elements.append(Element(words[1], int(words[2]), ()))
        elif words[:1] == ["property"]:
            last = elements[-1]
            types = [TYPES[word] for word in words[1:-1] if word != "list"]
            one = (words[-1], types[-1], types[0] if len(types) > 1 else None)
            elements[-1] = Element(last.name, last.count, (*last.properties, one))
    return kind, elements, end.end()


def read_ply(path: Path, data: bytes) -> Part:
    """Its polygons as triangles, with their colours. SceneError where it is no such file, or has no polygons."""
    try:
        tables = _tables(data)
        vertex, face = tables.get("vertex", {}), tables.get("face", {})
        positions = np.stack([vertex[axis].values for axis in "xyz"], axis=1).astype(np.float64)
    except (ValueError, KeyError, IndexError, OverflowError) as error:
        reason = " ".join(str(error).split())[:120]
        raise SceneError(path, f"not a readable PLY file ({reason})") from error
    lists = next((face[name] for name in CORNERS if name in face), None)
    if lists is None or lists.lengths is None or not len(lists.values):
        strips = ": its triangle strips are not read" if "tristrips" in tables else ""
        raise SceneError(path, f"no triangles{strips}")
    polygon = lists.values.astype(np.int64)
    outside = (polygon < 0) | (polygon >= len(positions))
    if outside.any():
        raise SceneError(path, f"index {polygon[outside][0]} is out of range: there are {len(positions)} vertices")
    check_triangle_count(path, int(np.maximum(lists.lengths - 2, 0).sum()))
    corners, fans = fan_corners(lists.lengths)
    if not len(corners):
        raise SceneError(path, "no triangles")
    corners, of = with_ears_clipped(positions, polygon[corners][:, None], fans)
    owner = np.repeat(np.flatnonzero(lists.lengths > 2), fans)[of]
    colours, of_faces = _colours(vertex), _colours(face)
    if colours is None and of_faces is not None:
        colours = np.repeat(of_faces[owner][:, None], 3, axis=1)
    return Part(positions, corners.reshape(-1, 3), colours=colours)


def _tables(data: bytes) -> dict[str, dict[str, Column]]:
    """The properties of each kind of element, by their names. Errors as of ``header``."""
    kind, elements, start = header(data)
    body: _Text | _Binary
    if kind == "ascii":
        body, at = _Text(np.array(data[start:].split(), np.float64)), 0
    else:
        body, at = _Binary(np.frombuffer(data, np.uint8), ORDERS[kind]), start
    tables = {}
    for element in elements:
        tables[element.name], at = _table(element, body, at)
    return tables


def _table(element: Element, body: _Text | _Binary, at: int) -> tuple[dict[str, Column], int]:
    """The properties of an element, which begins there, and where the next one does."""
    count, first, columns = element.count, [at], dict[str, Column]()  # where each property of the first row begins
    lengths = []  # of its lists; most tables have all rows alike
    if count > len(body):
        raise ValueError(f"it ends before its {element.name} elements do")
    for _, kind, counted in element.properties:
        if counted is None:
            first.append(first[-1] + body.size(kind))
            continue
        lengths.append(_length(body, first[-1], counted) if count else 0)
        first.append(first[-1] + body.size(counted) + body.size(kind) * lengths[-1])
    step = first.pop() - at
    if not count:
        empty = np.empty(0, np.int64)
        return {name: Column(empty, empty if counted else None) for name, _, counted in element.properties}, at
    if at + step * count > len(body):
        return _uneven(element, body, at)
    nth = iter(lengths)
    for (name, kind, counted), start in zip(element.properties, first, strict=True):
        if counted is None:
            columns[name] = Column(body.grid(start, kind, (count, 1), step)[:, 0])
            continue
        length = next(nth)
        if (body.grid(start, counted, (count, 1), step) != length).any():
            return _uneven(element, body, at)
        values = body.grid(start + body.size(counted), kind, (count, length), step).reshape(-1)
        columns[name] = Column(values, np.full(count, length, np.int64))
    return columns, at + step * count


def _uneven(element: Element, body: _Text | _Binary, at: int) -> tuple[dict[str, Column], int]:
    """As ``_table``, of rows with lists of different lengths."""
    first = np.empty((element.count, len(element.properties)), np.int64)
    lengths = np.zeros_like(first)
    sizes = [(body.size(kind), body.size(counted or kind), counted) for _, kind, counted in element.properties]
    for row, lists in zip(first, lengths, strict=True):
        for nth, (size, before, counted) in enumerate(sizes):
            row[nth] = at
            if counted:
                lists[nth] = length = _length(body, at, counted)
                at += before + size * length
            else:
                at += size
    if at > len(body):
        raise ValueError(f"it ends before its {element.name} elements do")
    columns = {}
    for nth, (name, kind, counted) in enumerate(element.properties):
        if counted is None:
            columns[name] = Column(body.at(first[:, nth], kind))
            continue
        mine = lengths[:, nth]
        within = np.arange(mine.sum()) - np.repeat(np.cumsum(mine) - mine, mine)
        starts = np.repeat(first[:, nth] + body.size(counted), mine)
        columns[name] = Column(body.at(starts + body.size(kind) * within, kind), mine)
    return columns, at


def _length(body: _Text | _Binary, place: int, kind: str) -> int:
    """Of the list that begins there. ValueError where it makes no sense."""
    if place + body.size(kind) > len(body):
        raise ValueError("it ends early")
    length = body.length(place, kind)
    if not 0 <= length <= len(body):
        raise ValueError(f"a list has {length} values")
    return length


def _colours(table: dict[str, Column]) -> F32 | None:
    """(n, 3) linear Rec.709; None if there are none. Whole numbers are shares of their most, others from 0 to 1, or to 255."""
    for names in COLOURS:
        if all(name in table for name in names):
            srgb = np.stack([table[name].values for name in names], axis=1)
            whole = srgb.dtype.kind in "iu"
            most = np.iinfo(srgb.dtype).max if whole else 255 if srgb.max(initial=0) > 1 else 1
            return linear_from_srgb(np.clip(srgb.astype(np.float32) / np.float32(most), 0, 1))
    return None
