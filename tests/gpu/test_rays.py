"""Rays on the GPU meet what they meet in float64; none slips between two triangles."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from triangles import bare_pool, batch, met, unit

from app.atlas.parametrize import parametrize
from app.gpu import Gpu
from app.lightmap.tile_pool import TilePool
from app.scene import shapes
from app.scene.load import load_scene
from app.scene.model import F64
from app.visibility.bvh import build_bvh
from app.visibility.bvh_table import node_table
from app.visibility.rays import corners_of

ULP = 2.0**-24  # of a float32 near 1
ROUNDINGS = 16  # of a coordinate on its way through the shear, the edge functions and the weights


def soup(rng: np.random.Generator, count: int) -> F64:
    """(count, 3, 3): triangles of all sizes, anywhere in a box."""
    size = 10.0 ** rng.uniform(-2.5, 0.0, (count, 1, 1))
    return rng.uniform(-1, 1, (count, 1, 3)) + size * rng.normal(size=(count, 3, 3))


def pool_of(corners: F64) -> Any:
    return bare_pool(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def rounding(corners: F64, directions: F64, distance: F64) -> F64:
    """Bound (n,) of the error of distances to triangles (n, 3, 3): corners seen along a ray are rounded to ROUNDINGS ulp of
    what they are away, which weights feel by the height of the triangle as it is seen; depth changes with weights by its span."""
    a, b, c = np.moveaxis(corners, 1, 0)
    seen = np.abs((np.cross(b - a, c - a) * directions).sum(1))  # twice the area
    longest = np.linalg.norm([b - a, c - b, a - c], axis=2).max(0)
    reach = distance + longest
    return np.asarray(ROUNDINGS * ULP * reach * (1 + longest * longest / seen))


@pytest.mark.parametrize("plain", [0.0, 1e4])
@pytest.mark.parametrize("count", [4096, 1 << 17])
def test_rays_meet_what_they_meet_in_double_precision(
    gpu: Gpu, rng: np.random.Generator, count: int, plain: float
) -> None:
    """plain: size of a triangle under all others, beside which these are small."""
    triangles = soup(rng, 200)
    triangles[0] = np.array([[-1, -1, -1], [1, -1, -1], [0, 1, -1]]) * [plain or 1, plain or 1, 2]
    pool = pool_of(triangles)
    corners = corners_of(pool)
    assert node_table(build_bvh(corners))[1] == (plain == 0.0), "whole cells do not fit the boxes beside a plain"
    origins = rng.uniform(-0.7, 0.7, (count, 3)) / pool.space.scale * np.sqrt(3)
    origins = (origins - pool.space.centre / pool.space.scale).astype(np.float32).astype(np.float64)
    directions = unit(rng, count).astype(np.float32).astype(np.float64)
    with batch(gpu, pool, origins, directions) as rays:
        hits = rays.closest()
        assert ((hits.triangle >= 0) == rays.any()).all()
    wrong = 0
    for start in range(0, count, 1 << 14):
        some = slice(start, start + (1 << 14))
        distances, least = met(corners, origins[some], directions[some])
        rows = np.arange(len(distances))
        true, mine = distances.argmin(1), hits.triangle[some]
        nothing = ~np.isfinite(distances[rows, true])
        true[nothing] = -1
        differs = mine != true
        # Another triangle, or none, only at an edge or where two are equally near
        edge = np.minimum(np.abs(least[rows, true]), np.abs(least[rows, mine])) < 1e-4
        with np.errstate(invalid="ignore"):  # of none and none
            gap = distances[rows, mine] - distances[rows, true]
        bound = rounding(corners[true], directions[some], hits.distance[some])
        assert (~differs | edge | (gap < 2 * bound)).all()
        wrong += int(differs.sum())
        same = ~differs & ~nothing
        error = np.abs(hits.distance[some] - distances[rows, true])
        assert (error[same] <= bound[same]).all(), (error / bound)[same].max()
        normal = np.cross(corners[true, 1] - corners[true, 0], corners[true, 2] - corners[true, 0])
        assert ((normal * directions[some]).sum(1)[same] < 0)[hits.front[some][same]].all()
        assert ((normal * directions[some]).sum(1)[same] > 0)[~hits.front[some][same]].all()
        assert (hits.distance[some][nothing & ~differs] == 4.0).all()
    assert wrong <= max(2, 1e-4 * count)


@pytest.fixture(scope="module")
def ball() -> object:
    """A closed room of 20480 triangles, no two alike."""
    rng = np.random.default_rng(7)
    mesh = shapes.icosphere(1.0, 5)
    return bare_pool(mesh.positions * rng.uniform(0.9, 1.0, (len(mesh.positions), 1)), mesh.triangles)


@pytest.mark.parametrize("count", [1 << 16, 1 << 20])
def test_no_ray_leaves_a_closed_room(gpu: Gpu, rng: np.random.Generator, ball: object, count: int) -> None:
    """Rays at vertices, at edges, and anywhere."""
    corners = corners_of(ball)
    triangle = corners[rng.integers(len(corners), size=count)]
    along = np.where(np.arange(count) % 3 == 0, rng.choice([0.0, 0.5, 0.25], count), rng.random(count))[:, None]
    inside = np.where(np.arange(count) % 3 == 2, rng.random(count), 0.0)[:, None]
    aim = triangle[:, 0] + along * (triangle[:, 1] - triangle[:, 0])
    aim += inside * (triangle[:, 2] - aim)
    origins = 0.3 * unit(rng, count).astype(np.float32)
    directions = aim - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    with batch(gpu, ball, origins, directions) as rays:
        hits = rays.closest()
        assert (hits.triangle >= 0).all(), f"{(hits.triangle < 0).sum()} of {count} escaped"
        # a ray that leaves the room at a ridge may meet it again where rounding does not tell the two places apart
        assert (hits.distance > 0.2).all() and hits.front[2::3].mean() < 1e-5
        assert rays.any().all()


def cube(cells: int) -> tuple[F64, NDArray[np.int64]]:
    """A closed cube, each side of cells² squares."""
    lines = np.linspace(-1.0, 1.0, cells + 1)
    u, v = (x.reshape(-1) for x in np.meshgrid(lines, lines, indexing="ij"))
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).reshape(-1)
    quads = np.stack([corner, corner + cells + 1, corner + cells + 2, corner + 1], 1)
    positions, triangles = [], []
    for axis in range(3):
        for side in (-1.0, 1.0):
            side_points = np.zeros((len(u), 3))
            side_points[:, axis], side_points[:, axis - 2], side_points[:, axis - 1] = side, u, v
            first = len(positions) * len(u)
            positions.append(side_points)
            triangles += [quads[:, [0, 1, 2]] + first, quads[:, [0, 2, 3]] + first]
    return np.concatenate(positions), np.concatenate(triangles)


def test_rays_along_the_axes_in_the_planes_of_edges_and_walls(gpu: Gpu) -> None:
    """Zeros in the direction, origins in the planes of the boxes' sides: neither leaks nor NaN."""
    positions, triangles = cube(8)
    pool = bare_pool(positions, triangles)
    lines = np.unique(corners_of(pool))
    sides = build_bvh(corners_of(pool)).nodes[:, [1, 3], :3]  # upper ones of boxes
    lines = np.concatenate([lines, (lines[1:] + lines[:-1]) / 2, np.unique(sides[sides < lines[-1]]), [0.0, -0.0]])
    grid = np.stack(np.meshgrid(lines, lines, [0.0, -0.0, lines[3]], indexing="ij"), -1).reshape(-1, 3)
    for axis in range(3):
        origins = np.roll(grid, axis + 1, axis=1)  # the third coordinate is along the ray
        for zero, sign in ((0.0, 1.0), (-0.0, 1.0), (0.0, -1.0), (-0.0, -1.0)):
            directions = np.full_like(origins, zero)
            directions[:, axis] = sign
            with batch(gpu, pool, origins, directions) as rays:
                hits = rays.closest()
                reach = np.abs(sign * lines[8] - origins[:, axis])
                assert (hits.triangle >= 0).all(), f"{(hits.triangle < 0).sum()} escaped along {axis}, {sign}"
                np.testing.assert_allclose(hits.distance, reach, rtol=0, atol=4 * ULP)
                assert rays.any().all()


