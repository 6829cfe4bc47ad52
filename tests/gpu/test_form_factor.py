"""Form factors on the GPU against Lambert's closed form in 64-bit floats, and against the catalogue."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from solver_scenes import UNIT_SQUARE, begin, grey, quads_scene

from app.gpu import Gpu, Pass
from app.gpu.shader import SHADERS, ShaderLibrary
from app.reference.form_factors import parallel_rectangles, perpendicular_rectangles, point_to_polygon
from app.scene.model import F64
from app.solvers.shooting.records import RECORDS

PROBE = """
#include "common/atlas.glsl"
#include "solvers/shooting/shooter.glsl"
#include "solvers/shooting/form_factor.glsl"
uniform sampler2D t_position;
uniform sampler2D t_normal;
uniform vec3 u_edge_u;
uniform vec3 u_edge_v;
layout(location = 0) out vec4 out_factor;
void main() {
    ivec2 px = ivec2(gl_FragCoord.xy);
    Shooter s;
    s.centre = vec3(0.0);
    s.normal = normalize(cross(u_edge_u, u_edge_v));
    s.edge_u = u_edge_u;
    s.edge_v = u_edge_v;
    s.area = length(cross(u_edge_u, u_edge_v));
    out_factor = vec4(form_factor(texelFetch(t_position, px, 0).xyz, texelFetch(t_normal, px, 0).xyz, s));
}
"""
EDGES = ([0.2, 0.0, 0.0], [0.05, 0.1, 0.0])  # a parallelogram about the origin that faces +z
LONGEST = 0.2


@pytest.fixture
def probe(gpu: Gpu, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Gpu]:
    """The context with a shader folder that has ``probe`` besides all others."""
    shutil.copytree(SHADERS, tmp_path / "shaders")
    (tmp_path / "shaders" / "probe.frag.glsl").write_text(PROBE)
    library = ShaderLibrary(gpu.ctx, tmp_path / "shaders")
    monkeypatch.setattr(gpu, "shaders", library)
    yield gpu
    library.release()


def factors(gpu: Gpu, positions: F64, normals: F64, **defines: object) -> F64:
    """(n,) F from each receiver to the parallelogram of EDGES."""
    inputs = [
        gpu.texture((len(a), 1), 4, "f4", np.float32(np.c_[a, a[:, :1] * 0]).tobytes()) for a in (positions, normals)
    ]
    output = gpu.texture((len(positions), 1), 4, "f4")
    target = gpu.target(output)
    Pass(gpu, "probe", defines=defines, slots=RECORDS).draw(
        target,
        textures=dict(zip(("t_position", "t_normal"), inputs, strict=True)),
        uniforms=dict(zip(("u_edge_u", "u_edge_v"), EDGES, strict=True)),
    )
    out = np.frombuffer(output.read(), np.float32).reshape(-1, 4)[:, 0].astype(np.float64)
    gpu.release_all(target, output, *inputs)
    return out


def exact(positions: F64, normals: F64) -> F64:
    u, v = np.array(EDGES) / 2
    return point_to_polygon(positions, normals, np.array([-u - v, u - v, u + v, v - u]))


def directions(rng: np.random.Generator, count: int) -> F64:
    d = rng.normal(size=(count, 3))
    return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))


def test_near_field_is_the_closed_form(probe: Gpu, rng: np.random.Generator) -> None:
    """Receivers all around, also below the plane, in front of the face's middle and with the horizon across it."""
    positions = directions(rng, 4000) * LONGEST * rng.uniform(0.05, 2.8, (4000, 1))
    normals = directions(rng, 4000)
    F, truth = factors(probe, positions, normals, NEAR_FIELD=True), exact(positions, normals)
    # single precision: each edge's angle is good to some 2^-23, and atan in the driver to about 1e-6
    np.testing.assert_allclose(F, truth, atol=1e-5)
    assert (truth == 0).sum() > 500 and (truth > 0.2).sum() > 100
    assert F.min() >= 0


