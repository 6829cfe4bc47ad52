"""The 64-bit reference against what is known exactly: catalogue formulas, closed rooms, the furnace."""

from __future__ import annotations

import numpy as np
import pytest

from app.errors import UserError
from app.reference.dense import form_factors, irradiance_at, solve_dense
from app.reference.form_factors import (
    parallel_rectangles,
    part_above_horizon,
    perpendicular_rectangles,
    point_to_polygon,
)
from app.reference.line_of_sight import visible
from app.reference.patches import make_patches, subdivide, texture_at
from app.scene.model import Material, Scene, Texture

EXACT = 1e-9  # closed forms in 64-bit floats: rounding of some hundred operations, and nothing else
UNIT_SQUARE = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]])  # front: +z


def quads_scene(quads, materials, material_ids=None):
    """A Scene of rectangles (n, 4, 3), each two triangles."""
    quads = np.asarray(quads, np.float64)
    count = len(quads)
    triangles = (4 * np.arange(count)[:, None, None] + [[0, 1, 2], [0, 2, 3]]).reshape(-1, 3)
    ids = np.repeat(np.zeros(count) if material_ids is None else material_ids, 2).astype(np.int32)
    return Scene(
        name="quads",
        positions=quads.reshape(-1, 3),
        triangles=triangles.astype(np.int32),
        material_ids=ids,
        object_ids=np.zeros(2 * count, np.int32),
        objects=("object",),
        materials=tuple(materials),
    )


def room(size=(1.0, 2.0, 3.0)):
    """The six walls (6, 4, 3) of a closed room, fronts inward: floor, ceiling, then the sides."""
    quads = []
    for axis in (1, 0, 2):
        for side in (0.0, 1.0):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            corners = np.zeros((4, 3))
            corners[:, axis] = side
            corners[:, u], corners[:, v] = (0, 1, 1, 0), (0, 0, 1, 1)
            quads.append(corners if side == 0.0 else corners[::-1])
    return np.array(quads) * size


@pytest.fixture
def rng():
    return np.random.default_rng(20)


def rotation(rng):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.linalg.det(q)


def area_mean(receiver, normal, polygon, n=64):
    """Mean of the point form factor over a unit-square receiver given as a function of (u, v) in (0, 1)²."""
    u, v = np.meshgrid((np.arange(n) + 0.5) / n, (np.arange(n) + 0.5) / n)
    points = receiver(u.ravel(), v.ravel())
    return point_to_polygon(points, np.broadcast_to(normal, points.shape), polygon).mean()


# -- form factors ------------------------------------------------------------------------------------------------------


def test_catalogue_numbers():
    assert parallel_rectangles(1, 1, 1) == pytest.approx(0.199825, abs=5e-7)  # Howell C-11, to the digits printed
    assert perpendicular_rectangles(1, 1, 1) == pytest.approx(0.200044, abs=5e-7)  # Howell C-14
    # the rooms' rows: floor to ceiling and to four walls is everything
    a, b, h = 2.0, 3.0, 1.5
    walls = 2 * perpendicular_rectangles(h, b, a) + 2 * perpendicular_rectangles(h, a, b)
    assert parallel_rectangles(a, b, h) + walls == pytest.approx(1, abs=EXACT)


@pytest.mark.parametrize(("a", "b", "c"), [(1, 1, 1), (1, 3, 0.5), (0.2, 0.4, 2)])
def test_parallel_rectangles_by_points(a, b, c):
    polygon = UNIT_SQUARE[::-1] * [a, b, 0] + [0, 0, c]  # front: -z
    mean = area_mean(lambda u, v: np.stack([a * u, b * v, 0 * u], -1), [0.0, 0.0, 1.0], polygon)
    # a 64² midpoint rule on a smooth function: its error falls with the cell's area over the distance²
    assert mean == pytest.approx(parallel_rectangles(a, b, c), rel=(max(a, b) / 64 / c) ** 2)


@pytest.mark.parametrize(("h", "w", "edge"), [(1, 1, 1), (2, 1, 3), (0.3, 1, 1)])
def test_perpendicular_rectangles_by_points(h, w, edge):
    polygon = np.array([[0, 0, 0], [0, edge, 0], [0, edge, h], [0, 0, h]], float)  # front: +x
    mean = area_mean(lambda u, v: np.stack([w * u, edge * v, 0 * u], -1), [0.0, 0.0, 1.0], polygon)
    # F jumps from 1/2 to 0 at the edge's ends only: the midpoint rule is off by half a cell there
    assert mean == pytest.approx(perpendicular_rectangles(h, w, edge), rel=0.5 / 64)