def test_coplanar_and_degenerate_triangles(gpu: Gpu, rng: np.random.Generator) -> None:
    """A wall of the same two triangles, a hundred times, with points and lines in it: it is met where it is, never at a line."""
    quad = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    wall = np.tile(quad[[[0, 1, 2], [0, 2, 3]]], (100, 1, 1))
    ends = rng.uniform(-1, 1, (100, 3, 3)) * [1, 1, 0]
    ends[:, 2] = ends[:, 1]
    ends[50:] = ends[50:, :1]
    deep = np.array([[[0.0, 0, -1], [0, 0, 1], [0, 0, 0.25]]])  # makes the scene as deep as it is wide
    corners = np.concatenate([ends, wall, deep])
    pool = pool_of(corners)
    aim = rng.uniform(-0.57, 0.57, (5000, 3)) * [1, 1, 0]
    aim[:2500] = corners_of(pool)[:100].reshape(-1, 3)[rng.integers(300, size=2500)]
    origins = np.column_stack([rng.uniform(-0.5, 0.5, (5000, 2)), rng.choice([-0.5, 0.5], 5000)])
    distance = np.linalg.norm(aim - origins, axis=1)
    with batch(gpu, pool, origins, (aim - origins) / distance[:, None]) as rays:
        hits = rays.closest()
    assert ((hits.triangle >= 100) & (hits.triangle < 300)).all()
    np.testing.assert_allclose(hits.distance, distance, rtol=0, atol=16 * ULP)
    assert (hits.front == (origins[:, 2] > 0)).all()


