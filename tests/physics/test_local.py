"""The local matrix: a whole scene is solved exactly, a part of it makes no light, and how it came about plays no part."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import ArrayLike
from solver_scenes import Solution, begin, grey, quads_scene, room, table_room

from app.errors import UserError
from app.gpu import Gpu, Texture
from app.reference.dense import irradiance_at, solve_dense
from app.scene.model import F64, Scene
from app.solvers.local.options import BOUNCES, OUTSIDE
from app.solvers.local.solver import Local
from app.util.parts import run_to_end
from app.validation.scenes import furnace

PIECES = 3000  # of work: a set that is not there then never will be
LAMP, RED = 2, 1
# the series of the paper counts short closed paths more than once, see tests/gpu/test_local_matrix.py
EXACT = pytest.mark.parametrize("bounces", [b for b in BOUNCES if b != "series"])


def lit_by(gpu: Gpu, scene: Scene, density: float = 3, **options: object) -> Solution:
    """Settled, seen from the middle of the scene. 32 bits and, unless given, the whole scene in the set."""
    known: dict[str, object] = {
        "patches": 1024,
        "patch_level": 0,
        "bits": 32,
        "rays": 256,
        "shadow_rays": 32,
        "missing": 0.0,
    }
    solution = begin(gpu, scene, density=density, solver="local", **(known | options))  # type: ignore[arg-type]
    settle(solution)
    return solution


def matrix_of(solution: Solution) -> Local:
    assert isinstance(solution.solver, Local)
    return solution.solver


def settle(solution: Solution) -> None:
    for _ in range(PIECES):
        if solution.solver.poll().converged:
            solution.solver.settle()
            return
        run_to_end(solution.solver.work(1))
    raise AssertionError("did not settle")


def walk(solution: Solution, *eyes: ArrayLike) -> None:
    """To each of these places, and settle there."""
    for eye in eyes:
        matrix_of(solution).set_observer(np.asarray(eye, np.float64))
        settle(solution)


def vector(solution: Solution, texture: Texture) -> F64:
    """(nodes, 3) of a vector with a number for each slot, of the nodes in the set [W/m²]."""
    there = matrix_of(solution).set.node >= 0
    values = np.frombuffer(texture.read(), np.float32).reshape(-1, 4)[:, :3].astype(np.float64)
    return np.asarray(values[there] * solution.lightmap.unit)


# -- the whole scene in the set ----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def by_others(_gpu: Gpu) -> dict[str, F64]:
    """H of the table room at 2 texels/m, of which every edge is a multiple, by the dense matrix and by gathering."""
    scene = table_room()
    gathered = begin(_gpu, scene, density=2, solver="gathering", noise=1e-3, smooth=False)
    gathered.gather(512)
    dense = solve_dense(scene, max_patches=600)
    found = {
        "dense": irradiance_at(dense, scene, gathered.position, gathered.normal.astype(np.float64)),
        "gathering": gathered.H,
    }
    gathered.release()
    return found


@EXACT
def test_the_whole_scene_is_what_the_dense_matrix_and_gathering_say(
    gpu: Gpu, by_others: dict[str, F64], bounces: str
) -> None:
    """Object by object, within 1 %: what is left is the noise of rays, of which each has some 10⁵."""
    lit = lit_by(gpu, table_room(), 2, bounces=bounces, rays=1024, shadow_rays=128)
    assert np.abs(matrix_of(lit).set.outside).max() < 1e-3, "all of the scene is inside"
    for what, H in by_others.items():
        mean = np.abs(lit.means(lit.H - H)).mean() / lit.H.mean()
        total = np.average(lit.H.mean(1), weights=lit.area) / np.average(H.mean(1), weights=lit.area)
        assert mean < 0.01 and total == pytest.approx(1, abs=0.01), what
    lit.release()


@EXACT
@pytest.mark.parametrize("albedo", [0.5, 0.9])
def test_a_closed_room_that_glows_has_the_light_of_a_furnace(gpu: Gpu, bounces: str, albedo: float) -> None:
    """H = E / (1 - ρ) on every texel, since rows sum to 1: but for shadow rays, 0.1 %."""
    lit = lit_by(gpu, furnace(albedo), density=8, bounces=bounces)
    indirect = vector(lit, matrix_of(lit).lighting.indirect)
    np.testing.assert_allclose(indirect, albedo / (1 - albedo), rtol=2e-3)
    lit.release()


def test_a_bright_room_is_beyond_sixteen_bits_and_the_solve_says_so(gpu: Gpu) -> None:
    """Light that goes round a thousand times goes round in what half floats round away; in 32 bits it does not."""
    for bits, said in ((16, True), (32, False)):
        lit = lit_by(gpu, furnace(0.999), density=8, bits=bits)
        note = lit.solver.settle().note
        assert (note is not None and "--bits 32" in note) == said
        assert (abs(np.average(lit.H.mean(1), weights=lit.area) * 0.001 - 1) < 0.01) != said
        lit.release()


# -- light with edges --------------------------------------------------------------------------------------------------


def test_light_is_reflected_from_where_it_falls(gpu: Gpu) -> None:
    """The floor is four patches, most of each in the shade of a low table, whose underside sees their lit rims from afar. Were
    they as bright all over, it would have more than three times the light. Further bounces are those of whole patches, which
    adds a sixth: the rims are the brightest to the walls, too."""
    lamp = [[1.5, 2.5, 1.5], [2.5, 2.5, 1.5], [2.5, 2.5, 2.5], [1.5, 2.5, 2.5]]
    top = np.array([[0.5, 0.3, 0.5], [0.5, 0.3, 3.5], [3.5, 0.3, 3.5], [3.5, 0.3, 0.5]])
    underside = top[::-1] - [0.0, 0.05, 0.0]
    scene = quads_scene(
        [*room((4.0, 3.0, 4.0)), lamp, top, underside], [grey(0.1), grey(0.0, 20.0)], [0] * 6 + [1, 0, 0]
    )
    gathered = begin(gpu, scene, density=4, solver="gathering", noise=1e-3, smooth=False)
    gathered.gather(256)
    lit = lit_by(gpu, scene, 4, patch_level=3, rays=1024)
    assert (matrix_of(lit).patches.end - matrix_of(lit).patches.start).max() == 64
    found, wanted = (
        np.average(one.H[one.object == 8].mean(1), weights=one.area[one.object == 8]) for one in (lit, gathered)
    )
    assert found == pytest.approx(wanted, rel=0.2)
    gathered.release()
    lit.release()


# -- rows --------------------------------------------------------------------------------------------------------------


def test_rows_sum_to_what_does_not_escape_and_pairs_are_reciprocal(gpu: Gpu) -> None:
    """Of patches and clusters."""
    lit = lit_by(gpu, table_room(), patches=128, outside="cascade")
    held = matrix_of(lit).set
    there = held.node >= 0
    factors = held.matrix().toarray()
    area = held.area[there]
    np.testing.assert_allclose(factors * area[:, None], (factors * area[:, None]).T, atol=1e-12)
    np.testing.assert_allclose(factors.sum(1), held.received[there], atol=1e-3)
    assert len(set(matrix_of(lit).patches.level[held.nodes].tolist())) > 1, "clusters must be there"
    assert lit.book.imbalance_share == pytest.approx(0, abs=0.02)  # clusters are coarse beside a table
    lit.release()


@EXACT
@pytest.mark.parametrize("outside", OUTSIDE)
def test_no_more_light_is_reflected_than_arrives(gpu: Gpu, bounces: str, outside: str) -> None:
    """What the set receives is what lamps and the outside send it, and what it sends itself, which is less than it reflects."""
    lit = lit_by(gpu, table_room(), patches=128, bounces=bounces, outside=outside)
    solver = matrix_of(lit)
    held, there = solver.set, solver.set.node >= 0
    indirect = vector(lit, solver.lighting.indirect)
    outside_light = np.frombuffer(solver.lighting.outside.read(), np.float32)[:3] * lit.lightmap.unit
    reflected = vector(lit, solver.lighting.reflected)  # direct light
    area, albedo = held.area[there][:, None], solver.members.albedo[held.nodes]
    came = (area * held.outside[there][:, None] * outside_light).sum()
    sent = (area * (reflected + albedo * indirect)).sum()
    assert (area * indirect).sum() <= (came + sent) * (1 + 1e-4)
    assert (area * indirect).sum() > 0.1 * sent
    lit.release()


# -- how it came about -------------------------------------------------------------------------------------------------

HERE, THERE, ELSEWHERE = (0.6, 1.2, 0.6), (3.3, 2.0, 3.5), (3.4, 0.4, 0.5)


@EXACT
@pytest.mark.parametrize("outside", OUTSIDE)
def test_the_light_is_the_same_whichever_way_the_observer_came(gpu: Gpu, bounces: str, outside: str) -> None:
    """Within 0.5 %, as the mean over the set."""
    straight = lit_by(gpu, table_room(), 2, patches=128, bounces=bounces, outside=outside)
    walk(straight, HERE)
    other = lit_by(gpu, table_room(), 2, patches=128, bounces=bounces, outside=outside)
    walk(other, THERE)
    assert np.abs(other.H - straight.H).mean() > 0.01 * straight.H.mean(), "the walk must change something"
    walk(other, ELSEWHERE, THERE, HERE)
    assert set(matrix_of(straight).set.nodes.tolist()) == set(matrix_of(other).set.nodes.tolist())
    assert np.abs(other.H - straight.H).mean() < 0.005 * straight.H.mean()
    straight.release()
    other.release()


def test_what_is_shown_does_not_jump_when_patches_come_and_go(gpu: Gpu) -> None:
    """In each picture a quarter of what is missing comes."""
    lit = lit_by(gpu, table_room(), patches=128, swaps=64, outside="constant")  # clusters are smoothed by their size
    before = lit.H
    matrix_of(lit).set_observer(np.array(THERE))
    run_to_end(lit.solver.work(1))
    solver = matrix_of(lit)
    assert solver.issued > 128, "nodes must have entered"
    first = np.abs(lit.H - before).mean()
    settle(lit)
    assert np.abs(lit.H - before).mean() > 3 * first
    lit.release()


@pytest.mark.parametrize("outside", OUTSIDE)
def test_texels_are_in_the_slot_of_their_node_all_along_a_walk(gpu: Gpu, outside: str) -> None:
    """Also while rows are missing, when what is to enter waits: no two nodes of the set cover a texel."""
    lit = lit_by(gpu, table_room(), density=6, patches=192, outside=outside, shadow_rays=4)
    solver = matrix_of(lit)
    for eye in (HERE, THERE, ELSEWHERE, HERE):
        solver.set_observer(np.array(eye))
        for _ in range(12):
            run_to_end(solver.work(1))
            held, patches = solver.set, solver.patches
            for slot in np.flatnonzero(held.node >= 0):
                node = held.node[slot]
                assert (held.slot_at[patches.start[node] : patches.end[node]] == slot).all()
    lit.release()


# -- edits -------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=BOUNCES)
def whole(_gpu: Gpu, request: pytest.FixtureRequest) -> Iterator[Solution]:
    """All of a room in the set, in patches of half a metre, of which every edge is a multiple; smaller where that is no work."""
    density = 3 if request.param == "iterate" else 2
    solution = lit_by(_gpu, table_room(), density=density, bounces=request.param)
    yield solution
    solution.release()


def painted(solution: Solution, material: int, **change: object) -> None:
    """Give the table room's own materials, but for one that is another, to a solution."""
    materials = list(table_room().materials)
    materials[material] = replace(materials[material], **change)  # type: ignore[arg-type]
    matrix_of(solution).set_materials(tuple(materials))