def test_polygon_behind_or_in_plane_or_turned_away_counts_nothing():
    points = np.array([[0.3, 0.4, -1.0], [0.3, 0.4, 0.0], [5.0, 0.0, 0.0], [0.3, 0.4, 1.0], [0.3, 0.4, 1.0]])
    normals = np.array([[0, 0, 1.0], [0, 0, 1.0], [0, 0, 1.0], [0, 0, 1.0], [0, 0, -1.0]])
    factors = point_to_polygon(points, normals, UNIT_SQUARE)
    assert (factors[:4] == 0.0).all()  # behind its front; within it; in its plane; it lies behind the point
    assert factors[4] > 0.2


def test_closed_box_is_everything_around_any_point_and_normal(rng):
    walls = room()
    points = rng.uniform(0.05, 0.95, (200, 3)) * [1, 2, 3]
    normals = rng.normal(size=(200, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    sums = point_to_polygon(points[:, None], normals[:, None], walls).sum(axis=1)  # most walls cross the horizon
    np.testing.assert_allclose(sums, 1.0, atol=EXACT)


def test_splitting_and_moving_a_polygon_changes_nothing(rng):
    triangle = rng.normal((0.0, 0.0, 2.0), size=(3, 3))
    triangle = triangle if np.linalg.det(triangle) < 0 else triangle[::-1]  # front towards the origin
    normal = np.array([0.0, 0.6, 0.8])
    whole = point_to_polygon(np.zeros(3), normal, triangle)
    assert whole > 0.01
    parts = point_to_polygon(np.zeros(3), normal, subdivide(triangle, 5)).sum()
    turn, shift = rotation(rng), rng.normal(size=3)
    moved = point_to_polygon(shift, turn @ normal, triangle @ turn.T + shift)
    assert parts == pytest.approx(whole, abs=EXACT)
    assert moved == pytest.approx(whole, abs=EXACT)


def test_target_of_a_clipped_polygon_is_above_the_horizon_and_inside(rng):
    polygon = np.array([[1.0, -1, -3], [1, 1, -3], [1, 1, 1], [1, -1, 1]])
    target = part_above_horizon(np.zeros(3), np.array([0, 0, 1.0]), polygon)
    np.testing.assert_allclose(target, [1, 0, 0.5], atol=EXACT)
    np.testing.assert_allclose(part_above_horizon(np.zeros(3), np.array([1.0, 0, 0]), polygon), [1, 0, -1], atol=EXACT)


# -- visibility --------------------------------------------------------------------------------------------------------


def test_visibility_through_and_beside_a_wall(rng):
    wall = UNIT_SQUARE[[[0, 1, 2], [0, 2, 3]]]
    across = rng.uniform(-0.5, 1.5, (500, 2))
    starts, ends = np.c_[across, np.full(500, -1.0)], np.c_[across, np.full(500, 2.0)]
    inside = ((across > 0) & (across < 1)).all(axis=1)
    np.testing.assert_array_equal(visible(starts, ends, wall), ~inside)
    np.testing.assert_array_equal(visible(ends, starts, wall), ~inside)  # both sides block


def test_visibility_at_seams_and_ends():
    wall = UNIT_SQUARE[[[0, 1, 2], [0, 2, 3]]]
    diagonal = np.linspace(0.01, 0.99, 99)
    starts = np.stack([diagonal, diagonal, np.full(99, 1.0)], -1)
    assert not visible(starts, starts - [0, 0, 2.0], wall).any()  # through the shared edge
    on_wall = starts - [0, 0, 1.0]
    assert visible(on_wall, starts, wall).all()  # what lies at an end does not block
    assert visible(starts, on_wall, wall).all()
    assert visible(on_wall[:-1], on_wall[1:], wall).all()  # nor what contains the segment


# -- patches -----------------------------------------------------------------------------------------------------------


def test_patches_tile_the_scene():
    scene = quads_scene(room(), [Material("wall", double_sided=True)])
    patches = make_patches(scene, 400)
    assert 200 <= len(patches.triangle) <= 400
    for back in (False, True):
        side = patches.back == back
        area = np.bincount(patches.triangle[side], patches.areas[side])
        np.testing.assert_allclose(area, scene.normals_areas[1], rtol=EXACT)
        normals = scene.normals_areas[0][patches.triangle[side]] * (-1 if back else 1)
        np.testing.assert_allclose(patches.normals[side], normals, atol=EXACT)


def test_too_many_triangles_are_refused():
    with pytest.raises(UserError, match=r"12 triangle sides: .* at most 10 patches"):
        solve_dense(quads_scene(room(), [Material("wall")]), max_patches=10)


@pytest.mark.parametrize(
    ("wrap", "expected"), [("repeat", [1, 0, 1, 0]), ("clamp", [0, 0, 1, 1]), ("mirror", [0, 0, 1, 1])]
)
def test_texture_lookup_wraps(wrap, expected):
    pixels = np.zeros((1, 2, 3), np.float32)
    pixels[0, 1] = 1
    texture = Texture("t", pixels, (wrap, wrap))
    u = np.array([-0.25, 0.25, 0.75, 1.25])
    np.testing.assert_array_equal(texture_at(texture, np.stack([u, 0 * u], -1))[:, 0], expected)


def test_textured_patches_have_their_mean():
    pixels = np.zeros((2, 2, 3), np.float32)
    pixels[0] = [1.0, 0.5, 0.25]  # the upper half, v < 1/2
    base = quads_scene([UNIT_SQUARE], [Material("m", (0.8, 0.8, 0.8), albedo_texture=Texture("t", pixels))])
    uv = np.float32([[0, 0], [1, 0], [1, 1], [0, 1]])[[[0, 1, 2], [0, 2, 3]]]
    scene = Scene(**{**vars(base), "uv0": uv})
    patches = make_patches(scene, 8)
    mean = (patches.albedo * patches.areas[:, None]).sum(axis=0)
    # 8² samples per patch: those on the border, a row of 16, may fall on either side
    np.testing.assert_allclose(mean, np.array([0.4, 0.2, 0.1]), rtol=1 / 16)
    assert patches.albedo[patches.centres[:, 1] > 2 / 3].max() == 0.0


# -- solutions ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rho", [0.3, 0.5, 0.9])
def test_furnace(rho):
    """In a closed room of one albedo and one emission, B = E / (1 - ρ) everywhere: rows of F sum to 1 exactly."""
    emission = (1.0, 0.5, 2.0)
    scene = quads_scene(room(), [Material("wall", (rho,) * 3, emission)])
    solution = solve_dense(scene, 108)
    np.testing.assert_allclose(solution.F.sum(axis=1), 1.0, atol=EXACT)
    expected = np.pi * np.array(emission) / (1 - rho)
    np.testing.assert_allclose(solution.B, np.broadcast_to(expected, solution.B.shape), rtol=EXACT / (1 - rho))
    points = np.array([[0.5, 0.0, 1.2], [0.01, 0.0, 0.01]])
    normals = np.array([[0.0, 1.0, 0.0]] * 2)
    np.testing.assert_allclose(irradiance_at(solution, scene, points, normals), [expected] * 2, rtol=EXACT / (1 - rho))


def test_whole_walls_exchange_what_the_catalogue_says():
    """Area-weighted sums of the matrix over two walls of a unit cube against C-11 and C-14."""
    scene = quads_scene(room((1, 1, 1)), [Material("wall")])
    solution = solve_dense(scene, 192)
    areas, wall = solution.patches.areas, solution.patches.triangle // 2
    for other, exact in ((1, parallel_rectangles(1, 1, 1)), (2, perpendicular_rectangles(1, 1, 1))):
        rows = wall == 0
        share = (areas[rows, None] * solution.F[np.ix_(rows, wall == other)]).sum() / areas[rows].sum()
        assert share == pytest.approx(exact, rel=0.005)  # points 1/8 apart, as in the half-per-cent rule of the solvers


def test_reciprocity():
    """A_i F_ij = A_j F_ji: points on i against the whole of j, so the difference is that of the grid of points."""
    scene = quads_scene(room(), [Material("wall")])
    errors = []
    for samples in (1, 2, 4):
        solution = solve_dense(scene, 50, samples)
        exchange = solution.patches.areas[:, None] * solution.F
        errors.append(np.abs(exchange - exchange.T).sum() / exchange.sum())
    assert errors[2] < 0.03  # 16 points on each patch
    assert errors[2] < errors[1] < errors[0]


def test_shadow_and_sides():
    """A lamp over a table: dark below it, lit above; a one-sided lamp sends nothing up. Nothing reflects."""
    lamp = UNIT_SQUARE[:, [0, 2, 1]] + np.array([0, 2, 0])  # front: -y
    table = UNIT_SQUARE[:, [0, 2, 1]][::-1] * [4, 1, 4] + [-1.5, 1, -1.5]  # front: +y
    floor = table - [0, 1, 0]
    materials = [Material("lamp", (0.0,) * 3, (1.0,) * 3), Material("black", (0.0,) * 3)]
    scene = quads_scene([lamp, table, floor], materials, [0, 1, 1])
    assert scene.normals_areas[0][:, 1].round(9).tolist() == [-1, -1, 1, 1, 1, 1]
    solution = solve_dense(scene, 100)
    points = np.array([[0.5, 1.0, 0.5], [0.5, 0.0, 0.5], [0.5, 3.0, 0.5]])
    normals = np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]])
    H = irradiance_at(solution, scene, points, normals)[:, 0]
    # over the middle of a unit square at distance 1, four times the corner formula (C-4) for a half by a half
    corner = 2 / (2 * np.pi) * (0.5 / np.sqrt(1.25) * np.arctan(0.5 / np.sqrt(1.25)))
    assert H[0] == pytest.approx(np.pi * 4 * corner, rel=EXACT)
    assert H[1] == 0.0
    assert H[2] == 0.0  # its back is dark


