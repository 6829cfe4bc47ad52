"""A record that host and shaders share, declared once: its GLSL and its numpy dtype follow.

    LIGHT = Struct("Light", "vec3 colour, float area", "vec3 normal, uint item")

lies in as many RGBA32F texels, or vec4 uniforms, as it has rows. In GLSL it is ``struct Light``, with

    const int LIGHT_ROWS
    Light light_from_rows(vec4 rows[LIGHT_ROWS])
    vec4  light_row(Light light, int row)

On the host ``LIGHT.read(data)`` is a structured array: ``LIGHT.read(data)["colour"]`` is (n, 3). Integers are held as floats,
exact up to 2^24; what a row leaves free is 0.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.gpu.shader import Glsl

WIDTHS = {"float": 1, "int": 1, "uint": 1, "vec2": 2, "vec3": 3, "vec4": 4}
ROW = 4  # floats


@dataclass(frozen=True)
class Field:
    """One member: its GLSL type, and the floats of a row that hold it, the first of ``width``."""

    name: str
    type: str
    row: int
    first: int

    @property
    def width(self) -> int:
        return WIDTHS[self.type]

    @property
    def swizzle(self) -> str:
        return "xyzw"[self.first : self.first + self.width]


class Struct:
    """rows: texels of one record; fields: its members, in order."""

    def __init__(self, name: str, *rows: str) -> None:
        """rows: the members in each, ``type name``, separated by commas."""
        self.name, self.rows = name, len(rows)
        self.fields: list[Field] = []
        for row, members in enumerate(rows):
            first = 0
            for member in members.split(","):
                kind, field = member.split()
                self.fields.append(Field(field, kind, row, first))
                first += WIDTHS[kind]
            assert first <= ROW, f"row {row} of {name} holds {first} floats"

    def field(self, name: str) -> Field:
        return next(f for f in self.fields if f.name == name)

    # -- on the host ---------------------------------------------------------------------------------------------------

    @functools.cached_property
    def dtype(self) -> np.dtype[np.void]:
        """Of one record: 32-bit floats, by name."""
        return np.dtype(
            {
                "names": [f.name for f in self.fields],
                "formats": [("f4", f.width) if f.width > 1 else "f4" for f in self.fields],
                "offsets": [4 * (ROW * f.row + f.first) for f in self.fields],
                "itemsize": 4 * ROW * self.rows,
            }
        )

    def read(self, data: bytes | NDArray[np.float32], stride: int = 0) -> NDArray[np.void]:
        """(n,) records of raw floats, each followed by texels of something else up to ``stride``."""
        floats = np.frombuffer(data, np.float32) if isinstance(data, bytes) else data
        texels = floats.reshape(-1, stride or self.rows, ROW)[:, : self.rows]
        return np.ascontiguousarray(texels).reshape(-1).view(self.dtype)

    def write(self, records: NDArray[np.void], stride: int = 0) -> bytes:
        """The bytes of (n,) records, padded to ``stride`` texels each."""
        texels = np.zeros((len(records), stride or self.rows, ROW), np.float32)
        texels[:, : self.rows] = np.ascontiguousarray(records).view(np.float32).reshape(len(records), self.rows, ROW)
        return texels.tobytes()

    # -- in shaders ----------------------------------------------------------------------------------------------------

    @functools.cached_property
    def glsl(self) -> Glsl:
        """The struct, how many rows it has, and how it comes from them and goes there."""
        name, small = self.name, self.name.lower()
        count = f"{self.name.upper()}_ROWS"
        lines = [f"struct {name} {{"]
        lines += [f"    {f.type} {f.name};" for f in self.fields]
        lines += ["};", "", f"const int {count} = {self.rows};", ""]
        lines += [f"{name} {small}_from_rows(vec4 rows[{count}]) {{", f"    {name} s;"]
        lines += [f"    s.{f.name} = {_from_float(f, f'rows[{f.row}].{f.swizzle}')};" for f in self.fields]
        lines += ["    return s;", "}", "", f"vec4 {small}_row({name} s, int row) {{"]
        for row in range(self.rows):
            test = f"if (row == {row}) " if row < self.rows - 1 else ""
            lines.append(f"    {test}return {self._packed(row)};")
        lines.append("}")
        return Glsl(f"<{small}>", "\n".join(lines) + "\n")

    def _packed(self, row: int) -> str:
        members = [f for f in self.fields if f.row == row]
        parts = [f"float(s.{f.name})" if f.type in ("int", "uint") else f"s.{f.name}" for f in members]
        parts += ["0.0"] * (ROW - sum(f.width for f in members))
        return f"vec4({', '.join(parts)})"


def _from_float(field: Field, value: str) -> str:
    return f"{field.type}({value})" if field.type in ("int", "uint") else value