def emission_of(material: int, factor: float) -> tuple[float, ...]:
    return tuple(factor * e for e in table_room().materials[material].emission)


def test_another_lamp_is_lit_in_one_piece_of_work_and_costs_no_ray(gpu: Gpu, whole: Solution) -> None:
    """Light is linear in it: but for light from outside, a row's thousandth, that follows a bounce later, and what the first
    bounces of ``iterate`` leave."""
    solver = matrix_of(whole)
    bounces = solver.options.bounces
    painted(whole, LAMP)
    settle(whole)
    before, traced = whole.H, solver.rows.traced + solver.direct.traced
    painted(whole, LAMP, emission=emission_of(LAMP, 2))
    run_to_end(solver.work(1))
    assert solver.rows.traced + solver.direct.traced == traced
    left = 0.05 if bounces == "iterate" else 1e-4
    assert np.abs(whole.H - 2 * before).mean() < left * before.mean()


def test_lamps_switched_off_are_dark(gpu: Gpu, whole: Solution) -> None:
    """But for what bounces leave."""
    painted(whole, LAMP)
    settle(whole)
    before = whole.H.max()
    painted(whole, LAMP, emission=emission_of(LAMP, 0))
    assert not whole.solver.poll().converged
    settle(whole)
    assert np.abs(whole.H).max() < 1e-3 * before


