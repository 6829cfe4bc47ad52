"""Plain GLSL from ``app/shaders`` with our own ``#include``: recursive, once; an error names file and line.

The host keeps the map from flattened to source lines itself: Mesa attributes type errors in an included file to the outer one
when ``#line`` tells it the file.

``#include "common/atlas.glsl"`` is a file below ``app/shaders``; ``#include <projection>`` is a slot that the host fills with a
file, or with GLSL that it makes. A define of the host overrides a ``#define NAME value`` that the shader declares, never adds
one; where the shader declares it without a value, the host must give it: it is known to the host first.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import moderngl

SHADERS = Path(__file__).parent.parent / "shaders"
VERSION = "#version 410 core"
_INCLUDE = re.compile(r'^\s*#include\s+(?:"([^"]+)"|<([^>]+)>)\s*$')
_DEFINE = re.compile(r"^\s*#define\s+(\w+)(?:\s+(.*?))?\s*(?://.*)?$")
_LOCATION = re.compile(r"\b0[:(](\d+)\)?")  # Mesa: 0:line(column), NVIDIA: 0(line)
MEMBERS: dict[type, str] = {
    moderngl.UniformBlock: "block",
    moderngl.Uniform: "uniform",
    moderngl.Attribute: "attribute",
}
FULLSCREEN = "common/fullscreen"


class ShaderError(Exception):
    """A shader that does not compile, link or bind: our mistake, with the file and line."""


@dataclass(frozen=True)
class Glsl:
    """GLSL that the host makes, to fill a slot in place of a file. name: in errors."""

    name: str
    text: str


def glsl_constant(path: str, name: str) -> float:
    """A number that a shader declares, for the host to use too: ``const float NAME = 4.0;``."""
    text = (SHADERS / path).read_text(encoding="utf-8")
    found = re.search(rf"^const \w+ {name} = ([^;]+);", text, re.MULTILINE)
    assert found, f"app/shaders/{path} declares no constant {name}"
    return float(found[1])


class ShaderLibrary:
    """Compiles programs by name: ``render/pick`` is ``pick.vert.glsl`` (or a shared one, by default the full-screen triangle) and
    ``pick.frag.glsl``. Keeps what it has compiled; ``reload`` compiles all again and keeps the last good program."""

    def __init__(self, ctx: moderngl.Context, root: Path = SHADERS) -> None:
        self._ctx = ctx
        self._root = root
        self._programs: dict[tuple[object, ...], moderngl.Program] = {}
        self._empty: dict[int, moderngl.VertexArray] = {}
        self.generation = 0  # counts reloads: holders of vertex arrays rebuild when it moves
        self.compiled = 0  # programs so far, those of reloads as well

    def program(
        self,
        name: str,
        defines: Mapping[str, object] | None = None,
        slots: Mapping[str, str | Glsl] | None = None,
        vertex: str = FULLSCREEN,
    ) -> moderngl.Program:
        """The program ``name`` with these defines and slots; vertex: the shader to take if it has none of its own. Raises
        ShaderError."""
        key = (name, tuple(sorted((defines or {}).items())), tuple(sorted((slots or {}).items())), vertex)
        if key not in self._programs:
            self._programs[key] = self._compile(name, defines or {}, slots or {}, vertex)
        return self._programs[key]

    def attributeless(self, program: moderngl.Program) -> moderngl.VertexArray:
        """A vertex array without buffers: the vertex shader makes its vertices from ``gl_VertexID``."""
        if program.glo not in self._empty:
            self._empty[program.glo] = self._ctx.vertex_array(program, [])
        return self._empty[program.glo]

    def reload(self) -> None:
        """Compile every program again from disk. Raises ShaderError and changes nothing if one fails, or if its names or types
        are others: what draws with it binds those that it had."""
        fresh: dict[tuple[object, ...], moderngl.Program] = {}
        try:
            for key, known in self._programs.items():
                fresh[key] = self._compile(key[0], dict(key[1]), dict(key[2]), key[3])  # type: ignore[arg-type, call-overload]
                _check_same_names(str(key[0]), _names(known), _names(fresh[key]))
        except ShaderError:
            for program in fresh.values():
                program.release()
            raise
        self.release()
        self._programs = fresh
        self.generation += 1

    def release(self) -> None:
        for vertex_array in self._empty.values():
            vertex_array.release()
        for program in self._programs.values():
            program.release()
        self._empty.clear()
        self._programs.clear()

    def _compile(
        self, name: str, defines: Mapping[str, object], slots: Mapping[str, str | Glsl], shared: str
    ) -> moderngl.Program:
        own = self._root / f"{name}.vert.glsl"
        vertex = f"{name if own.exists() else shared}.vert.glsl"
        unused = set(defines)
        stages = [Source(self._root, stage, defines, slots, unused) for stage in (vertex, f"{name}.frag.glsl")]
        if missing := stages[0].missing + stages[1].missing:
            raise ShaderError(missing[0])
        if unused:
            raise ShaderError(f"{name}: no shader declares #define {', '.join(sorted(unused))}")
        try:
            program = self._ctx.program(vertex_shader=stages[0].text, fragment_shader=stages[1].text)
        except moderngl.Error as error:
            message = str(error)
            raise ShaderError(stages["vertex_shader" not in message].explain(message)) from None
        self.compiled += 1
        return program


def _names(program: moderngl.Program) -> dict[str, tuple[object, ...]]:
    """What a program binds: name -> kind, type, and length or size."""
    names: dict[str, tuple[object, ...]] = {}
    for name in program:
        member: Any = program[name]  # moderngl's stubs lack gl_type
        kind = MEMBERS.get(type(member))
        if kind == "block":
            names[name] = kind, member.size
        elif kind and not name.startswith("gl_"):
            names[name] = "texture" if name.startswith("t_") else kind, member.gl_type, member.array_length
    return names


def _check_same_names(program: str, before: dict[str, tuple[object, ...]], now: dict[str, tuple[object, ...]]) -> None:
    """Raise ShaderError, on one line, where a program does not bind what it did."""
    changes = [f"{kind} {name} is gone or no longer read" for name, (kind, *_) in before.items() if name not in now]
    changes += [f"{kind} {name} is new" for name, (kind, *_) in now.items() if name not in before]
    changes += [f"{now[n][0]} {n} is of another type" for n in now if n in before and now[n] != before[n]]
    if changes:
        raise ShaderError(f"{program}: {', '.join(changes)}; start glowtree again for that")


class Source:
    """One stage's text, flattened; remembers which line came from which file."""

    def __init__(
        self, root: Path, name: str, defines: Mapping[str, object], slots: Mapping[str, str | Glsl], unused: set[str]
    ) -> None:
        self._root, self._defines, self._slots, self._unused = root, defines, slots, unused
        self._included: set[str] = set()
        self.missing: list[str] = []  # defines that the host must give, and does not
        self._places = ["version"]  # file and line that each flattened line came from
        lines = [VERSION]
        self._flatten(name, self._read(name), lines)
        self.text = "\n".join(lines) + "\n"

    def _flatten(self, name: str, text: str, lines: list[str]) -> None:
        self._included.add(name)
        for number, line in enumerate(text.splitlines(), start=1):
            place = f"{name}:{number}"
            if include := _INCLUDE.match(line):
                self._include(include[1], include[2], place, lines)
                continue
            if (define := _DEFINE.match(line)) and define[1] in self._defines:
                self._unused.discard(define[1])
                value = self._defines[define[1]]
                line = f"#define {define[1]} {int(value) if isinstance(value, bool) else value}"
            elif define and not define[2]:
                self.missing.append(f"app/shaders/{place}: the host gives no {define[1]}")
            lines.append(line)
            self._places.append(place)

    def _include(self, path: str | None, slot: str | None, place: str, lines: list[str]) -> None:
        if slot is not None:
            if slot not in self._slots:
                raise ShaderError(f"app/shaders/{place}: nothing fills the slot <{slot}>")
            filling = self._slots[slot]
            if isinstance(filling, Glsl):
                if filling.name not in self._included:
                    self._flatten(filling.name, filling.text, lines)
                return
            path = filling
        assert path is not None
        if path in self._included:
            return
        if not (self._root / path).is_file():
            raise ShaderError(f"app/shaders/{place}: no file app/shaders/{path}")
        self._flatten(path, self._read(path), lines)

    def _read(self, path: str) -> str:
        try:
            return (self._root / path).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:  # an editor is just replacing it
            raise ShaderError(f"app/shaders/{path}: cannot be read: {error}") from None

    def explain(self, message: str) -> str:
        """The driver's message with its line numbers turned into file and line."""

        def place(match: re.Match[str]) -> str:
            line = int(match[1])
            return f"app/shaders/{self._places[line - 1]}" if line <= len(self._places) else match[0]

        return "\n".join(_LOCATION.sub(place, line, count=1) for line in message.splitlines())
