"""Patches and clusters are ranges of texels; the set around the observer covers each once, and changes without running over."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from solver_scenes import table_room

from app.atlas.parametrize import parametrize
from app.lightmap.tile_pool import TilePool
from app.scene.model import Material
from app.solvers.local.patches import CELL_BITS, Patches, morton, patch_count, patches_of
from app.solvers.local.selection import Selection, distances, ranges, swaps

MOST = 200


def enclosed(texels: NDArray[np.int64]) -> NDArray[np.float64]:
    """No ray of any texel is lost."""
    return np.zeros(len(texels))


@pytest.fixture(scope="module")
def pool() -> TilePool:
    scene = table_room()
    return TilePool(scene, parametrize(scene, density=6))


@pytest.fixture(scope="module")
def patches(pool: TilePool) -> Patches:
    return patches_of(pool, 0, enclosed)


def texels_in(patches: Patches, nodes: NDArray[np.int64]) -> NDArray[np.int64]:
    """How many of the nodes each texel in order is in."""
    return np.bincount(ranges(patches.start[nodes], patches.end[nodes]), minlength=len(patches.order))


@pytest.mark.parametrize("level", [0, 1, 2])
def test_patches_are_squares_of_texels_and_cover_the_area_once(pool: TilePool, level: int) -> None:
    patches = patches_of(pool, level, enclosed)
    assert patches.count == patch_count(pool, level)
    size = (patches.end - patches.start)[: patches.count]
    assert size.max() == 4**level and (texels_in(patches, np.arange(patches.count)) == 1).all()
    area = pool.surfaces.area[pool.surfaces.area > 0].sum() / pool.space.scale**2
    assert patches.area[: patches.count].sum() == pytest.approx(area)
    x, y = patches.order & 0xFFFF, patches.order >> 16
    for node in range(patches.count):
        mine = slice(patches.start[node], patches.end[node])
        assert np.ptp(x[mine]) < 2**level and np.ptp(y[mine]) < 2**level


def test_every_cluster_is_its_children(patches: Patches) -> None:
    """Their texels, area and middle, and all of them face one way."""
    assert patches.level.max() > 2
    for node in np.flatnonzero(patches.level > 0):
        children = np.arange(*patches.children[node])
        assert (patches.level[children] == patches.level[node] - 1).all()
        assert (patches.start[children[0]], patches.end[children[-1]]) == (patches.start[node], patches.end[node])
        assert (patches.end[children[:-1]] == patches.start[children[1:]]).all()
        assert patches.area[children].sum() == pytest.approx(patches.area[node])
        middle = np.average(patches.centre[children], axis=0, weights=patches.area[children])
        np.testing.assert_allclose(middle, patches.centre[node], atol=1e-12)
        spread = np.ptp(patches.centre[children], axis=0)
        assert spread.max() <= patches.edge * 2 ** patches.level[node] + 1e-9


def test_no_cluster_is_of_what_is_open_and_what_is_enclosed(pool: TilePool) -> None:
    """What of the room lies beyond a plane, and is no more than a cube of 8 edges away from it, may count as either."""
    x = pool.surfaces.position[..., 0]
    beyond = pool.image_from_tiles((x > 2.0)[..., None])[..., 0]
    patches = patches_of(pool, 0, lambda texels: beyond[texels >> 16, texels & 0xFFFF].astype(float))
    away = pool.space.world_from_local(patches.centre)[: patches.count, 0] - 2.0
    sure = np.abs(away) > 8 * patches.edge * pool.space.scale
    for node in np.flatnonzero(patches.level > 0):
        mine = slice(patches.start[node], patches.end[node])
        assert np.ptp(np.sign(away[mine][sure[mine]])) == 0 if sure[mine].any() else True


def test_albedo_is_the_mean_over_the_area(pool: TilePool, patches: Patches) -> None:
    materials = tuple(Material(str(k), (0.1 * k, 0.5, 0.0)) for k in range(4))
    albedo = patches.albedo(materials, pool.scene.material_ids, pool.charts.face_triangle)
    top = patches.roots
    area = np.bincount(pool.scene.material_ids[pool.charts.face_triangle[patches.face]], patches.texel_area)
    assert patches.area[top] @ albedo[top, 0] == pytest.approx(area @ (0.1 * np.arange(4)))
    np.testing.assert_allclose(albedo[:, 1:], [[0.5, 0.0]] * len(patches), atol=1e-12)


def test_morton_codes_are_those_of_cubes_in_cubes() -> None:
    random = np.random.default_rng(1)
    cell = random.integers(0, 1 << CELL_BITS, (100, 3))
    code = morton(cell)
    np.testing.assert_array_equal(code >> 3, morton(cell >> 1))
    assert morton(np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1]])).tolist() == [1, 2, 4]


# -- which are in the set ----------------------------------------------------------------------------------------------


def all_may(nodes: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether they may enter."""
    return np.ones(len(nodes), bool)


