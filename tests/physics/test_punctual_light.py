"""Lamps without area by every solver, against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from solver_scenes import Solution, begin, grey, quads_scene, room

from app.estimate.ray_gather import SHIFTS, RayGather
from app.gpu import Gpu
from app.reference.dense import irradiance_at, solve_dense
from app.scene.lights import Light
from app.scene.model import Scene

SOLVERS = ("shooting", "quadtrees", "gathering", "local")  # quadtrees: shooting on them
EVERY_SOLVER = pytest.mark.parametrize("solver", SOLVERS)
FLOOR = [[0, 0, 2], [2, 0, 2], [2, 0, 0], [0, 0, 0]]  # faces up
POINT = Light("point", intensity=(1.0, 2.0, 3.0), position=(0.8, 1.3, 0.9))
DOWN = (0.0, -1.0, 0.0)
SLANTED = (0.6, -0.8, 0.0)
SPOT = Light("spot", "spot", (5.0, 5.0, 5.0), (1.0, 1.5, 1.0), DOWN, 0.2, 0.7)


def solved(gpu: Gpu, scene: Scene, solver: str) -> Solution:
    known: dict[str, object] = {
        "shooting": {"density": 8},
        "quadtrees": {"density": 4, "adaptive": True},
        "gathering": {"density": 8, "smooth": False},
        "local": {"density": 8, "shadow_rays": 64},
    }
    method = "shooting" if solver == "quadtrees" else solver
    lit = begin(gpu, scene, solver=method, **known[solver])  # type: ignore[arg-type]
    if solver == "gathering":
        lit.gather(64)
    else:
        lit.settle()
    return lit


@EVERY_SOLVER
@pytest.mark.parametrize(
    "light",
    [
        POINT,
        replace(POINT, range=2.0),
        replace(POINT, radius=0.2),
        replace(POINT, position=(1.0, 9.0, 3.0)),  # farther than the scene is wide
        SPOT,
        Light("sun", "directional", (1.0, 2.0, 3.0), direction=SLANTED),
        Light("disc", "directional", (1.0, 2.0, 3.0), direction=SLANTED, angle=0.1),
    ],
    ids=lambda light: f"{light.name}-{light.position[1]:g}-{light.range:g}-{light.radius:g}",
)
def test_an_open_floor_receives_what_the_law_says(gpu: Gpu, solver: str, light: Light) -> None:
    """E = I(ω) w cos θ / d², or E cos θ from afar, and the books count what is sent out."""
    scene = quads_scene([FLOOR], [grey(0.0)]).with_lights((light,))
    lit = solved(gpu, scene, solver)
    expected = light.irradiance(lit.position, lit.normal)
    # over a texel of 1/8 m a spot's falloff bends by 2 % of its most, cos θ / d² by less than a hundredth
    assert np.abs(lit.H - expected).max() < 0.02 * expected.max()
    arrived = (lit.H * lit.area[:, None]).sum(0)
    sent = np.array(light.intensity) * (4 * 0.8 if light.from_afar else light.solid_angle)
    assert np.allclose(lit.book.emitted, sent, rtol=5e-3)
    assert np.allclose(lit.book.absorbed, arrived, rtol=1e-3)
    assert np.allclose(lit.book.emitted, lit.book.absorbed + lit.book.escaped + lit.book.unshot, rtol=5e-3)
    lit.release()


@EVERY_SOLVER
@pytest.mark.parametrize("kind", ["point", "directional"])
def test_a_board_casts_its_shadow(gpu: Gpu, solver: str, kind: str) -> None:
    """A board of 0.5 m halfway below a point light takes 1 m of the floor, one that light from afar meets as much as it is."""
    board = np.array([[0.75, 0.75, 1.25], [1.25, 0.75, 1.25], [1.25, 0.75, 0.75], [0.75, 0.75, 0.75]])
    light = replace(POINT, position=(1.0, 1.5, 1.0)) if kind == "point" else Light("sun", "directional", direction=DOWN)
    scene = quads_scene([FLOOR, board], [grey(0.0, double_sided=True)]).with_lights((light,))
    lit = solved(gpu, scene, solver)
    floor = (lit.object == 0) & (lit.normal[:, 1] > 0)
    away = np.abs(lit.position[floor][:, [0, 2]] - 1.0).max(1)
    half = 0.5 if kind == "point" else 0.25
    H, free = lit.H[floor].mean(1), light.irradiance(lit.position, lit.normal)[floor].mean(1)
    inside, outside = away < half - 1 / 16, away > half + 1 / 16  # half a texel of 1/8 m
    assert H[inside].max() < 1e-3 * free.max()
    assert np.allclose(H[outside], free[outside], rtol=0.02)
    assert lit.H[(lit.object == 1) & (lit.normal[:, 1] < 0)].max() < 1e-3 * free.max()
    lit.release()


@pytest.mark.parametrize("kind", ["point", "disc", "directional"])
def test_a_texel_is_lit_by_as_much_as_lies_outside_of_the_shadow(gpu: Gpu, kind: str) -> None:
    """A board askew, and its shadow, twice as large from a point above it: of the texels on its edge, the share that lies outside
    of it. 16 places of a texel say that to an eighth, 32 that are as many shots hardly better; a lamp of 5 mm is as sharp."""
    turn = np.array([[math.cos(0.4), math.sin(0.4)], [-math.sin(0.4), math.cos(0.4)]])
    edge = np.array([[-0.25, 0.25], [0.25, 0.25], [0.25, -0.25], [-0.25, -0.25]]) @ turn
    board = np.insert(1 + edge, 1, 0.75, axis=1)
    light = replace(POINT, position=(1.0, 1.5, 1.0), radius=0.005 if kind == "disc" else 0.0)
    light = Light("sun", "directional", direction=DOWN) if kind == "directional" else light
    scene = quads_scene([FLOOR, board], [grey(0.0, double_sided=True)]).with_lights((light,))
    lit = begin(gpu, scene, solver="shooting", density=8)
    lit.settle()
    floor = (lit.object == 0) & (lit.normal[:, 1] > 0)
    x, z = lit.position[floor][:, [0, 2]].T
    shadow = shapely.Polygon(1 + edge * (1 if kind == "directional" else 2))
    texels = shapely.box(x - 1 / 16, z - 1 / 16, x + 1 / 16, z + 1 / 16)
    outside = 1 - 64 * shapely.area(shapely.intersection(texels, shadow))
    found = lit.H[floor].mean(1) / light.irradiance(lit.position, lit.normal)[floor].mean(1)
    partly = (outside > 1e-9) & (outside < 1 - 1e-9)
    assert partly.sum() > 12 and np.abs(found - outside).max() < 0.125
    assert np.sqrt(((found - outside)[partly] ** 2).mean()) < (0.07 if kind == "disc" else 0.05)
    lit.release()


@pytest.mark.parametrize("kind", ["point", "directional"])
def test_nothing_is_dark_where_a_lit_wall_stands_on_a_lit_floor(gpu: Gpu, kind: str) -> None:
    """Neither hides the other, down to their common edge, where samples of the map beside a texel show the other one, nearer to
    the light than the texel's own plane is there."""
    wall = [[2, 0, 2], [2, 1, 2], [2, 1, 0], [2, 0, 0]]
    sun = Light("sun", "directional", (1.0, 1.0, 1.0), direction=(0.5, -0.7, 0.51))
    light = replace(POINT, position=(0.5, 1.6, 0.9)) if kind == "point" else sun
    scene = quads_scene([FLOOR, wall], [grey(0.0)]).with_lights((light,))
    lit = begin(gpu, scene, solver="shooting", density=100)
    lit.settle()
    expected = light.irradiance(lit.position, lit.normal)
    assert expected.min() > 0.05  # all of it is lit
    np.testing.assert_allclose(lit.H, expected, rtol=5e-3)
    lit.release()


