"""How the light is stored, that it stays a number, and that the same solve gives the same answer."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import pytest
from solver_scenes import Solution, begin, grey, quads_scene, room, solve

from app.gpu import Gpu
from app.lightmap.options import STORAGE
from app.scene.model import Material, Scene


def two_coloured_room() -> Scene:
    lamp = Material("lamp", (0.3, 0.3, 0.3), (3.0, 1.0, 0.2))
    return quads_scene(room((2.0, 1.0, 1.0)), [grey(0.6), lamp], [0, 1, 0, 0, 0, 0])


@pytest.fixture(scope="module")
def solved(_gpu: Gpu) -> Iterator[dict[str, Solution]]:
    """The same room in every storage format, converged."""
    solutions = {}
    for storage in STORAGE:
        solutions[storage] = solve(
            _gpu, two_coloured_room(), texels=2000, storage=storage, residual=0.01, resolution=128
        )
    yield solutions
    for solution in solutions.values():
        solution.release()


@pytest.mark.parametrize("storage", STORAGE)
def test_light_is_finite_and_not_negative(gpu: Gpu, solved: dict[str, Solution], storage: str) -> None:
    """What was shot ahead is owed: r may be negative, where the storage can hold that."""
    H, r = solved[storage].H, solved[storage].r
    assert np.isfinite(H).all() and np.isfinite(r).all() and H.min() >= 0
    assert r.min() >= 0 or storage != "fixed8"
    assert solved[storage].H.max() > 0


@pytest.mark.usefixtures("undivided")
def test_half_floats_are_close_shot_by_shot(gpu: Gpu) -> None:
    """Every shot rounds H by at most 2^-10 of itself, the step of a half float. Black walls: each patch of the lamp shoots once,
    in whatever order."""
    scene = quads_scene(room((2.0, 1.0, 1.0)), [grey(0.0), grey(0.0, 3.0)], [0, 1, 0, 0, 0, 0])
    H = []
    for storage in ("rgba32f", "rgba16f"):
        solution = solve(gpu, scene, texels=2000, residual=1e-6, coarsen=False, storage=storage)
        H.append(solution.H)
        shots = solution.solver.issued
        solution.release()
    assert H[0].mean() > 0.3 and shots < 40
    np.testing.assert_allclose(
        H[1], H[0], rtol=shots * 2**-10, atol=1e-4
    )  # atol: contributions below half floats' range


@pytest.mark.parametrize("storage", STORAGE)
def test_what_storage_loses_is_in_the_book(gpu: Gpu, solved: dict[str, Solution], storage: str) -> None:
    """Light only disappears where it is stored, and that is the book's imbalance. It never appears: a half float of a driver
    that cuts instead of rounding (llvmpipe) only gets smaller, by the step of some hundred shots."""
    full, book = solved["rgba32f"].book, solved[storage].book
    missing = (full.absorbed + full.unshot - book.absorbed - book.unshot).sum() / book.emitted.sum()
    own = max(abs(full.imbalance_share), 1e-3)  # that of the form factors
    assert book.imbalance_share == pytest.approx(missing, abs=2 * own)
    assert missing > -0.005
    ratio = solved[storage].means(solved[storage].H) / solved["rgba32f"].means(solved["rgba32f"].H)
    assert ratio.max() < 1.005
    assert ratio.min() >= {"rgba32f": 1.0, "rgba16f": 0.8, "fixed8": 0.0}[storage]


def test_eight_bits_lose_light(gpu: Gpu, solved: dict[str, Solution]) -> None:
    """A contribution under half of 1/255 of the largest exitance is rounded away: the picture gets darker."""
    full, fixed = solved["rgba32f"], solved["fixed8"]
    assert (fixed.means(fixed.H) < full.means(full.H)).all()
    assert fixed.H.sum() < 0.9 * full.H.sum()
    assert fixed.book.imbalance_share > 0.05 > abs(full.book.imbalance_share)
    steps = fixed.H / fixed.lightmap.unit * 255
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-3)


@pytest.mark.parametrize("coarsen", [False, True])
def test_unshot_light_falls_shot_by_shot(gpu: Gpu, coarsen: bool) -> None:
    """What a shot takes away is more than what its receivers reflect: ρ < 1, and form factors add at most 0.5 %; with light that
    is shot ahead as with other. The report is what the texels say, tile by tile."""
    box = begin(gpu, two_coloured_room(), texels=2000, coarsen=coarsen)
    unshot = [box.book.unshot.sum()]
    while box.solver.poll().remaining > 0.05:
        box.step(8)
        box.solver.poll(wait=True)
        unshot.append(box.book.unshot.sum())
    assert all(later < earlier for earlier, later in itertools.pairwise(unshot))
    area = box.lightmap.pool.surfaces.area[..., None]
    flux = (box.lightmap.residual().astype(np.float64) * area).sum((1, 2))
    said = box.solver.settle().remaining * box.book.emitted.sum()
    assert said == pytest.approx(np.abs(flux).sum(), rel=1e-4)  # f32 sums
    box.step(1)  # a report is of the state before its step
    assert box.solver.poll(wait=True).remaining * box.book.emitted.sum() == pytest.approx(said, rel=1e-4)
    box.release()


def test_the_same_solve_again_is_identical(gpu: Gpu) -> None:
    """Nothing depends on time, and blending on one device adds in one order: after a reset, and in a new lightmap."""
    first = begin(gpu, two_coloured_room(), texels=1500, resolution=128)
    first.shoot(200)
    H = first.H
    first.solver.reset()
    assert first.H.max() == 0 and first.solver.issued == 0 and first.book.absorbed.sum() == 0
    first.shoot(200)
    second = begin(gpu, two_coloured_room(), texels=1500, resolution=128)
    second.shoot(200)
    np.testing.assert_array_equal(first.H, H)
    np.testing.assert_array_equal(second.H, H)
    for solution in (first, second):
        solution.release()


def test_a_scene_without_light_stays_dark(gpu: Gpu) -> None:
    dark = begin(gpu, quads_scene(room(), [grey(0.5)]), texels=400)
    assert dark.solver.poll().remaining == 0
    dark.step(8)
    dark.solver.poll(wait=True)
    assert dark.solver.poll().remaining == 0
    assert dark.H.max() == 0 and dark.book.imbalance_share == 0
    dark.release()


@pytest.mark.parametrize("exitance", [1e-6, 1e6])
def test_bright_and_faint_lamps_alike(gpu: Gpu, exitance: float) -> None:
    """Stored relative to the brightest lamp: the same bits whatever the unit, but for the rounding of the unit itself."""
    results = []
    for E in (1.0, exitance):
        box = solve(
            gpu, quads_scene(room(), [grey(0.5, E)]), texels=400, residual=0.02, storage="rgba16f", resolution=128
        )
        results.append(box.H / E)
        box.release()
    np.testing.assert_allclose(results[1], results[0], rtol=2e-3)  # 2^-11 of a half float, a few roundings
