"""No light passes from one side of a wall to the other through texels that lie on both."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.typing import ArrayLike
from solver_scenes import EVERY_SOLVER, FAST, begin, grey, quads_scene, room

from app.gpu import Gpu
from app.scene.model import F64, Scene
from app.session.balance import TOO_MUCH

WALL = [(1.03, 0, 0), (1.03, 1, 0), (1.03, 1, 1), (1.03, 0, 1)]
LAMP = [(0.3, 0.97, 0.4), (0.5, 0.97, 0.4), (0.5, 0.97, 0.6), (0.3, 0.97, 0.6)]


def lit_from_the_left(*quads: ArrayLike) -> Scene:
    """A room 2 × 1 × 1 whose left half has a lamp, and a wall without thickness between both halves."""
    walls = [*room((2.0, 1.0, 1.0)), WALL, *quads]
    return quads_scene([*walls, LAMP], [grey(0.5, double_sided=True), grey(0.0, 10.0)], [0] * len(walls) + [1])


def beam() -> F64:
    """Through the wall, askew: four sides and two ends, fronts out."""
    inside = room((1.0, 0.2, 0.2))[:, ::-1] - (0.5, 0.1, 0.1)
    turn = np.array([[0.9, 0.0, 0.43589], [0.0, 1.0, 0.0], [-0.43589, 0.0, 0.9]])
    return np.asarray(inside @ turn.T + (1.03, 0.4, 0.5))


def parted() -> Scene:
    """Rooms of quads of their own, in the same planes, that share a wall."""
    left, right = room((1.03, 1.0, 1.0)), np.add(room((0.97, 1.0, 1.0)), (1.03, 0, 0))
    walls = [*np.delete(left, 3, 0), *np.delete(right, 2, 0), WALL]
    return quads_scene([*walls, LAMP], [grey(0.5, double_sided=True), grey(0.0, 10.0)], [0] * len(walls) + [1])


@EVERY_SOLVER
def test_sheets_back_to_back_are_a_wall(gpu: Gpu, solver: str) -> None:
    """Two of one side each, in one place, in other triangles, receive and reflect as one with two sides does, and are in the
    books as it is: a ray that meets both meets the one that faces it."""
    walls, found = room((2.0, 1.0, 1.0)), []
    back = np.roll(WALL, 1, axis=0)[::-1]
    for sheets, two_sided in (([WALL], True), ([WALL, back], False)):
        quads = [*walls, LAMP, *sheets]
        materials = [grey(0.5), grey(0.0, 10.0), grey(0.8, double_sided=two_sided)]
        scene = quads_scene(quads, materials, [0] * len(walls) + [1] + [2] * len(sheets))
        solution = begin(gpu, scene, texels=2000, solver=solver)
        solution.settle()
        found.append(solution.means(solution.H)[: len(walls), 0])
        assert abs(solution.book.imbalance_share) < 0.01
        solution.release()
    assert found[1] == pytest.approx(found[0], rel=0.01)


SCENES = {"a sheet": lit_from_the_left, "a beam through it": lambda: lit_from_the_left(*beam()), "two rooms": parted}


@pytest.mark.parametrize(("solver", "name"), [*itertools.product(FAST, SCENES), ("local", "a beam through it")])
def test_the_dark_half_is_dark(gpu: Gpu, solver: str, name: str) -> None:
    solution = begin(gpu, SCENES[name](), texels=300 if solver == "local" else 3000, solver=solver)
    solution.settle()
    dark = solution.position[:, 0] > 1.03 + 1e-6
    on_wall = np.abs(solution.position[:, 0] - 1.03) <= 1e-6
    dark |= on_wall & (solution.normal[:, 0] > 0)
    H = solution.H.mean(1)
    assert 0.3 < dark.mean() < 0.7 and H[~dark].mean() > 0.1
    dark_light, lit_light = ((H * solution.area)[mine].sum() / solution.area[mine].sum() for mine in (dark, ~dark))
    # Where an edge of the beam runs askew through a sample of a map, the sample may see past it: the rasteriser rounds to 1/256
    # of one. Straight feet of walls pass nothing at all.
    least = 1e-6 if solver == "shooting" and name == "a beam through it" else 0.0
    if (
        solver == "local"
    ):  # single precision, twice: a matrix is inverted, whose blocks of zeros are left with what rounding makes
        least = 1e-12
    assert dark_light <= least * lit_light
    solution.release()


def test_light_is_kept_among_boxes_as_wide_as_a_texel(gpu: Gpu) -> None:
    """36 of 0.6 m, one on each square metre, of two sides as files often have it. In rays, what is within one sees the lit floor
    that it stands on as well as its own bottom: 4 % of the light came from nothing."""
    quads: list[ArrayLike] = [
        [(0, 0, 0), (0, 0, 6), (6, 0, 6), (6, 0, 0)],
        [(2, 2, 2), (4, 2, 2), (4, 2, 4), (2, 2, 4)],
    ]
    for k, angle in enumerate(np.random.default_rng(1).uniform(0, np.pi / 2, 36)):
        c, s = np.cos(angle), np.sin(angle)
        box = (0.6 * room()[:, ::-1] - (0.3, 0, 0.3)) @ [(c, 0, -s), (0, 1, 0), (s, 0, c)]
        quads += list(np.add(box, (k % 6 + 0.5, 0, k // 6 + 0.5)))
    numbers = [0, 1] + [0] * (len(quads) - 2)
    scene = quads_scene(quads, [grey(0.5, double_sided=True), grey(0.0, 10.0)], numbers)
    solution = begin(gpu, scene, density=1.8, solver="gathering")
    solution.gather(256)
    assert abs(solution.book.imbalance_share) < TOO_MUCH  # within which a solution is said to be sound
    solution.release()


@pytest.mark.parametrize("solver", ["shooting", "gathering"])
def test_a_carpet_in_the_plane_of_the_floor_is_a_part_of_the_floor(gpu: Gpu, solver: str) -> None:
    """And a lamp in that of the ceiling a part of the ceiling: light as where there are holes under them."""
    walls = room()
    carpet = [(0.5, 0, 0.5), (0.5, 0, 1), (1, 0, 1), (1, 0, 0.5)]
    lamp = [(0.5, 1, 0), (1, 1, 0), (1, 1, 0.5), (0.5, 1, 0.5)]
    rest = [(0, 0, 0), (0, 0, 1), (0.5, 0, 1), (0.5, 0, 0)], [(0.5, 0, 0), (0.5, 0, 0.5), (1, 0, 0.5), (1, 0, 0)]
    above = [[(x, 1, 1 - z) for x, _, z in quad] for quad in rest]
    materials = [grey(0.5), grey(0.8), grey(0.0, 10.0)]
    found = []
    for quads in ([carpet, lamp, walls[0], walls[1], *walls[2:]], [carpet, lamp, *rest, *above, *walls[2:]]):
        ids = [1, 2] + [0] * (len(quads) - 2)
        solution = begin(gpu, quads_scene(quads, materials, ids), texels=800, solver=solver)
        solution.settle()
        means = solution.means(solution.H)[:, 0]
        found.append(np.append(means[:1], means[-4:]))
        assert abs(solution.book.imbalance_share) < 0.01
        solution.release()
    assert found[0] == pytest.approx(found[1], rel=0.015)