def test_horizon_cuts_the_polygon(probe: Gpu) -> None:
    """Receivers whose own plane cuts the polygon: of one that stands on edge at its middle line, half is seen."""
    height, turn = 0.05, np.radians(np.arange(0, 360, 7.5))
    positions = np.tile([0.0, 0.0, height], (len(turn), 1))
    normals = np.stack([np.cos(turn), np.sin(turn), 0 * turn], 1)
    F, truth = factors(probe, positions, normals, NEAR_FIELD=True), exact(positions, normals)
    assert truth.min() > 0.1
    np.testing.assert_allclose(F, truth, atol=1e-5)  # as above
    # turned by half a circle it sees the other half; the polygon is symmetric about its centre
    np.testing.assert_allclose(F, np.roll(F, len(F) // 2), atol=1e-5)


@pytest.mark.parametrize(
    ("ratio", "error", "bias"), [(8, 1.5e-3, 1e-4), (128, 2e-3, 2e-4)], ids=["four points", "one point"]
)
def test_far_field_switches(probe: Gpu, rng: np.random.Generator, ratio: int, error: float, bias: float) -> None:
    """Just beyond each switch, √ratio longest edges away, where far_field.glsl states its errors: on average, weighted as light
    is (F is the weight), and in sum. On the near side of the first the closed form is used, which it meets there."""
    away = LONGEST * np.sqrt(ratio)
    sky = directions(rng, 16000)
    sky[:, 2] = np.abs(sky[:, 2])
    positions, normals = sky * away * 1.0001, directions(rng, 16000)
    normals *= -np.sign((normals * sky).sum(1))[:, None]  # all look towards the shooter
    truth = exact(positions, normals)
    F = factors(probe, positions, normals, NEAR_FIELD=False)
    assert np.abs(F - truth).sum() / truth.sum() < error
    assert abs(F.sum() / truth.sum() - 1) < bias
    before = factors(probe, positions / 1.001, normals, NEAR_FIELD=ratio == 8)
    after = exact(positions / 1.001, normals)
    # closer by a hair, the finer rule: at least ten times better
    assert np.abs(before - after).sum() / after.sum() < 0.1 * np.abs(F - truth).sum() / truth.sum()


def test_discs_approach_the_polygon(probe: Gpu, rng: np.random.Generator) -> None:
    """[Coombe03, eq. 2]: from one disc to 8 × 8 the error falls at every step; near the patch one disc is far off."""
    positions = np.c_[rng.uniform(-0.2, 0.2, (1000, 2)), rng.uniform(0.05, 0.2, 1000)]
    normals = directions(rng, 1000)
    truth = exact(positions, normals)
    counts = (1, 2, 4, 8)
    errors = [np.abs(factors(probe, positions, normals, DISC=True, DISC_SUBDIVISION=m) - truth).mean() for m in counts]
    assert errors == sorted(errors, reverse=True)
    assert errors[0] > 0.1 * truth.mean()
    assert errors[3] < 0.01 * truth.mean()  # 64 pieces of 1/40 of the edge: second order in their size


# -- the catalogue, through a whole shot -------------------------------------------------------------------------------

FACING = np.add(UNIT_SQUARE[::-1], [0.0, 0.0, 1.0])
STANDING = np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])  # on an edge, faces +x


@pytest.mark.usefixtures("undivided")
@pytest.mark.parametrize(("level", "density"), [(2, 32), (4, 16)], ids=["64 patches", "whole square"])
@pytest.mark.parametrize(
    ("other", "expected"),
    [(FACING, parallel_rectangles(1, 1, 1)), (STANDING, perpendicular_rectangles(1, 1, 1))],
    ids=["facing", "perpendicular"],
)
def test_unit_squares(gpu: Gpu, other: F64, expected: float, level: int, density: int) -> None:
    """F = 0.1998 and 0.2000 [Howell C-11, C-14] from all patches of one square to the texels of the other, both ways."""
    solution = begin(gpu, quads_scene([UNIT_SQUARE, other], [grey(0.5, 1.0)]), density=density, level=level)
    audits = solution.audits()
    area = sum(a.shot.area for a in audits)
    F = sum(a.received * a.shot.area for a in audits) / area
    # the midpoint rule on 16 texels, second order in their width: 0.06 %
    assert F == pytest.approx(expected, rel=0.005)
    assert area == pytest.approx(2, rel=1e-5)
    if level == 2:  # the rest leaves, as small patches see it from their middle
        left = sum(a.open * a.shot.area for a in audits) / area
        assert F + left == pytest.approx(1, abs=0.005)
    solution.release()


@pytest.mark.usefixtures("undivided")
@pytest.mark.parametrize("discs", [1, 4])
def test_unit_squares_by_discs(gpu: Gpu, discs: int) -> None:
    """The papers' discs reach the shot: one for a patch of a quarter of the square is already within 2 % at this distance
    (the disc's own error is of second order in size over distance, 1/16), sixteen are within the closed form's 0.5 %."""
    scene = quads_scene([UNIT_SQUARE, FACING], [grey(0.5, 1.0)])
    solution = begin(gpu, scene, density=16, level=2, form_factor="disc", discs=discs)
    received = np.array([a.received for a in solution.audits()])  # patches of equal area
    assert received.mean() == pytest.approx(parallel_rectangles(1, 1, 1), rel=0.02 if discs == 1 else 0.005)
    solution.release()