def test_another_albedo_ends_where_a_fresh_solve_ends(gpu: Gpu, whole: Solution) -> None:
    painted(whole, LAMP)
    settle(whole)
    before = whole.H
    painted(whole, RED, albedo=(0.1, 0.7, 0.2))
    run_to_end(whole.solver.work(1))
    settle(whole)
    density, bounces = whole.lightmap.charts.density, matrix_of(whole).options.bounces
    fresh = lit_by(gpu, whole.lightmap.scene, density, bounces=bounces)
    assert np.abs(before - fresh.H).mean() > 0.02 * fresh.H.mean(), "the edit must change something"
    assert np.abs(whole.H - fresh.H).mean() < 1e-4 * fresh.H.mean()
    fresh.release()


def test_an_edit_before_all_tiles_are_lit_loses_no_light(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tiles from which shadow rays come late are looked at, too. How many rays each had plays a small part."""
    monkeypatch.setattr("app.solvers.local.tiles.AT_ONCE", 2)
    monkeypatch.setattr("app.solvers.local.tiles.NEAR", 2)
    edited, fresh = (
        begin(gpu, table_room(), density=4, solver="local", patches=16, rays=16, shadow_rays=16) for _ in range(2)
    )
    settle(fresh)
    while not matrix_of(edited).issued:
        run_to_end(edited.solver.work(1))
    (lit,) = matrix_of(edited).direct.sets
    assert 0 < np.count_nonzero(lit.passes) < np.count_nonzero(edited.lightmap.pool.slot_texels)
    for factor in (2, 1):
        painted(edited, LAMP, emission=emission_of(LAMP, factor))
        run_to_end(edited.solver.work(1))
    settle(edited)
    found, wanted = (
        np.sum(one.lightmap.light_of(matrix_of(one).direct.light)[..., 0] * one.lightmap.pool.surfaces.area)
        for one in (edited, fresh)
    )
    assert found == pytest.approx(wanted, rel=0.02)
    edited.release()
    fresh.release()


# -- bad input ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "what"),
    [
        ({"patches": 16384, "matrix_memory": 65536}, ""),
        ({"patches": 1024, "matrix_memory": 1}, "--matrix-memory 1: the matrix of"),
        ({"patches": 1024, "row_memory": 1, "rays": 1024}, "--row-memory 1:"),
    ],
)
def test_what_does_not_fit_says_so(gpu: Gpu, options: dict[str, object], what: str) -> None:
    """A set of more patches than the scene has is the scene."""
    if not what:
        lit = lit_by(gpu, furnace(0.5), density=4, **options)
        assert matrix_of(lit).set.most == 128 and matrix_of(lit).set.free == 32
        lit.release()
        return
    with pytest.raises(UserError, match=what):
        begin(gpu, table_room(), density=6, solver="local", patch_level=0, **options)


def test_an_observer_who_is_nowhere_says_so_and_one_far_away_sees_the_scene(gpu: Gpu) -> None:
    lit = lit_by(gpu, table_room(), patches=128)
    with pytest.raises(UserError, match="nan"):
        matrix_of(lit).set_observer(np.array([0.0, np.nan, 0.0]))
    walk(lit, (1e6, 0.0, 0.0))
    assert matrix_of(lit).set.nodes.size and np.isfinite(lit.H).all()
    lit.release()


def test_quadtrees_are_refused(gpu: Gpu) -> None:
    with pytest.raises(UserError, match="uniform texels"):
        begin(gpu, table_room(), density=4, solver="local", adaptive=True)
