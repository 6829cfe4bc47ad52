"""Every projection keeps its contract (visibility/projections/base.py): weights that sum to 1, maps that invert each other, and
pictures that show what a ray meets."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from solver_scenes import Solution, begin, table_room

from app.gpu import Gpu, Pass
from app.gpu.shader import SHADERS, ShaderLibrary
from app.scene.load import load_scene
from app.scene.model import F64
from app.solvers.shooting.records import BATCH, Shot
from app.visibility.occluders import halved, occluders
from app.visibility.projections import PROJECTIONS

# One fragment per texel of the map: its weight and direction; how far each pair of functions is from inverting the other
PROBE = """
#include <projection>
layout(location = 0) out vec4 out_weight;  // direction in the shooter's frame, delta form factor
layout(location = 1) out vec4 out_trip;    // px error, axes error, depth error, 1 where view and bounds are right
layout(location = 2) out vec4 out_four;    // of sights_dot and on_hemisphere: the largest error; if this texel is on it; px
const float DEPTH = 1.75;
void main() {
    vec2 px = gl_FragCoord.xy;
    int view = view_from_px(px);
    vec3 sight = sight_from_px(view, px), local = local_from_view(view, sight), point = DEPTH * sight;
    vec4 bounds = view_bounds_px(view);
    bool inside = all(greaterThan(px, bounds.xy)) && all(lessThan(px, bounds.zw));
    out_weight = vec4(normalize(local), delta_form_factor(view, px));
    const vec3 NORMAL = vec3(0.3, -0.5, -0.8);
    vec4 slopes = sights_dot(view, px, NORMAL), on = on_hemisphere(px);
    float error = 0.0;
    for (int k = 0; k < 4; ++k) {  // textureGather's order
        vec2 there = px + vec2(k == 1 || k == 2 ? 0.5 : -0.5, k < 2 ? 0.5 : -0.5);
        error = max(error, abs(slopes[k] - dot(sight_from_px(view, there), NORMAL)));
        error = max(error, abs(on[k] - float(delta_form_factor(view, there) > 0.0)));
    }
    out_four = vec4(error, on_hemisphere(px + 0.5).w, px);
    out_trip = vec4(distance(px_from_view(view, point), px), distance(view_from_local(view, local), sight),
                    abs(depth_from_view(point) - DEPTH), float(inside && view_from_direction(local) == view));
}
"""
RESOLUTIONS = (64, 256, 1024)


@pytest.fixture
def probe(gpu: Gpu, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Gpu]:
    """The context with a shader folder that has ``probe`` besides all others."""
    shutil.copytree(SHADERS, tmp_path / "shaders")
    (tmp_path / "shaders" / "probe.frag.glsl").write_text(PROBE)
    library = ShaderLibrary(gpu.ctx, tmp_path / "shaders")
    monkeypatch.setattr(gpu, "shaders", library)
    yield gpu
    library.release()


def probed(gpu: Gpu, name: str, resolution: int) -> tuple[F64, F64, F64]:
    """(texels, 4) each: what ``probe`` writes for every texel of the map."""
    projection = PROJECTIONS[name]
    size = projection.size(resolution)
    textures = [gpu.texture(size, 4, "f4") for _ in range(3)]
    target = gpu.target(*textures)
    Pass(gpu, "probe", defines={"RESOLUTION": resolution}, slots={"projection": projection.glsl}).draw(target)
    weight, trip, four = (np.frombuffer(t.read(), np.float32).reshape(-1, 4).astype(np.float64) for t in textures)
    gpu.release_all(target, *textures)
    return weight, trip, four


@pytest.mark.parametrize("resolution", RESOLUTIONS)
@pytest.mark.parametrize("name", PROJECTIONS)
def test_delta_form_factors_are_the_cosine_over_the_hemisphere(probe: Gpu, name: str, resolution: int) -> None:
    """Σ w = 1; and with x the direction, Σ w x = (0, 0, 2/3), Σ w x xᵀ = diag(1/4, 1/4, 1/2): moments of cosθ dω / π. A face
    that is turned, missing or twice there breaks them."""
    weight, _, four = probed(probe, name, resolution)
    direction, w = weight[:, :3], weight[:, 3]
    # the midpoint rule on texels of 2/R: its error falls with their area, 4/R², 1e-3 at R = 64
    error = max(4 / resolution**2, 1e-6)
    on = four[:, 1] == 1
    assert w[on].min() > 0 and direction[on, 2].min() > 0
    assert not w[~on].any() and (direction[~on, 2] <= 0).all()
    assert w.sum() == pytest.approx(1, abs=error)
    np.testing.assert_allclose(w @ direction, [0, 0, 2 / 3], atol=error)
    np.testing.assert_allclose((w[:, None] * direction).T @ direction, np.diag([0.25, 0.25, 0.5]), atol=error)


@pytest.mark.parametrize("resolution", RESOLUTIONS)
@pytest.mark.parametrize("name", PROJECTIONS)
def test_maps_invert_each_other(probe: Gpu, name: str, resolution: int) -> None:
    _, trip, four = probed(probe, name, resolution)
    on = four[:, 1] == 1
    px_error, axes_error, depth_error, right = trip[on].T
    # single precision, of numbers up to the map's edge; at the rim places move inward so far that a texel is left to look up
    moved = px_error > 3 * resolution * 2e-7
    assert px_error.max(initial=0) < 0.75
    off = np.hypot(*(four[on][moved, 2:] - resolution).T)
    assert (off > resolution - 0.75).all()
    assert axes_error.max() < 1e-6 and depth_error.max() < 1e-6
    assert right.min() == 1, f"{(right < 1).sum()} texels lie in another view than their direction"


@pytest.mark.parametrize("name", PROJECTIONS)
def test_the_four_samples_around_a_place(probe: Gpu, name: str) -> None:
    """The vector forms against the plain ones, texel by texel."""
    _, _, four = probed(probe, name, 64)
    inside = np.abs(four[:, 2:] % 32 - 16) < 15  # not in the next view, which may be half a face high
    assert four[inside.all(1), 0].max() < 1e-5


# -- pictures ----------------------------------------------------------------------------------------------------------

# Share of the hemisphere, weighted by its cosine, that may show another item than a ray meets: samples that lie on an edge. The
# stereographic map draws edges straight, see app/visibility/occluders.py.
WRONG = {"hemicube": 5e-4, "stereographic": 1e-3, "nonlinear": 5e-4}
CLOSE = (
    0.03  # solver space. A patch's middle inside of a block, or next to it: for this no straight edge is short enough
)
# The same at 64 px: a sample is twice as large as at the 128 px of WRONG
EDGES_OF_64 = 2 * WRONG["hemicube"]
SCENES = {"table": table_room, "cornell-box": lambda: load_scene("cornell-box")}


def met(corners: F64, sides: F64, origin: F64, rays: F64, own: int) -> tuple[F64, F64]:
    """Item and distance of the first side that each ray (n, 3) meets, [Moller97]; corners (m, 3, 3), sides (m, 2)."""
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal, offset = np.cross(u, v), origin - a
    slope = rays @ normal.T
    with np.errstate(divide="ignore", invalid="ignore"):
        t = -(offset * normal).sum(-1) / slope
        s = np.einsum("nk,mk->nm", rays, np.cross(v, offset)) / -slope
        r = np.einsum("nk,mk->nm", rays, np.cross(offset, u)) / -slope
        hit = (t > 1e-6) & (s >= 0) & (r >= 0) & (s + r <= 1) & ~(sides == own).any(1)
    t = np.where(hit, t, np.inf)
    first = t.argmin(1)
    at = np.arange(len(rays))
    item = sides[first, (slope[at, first] > 0).astype(int)]
    return np.where(np.isfinite(t[at, first]), item, 0.0), t[at, first]


def met_from(solution: Solution, shot: Shot, weight: F64) -> tuple[F64, F64]:
    """What rays from a shooter through every texel of its map meet: item and distance; weight: see ``probed``."""
    pool = solution.lightmap.pool
    vertices, triangles = occluders(pool, np.arange(len(pool.scene.triangles)))
    corners = vertices["in_position"][triangles].astype(np.float64)
    sides = vertices["in_sides"][triangles[:, 2]]
    record = {name: shot.record[name].astype(np.float64) for name in ("origin", "normal", "edge_u", "facet")}
    normal, u = record["normal"], record["edge_u"]
    u = u - normal * (u @ normal)
    u /= np.linalg.norm(u)
    rays = weight[:, :3] @ np.stack([u, np.cross(normal, u), normal])
    return met(corners, sides, record["origin"], rays, int(record["facet"]))


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("name", PROJECTIONS)
def test_map_shows_what_a_ray_meets(probe: Gpu, name: str, scene: str) -> None:
    resolution = 128
    solution = begin(probe, SCENES[scene](), texels=1500, projection=name, resolution=resolution, level=3)
    weight, _, _ = probed(probe, name, resolution)
    solution.light_up()
    wrong, off = [], []
    for x, y in solution.patches()[::5]:
        solver = solution.solver
        shot = solver.audit((int(x), int(y))).shot
        item, distance = met_from(solution, shot, weight)
        seen = solver.sight(shot)
        shown, depth = (np.frombuffer(seen[k].read(), np.float32) for k in ("items", "depth"))
        share = weight[shown != item, 3].sum()
        if distance.min() < CLOSE:
            assert share < 0.2
            continue
        wrong.append(share)
        right = (shown == item) & (item > 0) & (weight[:, 3] > 0)
        # depth of the hemicube is that along a view's axis
        scale = np.abs(weight[:, :3]).max(1) if name == "hemicube" else 1.0
        off.append(np.abs(2 * depth / (distance * scale) - 1)[right])
    assert len(wrong) > 5
    assert np.mean(wrong) < WRONG[name]
    # DEPTH_SLACK of visibility/visible.glsl, but for a few samples that graze a surface
    assert np.quantile(np.concatenate(off), 0.999) < 1 / 16384
    solution.release()


# -- looking into it ---------------------------------------------------------------------------------------------------


def test_inspect_shows_what_the_last_shot_saw(probe: Gpu) -> None:
    """Before the first one, after a step of several maps, while earlier shots are made again, and with another projection."""
    solution = begin(
        probe, table_room(), density=4.0, adaptive=True, level=1, resolution=64, depth=0, gradient=0.1, residual=0.2
    )
    solver = solution.solver

    def share_wrong() -> float:
        weight, _, _ = probed(probe, solver.options.projection, 64)
        item, _ = met_from(solution, solver.last_shot, weight)
        return float(weight[np.frombuffer(solver.sight()["items"].read(), np.float32) != item, 3].sum())

    assert not np.frombuffer(solver.sight()["items"].read(), np.float32).any() and solver.vanished() == 0
    solution.settle()
    assert share_wrong() < EDGES_OF_64
    solution.refine(depth=1)
    while solver.batch.replay.under_way is None:
        solution.step(BATCH)
        solver.poll()
    solver.poll(wait=True)
    assert share_wrong() < EDGES_OF_64
    solver.set_options(solver.options.replace(projection="nonlinear"))
    assert share_wrong() < EDGES_OF_64
    solution.release()


def test_inspecting_a_shot_under_way_leaves_its_light_alone(gpu: Gpu) -> None:
    light = []
    for looked_at in (False, True):
        solution = begin(gpu, table_room(), texels=2000, resolution=64)
        solution.shoot(4)
        assert solution.solver.last_shot is not None
        for _ in range(4):
            for _ in solution.solver.work(1, 3):
                if looked_at:
                    solution.solver.sight()
                    solution.solver.vanished()
        light.append(solution.H)
        solution.release()
    np.testing.assert_array_equal(*light)


# -- short edges -------------------------------------------------------------------------------------------------------


def test_halved_triangles_still_fit_together(rng: np.random.Generator) -> None:
    """A closed box of triangles: pieces are short, keep its area, and every edge is still that of two of them."""
    scene = load_scene("furnace")
    corners = scene.corners.astype(np.float32)
    corners += rng.normal(0, 0.05, 3).astype(np.float32)
    pieces, parent = halved(corners, 0.1)
    edges = np.roll(pieces, -1, axis=1) - pieces
    assert np.linalg.norm(edges, axis=-1).max() <= 0.1

    def areas(triangles: F64) -> F64:
        return (
            np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1) / 2
        )

    # in single precision, of corners up to 1
    np.testing.assert_allclose(np.bincount(parent, areas(pieces.astype(np.float64))), areas(corners), rtol=1e-4)
    _, point = np.unique(pieces.reshape(-1, 3), axis=0, return_inverse=True)
    ends = np.sort(
        np.stack([point.reshape(-1, 3), np.roll(point.reshape(-1, 3), -1, axis=1)], -1).reshape(-1, 2), axis=1
    )
    assert (np.unique(ends, axis=0, return_counts=True)[1] == 2).all()