@EVERY_SOLVER
def test_in_a_closed_room_nothing_is_lost(gpu: Gpu, solver: str) -> None:
    """Albedo 1/2 all over: what a point light sends out is absorbed in the end, and its walls receive twice that."""
    scene = quads_scene(room((2.0, 2.0, 2.0)), [grey(0.5)]).with_lights(
        (POINT, replace(POINT, position=(1.5, 0.5, 1.2)))
    )
    lit = solved(gpu, scene, solver)
    sent = 2 * 4 * math.pi * np.array(POINT.intensity)
    assert np.allclose(lit.book.emitted, sent, rtol=1e-6)
    assert np.allclose((lit.H * lit.area[:, None]).sum(0), 2 * sent, rtol=0.02)
    assert abs(lit.book.imbalance_share) < 0.02
    lit.release()


@EVERY_SOLVER
def test_light_follows_an_edit(gpu: Gpu, solver: str) -> None:
    """Another strength, another place, and off."""
    scene = quads_scene([FLOOR], [grey(0.0)]).with_lights((POINT,))
    lit = solved(gpu, scene, solver)
    for light in (
        replace(POINT, intensity=(4.0, 1.0, 1.0)),
        replace(POINT, position=(1.4, 1.0, 1.5)),
        replace(POINT, on=False),
    ):
        lit.solver.set_lights((light,))
        lit.settle()
        expected = light.irradiance(lit.position, lit.normal)
        assert np.abs(lit.H - expected).max() < 0.01 * max(float(expected.max()), 1.0)
    lit.release()


