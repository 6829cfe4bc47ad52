"""Light through what is not opaque: by how much less there is of it, and where it is."""

from __future__ import annotations

import functools
import itertools
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from solver_scenes import EVERY_SOLVER, Solution, begin, grey, quads_scene, room, with_uv

from app.atlas.parametrize import parametrize
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.lightmap.tile_pool import TilePool
from app.scene.lights import Light
from app.scene.model import Material, Scene, Texture
from app.scene.sky import Sky
from app.solvers.pairs.options import PairsOptions
from app.solvers.pairs.solver import Pairs
from app.util.parts import run_to_end
from app.visibility.projections import PROJECTIONS

CHECKS = 16.0  # pairs of black and white along the board's edge
CUT_OUT = Texture(
    "checker",
    np.array([[[1], [0]], [[0], [1]]], np.float32),
    bilinear=False,
    uv_transform=np.array([[CHECKS, 0.0, 0.0], [0.0, CHECKS, 0.0]]),
)
FLOOR, LAMP, BOARD = range(3)
BOARDS = {
    "half": replace(grey(0.6, double_sided=True), opacity=0.5),
    "glass": replace(grey(0.6, double_sided=True), opacity=0.1),
    "holes": replace(grey(0.6, double_sided=True), opacity_texture=CUT_OUT, opacity_cutoff=0.5),
    "half as a picture": replace(grey(0.6, double_sided=True), opacity_texture=replace(CUT_OUT, bilinear=True)),
}
CLOSED = grey(0.6, double_sided=True)
THERE = {"half": 0.5, "glass": 0.1, "holes": 0.5, "half as a picture": 0.5}
WAYS = {name: ("shooting", name) for name in PROJECTIONS} | {name: (name, None) for name in ("gathering", "local")}


def square(y: float, half: float, *, down: bool = False) -> list[list[float]]:
    """Around (2, y, 2), facing up, or down."""
    low, high = 2 - half, 2 + half
    corners = [[low, y, low], [low, y, high], [high, y, high], [high, y, low]]
    return corners[::-1] if down else corners


def board_scene(board: Material | None) -> Scene:
    """A black floor, a lamp that faces it, and a board between them that is wider than both."""
    quads = [square(0.0, 1.0), square(2.0, 0.5, down=True), *([] if board is None else [square(1.0, 1.5)])]
    return with_uv(quads_scene(quads, [grey(0.0), grey(0.0, 10.0), board or grey(0.5)], range(len(quads))))


LOCAL = {"patches": 1024, "patch_level": 0, "bits": 32, "rays": 256, "shadow_rays": 64, "missing": 0.0}
PAIRS = {
    "rays": PairsOptions(senders="all", occlusion="rays"),
    "kept": PairsOptions(senders="all", occlusion="rays", keep_pairs=True),
    "hemicube": PairsOptions(senders="all", occlusion="hemicube"),
    "directional": PairsOptions(senders="directional", directions=1024),
}


def received(solution: Solution) -> NDArray[np.float64]:
    """Power on each object [W]."""
    return np.bincount(solution.object, solution.area * solution.H[:, 0])


def lit(gpu: Gpu, scene: Scene, solver: str, projection: str | None) -> NDArray[np.float64]:
    """Power on each object, once all light is there; it is in the books."""
    local, options = solver == "local", {} if projection is None else {"projection": projection}
    solution = begin(gpu, scene, density=4 if local else 8, solver=solver, **(LOCAL if local else {}) | options)  # type: ignore[arg-type]
    solution.settle()
    power, book = received(solution), solution.book
    solution.release()
    assert abs(book.imbalance_share) < 0.02
    return power


def by_pairs(gpu: Gpu, scene: Scene, options: PairsOptions) -> NDArray[np.float64]:
    """Power on each object after two bounces."""
    lightmap = Lightmap(gpu, TilePool(scene, parametrize(scene, density=4)))
    solver = Pairs(gpu, lightmap, options)
    while solver.issued < 2:
        run_to_end(solver.work(1))
    covered = lightmap.pool.surfaces.area > 0
    power = lightmap.irradiance()[covered][:, 0] * lightmap.pool.surfaces.area[covered]
    triangle = lightmap.charts.face_triangle[lightmap.pool.surfaces.face[covered]]
    solver.release()
    lightmap.release()
    return np.bincount(scene.object_ids[triangle], power)


def check(free: NDArray[np.float64], closed: NDArray[np.float64], through: NDArray[np.float64], there: float) -> None:
    """Within 3 %, the noise of rays and of maps; of pairs, that of a ray between two texels. A sheet of which little is there is
    as much better."""
    assert through[FLOOR] == pytest.approx(
        (1 - there) * free[FLOOR], abs=0.03 * there * free[FLOOR] + 0.002 * free[FLOOR]
    )
    assert through[BOARD] == pytest.approx(there * closed[BOARD], rel=0.03)
    assert closed[FLOOR] < 1e-3 * free[FLOOR]


