"""The loader joins files of shaders and says where one is wrong; passes bind by name."""

from __future__ import annotations

import contextlib
import gc
import re
from collections.abc import Iterator
from pathlib import Path

import moderngl
import numpy as np
import pytest

from app.gpu import Gpu, Mesh, Pass, ShaderError, ShaderLibrary
from app.gpu.shader import Source

FULLSCREEN = "void main() { gl_Position = vec4(0.0); }\n"


class Broken:
    """A shader folder of its own, one file by default."""

    def __init__(self, gpu: Gpu, root: Path) -> None:
        self.root, self.library = root, ShaderLibrary(gpu.ctx, root)
        self.write("common/fullscreen.vert.glsl", FULLSCREEN)

    def write(self, path: str, text: str) -> None:
        file = self.root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)


@pytest.fixture
def folder(gpu: Gpu, tmp_path: Path) -> Iterator[Broken]:
    broken = Broken(gpu, tmp_path)
    yield broken
    broken.library.release()


def test_a_file_is_included_once(folder: Broken) -> None:
    folder.write("half.glsl", "float half_of(float x) { return 0.5 * x; }\n")
    folder.write("quarter.glsl", '#include "half.glsl"\nfloat quarter_of(float x) { return half_of(half_of(x)); }\n')
    folder.write(
        "a.frag.glsl",
        '#include "half.glsl"\n#include "quarter.glsl"\n#include "half.glsl"\nuniform float u_x;\n'
        "layout(location = 0) out vec4 out_x;\nvoid main() { out_x = vec4(half_of(u_x) + quarter_of(u_x)); }\n",
    )
    folder.library.program("a")  # twice the same function would not compile
    text = Source(folder.root, "a.frag.glsl", {}, {}, set()).text
    assert text.count("float half_of") == text.count("float quarter_of") == 1
    assert text.index("float half_of") < text.index("float quarter_of")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ('#include "nowhere.glsl"', "app/shaders/a.frag.glsl:2: no file app/shaders/nowhere.glsl"),
        ("#include <slot>", "app/shaders/a.frag.glsl:2: nothing fills the slot <slot>"),
    ],
)
def test_an_include_that_leads_nowhere(folder: Broken, line: str, message: str) -> None:
    folder.write("a.frag.glsl", f"// a comment\n{line}\nvoid main() {{}}\n")
    with pytest.raises(ShaderError, match=re.escape(message)):
        folder.library.program("a")


def test_a_define_that_no_shader_declares(folder: Broken) -> None:
    folder.write("a.frag.glsl", "#define SIZE 1\nvoid main() {}\n")
    folder.library.program("a", {"SIZE": 2})
    with pytest.raises(ShaderError, match="a: no shader declares #define LENGTH"):
        folder.library.program("a", {"SIZE": 2, "LENGTH": 3})


def test_a_define_replaces_the_default(folder: Broken) -> None:
    folder.write("a.frag.glsl", "  #define ON 0\n#define SIZE 1\nvoid main() {}\n")
    text = Source(folder.root, "a.frag.glsl", {"ON": True, "SIZE": 7}, {}, set()).text
    assert "#define ON 1\n" in text and "#define SIZE 7\n" in text


@pytest.mark.parametrize("stage", ["vert", "frag"])
@pytest.mark.parametrize("kind", ["undeclared", "type"])
def test_an_error_names_the_included_file_and_its_line(folder: Broken, stage: str, kind: str) -> None:
    wrong = {"undeclared": "return x * nothing;", "type": "vec3 y = vec2(x); return y.x;"}[kind]
    folder.write("inner.glsl", f"// one\n// two\nfloat f(float x) {{ {wrong} }}\n")
    folder.write("outer.glsl", '// one\n#include "inner.glsl"\nfloat g(float x) { return f(x); }\n')
    good = {"vert": FULLSCREEN, "frag": "layout(location = 0) out vec4 c;\nvoid main() { c = vec4(1.0); }\n"}
    for name, text in good.items():
        folder.write(f"a.{name}.glsl", text if name != stage else '\n\n\n#include "outer.glsl"\n' + text)
    with pytest.raises(ShaderError, match=r"app/shaders/inner\.glsl:3\b"):
        folder.library.program("a")