@pytest.mark.parametrize(("scale", "away"), [(1e-3, 0.0), (1e6, 0.0), (1.0, 1e6), (1e-3, 10.0)])
def test_neither_size_nor_place_of_the_scene_matters(
    gpu: Gpu, rng: np.random.Generator, scale: float, away: float
) -> None:
    corners = soup(rng, 200)
    origins, directions = rng.uniform(-0.5, 0.5, (4096, 3)), unit(rng, 4096)
    found = []
    for pool in (pool_of(corners), pool_of(corners * scale + away)):
        with batch(gpu, pool, origins, directions) as rays:
            found.append(rays.closest())
    # Rounding of the moved corners, in the solver space
    moved = 2 * (np.spacing(away + 4 * scale) / scale + ULP)
    same = found[0].triangle == found[1].triangle
    assert same.mean() > 0.999
    hit = same & (found[0].triangle >= 0)
    triangles = corners_of(pool_of(corners))[found[0].triangle[hit]]
    bound = rounding(triangles, directions[hit], found[0].distance[hit]) * (1 + moved / ULP)
    assert (np.abs(found[0].distance - found[1].distance)[hit] <= bound).all()


def test_a_thin_wall_is_met_on_the_near_side(gpu: Gpu, rng: np.random.Generator) -> None:
    """1e-5 of the scene's radius thick."""
    thick = 1e-5
    quad = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    half = np.array([0, 0, thick / 2])
    near, far = quad + half, quad[::-1] - half
    walls = np.concatenate([sheet[[[0, 1, 2], [0, 2, 3]]] for sheet in (near, far)])
    walls /= np.sqrt(2)  # radius 1
    pool = pool_of(walls)
    count = 20000
    aim = np.column_stack([rng.uniform(-0.7, 0.7, (count, 2)), np.zeros(count)])
    side = rng.choice([-1.0, 1.0], count)
    origins = np.column_stack([rng.uniform(-0.7, 0.7, (count, 2)), 10 ** rng.uniform(-3, 0, count) * side])
    directions = (aim - origins) / np.linalg.norm(aim - origins, axis=1, keepdims=True)
    steep = np.abs(directions[:, 2]) > 0.01
    with batch(gpu, pool, origins[steep], directions[steep]) as rays:
        hits = rays.closest()
    assert hits.front.all()
    assert ((hits.triangle < 2) == (side[steep] > 0)).all()


def test_hits_count_between_nearest_and_farthest(gpu: Gpu) -> None:
    sheets = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]]) + np.array([[[0, 0, z]] for z in (-0.5, 0, 0.5)])
    pool = pool_of(sheets)
    depths = corners_of(pool)[:, 0, 2] + 1
    origins, directions = np.array([[0.0, 0, -1]]), np.array([[0.0, 0, 1]])
    spans = {(0.0, 4.0): 0, (depths[0] + 1e-3, 4.0): 1, (0.0, depths[0] - 1e-3): -1, (depths[2] + 1e-3, 4.0): -1}
    for (nearest, farthest), triangle in spans.items():
        with batch(gpu, pool, origins, directions, nearest, farthest) as rays:
            assert rays.closest().triangle[0] == triangle
            assert rays.any()[0] == (triangle >= 0)


def test_a_hit_knows_its_place_in_the_atlas(gpu: Gpu, rng: np.random.Generator) -> None:
    """On the side that was hit; negative on a back that is black."""
    scene = load_scene("two-rooms")
    pool = TilePool(scene, parametrize(scene, texels=2000))
    corners = corners_of(pool)
    origins, directions = rng.uniform(-0.6, 0.6, (4096, 3)), unit(rng, 4096)
    with batch(gpu, pool, origins, directions) as rays:
        hits = rays.closest()
    uv = np.full((len(corners), 2, 3, 2), -1.0)
    uv[pool.charts.face_triangle, pool.charts.face_back.astype(int)] = pool.charts.face_uv
    met_one = hits.triangle >= 0
    triangle, weights = hits.triangle[met_one], hits.weights[met_one].astype(np.float64)
    weights = np.column_stack([1 - weights.sum(1), weights])
    place = (uv[triangle, (~hits.front[met_one]).astype(int)] * weights[..., None]).sum(1)
    np.testing.assert_allclose(hits.place[met_one], place, atol=pool.charts.size[0] * 8 * ULP)
    point = (corners[triangle] * weights[..., None]).sum(1)
    there = origins[met_one] + hits.distance[met_one, None] * directions[met_one]
    np.testing.assert_allclose(point, there, atol=1e-5)
    assert (place[:, 0] < 0).any() and (place[:, 0] > 0).any()


@pytest.mark.parametrize("count", [0, 1])
def test_few_triangles(gpu: Gpu, count: int) -> None:
    positions = np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]])
    pool = bare_pool(positions, np.array([[0, 1, 2]]))
    pool.scene.triangles = pool.scene.triangles[:count]
    with batch(gpu, pool, np.array([[0.0, 0, 1]]), np.array([[0.0, 0, -1]]), farthest=1e20) as rays:
        assert (rays.closest().triangle >= 0).sum() == rays.any().sum() == count