@functools.cache
def without_and_closed(gpu: Gpu, way: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Power on each object without a board, and below one that is closed."""
    return lit(gpu, board_scene(None), *WAYS[way]), lit(gpu, board_scene(CLOSED), *WAYS[way])


@pytest.mark.parametrize(
    ("way", "board"),
    [
        *itertools.product(("hemicube", "gathering"), BOARDS),
        *itertools.product(("local", "nonlinear", "stereographic"), ("half", "holes")),
    ],
)
def test_a_board_passes_what_of_it_is_not_there(gpu: Gpu, way: str, board: str) -> None:
    """The floor receives 1 - opacity of what it would without a board, and the board opacity of what one would that is closed."""
    check(*without_and_closed(gpu, way), lit(gpu, board_scene(BOARDS[board]), *WAYS[way]), THERE[board])


@pytest.mark.parametrize("way", PAIRS)
def test_pairs_see_each_other_through_a_board(gpu: Gpu, way: str) -> None:
    free, closed, through = (by_pairs(gpu, board_scene(b), PAIRS[way]) for b in (None, CLOSED, BOARDS["half"]))
    check(free, closed, through, 0.5)


@EVERY_SOLVER
@pytest.mark.parametrize("board", ["glass", "holes"])
def test_a_furnace_with_a_board_in_it_stays_one(gpu: Gpu, solver: str, board: str) -> None:
    """H = E / (1 - albedo) everywhere, also on a board that emits and reflects as the walls do, however much of it is there."""
    material = replace(BOARDS[board], albedo=(0.5,) * 3, emission=(1.0 / np.pi,) * 3)
    inside = np.array([[0.25, 0.5, 0.25], [0.25, 0.5, 0.75], [0.75, 0.5, 0.75], [0.75, 0.5, 0.25]])
    scene = with_uv(quads_scene([*room(), inside], [grey(0.5, 1.0), material], [0] * 6 + [1]))
    solution = begin(gpu, scene, density=16, solver=solver)
    solution.settle()
    means = solution.means(solution.H)[:, 0]
    assert means == pytest.approx(2.0, rel=0.03)
    assert abs(solution.book.imbalance_share) < 0.02
    solution.release()


@pytest.mark.parametrize(("what", "way"), [("sky", "gathering"), ("point", "gathering"), ("point", "hemicube")])
def test_sky_and_lights_without_area_shine_through_a_board(gpu: Gpu, what: str, way: str) -> None:
    """The floor receives the mean of what it does without a board, and under one that is closed, past which it sees the
    horizon."""
    power = []
    for board in (None, CLOSED, BOARDS["half"]):
        quads = [square(0.0, 1.0), *([] if board is None else [square(1.0, 1.5)])]
        scene = quads_scene(quads, [grey(0.0), replace(board or CLOSED, albedo=(0.0,) * 3)], range(len(quads)))
        if what == "sky":
            scene = scene.with_sky(Sky())
        else:
            scene = scene.with_lights((Light("bulb", position=(2.0, 2.0, 2.0)),))
        power.append(lit(gpu, scene, *WAYS[way])[0])
    assert power[2] == pytest.approx((power[0] + power[1]) / 2, rel=0.02)
    assert power[1] < 0.6 * power[0]


def specks(count: int) -> list[list[list[float]]]:
    """Small squares aside, in no light's way."""
    corners = np.array([[3.2, 0.9, 0.0], [3.2, 0.9, 0.1], [3.3, 0.9, 0.1], [3.3, 0.9, 0.0]])
    return [np.add(corners, [0.0, 0.0, 0.6 + 0.25 * k]).tolist() for k in range(count)]


@pytest.mark.parametrize(("panes", "apart"), [(2, 1), (3, 1), (2, 8)])
def test_the_sun_shines_through_panes_behind_each_other(gpu: Gpu, panes: int, apart: int) -> None:
    """By the product of what each lets pass, wherever they stand in the file: all are seen in the same maps. Within 2 %: of
    eight maps, each of 256 texels looks up 16 places, a lattice in each; so three panes are off by 0.6 % on average. A texel by
    itself is off by 12 %; of one place in each map, by 59 %."""
    quads = [square(0.0, 1.0)]
    for k in range(panes):
        quads += [square(1.0 + 0.3 * k, 1.5), *(specks(apart - 1) if k + 1 < panes else [])]
    black = replace(CLOSED, albedo=(0.0,) * 3, opacity=0.5)
    scene = quads_scene(quads, [grey(0.0), black], [0] + [1] * (len(quads) - 1))
    sun = Light("sun", "directional", direction=(0.0, -1.0, 0.0))
    solution = begin(gpu, scene.with_lights((sun,)), density=8)
    solution.settle()
    assert received(solution)[0] == pytest.approx(4 * 0.5**panes, rel=0.02)
    assert solution.H[solution.object == 0, 0].std() < 0.2 * 0.5**panes
    solution.release()
