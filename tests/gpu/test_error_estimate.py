"""The error that a solution states of itself, and the light gathered at points that tells it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from boxes import box, cornell, put
from forests import Forest, forest
from gl_objects import forgotten, held
from solver_scenes import begin, grey, quads_scene, room, table_room

from app.atlas.options import AtlasOptions
from app.atlas.parametrize import parametrize
from app.atlas.points import random_points
from app.estimate.error import FEWEST, POINTS, TURNS, ErrorEstimator, choose_points, estimate_error
from app.estimate.hemicube_irradiance import HemicubeIrradiance, tangents
from app.gpu import Gpu
from app.lightmap.at_points import irradiance_of
from app.lightmap.lightmap import Lightmap
from app.reference.form_factors import point_to_polygon
from app.reference.metrics import bias, lit_points, relative_rms
from app.scene.model import F64
from app.session.run import Stop
from app.session.session import Session
from app.solvers import ShootingOptions
from app.util.parts import run_to_end

__all__ = ["box", "cornell", "forest", "forgotten"]


def gathered(gpu: Gpu, lightmap: Lightmap, position: F64, normal: F64) -> F64:
    gather = HemicubeIrradiance(gpu, lightmap, len(position))
    turn = np.random.default_rng(2).uniform(0, 2 * np.pi, len(position))
    irradiance = gather.irradiance(gather.look(position, normal, turn))
    gather.release()
    return irradiance


# -- gathering ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wall", range(6))
def test_a_shining_wall_gives_its_form_factor(gpu: Gpu, wall: int) -> None:
    """From points on the other walls, in a room that is not a cube, whatever their hemicube's turn."""
    walls = room((2.0, 1.0, 3.0))
    scene = quads_scene(walls, (grey(0.5), grey(0.5, 7.0)), [int(k == wall) for k in range(6)])
    lightmap = Lightmap.of(gpu, scene, parametrize(scene, texels=2000))
    points = random_points(scene, 24, wall)
    position, normal = points.positions_normals(scene)
    expected = 7.0 * point_to_polygon(position, normal, walls[wall])
    found = gathered(gpu, lightmap, position, normal)
    # an edge of the wall may lie up to half a sample of 1/128 off, over a fifth of the sight at least
    np.testing.assert_allclose(found, np.repeat(expected[:, None], 3, 1), rtol=0.01, atol=0.01 * 7)
    assert np.abs(found[:, 0] - expected).mean() < 0.002 * 7
    lightmap.release()


def test_radiosity_is_what_is_emitted_and_what_is_reflected(gpu: Gpu) -> None:
    """Closed walls of different albedo under even light: each point receives Σ F (E + ρH)."""
    walls, albedos = room((1.0, 1.0, 1.0)), (0.1, 0.9, 0.3, 0.7, 0.5, 0.2)
    scene = quads_scene(walls, [grey(a, float(k == 4)) for k, a in enumerate(albedos)], list(range(6)))
    lightmap = Lightmap.of(gpu, scene, parametrize(scene, texels=1000))
    put(lightmap, "t_irradiance", (lightmap.pool.surfaces.area > 0)[..., None] * np.array([1.0, 2.0, 3.0]))
    position, normal = random_points(scene, 20, 1).positions_normals(scene)
    factors = np.array([point_to_polygon(position, normal, wall) for wall in walls])
    expected = factors.T @ (np.array(albedos)[:, None] * [1.0, 2.0, 3.0] + np.eye(6)[4][:, None])
    np.testing.assert_allclose(gathered(gpu, lightmap, position, normal), expected, rtol=0.01)
    lightmap.release()


def test_textures_are_looked_up(gpu: Gpu, forest: Callable[..., Forest]) -> None:
    """And leaves of several levels: what is gathered under light that is even does not depend on the tree."""
    from app.scene.load import load_scene

    trees = forest(load_scene("textured-room"), texels=3000)
    lightmap, rng = trees.lightmap, np.random.default_rng(5)
    position, normal = random_points(lightmap.scene, 16, 3).positions_normals(lightmap.scene)
    light = np.ones((trees.pool.tiles, 16, 16, 3))
    trees.write({"t_irradiance": light, "t_residual": light})
    before = gathered(gpu, lightmap, position, normal)
    trees.grow(0.4, rng)
    trees.grow(0.4, rng)
    light = np.ones((trees.pool.tiles, 16, 16, 3))
    trees.write({"t_irradiance": light, "t_residual": light})
    after = gathered(gpu, lightmap, position, normal)
    assert before.min() > 0 and np.ptp(before) > 0.2 * before.mean(), "colours are there"
    np.testing.assert_allclose(after, before, rtol=0.02)  # texels of the texture are means over texels of the lightmap


