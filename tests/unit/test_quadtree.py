"""Texture quadtrees: what may split and merge, and what stays the same whatever the leaves."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from atlas_scenes import own_cache
from quadtrees import DEPTH, SCENES, UNEVEN, WITH_TILES, grow, shuffle, small_lamp_room, tree_of
from solver_scenes import grey, quads_scene, room

from app.atlas.parametrize import parametrize
from app.lightmap.quadtree import SMALLEST, WHOLE_CHART, Quadtree, first_leaves
from app.lightmap.tile_pool import TilePool
from app.scene.model import F64, Scene

__all__ = ["own_cache"]

AREA = 1e-9  # relative: texels are cut exactly, in double precision


def places(tree: Quadtree) -> set[tuple[int, int, int]]:
    return {tree.tile(int(slot)) for slot in np.flatnonzero(tree.pool.used)}


def charts_in(pool: TilePool, slot: int) -> set[int]:
    face = pool.surfaces.face[slot]
    return set(pool.charts.face_chart[face[face >= 0]].tolist())


def worst_step(pool: TilePool) -> int:
    """Largest difference in level between two leaves that meet along an edge and share a chart."""
    pages = pool.slot_tables["t_pages"][..., 0].astype(np.int64) - 1
    pairs = set()
    for a, b in ((pages[1:], pages[:-1]), (pages[:, 1:], pages[:, :-1])):
        met = (a >= 0) & (b >= 0) & (a != b)
        pairs |= set(zip(a[met].tolist(), b[met].tolist(), strict=True))
    level = pool.leaves.level
    apart = [abs(int(level[a] - level[b])) for a, b in pairs if charts_in(pool, a) & charts_in(pool, b)]
    return max(apart, default=0)


# -- splits and merges -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "tile"), WITH_TILES)
def test_whatever_splits_and_merges_the_surface_is_covered_once(name: str, tile: int) -> None:
    tree, rng = tree_of(name, tile=tile), np.random.default_rng(0)
    pool = tree.pool
    _, areas = pool.scene.normals_areas
    surface = areas[pool.charts.face_triangle].sum()
    for _ in range(3):
        shuffle(tree, rng, rounds=3)
        assert len(set(pool.leaves.level[pool.used])) > 1, "nothing was split"
        assert pool.surfaces.area.sum() == pytest.approx(surface, rel=AREA)
        assert ((pool.surfaces.area > 0) == (pool.surfaces.face >= 0)).all()
        assert pool.texel_count == (pool.surfaces.face >= 0).sum()
        by_object = np.bincount(object_of(pool), pool.surfaces.area[pool.surfaces.face >= 0])
        np.testing.assert_allclose(by_object, object_areas(pool), rtol=AREA if name not in UNEVEN else 1e-2)


def object_of(pool: TilePool) -> np.ndarray:
    face = pool.surfaces.face[pool.surfaces.face >= 0]
    return np.asarray(pool.scene.object_ids[pool.charts.face_triangle[face]])


def object_areas(pool: TilePool) -> F64:
    triangle = pool.charts.face_triangle
    return np.bincount(pool.scene.object_ids[triangle], pool.scene.normals_areas[1][triangle])


@pytest.mark.parametrize("name", SCENES)
def test_neighbours_in_a_chart_differ_by_one_level_at_most(name: str) -> None:
    tree, rng = tree_of(name), np.random.default_rng(0)
    assert worst_step(tree.pool) <= 1, "at the start"
    for _ in range(3):
        shuffle(tree, rng, rounds=3)
        assert worst_step(tree.pool) <= 1
        assert tree.pool.leaves.level.max() > 1, "nothing is tested"


def test_a_leaf_deep_in_a_corner_takes_its_neighbours_along() -> None:
    """Three splits of the leaf at one place leave all levels from 0 to 3 around it."""
    tree = tree_of("walls", density=24.0)
    x, y, w, h = tree.pool.charts.chart_rects[0]
    assert min(w, h) >= 4 * tree.pool.tile
    for _ in range(3):
        grow(tree, [tree.pool.slot_at((x + w / 2 + 0.1, y + h / 2 + 0.1))])
    assert set(tree.pool.leaves.level[tree.pool.used]) == {0, 1, 2, 3}
    assert worst_step(tree.pool) == 1


@pytest.mark.parametrize("name", SCENES)
def test_merging_ends_at_the_first_leaves(name: str) -> None:
    tree, rng = tree_of(name), np.random.default_rng(7)
    first = places(tree)
    for _ in range(2):
        grow(tree, np.flatnonzero(tree.pool.used).tolist())
    assert len(tree) > 2 * len(first)
    assert not tree.merges(np.array([], np.int64))
    while families := tree.merges(np.flatnonzero(tree.pool.used & (rng.random(tree.pool.tiles) < 0.9))):
        tree.merge(families)
    while families := tree.merges(np.flatnonzero(tree.pool.used)):
        tree.merge(families)
    assert places(tree) == first


def test_what_is_split_and_merged_again_is_where_it_was() -> None:
    """Solvers do that once before there is light, which is for slots as they were."""
    tree = tree_of("walls")
    grow(tree, [0])
    before = dict(tree.slots)
    for slot in sorted(before.values())[:3]:
        change = tree.split([slot])
        assert tree.slots != before
        tree.merge([change.children.tolist()])
        assert tree.slots == before


def test_a_family_merges_whole_or_not_at_all() -> None:
    tree = tree_of("walls")
    change = grow(tree, [0])
    assert change is not None
    children = change.children[change.parents == 0]
    assert len(children) > 1
    assert not tree.merges(children[:-1])
    assert [sorted(f) for f in tree.merges(children)] == [sorted(children.tolist())]


def test_depth_ends_splitting() -> None:
    tree = tree_of("table")
    for _ in range(5):
        grow(tree, np.flatnonzero(tree.pool.used).tolist(), depth=2)
    assert not tree.splits(np.flatnonzero(tree.pool.used).tolist(), 2)
    assert set(tree.pool.leaves.level[tree.pool.used]) <= set(range(max(3, int(tree.pool.leaves.level.max()) + 1)))
    fresh = tree_of("table")
    assert set(tree.pool.leaves.level[tree.pool.used]) == {2} | {level for level, *_ in places(fresh) if level > 2}


def test_a_change_says_who_took_whose_place() -> None:
    tree = tree_of("table")
    before = {slot: tree.tile(slot) for slot in range(4)}
    split = grow(tree, list(before))
    assert split is not None and split.split
    for parent, child, corner in zip(split.parents.tolist(), split.children.tolist(), split.corner, strict=True):
        level, x, y = before.get(parent, (-1, -1, -1))
        if level >= 0:
            assert tree.tile(child) == (level + 1, 2 * x + corner[0], 2 * y + corner[1])
    after = {slot: tree.tile(slot) for slot in split.children.tolist()}
    merged = tree.merge(tree.merges(split.children))
    assert not merged.split
    for parent, child, corner in zip(merged.parents.tolist(), merged.children.tolist(), merged.corner, strict=True):
        level, x, y = tree.tile(parent)
        assert after[child] == (level + 1, 2 * x + corner[0], 2 * y + corner[1])


def test_fields_of_a_change_are_as_long_as_each_other() -> None:
    tree = tree_of("ball")
    change = grow(tree, np.flatnonzero(tree.pool.used).tolist())
    assert change is not None
    lengths = {len(getattr(change, f.name)) for f in dataclasses.fields(change) if f.name != "split"}
    assert len(lengths) == 1 and change.corner.shape[1] == 2


# -- room --------------------------------------------------------------------------------------------------------------


def test_slots_are_used_again() -> None:
    tree = tree_of("table")
    rooms, first = [], places(tree)
    for _ in range(6):
        splits = tree.splits(np.flatnonzero(tree.pool.used).tolist(), DEPTH)
        tree.split(splits)
        assert tree.room + len(tree) == tree.pool.tiles
        while families := tree.merges(np.flatnonzero(tree.pool.used)):
            tree.merge(families)
        rooms.append(tree.room)
        assert places(tree) == first
    assert len(set(rooms)) == 1 and tree.room + len(tree) == tree.pool.tiles
    assert sorted(tree.slots.values()) == np.flatnonzero(tree.pool.used).tolist()


def test_coarse_leaves_split_first() -> None:
    """So that a list cut short leaves the tree balanced."""
    tree = tree_of("table")
    tree.split(tree.splits([min(tree.slots.values())], DEPTH))
    levels = [tree.tile(slot)[0] for slot in tree.splits(np.flatnonzero(tree.pool.used).tolist(), DEPTH)]
    assert levels == sorted(levels) and len(set(levels)) > 1


def test_merging_needs_no_room() -> None:
    """A tree that has used its budget up must be able to shrink."""
    tree = tree_of("table")
    first = places(tree)
    grow(tree, np.flatnonzero(tree.pool.used).tolist())
    tree._free = []
    families = tree.merges(np.flatnonzero(tree.pool.used))
    before = len(tree)
    tree.merge(families)
    assert places(tree) == first
    assert tree.room == before - len(tree) > 0


def test_enlarging_keeps_everything() -> None:
    tree = tree_of("table")
    grow(tree, np.flatnonzero(tree.pool.used)[::3].tolist())
    pool = tree.pool
    slots, tiles, columns, room = dict(tree.slots), pool.tiles, pool.columns, tree.room
    arrays = pool.tile_arrays(np.arange(tiles))
    pages = pool.slot_tables["t_pages"]
    shapes = pool.shapes.copy()
    tree.resize(tiles + 100)
    assert (pool.tiles, pool.columns, tree.room, tree.slots) == (tiles + 100, columns, room + 100, slots)
    assert pool.size == (columns * pool.tile, -(-pool.tiles // columns) * pool.tile)
    for name, array in pool.tile_arrays(np.arange(tiles)).items():
        np.testing.assert_array_equal(array, arrays[name])
    np.testing.assert_array_equal(pool.slot_tables["t_pages"], pages)
    np.testing.assert_array_equal(pool.shapes[:tiles], shapes)
    splits = tree.splits(np.flatnonzero(pool.used).tolist(), DEPTH)
    assert tree.split(splits).children.max() < pool.tiles


# -- places ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "tile"), WITH_TILES)
def test_the_page_table_finds_the_leaf_at_any_place(name: str, tile: int, rng: np.random.Generator) -> None:
    tree = tree_of(name, tile=tile)
    shuffle(tree, rng, rounds=3)
    pool = tree.pool
    pages = pool.slot_tables["t_pages"][..., 0].astype(np.int64) - 1
    found = 0
    for uv in rng.uniform(0, pool.charts.size, (400, 2)):
        slot = int(pages[tuple((uv * pool.pages_per_texel).astype(int)[::-1])])
        assert slot == pool.slot_at((float(uv[0]), float(uv[1])))
        if slot < 0:
            continue
        found += 1
        leaf = pool.leaves.only(np.array([slot]))
        low = np.array([leaf.x[0], leaf.y[0]]) * tile / 2.0 ** leaf.level[0]
        assert ((uv >= low) & (uv < low + tile / 2.0 ** leaf.level[0])).all()
    assert found > 100


def test_all_covered_places_have_a_leaf(rng: np.random.Generator) -> None:
    """Whatever was split: points inside of faces, not only tiles that happen to be there."""
    tree = tree_of("ball")
    shuffle(tree, rng, rounds=5)
    uv = tree.pool.charts.face_uv
    weights = rng.dirichlet((1.0, 1.0, 1.0), len(uv))
    for u, v in np.einsum("fk,fkc->fc", weights, uv):
        assert tree.pool.slot_at((float(u), float(v))) >= 0


@pytest.mark.parametrize("tile", [8, 16])  # in a larger one the two share a leaf
def test_lamps_and_small_charts_begin_with_enough_texels(tile: int) -> None:
    """A lamp has WHOLE_CHART texels along its edge, a small panel one patch; what is larger begins with its root."""
    scene = small_lamp_room()
    charts = parametrize(scene, density=10, tile=tile)
    leaves = first_leaves(scene, charts, 6)
    pool = TilePool(scene, charts, leaves, adaptive=True)
    longer = charts.chart_rects[:, 2:].max(1)
    assert longer.min() < SMALLEST
    chart_of = {scene.object_ids[t]: c for t, c in zip(charts.face_triangle, charts.face_chart, strict=True)}
    face = pool.surfaces.face
    for name, enough in ((6, WHOLE_CHART), (7, SMALLEST)):
        chart = chart_of[name]
        mine = (face >= 0) & (charts.face_chart[face] == chart)
        coarsest = leaves.level[mine.any((1, 2))].min()
        assert longer[chart] * 2**coarsest >= enough > longer[chart] * 2 ** (coarsest - 1)
    assert set(leaves.level[:1]) == {0} or leaves.level.min() == 0
    # no leaf is split for nothing
    assert first_leaves(*unlit_walls(), 6).level.max() == 0


def unlit_walls() -> tuple[Scene, object]:
    scene = quads_scene(room((4.0, 3.0, 4.0)), [grey(0.5)])
    return scene, parametrize(scene, density=10)
