"""No light passes from one side of a wall to the other through texels that lie on both."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import ArrayLike
from solver_scenes import EVERY_SOLVER, begin, grey, quads_scene, room

from app.gpu import Gpu
from app.scene.model import F64, Scene

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


SCENES = {"a sheet": lit_from_the_left, "a beam through it": lambda: lit_from_the_left(*beam()), "two rooms": parted}


@EVERY_SOLVER
@pytest.mark.parametrize("name", SCENES)
def test_the_dark_half_is_dark(gpu: Gpu, solver: str, name: str) -> None:
    solution = begin(gpu, SCENES[name](), texels=3000, solver=solver)
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
    assert dark_light <= least * lit_light
    solution.release()