def test_what_is_black_or_open_gives_nothing(gpu: Gpu) -> None:
    """A lamp seen from behind, and no surface at all."""
    lamp = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]  # faces +z
    floor = [[0.0, 0.0, -1.0], [1.0, 0.0, -1.0], [1.0, 1.0, -1.0], [0.0, 1.0, -1.0]]
    scene = quads_scene([lamp, floor], (grey(0.5, 5.0), grey(0.5)), [0, 1])
    lightmap = Lightmap.of(gpu, scene, parametrize(scene, texels=500))
    position = np.array([[0.5, 0.5, -1.0], [0.5, 0.5, 0.0]])
    np.testing.assert_array_equal(gathered(gpu, lightmap, position, np.array([[0, 0, 1.0]] * 2)), 0.0)
    lightmap.release()


def test_tangents_are_square_to_normals() -> None:
    normal = np.concatenate([np.eye(3), -np.eye(3), [[0.6, 0.0, 0.8]]])
    x = tangents(normal, np.linspace(0, 6, len(normal)))
    np.testing.assert_allclose(np.linalg.norm(x, axis=1), 1.0)
    np.testing.assert_allclose(np.einsum("nk,nk->n", x, normal), 0.0, atol=1e-15)


# -- the error that it says --------------------------------------------------------------------------------------------


def test_noise_of_the_hemicubes_cancels() -> None:
    """Light that is off by 1 % at random, gathered with three times as much noise, twice."""
    rng, right = np.random.default_rng(8), np.full((4000, 3), 5.0)
    solution = right * (1 + 0.01 * rng.standard_normal((4000, 1)))
    seen = right[:, None] * (1 + 0.03 * rng.standard_normal((4000, TURNS, 1)))
    error = estimate_error(solution, seen, np.ones(4000), np.zeros(3))
    assert error is not None and error.points == 4000
    assert error.rms == pytest.approx(0.01, rel=0.1)
    assert error.median == pytest.approx(0.01 * 0.674, rel=0.15)  # 67 % of a normal spread


def test_chance_does_not_come_back(rng: np.random.Generator) -> None:
    """Errors of 3 % that cancel, where nine tenths of the light returns: their mean over 256 points is not a tenth of that
    spread by more than chance, but counts ten times in each."""
    right = np.full((POINTS, 3), 2.0)
    squares = []
    for _ in range(200):
        solution = right * (1 + 0.03 * rng.standard_normal((POINTS, 1)))
        error = estimate_error(solution, np.repeat(right[:, None], TURNS, 1), np.ones(POINTS), np.full(3, 0.9))
        assert error is not None
        squares.append(error.rms**2)
    assert np.sqrt(np.mean(squares)) == pytest.approx(0.03, rel=0.1)  # 0.035 with it


def test_what_lacks_everywhere_comes_back() -> None:
    """Where all points lack a tenth and half of it returns, two tenths are missing."""
    right = np.ones((50, 3))
    error = estimate_error(0.8 * right, np.repeat(0.9 * right[:, None], TURNS, 1), np.ones(50), np.full(3, 0.5))
    assert error is not None
    assert error.rms == pytest.approx(0.2) and error.bias == pytest.approx(-0.2)


def test_points_are_where_the_light_is_and_weigh_less_there(rng: np.random.Generator) -> None:
    """One candidate in fifty is a hundred times as bright: means are those of the candidates, nearer than of even points."""
    light = np.where(np.arange(5000) % 50 == 0, 100.0, 1.0)[:, None] * np.ones(3)
    found = []
    for _ in range(40):
        chosen, weights = choose_points(light, rng)
        assert 60 < (light[chosen, 0] > 1).sum() < 180  # of 256; two thirds of the light is there
        found.append(weights @ light[chosen, 0] / weights.sum())
    assert np.mean(found) == pytest.approx(light.mean(), rel=0.05)
    assert np.std(found) < 0.15 * light.mean()  # of 256 even points: 0.29


@pytest.mark.parametrize("broken", [np.nan, np.inf])
def test_nothing_is_expected_of_the_dark_or_the_broken(broken: float) -> None:
    black = np.zeros((9, 3))
    assert estimate_error(black, np.zeros((9, TURNS, 3)), np.ones(9), np.zeros(3)) is None
    assert estimate_error(black + broken, np.ones((9, TURNS, 3)), np.ones(9), np.zeros(3)) is None


def test_time_that_is_up_leaves_some_points(gpu: Gpu, box: Lightmap) -> None:
    box.light_target.clear(*[1.0] * 3, 0.0)
    estimator = ErrorEstimator(gpu, box, 8)
    all_of_them, some = (run_to_end(estimator.parts(np.zeros(3), seconds)) for seconds in (np.inf, 0.0))
    assert all_of_them is not None and some is not None
    assert 0 < some.points <= FEWEST < all_of_them.points <= POINTS
    assert some.rms == pytest.approx(all_of_them.rms, rel=0.5)
    box.light_target.clear(*[np.inf] * 3, 0.0)
    assert run_to_end(estimator.parts(np.zeros(3), 0.0)) is None
    estimator.release()