def test_an_error_after_an_include_names_the_outer_line(folder: Broken) -> None:
    folder.write("inner.glsl", "float f(float x) { return x; }\n" + "// more\n" * 9)
    folder.write("a.frag.glsl", '#include "inner.glsl"\nvoid main() {\n    undeclared = 1.0;\n}\n')
    with pytest.raises(ShaderError, match=r"app/shaders/a\.frag\.glsl:3\b"):
        folder.library.program("a")


def test_reload_keeps_the_last_good_programs(folder: Broken) -> None:
    good = "layout(location = 0) out vec4 c;\nvoid main() { c = vec4(1.0); }\n"
    for name in ("a", "b"):
        folder.write(f"{name}.frag.glsl", good)
    before = [folder.library.program(name) for name in ("a", "b")]
    folder.write("b.frag.glsl", "void main() { wrong }\n")
    with pytest.raises(ShaderError, match=r"b\.frag\.glsl:1"):
        folder.library.reload()
    assert [folder.library.program(name) for name in ("a", "b")] == before
    assert folder.library.generation == 0
    folder.write("b.frag.glsl", good)
    folder.library.reload()
    assert folder.library.generation == 1
    assert folder.library.program("a") is not before[0]


COVERING = "void main() { gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 2 * (gl_VertexID & 2) - 1, 0, 1); }\n"


LIT = """
uniform float u_gain;
uniform sampler2D t_map;
layout(location = 0) out vec4 c;
void main() { c = u_gain * texelFetch(t_map, ivec2(0), 0); }
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("u_gain * texel", "texel", "a: uniform u_gain is gone or no longer read; start glowtree again for that"),
        ("u_gain", "u_boost", "uniform u_gain is gone or no longer read, uniform u_boost is new"),
        ("void main", "uniform sampler2D t_more;\nvec4 more = texelFetch(t_more, ivec2(0), 0);\nvoid main", None),
        ("vec4(1)", "vec4(2)", None),
        ("float u_gain", "vec4 u_gain", "uniform u_gain is of another type"),
        ("c = u_gain", "c = texelFetch(t_more, ivec2(0), 0) + u_gain", "texture t_more is new"),
        ("sampler2D t_map", "usampler2D t_map", "texture t_map is of another type"),
    ],
)
def test_reload_refuses_other_names_and_keeps_the_last_good_programs(
    gpu: Gpu, folder: Broken, monkeypatch: pytest.MonkeyPatch, old: str, new: str, message: str | None
) -> None:
    """A shader that compiles, but binds other names than its pass gives: it would fail at the next draw."""
    monkeypatch.setattr(gpu, "shaders", folder.library)
    folder.write("a.vert.glsl", COVERING)
    folder.write("a.frag.glsl", LIT)
    lit = Pass(gpu, "a")
    texture = gpu.texture((4, 4), 4, "f4", np.full(64, 0.5, np.float32).tobytes())
    picture = gpu.texture((4, 4), 4, "f4")
    target = gpu.target(picture)

    def drawn() -> float:
        lit.draw(target, textures={"t_map": texture}, uniforms={"u_gain": 3.0})
        return float(np.frombuffer(picture.read(), np.float32)[0])

    assert drawn() == 1.5
    declared = "uniform sampler2D t_more;\n" if "t_more" in new else ""
    folder.write("a.frag.glsl", declared * ("void" not in old) + LIT.replace(old, new))
    if message is None:
        folder.library.reload()
    else:
        with pytest.raises(ShaderError, match=re.escape(message)):
            folder.library.reload()
        assert folder.library.generation == 0
    assert drawn() == 1.5
    gpu.release_all(target, picture, texture)


def test_a_file_that_is_gone_at_a_reload(folder: Broken) -> None:
    folder.write("a.frag.glsl", LIT)
    kept = folder.library.program("a")
    (folder.root / "a.frag.glsl").unlink()
    with pytest.raises(ShaderError, match=r"app/shaders/a\.frag\.glsl: cannot be read"):
        folder.library.reload()
    assert folder.library.program("a") is kept


def test_reloads_leave_nothing_behind(gpu: Gpu, folder: Broken, monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither programs nor vertex arrays, of reloads that succeed and of those that fail."""
    monkeypatch.setattr(gpu, "shaders", folder.library)
    folder.write("named.vert.glsl", "in vec3 in_position;\nvoid main() { gl_Position = vec4(in_position, 1.0); }\n")
    good = "layout(location = 0) out vec4 c;\nvoid main() { c = vec4(1.0); }\n"
    for name in ("named", "a", "b"):
        folder.write(f"{name}.frag.glsl", good)
    mesh, picture = Mesh(gpu, bytes(36), {"in_position": "3f"}), gpu.texture((4, 4), 4, "f4")
    target = gpu.target(picture)
    passes = {name: Pass(gpu, name) for name in ("named", "a", "b")}

    def held() -> int:
        gc.collect()
        kinds = (moderngl.VertexArray, moderngl.Program)
        mine = (o for o in gc.get_objects() if isinstance(o, kinds) and o.ctx is gpu.ctx)
        return sum(not isinstance(o.mglo, moderngl.InvalidObject) for o in mine)

    gc.collect()
    mode, gpu.ctx.gc_mode = gpu.ctx.gc_mode, "context_gc"  # keeps what was forgotten without being released
    gpu.ctx.objects.clear()
    counts = []
    for k in range(8):
        folder.write("b.frag.glsl", "void main() { wrong }\n" if k % 4 == 1 else good)
        with contextlib.suppress(ShaderError):
            folder.library.reload()
        for name, draws in passes.items():
            draws.draw(target, mesh=mesh if name == "named" else None)
        counts.append(held())
    gc.collect()
    forgotten = [o for o in gpu.ctx.objects if not isinstance(o, moderngl.InvalidObject)]
    gpu.ctx.gc_mode = mode
    gpu.ctx.objects.clear()
    assert folder.library.generation == 6
    assert len(set(counts)) == 1, counts
    assert not forgotten
    gpu.release_all(target, picture, mesh)


