"""PLY (Turk 1994, The PLY polygon file format): its header, and vertices and polygons of it as a Part of a Scene.

Text, or bytes in either order. Polygons of any number of corners, as fans, or by ear clipping where they are concave. Colours are
those of vertices or else of faces, sRGB.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
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
from app.util.background import Report, unheard

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
LETTERS = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "f4": "f", "f8": "d"}  # of struct
LARGEST = 2.0**53  # up to here f64 holds all integers
ROWS = 1 << 15  # of a table, between two reports
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
    """A property of all elements of a kind: values and their type, and of lists their lengths (n,), one list after the other."""

    values: NDArray[Any]
    kind: str
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

    def reader(self, kind: str) -> Callable[[int], float]:
        """What reads one number at a place."""
        return self.numbers.item

    def at(self, places: I64, kind: str) -> NDArray[Any]:
        """Those that begin there."""
        return _whole(self.numbers[places], kind)

    def grid(self, first: int, kind: str, shape: tuple[int, int], step: int) -> NDArray[Any]:
        """The first, and others after it in as many columns, rows so far apart."""
        size = self.numbers.itemsize
        return _whole(np.ndarray(shape, np.float64, self.numbers, first * size, (step * size, size)), kind)


def _whole(numbers: F64, kind: str) -> NDArray[Any]:
    """Numbers of a text as integers where their type is one and so are they, however large; else as they are."""
    if kind[0] == "f" or not ((np.abs(numbers) < LARGEST) & (numbers % 1 == 0)).all():
        return numbers.copy()
    return numbers.astype(np.int64)


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

    def reader(self, kind: str) -> Callable[[int], float]:
        """As of text."""
        one, data = struct.Struct(self.order + LETTERS[kind]).unpack_from, self.data.data
        return self.data.item if kind == "u1" else lambda place: one(data, place)[0]

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
            unknown = [word for word in words[1:-1] if word != "list" and word not in TYPES]
            if unknown or len(words) < 3:
                raise ValueError(f"property {words[-1]} is of no known type" + "".join(f": '{w}'" for w in unknown))
            types = [TYPES[word] for word in words[1:-1] if word != "list"]
            one = (words[-1], types[-1], types[0] if len(types) > 1 else None)
            elements[-1] = Element(last.name, last.count, (*last.properties, one))
    if kind != "ascii" and kind not in ORDERS:
        raise ValueError(f"format '{kind}' is unknown" if kind else "its header has no format")
    return kind, elements, end.end()


def read_ply(path: Path, data: bytes, report: Report = unheard) -> Part:
    """Its polygons as triangles, with their colours. SceneError where it is no such file, or has no polygons. report(share) is
    called now and then and may raise to cancel."""
    try:
        tables = _tables(data, report)
        vertex, face = tables.get("vertex", {}), tables.get("face", {})
        lost = [axis for axis in "xyz" if axis not in vertex]
        if lost:
            raise ValueError(f"its vertices have no {', '.join(lost)}")
        positions = np.stack([vertex[axis].values for axis in "xyz"], axis=1).astype(np.float64)
    except (ValueError, KeyError, IndexError, OverflowError) as error:
        reason = " ".join(str(error).split())[:120]
        raise SceneError(path, f"not a readable PLY file ({reason})") from error
    lists = next((face[name] for name in CORNERS if name in face), None)
    if lists is None or lists.lengths is None or not len(lists.values):
        strips = ": its triangle strips are not read" if "tristrips" in tables else ""
        raise SceneError(path, f"no triangles{strips}")
    polygon = lists.values
    broken = ~((polygon >= 0) & (polygon < len(positions)))
    if broken.any():
        worst = polygon[broken][0]
        raise SceneError(path, f"index {worst:.15g} is out of range: there are {len(positions)} vertices")
    if (polygon % 1 != 0).any():
        raise SceneError(path, f"index {polygon[polygon % 1 != 0][0]:g} is no whole number")
    polygon = polygon.astype(np.int64)
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


def _tables(data: bytes, report: Report) -> dict[str, dict[str, Column]]:
    """The properties of each kind of element, by their names. Errors as of ``header``."""
    kind, elements, start = header(data)
    body: _Text | _Binary
    if kind == "ascii":
        body, at = _Text(np.array(data[start:].split(), np.float64)), 0
    else:
        body, at = _Binary(np.frombuffer(data, np.uint8), ORDERS[kind]), start
    tables = {}
    for element in elements:
        tables[element.name], at = _table(element, body, at, report)
    if kind == "ascii" and at < len(body):
        raise ValueError(f"it has {len(body) - at} more numbers than its header says")
    return tables


def _table(element: Element, body: _Text | _Binary, at: int, report: Report) -> tuple[dict[str, Column], int]:
    """The properties of an element, which begins there, and where the next one does."""
    count, first, columns = element.count, [at], dict[str, Column]()  # where each property of the first row begins
    lengths = []  # of its lists; most tables have all rows alike
    if count > len(body):
        raise ValueError(f"it ends before its {element.name} elements do")
    for _, kind, counted in element.properties:
        if counted is None:
            first.append(first[-1] + body.size(kind))
            continue
        lengths.append(_length(body, body.reader(counted), first[-1], body.size(counted)) if count else 0)
        first.append(first[-1] + body.size(counted) + body.size(kind) * lengths[-1])
    step = first.pop() - at
    if not count:
        empty = np.empty(0, np.int64)
        return {name: Column(empty, kind, empty if counted else None) for name, kind, counted in element.properties}, at
    if at + step * count > len(body):
        return _uneven(element, body, at, report)
    nth = iter(lengths)
    for (name, kind, counted), start in zip(element.properties, first, strict=True):
        if counted is None:
            columns[name] = Column(body.grid(start, kind, (count, 1), step)[:, 0], kind)
            continue
        length = next(nth)
        if (body.grid(start, counted, (count, 1), step) != length).any():
            return _uneven(element, body, at, report)
        values = body.grid(start + body.size(counted), kind, (count, length), step).reshape(-1)
        columns[name] = Column(values, kind, np.full(count, length, np.int64))
    return columns, at + step * count


def _uneven(element: Element, body: _Text | _Binary, at: int, report: Report) -> tuple[dict[str, Column], int]:
    """As ``_table``, of rows with lists of different lengths, one row after another."""
    starts, counts = list[int](), list[int]()  # of each property of each row; the second of lists
    readers = {counted: body.reader(counted) for _, _, counted in element.properties if counted}
    parts = [
        (body.size(kind), body.size(counted or kind), readers.get(counted or ""))
        for _, kind, counted in element.properties
    ]
    for row in range(element.count):
        if row % ROWS == 0:
            report(row / element.count)
        for size, before, read in parts:
            starts.append(at)
            at += before
            length = 0
            if read:
                length = _length(body, read, at - before, before)
                at += size * length
            counts.append(length)
    if at > len(body):
        raise ValueError(f"it ends before its {element.name} elements do")
    shape = element.count, len(element.properties)
    first, lengths = (np.array(each, np.int64).reshape(shape) for each in (starts, counts))
    columns = {}
    for nth, (name, kind, counted) in enumerate(element.properties):
        if counted is None:
            columns[name] = Column(body.at(first[:, nth], kind), kind)
            continue
        mine = lengths[:, nth]
        within = np.arange(mine.sum()) - np.repeat(np.cumsum(mine) - mine, mine)
        begin = np.repeat(first[:, nth] + body.size(counted), mine)
        columns[name] = Column(body.at(begin + body.size(kind) * within, kind), kind, mine)
    return columns, at


def _length(body: _Text | _Binary, read: Callable[[int], float], place: int, size: int) -> int:
    """Of the list that begins there. ValueError where it makes no sense."""
    if place + size > len(body):
        raise ValueError("it ends early")
    length = read(place)
    if not 0 <= length <= len(body) or length % 1:
        raise ValueError(f"a list has {length:.15g} values")
    return int(length)


def _colours(table: dict[str, Column]) -> F32 | None:
    """(n, 3) linear Rec.709; None if there are none. Integers of 8 or 16 bits are shares of the most that they hold, wider
    ones of 255; numbers with fractions are shares of 1, or of 255 where one is above 1."""
    for names in COLOURS:
        if all(name in table for name in names):
            srgb = np.stack([table[name].values for name in names], axis=1)
            kind = table[names[0]].kind
            if srgb.dtype.kind == "f":
                most = 255 if srgb.max(initial=0) > 1 else 1
            else:
                most = 255 if int(kind[1]) > 2 else np.iinfo(kind).max
            return linear_from_srgb(np.clip(srgb.astype(np.float32) / np.float32(most), 0, 1))
    return None