@pytest.mark.parametrize("residual", [0.3, 0.03])
def test_a_furnace_knows_what_it_lacks(gpu: Gpu, residual: float) -> None:
    """H = E / (1 - ρ) everywhere: how far off a solve is that stopped early is known exactly."""
    scene = quads_scene(room(), (grey(0.5, 3.0),))
    half = begin(gpu, scene, texels=1500, residual=residual, resolution=64)
    half.shoot()
    points = random_points(half.lightmap.scene, POINTS, 7)
    H = irradiance_of(half.lightmap, points)
    right = np.full_like(H, 3.0 / (1 - 0.5))
    estimator = ErrorEstimator(gpu, half.lightmap, 32)
    error = run_to_end(estimator.parts(half.book.returned, np.inf))
    assert error is not None and error.points == POINTS
    # what is unshot is not even: its light that comes back is taken to be
    assert error.rms == pytest.approx(relative_rms(H, right), rel=0.2)
    spread = error.rms / (1 - 0.5) / np.sqrt(POINTS)  # of the mean over random points, which comes back
    assert error.bias == pytest.approx(bias(H, right), rel=0.1, abs=3 * spread)
    estimator.release()
    half.release()


def test_shadows_on_coarse_texels_are_expected_to_be_off(gpu: Gpu) -> None:
    """Within a factor of two of how far they are from ten times as many texels."""
    coarse, fine = (begin(gpu, table_room(), density=density, residual=3e-3, resolution=128) for density in (6.0, 20.0))
    for one in (coarse, fine):
        one.settle()
    points = random_points(coarse.lightmap.scene, 2000, 3)
    H, right = (irradiance_of(one.lightmap, points) for one in (coarse, fine))
    lit = lit_points(right)
    true = relative_rms(H[lit], right[lit])
    errors = []
    for one in (coarse, fine):
        estimator = ErrorEstimator(gpu, one.lightmap, 16)
        error = run_to_end(estimator.parts(one.book.returned, np.inf))
        assert error is not None
        errors.append(error.rms)
        estimator.release()
        one.release()
    assert true / 2 < errors[0] < 2 * true, f"{errors[0]:.2%} for {true:.2%}"
    assert errors[1] < 0.7 * errors[0]


# -- of a session ------------------------------------------------------------------------------------------------------


@pytest.fixture
def session(gpu: Gpu) -> Session:
    return Session(gpu, options=ShootingOptions(resolution=64, residual=0.1), atlas=AtlasOptions(texels=800))


def test_a_session_at_rest_says_what_it_expects(gpu: Gpu, session: Session) -> None:
    """A part per frame, once light is at rest; another light is judged anew."""
    session.open_now("cornell-box")
    session.solve(Stop())
    assert session.expected is None and not session.at_rest
    frames, shares = 0, [0.0]
    while not session.at_rest:
        session.poll()
        shares.append(session.estimate.share)
        frames += 1
    assert frames > 64 and np.diff(shares).min() >= 0
    first = session.expected
    assert first is not None and 0.005 < first.rms < 0.5
    session.set_material(1, session.scene.materials[1])
    session.work(1)
    assert session.expected is None
    session.solve(Stop())
    session.estimate_now(lambda share: None)
    second = session.expected
    assert second is not None and second != first and second.rms == pytest.approx(first.rms, rel=0.5)
    session.release()


def test_as_many_other_shots_are_other_light(gpu: Gpu, session: Session) -> None:
    session.open_now("cornell-box")
    session.solve(Stop(work=8))
    session.estimate_now(lambda share: None)
    assert session.expected is not None
    session.restart()
    session.set_options(session.options.replace(visibility="depth"))
    session.solve(Stop(work=8))
    assert session.expected is None
    session.release()


def test_a_hand_comes_first(gpu: Gpu, session: Session) -> None:
    session.open_now("cornell-box")
    session.solve(Stop(work=8))
    session.run.running = False
    for _ in range(3):
        session.poll(interactive=True)
    assert session.estimate.share == 0.0 and not session.at_rest
    for _ in range(3):
        session.poll()
    assert session.estimate.share > 0.0
    session.release()


def test_nothing_of_it_stays(gpu: Gpu, session: Session, forgotten: Callable[[], list[object]]) -> None:
    session.open_now("cornell-box")
    session.solve(Stop(work=8))
    session.estimate_now(lambda share: None)
    session.open_now("cornell-box")
    before = held(gpu)
    for _ in range(2):
        session.solve(Stop(work=8))
        session.run.running = False
        for _ in range(4):
            session.poll()
        assert session.estimate.share > 0.0, "on its way"
        session.run.running = True
        session.open_now("cornell-box")
    assert held(gpu) == before and not forgotten()
    session.release()
