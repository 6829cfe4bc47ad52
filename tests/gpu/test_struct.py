"""A record that host and shaders share is the same on both sides."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from app.gpu import Gpu, Pass, ShaderError, ShaderLibrary, Struct

RECORD = Struct("Record", "vec3 place, int edge", "vec2 mark", "float one, uint item, vec2 rest")
TWICE = """
#include <record>
uniform sampler2D t_records;
layout(location = 0) out vec4 out_row;
void main() {
    vec4 rows[RECORD_ROWS];
    for (int row = 0; row < RECORD_ROWS; ++row) rows[row] = texelFetch(t_records, ivec2(row, int(gl_FragCoord.y)), 0);
    Record record = record_from_rows(rows);
    record.place *= 2.0;
    record.edge += 1;
    record.item <<= 1;
    record.mark = record.mark.yx;
    out_row = record_row(record, int(gl_FragCoord.x));
}
"""


def records() -> np.ndarray:
    made = np.zeros(5, RECORD.dtype)
    rng = np.random.default_rng(3)
    for field in RECORD.fields:
        made[field.name] = rng.integers(-100, 100, made[field.name].shape)
    made["item"] = np.arange(5) + (1 << 22)
    return made


def test_what_a_shader_makes_of_records_is_read_by_name(
    gpu: Gpu, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "twice.frag.glsl").write_text(TWICE)
    (tmp_path / "cover.vert.glsl").write_text(
        "void main() { gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 2 * (gl_VertexID & 2) - 1, 0, 1); }\n"
    )
    monkeypatch.setattr(gpu, "shaders", ShaderLibrary(gpu.ctx, tmp_path))
    given = records()
    source = gpu.texture((8, 5), 4, "f4", RECORD.write(given, 8))
    made = gpu.texture((RECORD.rows, 5), 4, "f4")
    target = gpu.target(made)
    twice = Pass(gpu, "twice", slots={"record": RECORD.glsl}, vertex="cover")
    twice.draw(target, textures={"t_records": source})
    found = RECORD.read(made.read())
    np.testing.assert_array_equal(found["place"], 2 * given["place"])
    np.testing.assert_array_equal(found["edge"], given["edge"] + 1)
    np.testing.assert_array_equal(found["mark"], given["mark"][:, ::-1])
    np.testing.assert_array_equal(found["one"], given["one"])
    np.testing.assert_array_equal(found["item"], 2 * given["item"])
    np.testing.assert_array_equal(found["rest"], given["rest"])
    gpu.shaders.release()
    gpu.release_all(target, made, source)


def test_records_keep_what_they_hold_among_others() -> None:
    given = records()
    assert RECORD.dtype.itemsize == 3 * 16
    np.testing.assert_array_equal(RECORD.read(RECORD.write(given, 5), 5), given)
    np.testing.assert_array_equal(RECORD.read(RECORD.write(given)), given)


def test_a_row_holds_four_floats() -> None:
    with pytest.raises(AssertionError, match="row 1 of Wide holds 5 floats"):
        Struct("Wide", "vec4 first", "vec3 second, vec2 third")


def test_a_define_without_a_value_must_be_given(gpu: Gpu, tmp_path: Path) -> None:
    (tmp_path / "a.vert.glsl").write_text("void main() { gl_Position = vec4(0); }\n")
    (tmp_path / "a.frag.glsl").write_text(
        "#define COUNT  // things\nlayout(location = 0) out vec4 c;\nvoid main() { c = vec4(COUNT); }\n"
    )
    library = ShaderLibrary(gpu.ctx, tmp_path)
    with pytest.raises(ShaderError, match=r"a\.frag\.glsl:1: the host gives no COUNT"):
        library.program("a")
    library.program("a", {"COUNT": 3})
    library.release()
