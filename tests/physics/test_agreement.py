"""The solver against the dense float64 reference (app/reference), which shares no code with it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from solver_scenes import UNIT_SQUARE, Solution, grey, quads_scene, room, solve, table_room

from app.gpu import Gpu
from app.metrics import relative_rms
from app.reference.dense import irradiance_at, solve_dense
from app.scene.model import Material
from app.solvers import SOLVERS


@pytest.mark.parametrize("solver", SOLVERS)
def test_room_without_shadows(gpu: Gpu, solver: str) -> None:
    """A box of three albedos, its ceiling the lamp: mean irradiance of each wall, and of points on the floor.

    In a convex room the reference's rows sum to 1 exactly and its error is that of its grid, 0.5 % between walls that touch;
    the solver's shooters hand out all their light within 0.5 %."""
    materials = (grey(0.2), grey(0.0, 4.0), Material("red", (0.8, 0.3, 0.1)), grey(0.5))
    scene = quads_scene(room((2.0, 1.0, 1.5)), materials, [0, 1, 2, 3, 3, 2])
    mine = solve(gpu, scene, texels=2500, solver=solver)
    dense = solve_dense(scene, 300, 2)
    wall = scene.object_ids[dense.patches.triangle]
    areas = np.bincount(wall, dense.patches.areas)
    truth = np.stack([np.bincount(wall, dense.patches.areas * h) / areas for h in dense.H.T], -1)
    np.testing.assert_allclose(mine.means(mine.H), truth, rtol=0.01)
    floor = np.flatnonzero(mine.object == 0)[::7]
    points = irradiance_at(dense, scene, mine.position[floor], mine.normal[floor])
    assert relative_rms(mine.H[floor], points) < 0.01
    mine.release()


@pytest.fixture(scope="module")
def table(_gpu: Gpu) -> Iterator[Solution]:
    solution = solve(_gpu, table_room(), density=8, residual=3e-3, coarsen=False)
    yield solution
    solution.release()


def test_room_with_a_table(gpu: Gpu, table: Solution) -> None:
    """Shadow, both sides, colour: means within 3 %. The reference's 380 patches resolve a shadow's edge to a third of a metre,
    and one visibility ray for each of its pieces errs by about 2 % where the table hides the lamp."""
    scene = table.lightmap.scene
    dense = solve_dense(scene, 380, 2)
    wall = scene.object_ids[dense.patches.triangle]
    areas = np.bincount(wall, dense.patches.areas)
    truth = np.stack([np.bincount(wall, dense.patches.areas * h) / areas for h in dense.H.T], -1)
    mine = table.means(table.H)
    print(mine / truth - 1)
    np.testing.assert_allclose(mine, truth, rtol=0.03)
    under = (table.object == 7) & (table.normal[:, 1] < 0)
    points = irradiance_at(dense, scene, table.position[under][::5], table.normal[under][::5])
    print(relative_rms(table.H[under][::5], points), table.H[under][::5].mean(), points.mean())


def test_direct_light_is_the_closed_form(gpu: Gpu) -> None:
    """Black surfaces: one bounce. H at texels under a square lamp against Lambert's formula from the whole lamp at once."""
    from app.reference.form_factors import point_to_polygon

    lamp = UNIT_SQUARE[:, [0, 2, 1]] + [0.0, 1.0, 0.0]  # faces down
    floor = UNIT_SQUARE[:, [0, 2, 1]][::-1] * [3.0, 1.0, 3.0] - [1.0, 0.0, 1.0]
    scene = quads_scene([floor, lamp], [grey(0.0), grey(0.0, 2.0)], [0, 1])
    mine = solve(gpu, scene, density=12, residual=1e-6)
    below = mine.object == 0
    truth = 2.0 * point_to_polygon(mine.position[below], mine.normal[below], lamp)
    # the far field's Gauss points, 0.15 % on average, and twice that on single texels
    np.testing.assert_allclose(mine.H[below, 0], truth, rtol=3e-3)
    assert mine.H[below, 0].sum() == pytest.approx(truth.sum(), rel=5e-4)
    mine.release()