def test_nothing_inside_a_closed_box_from_outside():
    outer, inner = room((4, 4, 4)), room((1, 1, 1)) + 1.5
    scene = quads_scene(
        np.concatenate([outer, inner]), [Material("w", (0.9,) * 3, (1.0,) * 3), Material("i")], [0] * 6 + [1] * 6
    )
    solution = solve_dense(scene, 200)
    assert (solution.H[solution.patches.triangle >= 12] == 0.0).all()


def test_what_lies_below_the_floor_neither_lights_nor_hides_the_rest():
    """A slab sees the upper part of a wall that goes on below it as if the lower part were not there."""
    platform = UNIT_SQUARE[:, [0, 2, 1]][::-1] * [4, 1, 4]
    underside = platform[::-1] - [0, 0.1, 0]
    factors = []
    for bottom in (-4.0, 0.0):
        wall = np.array([[3.0, bottom, 3.0], [3.0, 1.0, 3.0], [3.0, 1.0, 1.0], [3.0, bottom, 1.0]])  # front: -x
        scene = quads_scene([platform, underside, wall], [Material("m")])
        patches = make_patches(scene, 6)
        at = np.array([[1.0, 0.0, 2.0]])
        factors.append(form_factors(at, np.array([[0.0, 1.0, 0.0]]), patches, 1, scene).sum())
    assert factors[0] > 0.01
    assert factors[0] == pytest.approx(factors[1], rel=EXACT)