def test_references_know_them() -> None:
    """The dense matrix: the law on an open floor, and in a closed room of albedo 1/2 twice what is sent out."""
    floor = quads_scene([FLOOR], [grey(0.0)]).with_lights((POINT, replace(SPOT, name="second")))
    points, up = np.array([[0.3, 0.0, 0.4], [1.0, 0.0, 1.1]]), np.tile([0.0, 1.0, 0.0], (2, 1))
    expected = sum(light.irradiance(points, up) for light in floor.lights)
    assert np.allclose(irradiance_at(solve_dense(floor, 8, 1), floor, points, up), expected, rtol=1e-9)
    closed = quads_scene(room((2.0, 2.0, 2.0)), [grey(0.5)]).with_lights((POINT,))
    solution = solve_dense(closed, 300, 2)
    received = (solution.H * solution.patches.areas[:, None]).sum(0)
    # 2 × 2 points of a patch of 0.3 m say what it receives 0.7 m from a lamp to a hundredth
    assert np.allclose(received, 2 * 4 * math.pi * np.array(POINT.intensity), rtol=0.01)


def test_the_estimate_of_error_looks_at_them(gpu: Gpu) -> None:
    """Any number of rays: each light gets as many, and what is a point is known from one."""
    lights = (POINT, replace(SPOT, intensity=(1.0, 1.0, 1.0)), Light("sun", "directional", direction=SLANTED))
    lit = begin(gpu, quads_scene([FLOOR], [grey(0.0)]).with_lights(lights), density=8)
    gather = RayGather(gpu, lit.lightmap, 4)
    assert gather.find_lamps()
    points, up = np.array([[0.3, 0.0, 0.4], [1.0, 0.0, 1.1]]), np.tile([0.0, 1.0, 0.0], (2, 1))
    for rays in (32, 512):
        found = gather.irradiance(gather.look(points, up, np.full((2, SHIFTS), 0.3), rays), 2, rays)
        expected = sum(light.irradiance(points, up) for light in lights)
        assert np.allclose(found[:, :3], expected, rtol=1e-4) and np.allclose(found[:, 3], expected.mean(1), rtol=1e-4)
    gather.release()
    lit.release()


def test_quadtrees_hold_what_point_and_spot_lights_give(gpu: Gpu) -> None:
    """Leaves that come later have all of it, not what they inherit; another place of a light, too."""
    board = np.array([[0.75, 0.75, 1.25], [1.25, 0.75, 1.25], [1.25, 0.75, 0.75], [0.75, 0.75, 0.75]])
    light = replace(POINT, position=(1.0, 1.5, 1.0))
    scene = quads_scene([FLOOR, board], [grey(0.2, double_sided=True)]).with_lights((light, SPOT))
    lit = begin(gpu, scene, density=4, adaptive=True, depth=2)
    lit.settle()
    for _ in range(2):
        assert lit.lightmap.pool.leaves.level.max() > 0
        floor = (lit.object == 0) & (lit.normal[:, 1] > 0)
        away = np.abs(lit.position[floor][:, [0, 2]] - np.array(light.position)[[0, 2]]).max(1)
        free = sum(light.irradiance(lit.position, lit.normal) for light in lit.lightmap.scene.lights)[floor].mean(1)
        outside = away > 0.5 + 1 / 8  # a texel of the roots
        assert np.allclose(lit.H[floor].mean(1)[outside], free[outside], rtol=0.05, atol=0.02)
        lit.solver.set_lights((replace(light, intensity=(3.0, 3.0, 3.0)), SPOT))
        lit.settle()
    lit.release()
