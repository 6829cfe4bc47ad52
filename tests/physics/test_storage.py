"""How the light is stored, that it stays a number, and that the same solve gives the same answer."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from solver_scenes import Solution, begin, grey, quads_scene, room, solve

from app.atlas.lightmap import STORAGE
from app.gpu import Gpu
from app.scene.model import Material, Scene

SHOTS = 320


def two_coloured_room() -> Scene:
    return quads_scene(room((2.0, 1.0, 1.0)), [grey(0.6), Material("lamp", (0.3, 0.3, 0.3), (3.0, 1.0, 0.2))], [0, 1] + [0] * 4)


@pytest.fixture(scope="module")
def solved(_gpu: Gpu) -> Iterator[dict[str, Solution]]:
    """The same shots in every storage format."""
    solutions = {}
    for storage in STORAGE:
        solutions[storage] = begin(_gpu, two_coloured_room(), texels=2000, storage=storage, coarsen=False, resolution=128)
        solutions[storage].shoot(SHOTS)
    yield solutions
    for solution in solutions.values():
        solution.release()


@pytest.mark.parametrize("storage", STORAGE)
def test_light_is_finite_and_not_negative(gpu: Gpu, solved: dict[str, Solution], storage: str) -> None:
    for values in (solved[storage].H, solved[storage].r):
        assert np.isfinite(values).all() and values.min() >= 0
    assert solved[storage].H.max() > 0


def test_half_floats_are_close_to_floats(gpu: Gpu, solved: dict[str, Solution]) -> None:
    """Each of the few dozen shots that a texel receives rounds H to 2^-11 of itself, without bias."""
    full, half = solved["rgba32f"].H, solved["rgba16f"].H
    assert np.abs(half - full).max() / full.mean() < 0.02
    np.testing.assert_allclose(half.mean(0), full.mean(0), rtol=3e-3)


def test_eight_bits_lose_light_and_the_book_says_so(gpu: Gpu, solved: dict[str, Solution]) -> None:
    """A contribution under half of 1/255 of the largest exitance is rounded away: the picture gets darker, and what is
    missing is the imbalance."""
    full, fixed = solved["rgba32f"], solved["fixed8"]
    assert fixed.means(fixed.H).max() > 0
    assert (fixed.means(fixed.H) <= full.means(full.H)).all()
    assert fixed.H.sum() < 0.9 * full.H.sum()
    book = fixed.book
    assert book.imbalance_share > 0.05 > abs(full.book.imbalance_share)
    # light only disappears where it is stored
    missing = (full.book.absorbed + full.book.unshot - book.absorbed - book.unshot).sum() / book.emitted.sum()
    assert book.imbalance_share == pytest.approx(missing, abs=0.01)


@pytest.mark.parametrize("coarsen", [False, True])
def test_residual_falls_shot_by_shot(gpu: Gpu, coarsen: bool) -> None:
    """What a shot takes away is more than what its receivers reflect, ρ < 1; the report follows the book."""
    box = begin(gpu, two_coloured_room(), texels=2000, coarsen=coarsen)
    reported = [box.solver.report.residual]
    while reported[-1] > 0.05:
        box.solver.step(8)
        reported.append(box.solver.poll(wait=True).residual)
    # a report is of the state before its step; form factors make at most 0.5 % of a shot's light out of nothing, less than ρ takes
    assert all(b < a for a, b in zip(reported[1:], reported[2:], strict=False))
    assert reported[0] == 1 == pytest.approx(reported[1], rel=1e-5)
    book = box.book
    box.solver.step(1)
    assert box.solver.poll(wait=True).residual == pytest.approx(book.unshot.sum() / book.emitted.sum(), rel=1e-4)  # f32 sums
    box.release()


def test_the_same_solve_again_is_identical(gpu: Gpu) -> None:
    """Nothing depends on time, and blending on one device adds in one order: after a reset, and in a new lightmap."""
    first = begin(gpu, two_coloured_room(), texels=1500, resolution=128)
    first.shoot(200)
    H = first.H
    first.solver.reset()
    assert first.H.max() == 0 and first.solver.shots == 0 and first.book.absorbed.sum() == 0
    first.shoot(200)
    second = begin(gpu, two_coloured_room(), texels=1500, resolution=128)
    second.shoot(200)
    np.testing.assert_array_equal(first.H, H)
    np.testing.assert_array_equal(second.H, H)
    for solution in (first, second):
        solution.release()


def test_a_scene_without_light_stays_dark(gpu: Gpu) -> None:
    dark = begin(gpu, quads_scene(room(), [grey(0.5)]), texels=400)
    assert dark.solver.report.residual == 0
    dark.solver.step(8)
    dark.solver.poll(wait=True)
    assert dark.solver.report.residual == 0
    assert dark.H.max() == 0 and dark.book.imbalance_share == 0
    dark.release()


@pytest.mark.parametrize("exitance", [1e-6, 1e6])
def test_bright_and_faint_lamps_alike(gpu: Gpu, exitance: float) -> None:
    """Stored relative to the brightest lamp: the same bits whatever the unit, but for the rounding of the unit itself."""
    results = []
    for E in (1.0, exitance):
        box = solve(gpu, quads_scene(room(), [grey(0.5, E)]), texels=400, residual=0.02, storage="rgba16f", resolution=128)
        results.append(box.H / E)
        box.release()
    np.testing.assert_allclose(results[1], results[0], rtol=2e-3)  # 2^-11 of a half float, a few roundings