NAMES = """
in vec3 in_position;
uniform float u_gain;
uniform sampler2D t_map;
layout(std140) uniform Block { vec4 u_offset; };
void main() { gl_Position = u_gain * vec4(in_position, 1.0) + texelFetch(t_map, ivec2(0), 0) + u_offset; }
"""


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"textures": ()}, "pass named needs texture t_map"),
        ({"textures": ("t_map", "t_more", "t_most")}, "pass named has no texture t_more, t_most"),
        ({"uniforms": ()}, "pass named needs uniform u_gain"),
        ({"uniforms": ("u_gain", "u_lost")}, "pass named has no uniform u_lost"),
        ({"blocks": ()}, "pass named needs block Block"),
        ({"blocks": ("Block", "Rock")}, "pass named has no block Rock"),
        ({"mesh": "in_colour"}, "mesh has no attribute in_position"),
        ({}, None),
    ],
)
def test_a_pass_refuses_names_it_lacks_and_asks_for_those_it_needs(
    gpu: Gpu, folder: Broken, monkeypatch: pytest.MonkeyPatch, change: dict[str, object], message: str | None
) -> None:
    folder.write("named.vert.glsl", NAMES)
    folder.write("named.frag.glsl", "layout(location = 0) out vec4 c;\nvoid main() { c = vec4(1.0); }\n")
    monkeypatch.setattr(gpu, "shaders", folder.library)
    texture, buffer = gpu.texture((4, 4), 4, "f4"), gpu.buffer(16)
    target = gpu.target(gpu.texture((4, 4), 4, "f4"))
    names = {"textures": ("t_map",), "uniforms": ("u_gain",), "blocks": ("Block",), "mesh": "in_position"} | change
    mesh = Mesh(gpu, bytes(36), {str(names.pop("mesh")): "3f"})
    values = {"textures": texture, "uniforms": 1.0, "blocks": (buffer, 0, 16)}
    given = {kind: dict.fromkeys(names[kind], values[kind]) for kind in values}  # type: ignore[call-overload]
    named = Pass(gpu, "named")
    if message is None:
        named.draw(target, mesh=mesh, **given)
    else:
        with pytest.raises(ShaderError, match=message):
            named.draw(target, mesh=mesh, **given)
    gpu.release_all(target, *target.color_attachments, texture, buffer, mesh)