EYES = ((0.0, 0.0, 0.0), (0.3, -0.1, 0.2), (-0.5, 0.3, -0.4), (9.0, 0.0, 0.0))


@pytest.mark.parametrize("eye", EYES)
def test_the_nearest_are_nearer_than_all_others(patches: Patches, eye: tuple[float, ...]) -> None:
    found = Selection(patches, MOST).nearest(np.array(eye))
    away = distances(patches, np.arange(patches.count), np.array(eye))
    assert len(found) == MOST and (np.diff(away[found]) >= 0).all()
    assert away[found].max() <= np.delete(away, found).min() + 1e-12


@pytest.mark.parametrize("eye", EYES)
def test_a_cascade_covers_each_texel_once_and_grows_with_distance(patches: Patches, eye: tuple[float, ...]) -> None:
    found = Selection(patches, MOST).cascade(np.array(eye))
    assert MOST / 2 < len(found) <= MOST
    assert (texels_in(patches, found) == 1).all()
    away = distances(patches, found, np.array(eye))
    level = patches.level[found]
    if np.linalg.norm(eye) < 1:
        assert away[level == level.min()].mean() < away[level == level.max()].mean()


def test_the_cascade_is_the_same_wherever_the_observer_came_from(patches: Patches) -> None:
    one, other = Selection(patches, MOST), Selection(patches, MOST)
    for eye in EYES:
        other.cascade(np.array(eye))
    for eye in EYES:
        np.testing.assert_array_equal(one.cascade(np.array(eye)), other.cascade(np.array(eye)))


def test_a_set_too_small_for_the_world_names_no_node_twice(patches: Patches) -> None:
    found = Selection(patches, 20).cascade(np.zeros(3))
    assert len(found) <= 20 and texels_in(patches, found).max() == 1


def test_a_set_with_room_for_all_is_all_patches(patches: Patches) -> None:
    found = Selection(patches, patches.count).cascade(np.zeros(3))
    np.testing.assert_array_equal(np.sort(found), np.arange(patches.count))


# -- how it changes ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cascade", [False, True])
def test_swaps_lead_to_what_is_wanted_and_never_run_over(patches: Patches, cascade: bool) -> None:
    selection, inside = Selection(patches, MOST), np.empty(0, np.int64)
    for eye in (*EYES, EYES[1]):
        observer = np.array(eye)
        wanted = selection.cascade(observer) if cascade else selection.nearest(observer)
        now = set(inside.tolist())
        for swap in swaps(patches, inside, wanted, MOST - len(inside), observer, all_may):
            assert set(swap.leave) <= now
            now = now - set(swap.leave) | set(swap.enter)
            assert len(now) <= MOST
            assert texels_in(patches, np.array(sorted(now))).max() == 1, "two nodes cover the same texel"
        assert now == set(wanted.tolist())
        inside = np.array(sorted(now))
        assert not list(swaps(patches, inside, wanted, 0, observer, all_may)), "nothing is nearer"


def test_what_is_nearest_enters_first_and_what_is_farthest_leaves_first(patches: Patches) -> None:
    selection = Selection(patches, MOST)
    inside, observer = selection.nearest(np.zeros(3)), np.array([0.4, 0.0, 0.1])
    plan = list(swaps(patches, inside, selection.nearest(observer), 0, observer, all_may))
    enter = [node for swap in plan for node in swap.enter]
    leave = [node for swap in plan for node in swap.leave]
    assert len(enter) > 10 and len(enter) == len(leave)
    assert (np.diff(distances(patches, np.array(enter), observer)) >= -1e-12).all()
    assert (np.diff(distances(patches, np.array(leave), observer)) <= 1e-12).all()


@pytest.mark.parametrize("cascade", [False, True])
def test_nothing_leaves_for_what_may_not_enter_yet(patches: Patches, cascade: bool) -> None:
    selection, observer = Selection(patches, MOST), np.array([0.4, 0.0, 0.1])
    choose = selection.cascade if cascade else selection.nearest
    inside, wanted = choose(np.zeros(3)), choose(observer)
    late = np.setdiff1d(wanted, inside)[::3]
    now = set(inside.tolist())
    for swap in swaps(patches, inside, wanted, MOST - len(inside), observer, lambda nodes: ~np.isin(nodes, late)):
        assert not set(swap.enter) & set(late.tolist())
        now = now - set(swap.leave) | set(swap.enter)
        assert len(now) <= MOST
    assert now != set(inside.tolist()), "the others enter"
    covered = texels_in(patches, np.array(sorted(now))) > 0
    assert covered.sum() >= 0.95 * (texels_in(patches, inside) > 0).sum(), "no hole is left where rows are waited for"
    left = len(late)
    rest = list(swaps(patches, np.array(sorted(now)), wanted, MOST - len(now), observer, all_may))
    assert len([node for swap in rest for node in swap.enter]) >= left