def test_no_row_hands_out_more_than_all_light():
    """Many small things in a closed room: what the grid gets wrong about visibility must not make light."""
    boards = [UNIT_SQUARE * [0.6, 0.6, 1] + [0.2 + 0.3 * i, 0.2 + 0.2 * i, 0.6 + 0.6 * i] for i in range(3)]
    scene = quads_scene(np.concatenate([room((2, 2, 3)), boards]), [Material("w", double_sided=True)])
    sums = solve_dense(scene, 60, 1).F.sum(axis=1)
    assert sums.max() == pytest.approx(1.0, abs=EXACT)  # some rows reach it, by being held to it
    assert (sums < 0.999).any()


def test_emitters_are_cut_finer():
    scene = quads_scene(room((2, 2, 2)), [Material("w"), Material("lamp", (0.0,) * 3, (1.0,) * 3)], [0, 1, 0, 0, 0, 0])
    patches = make_patches(scene, 300)
    lamp = patches.exitance[:, 0] > 0
    assert patches.areas[lamp].max() < patches.areas[~lamp].min() / 4


def test_scale_and_motion_change_nothing(rng):
    quads = np.concatenate([room((2, 2, 2)), [UNIT_SQUARE[:, [0, 2, 1]] * 0.7 + [0.6, 1.1, 0.7]]])
    materials = [Material("w", (0.6,) * 3), Material("lamp", (0.1,) * 3, (5.0,) * 3), Material("t", double_sided=True)]
    ids = [0, 1, 0, 0, 0, 0, 2]
    reference = solve_dense(quads_scene(quads, materials, ids), 60).B
    turn = rotation(rng)
    for scale, shift in ((1e-3, 0.0), (1e3, 0.0), (1.0, 100.0)):
        moved = solve_dense(quads_scene(quads @ turn.T * scale + shift, materials, ids), 60).B
        # A segment that grazes an edge to the last bit may change sides: none of them here does
        np.testing.assert_allclose(moved, reference, rtol=1e-6)
