"""Light that moves with the leaves: what splits and merges keep, and that nothing leaks."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from forests import OTHER_TILES, SCENES, Forest, forest, places
from gl_objects import forgotten, held
from solver_scenes import grey, quads_scene, room, table_room

from app.atlas.charts import DEFAULT_TILE, TILES
from app.gpu import Gpu
from app.lightmap.options import STORAGE
from app.scene.load import load_scene

__all__ = ["forest", "forgotten"]

# How far storage may be off for each texel, as a share of its light or in stored units: float sums; a half float has 11 bits and
# llvmpipe cuts them off; 8 bits are steps of 1/255, rounded or cut
RELATIVE = {"rgba32f": 1e-4, "rgba16f": 2.0**-9, "fixed8": 0.0}
ABSOLUTE = {"rgba32f": 0.0, "rgba16f": 0.0, "fixed8": 2 / 255}


@pytest.mark.parametrize(
    ("name", "storage", "tile"),
    [
        *((name, storage, DEFAULT_TILE) for name in SCENES for storage in STORAGE),
        *(("table", "rgba32f", tile) for tile in OTHER_TILES),
    ],
)
def test_splits_and_merges_keep_all_energy(
    forest: Callable[..., Forest], rng: np.random.Generator, name: str, storage: str, tile: int
) -> None:
    trees = forest(SCENES[name](), storage=storage, tile=tile)
    trees.write_noise(rng, negative=storage != "fixed8")
    area = trees.pool.surfaces.area.sum()
    weight = trees.pool.surfaces.area[..., None]
    lights = np.array([(np.abs(tiles) * weight).sum((0, 1, 2)) for tiles in (*trees.light.values(), trees.shot)])
    lights = lights.sum(0)  # R is the difference of the others
    before = trees.energy
    for change in (trees.grow, lambda: trees.grow(0.3, rng), trees.shrink, trees.shrink):
        change()
        change_of_energy = np.abs(trees.energy - before)
        assert (change_of_energy <= RELATIVE[storage] * lights + ABSOLUTE[storage] * area).all()
        before = trees.energy
    assert np.abs(before).min() > 0


@pytest.mark.parametrize("name", SCENES)
def test_what_was_pushed_and_pulled_is_what_it_was(
    forest: Callable[..., Forest], rng: np.random.Generator, name: str
) -> None:
    trees = forest(SCENES[name]())
    trees.write_noise(rng, negative=True)
    before = trees.by_tile()
    trees.grow()
    assert trees.by_tile().keys() != before.keys()
    while (after := trees.by_tile()).keys() != before.keys():  # leaves beside finer ones merge after these
        trees.shrink()
    for tile, values in before.items():
        np.testing.assert_allclose(after[tile], values, rtol=1e-4, atol=1e-5)  # float sums


@pytest.mark.parametrize("tile", TILES)
def test_push_interpolates(forest: Callable[..., Forest], tile: int) -> None:
    """Linear light stays linear two levels down, a texel away from where the leaf above ended; even light stays even."""
    trees = forest(quads_scene([room((4.0, 4.0, 4.0))[0]], [grey(0.5)]), texels=tile**2, tile=tile)
    assert len(trees.tree) == 1
    slope = np.array([[0.01, 0.02], [0.02, 0.0], [0.0, 0.0]])
    trees.write({"t_irradiance": 0.3 + places(trees) @ slope.T})
    trees.grow()
    expected = 0.3 + places(trees) @ slope.T
    covered = trees.pool.surfaces.area > 0
    rect = trees.pool.charts.chart_rects[0]
    uv = places(trees)
    inner = covered & ((uv > rect[:2] + 1.01) & (uv < rect[:2] + rect[2:] - 1.01)).all(-1)
    assert inner.sum() > tile**2
    H = trees.light["t_irradiance"]
    np.testing.assert_allclose(H[inner], expected[inner], atol=1e-5)
    np.testing.assert_allclose(H[covered][:, 2], 0.3, atol=1e-5)


@pytest.mark.parametrize("name", SCENES)
def test_who_has_shot_is_not_forgotten(forest: Callable[..., Forest], rng: np.random.Generator, name: str) -> None:
    """A texel's children have shot what it has shot, not what its neighbours have. Albedo is a half float on the GPU."""
    trees = forest(SCENES[name]())
    trees.write_noise(rng, negative=True)
    before = {tile: trees.shot[slot] for tile, slot in trees.tree.slots.items()}
    trees.grow()
    shot, split = trees.shot, 0
    for (level, x, y), slot in trees.tree.slots.items():
        above = before.get((level - 1, x // 2, y // 2))
        if above is not None:
            half = above[y % 2 * 8 : y % 2 * 8 + 8, x % 2 * 8 : x % 2 * 8 + 8]
            covered = trees.pool.surfaces.area[slot] > 0
            np.testing.assert_allclose(shot[slot][covered], half.repeat(2, 0).repeat(2, 1)[covered], atol=2**-11)
            split += 1
    assert split > 10


def test_what_was_sent_to_a_texel_is_known_to_its_children(forest: Callable[..., Forest]) -> None:
    """In the residual's a: with that of H, it tells whether a texel lies in shadow."""
    trees = forest(table_room())
    residual = trees.lightmap.texture("t_residual")
    residual.write(np.full((*residual.size[::-1], 4), 0.7, np.float32).tobytes())
    for change in (trees.grow, trees.shrink):
        change()
        raw = np.frombuffer(residual.read(), np.float32).reshape(*residual.size[::-1], 4)
        sent = trees.pool.tiles_from_image(raw)[..., 3]
        np.testing.assert_allclose(sent[trees.pool.surfaces.area > 0], 0.7, rtol=1e-5)


@pytest.mark.parametrize("storage", STORAGE)
def test_what_has_shot_all_makes_no_light(
    forest: Callable[..., Forest], rng: np.random.Generator, storage: str
) -> None:
    """r = 0 everywhere: as much below zero as above it in children that receive more and less than their parent did, or, where
    nothing can be negative, zero."""
    trees = forest(table_room(), storage=storage)
    noise = rng.uniform(0.2, 1.0, (*trees.pool.surfaces.face.shape, 3))
    trees.write({"t_irradiance": noise, "t_residual": 0 * noise})
    trees.grow()
    area = trees.pool.surfaces.area[..., None]
    unshot, light = ((tiles * area).sum() for tiles in reversed(trees.light.values()))
    assert abs(unshot) <= RELATIVE[storage] * light


def test_light_is_never_made_negative(forest: Callable[..., Forest], rng: np.random.Generator) -> None:
    """Single bright texels among black ones: what is interpolated must not go below zero."""
    trees = forest(table_room())
    spots = (rng.random((*trees.pool.surfaces.area.shape, 1)) < 0.05) * np.ones(3)
    trees.write({"t_irradiance": spots, "t_residual": spots})
    trees.grow()
    assert trees.light["t_irradiance"].min() >= 0
    assert np.isfinite(trees.light["t_irradiance"]).all() and np.isfinite(trees.light["t_residual"]).all()


def test_other_leaves_are_left_alone(forest: Callable[..., Forest], rng: np.random.Generator) -> None:
    trees = forest(table_room())
    trees.write_noise(rng)
    before = trees.by_tile()
    trees.grow(0.2, rng)
    after = trees.by_tile()
    kept = before.keys() & after.keys()
    assert 0 < len(kept) < len(before)
    for tile in kept:
        np.testing.assert_array_equal(after[tile], before[tile])


@pytest.mark.parametrize("storage", STORAGE)
def test_enlarging_keeps_the_light(forest: Callable[..., Forest], rng: np.random.Generator, storage: str) -> None:
    trees = forest(table_room(), storage=storage)
    trees.write_noise(rng)
    before, rows = trees.by_tile(), trees.lightmap.rows
    trees.lightmap.resize(trees.tree.resize(2 * trees.pool.tiles))
    assert trees.lightmap.rows > rows
    after = trees.by_tile()
    for tile, values in before.items():
        np.testing.assert_array_equal(after[tile], values)
    assert np.count_nonzero(trees.light["t_irradiance"][~trees.pool.used]) == 0


def test_the_textures_follow_the_node_set(forest: Callable[..., Forest], rng: np.random.Generator) -> None:
    """What is written tile by tile is what a new lightmap would hold."""
    trees = forest(load_scene("textured-room"))
    trees.grow(0.4, rng)
    trees.shrink()
    area = trees.pool.surfaces.area
    held_ones = {"t_position_area", "t_albedo", "t_normal_ids"}
    for name, array in trees.pool.arrays.items():
        texture = trees.lightmap.texture(name)
        read = np.frombuffer(texture.read(), array.dtype).reshape(array.shape)
        if name in held_ones:
            mine = area > 0
            read, array = trees.pool.tiles_from_image(read)[mine], trees.pool.tiles_from_image(array)[mine]
        np.testing.assert_array_equal(read, array, err_msg=name)


def test_splitting_and_merging_everything_leaves_no_objects(
    gpu: Gpu, forest: Callable[..., Forest], forgotten: Callable[[], list[object]]
) -> None:
    trees = forest(table_room(), texels=1000)
    trees.grow()  # makes room
    trees.shrink()
    counts, rooms = [], []
    for _ in range(6):
        trees.grow()
        trees.shrink()
        counts.append(held(gpu))
        rooms.append(trees.tree.room)
    assert len(set(counts)) == 1 and len(set(rooms)) == 1, counts
    assert not forgotten()
