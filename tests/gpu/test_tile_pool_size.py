"""Node sets grow and shrink: leaves that move take everything along, and nobody sees or hears of it but the memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from forests import SCENES, Forest, forest, tables
from numpy.typing import NDArray
from solver_scenes import Solution, begin, table_room

from app.atlas.options import AtlasOptions
from app.gpu import Gpu, Texture
from app.lightmap.collapse import collapse
from app.lightmap.lightmap import Lightmap
from app.lightmap.options import STORAGE, LightmapOptions
from app.lightmap.quadtree import Quadtree, Tile, quadtree_pool
from app.lightmap.refinement import Refinement
from app.lightmap.textures import LIGHT
from app.render import resolve
from app.render.ages import LeafAges
from app.render.options import DisplayOptions
from app.render.resolve import BORDER, DisplayTexels
from app.session.session import Session
from app.session.view import View
from app.solvers import EnergyBalance, ShootingOptions
from app.solvers.shooting.patch_marks import PatchMarks
from app.solvers.shooting.receivers import receivers
from app.solvers.shooting.records import EMITTER
from app.solvers.shooting.replay import Replay
from app.solvers.shooting.solver import Shooting
from app.viewer.picture import picture

__all__ = ["forest"]

SMALL_ROOM = 4096  # texels that a tile pool has room for at least: a small scene outgrows it
MANY: dict[str, object] = {"depth": 3, "gradient": 0.06}
FEW: dict[str, object] = {"depth": 1, "gradient": 0.5}


@pytest.fixture(autouse=True)
def small_room(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("app.lightmap.quadtree", "app.lightmap.refinement"):
        monkeypatch.setattr(f"{module}.FIRST_ROOM", SMALL_ROOM)


# -- what moves --------------------------------------------------------------------------------------------------------


def by_leaf(tree: Quadtree, texture: Texture) -> dict[Tile, bytes]:
    """What a texture that is as large as the tile pool holds of each leaf."""
    pool, raw = tree.pool, np.frombuffer(texture.read(alignment=1), np.uint8)
    tiles = pool.tiles_from_image(raw.reshape(*pool.size[::-1], -1))
    return {tile: tiles[slot].tobytes() for tile, slot in tree.slots.items()}


def leaf_textures(lightmap: Lightmap) -> list[str]:
    return [*lightmap.pool.tile_arrays(np.empty(0, np.int64)), *LIGHT]


def scattered(trees: Forest, rng: np.random.Generator) -> None:
    """Leaves and holes all over the tile pool."""
    for _ in range(2):
        trees.grow()
    siblings = trees.tree.merges(np.flatnonzero(trees.pool.used))
    trees.transfer.apply(trees.tree.merge([family for family in siblings if rng.random() < 0.7]))


@pytest.mark.parametrize(("name", "storage"), [*(("table", storage) for storage in STORAGE), ("textured", "rgba32f")])
def test_leaves_take_along_all_that_is_theirs(
    gpu: Gpu, forest: Callable[..., Forest], rng: np.random.Generator, name: str, storage: str
) -> None:
    """To the bit: surfaces, light with its alpha, a solver's own texels, and how finely they shoot."""
    trees = forest(SCENES[name](), storage=storage)
    scattered(trees, rng)
    pool, tree, lightmap = trees.pool, trees.tree, trees.lightmap
    for light in LIGHT:
        texture = lightmap.texture(light)
        noise = rng.uniform(0, 1, (*texture.size[::-1], 4)) ** 8  # also very little
        kind = {"rgba32f": np.float32, "rgba16f": np.float16, "fixed8": np.uint8}[storage]
        texture.write((noise * (255 if storage == "fixed8" else 1)).astype(kind).tobytes())
    own = gpu.texture(lightmap.size, 4, "f4", rng.uniform(-1, 1, (*lightmap.size, 4)).astype(np.float32).tobytes())
    marks = PatchMarks(gpu, lightmap)
    marks.tiles[:] = rng.integers(0, 3, marks.tiles.shape) + EMITTER * rng.integers(0, 2, marks.tiles.shape)

    def held() -> list[dict[Tile, bytes]]:
        assert marks.texture.read() == marks.levels.tobytes()
        finer = {tile: marks.tiles[divmod(slot, pool.columns)].tobytes() for tile, slot in tree.slots.items()}
        return [*(by_leaf(tree, lightmap.texture(n)) for n in leaf_textures(lightmap)), by_leaf(tree, own), finer]

    marks.upload()
    before, memory, leaves, room = held(), sum(lightmap.memory.values()), len(tree), tree.room
    moves = tree.resize(len(tree) + 5)
    lightmap.resize(moves)
    own = lightmap.moved(own, moves)
    marks.resize(lightmap, moves)
    assert len(moves.old) > 20 and moves.new.max() < moves.old.min(), "it moved nothing"
    assert (len(before) > 6) == (name == "textured")
    for was, now in zip(before, held(), strict=True):
        assert now == was and len(set(was.values())) > 1
    assert len(tree) == leaves and tree.room == 5 < room
    assert sum(lightmap.memory.values()) < memory
    for texture in (own, *(lightmap.texture(light) for light in LIGHT)):  # books are added up over all slots
        assert texture.size == lightmap.size == pool.size
    covered = by_area(lightmap)
    assert covered[~pool.used].sum() == 0 and covered[pool.used].all()
    marks.release()
    own.release()


def by_area(lightmap: Lightmap) -> NDArray[np.bool_]:
    """Whether the GPU holds texels that cover a surface in each slot, also those beyond the last."""
    pool = lightmap.pool
    raw = np.frombuffer(lightmap.texture("t_position_area").read(), np.float32).reshape(*pool.size[::-1], 4)[..., 3]
    cells = raw.reshape(pool.rows, pool.tile, pool.columns, pool.tile).swapaxes(1, 2)
    found = (cells > 0).any((2, 3)).ravel()
    assert not found[pool.tiles :].any()
    return np.asarray(found[: pool.tiles])


def test_the_node_set_is_one_that_was_never_larger(forest: Callable[..., Forest], rng: np.random.Generator) -> None:
    """Tables, receivers and textures are what they would be for leaves that had always been there; and it grows again."""
    trees = forest(SCENES["textured"]())
    scattered(trees, rng)
    pool, tree = trees.pool, trees.tree
    whole = trees.energy
    trees.lightmap.resize(tree.resize(len(tree) + 1))
    assert sorted(tree.slots.values()) == np.flatnonzero(pool.used).tolist()
    assert all(tree.tile(slot) == tile for tile, slot in tree.slots.items())
    pages = pool.slot_tables["t_pages"][..., 0]
    for slot in np.flatnonzero(pool.used):
        side = 1 << (pool.depth - pool.leaves.level[slot])
        x, y = pool.leaves.x[slot] * side, pool.leaves.y[slot] * side
        assert (pages[y : y + side, x : x + side] == slot + 1).all()
    assert len(np.unique(pages)) == len(tree) + (pages == 0).any()
    for name, array in pool.arrays.items():
        texture = trees.lightmap.texture(name)
        read = np.frombuffer(texture.read(), array.dtype).reshape(array.shape)
        if name in leaf_textures(trees.lightmap):
            mine = pool.surfaces.area > 0
            read, array = pool.tiles_from_image(read)[mine], pool.tiles_from_image(array)[mine]
        np.testing.assert_array_equal(read, array, err_msg=name)
    quads = np.concatenate(receivers(pool, np.flatnonzero(pool.used)))
    assert (quads[:, 2] * quads[:, 3]).sum() >= pool.texel_count, "some leaves receive nothing"
    assert (quads[:, 1] + quads[:, 3]).max() <= pool.size[1]
    np.testing.assert_allclose(trees.energy, whole, rtol=1e-12)  # sums in another order
    trees.grow(0.3, rng)
    np.testing.assert_allclose(trees.energy, whole, rtol=1e-4)  # as any split
    assert tree.room + len(tree) == pool.tiles


@pytest.mark.parametrize("interpolation", BORDER)
def test_display_texels_are_the_same(
    gpu: Gpu, forest: Callable[..., Forest], rng: np.random.Generator, interpolation: str
) -> None:
    """Of new ones, and of those that stay and follow leaf by leaf, where the tile pool shrinks and grows between two frames."""
    trees, border = forest(table_room()), BORDER[interpolation]
    scattered(trees, rng)
    noise = rng.uniform(0, np.pi / trees.lightmap.unit, (*trees.pool.surfaces.area.shape, 3))
    trees.write({"t_irradiance": noise})
    options = DisplayOptions(layer="irradiance", tone_map="clamp", interpolation=interpolation)

    def shown(display: DisplayTexels, *, whole: bool) -> dict[Tile, bytes]:
        display.resolve("irradiance", options, scale=None, whole=whole)
        slots = np.flatnonzero(trees.pool.used).tolist()
        return {trees.tree.tile(slot): tables(display)["colours"][nth].tobytes() for nth, slot in enumerate(slots)}

    known = DisplayTexels(gpu, trees.lightmap, LeafAges(trees.pool), border)
    before, slots = shown(known, whole=True), trees.pool.tiles
    assert len(set(before.values())) == len(before), "it shows nothing"
    trees.lightmap.resize(trees.tree.resize(len(trees.tree)))
    assert not known.fits(border), "nor is there anything left that it could follow"
    fresh = DisplayTexels(gpu, trees.lightmap, LeafAges(trees.pool), border)
    assert shown(fresh, whole=True) == before
    trees.lightmap.resize(trees.tree.resize(slots))
    assert known.fits(border)
    for _ in range(-(-known.size[0] * known.size[1] // resolve.TEXELS_PER_FRAME)):
        after = shown(known, whole=False)
    assert after == before
    for display in (known, fresh):
        display.release()


# -- a solver that goes on -----------------------------------------------------------------------------------------------


@pytest.fixture
def planted(gpu: Gpu) -> Iterator[Callable[..., Solution]]:
    """The table's room before the first shot, on quadtrees."""
    made: list[Solution] = []

    def plant(**options: object) -> Solution:
        known: dict[str, object] = {"density": 3.0, "level": 1, "resolution": 64, "residual": 0.1}
        made.append(begin(gpu, table_room(), adaptive=True, **(known | options)))  # type: ignore[arg-type]
        return made[-1]

    yield plant
    for one in made:
        one.release()


def follow(solution: Solution, **options: object) -> None:
    """Turn knobs, and let the leaves follow until they rest."""
    solution.refine(**options)
    solution.step(8)
    solution.settle(3000)


def refinement_of(solution: Solution) -> Refinement:
    assert solution.lightmap.refinement is not None
    return solution.lightmap.refinement


def replay_of(solution: Solution) -> Replay:
    assert solution.solver.batch.replay is not None
    return solution.solver.batch.replay


def test_memory_follows_the_light(planted: Callable[..., Solution]) -> None:
    """A tree that merges gives its room back, once: what is left serves as it comes and goes a little."""
    box = planted(**MANY)
    refinement, pool = refinement_of(box), box.lightmap.pool
    first, sizes, tree = sum(box.lightmap.memory.values()), [pool.tiles], refinement.tree
    resize = refinement._resize

    def watched(slots: int) -> None:
        before, energy = leaves_of(box), box.solver.energy()
        resize(slots)
        sizes.append(pool.tiles)
        assert leaves_of(box) == before
        assert_same_energy(box.solver.energy(), energy)

    refinement._resize = watched  # type: ignore[method-assign]
    box.settle()
    peak, most, imbalance = sum(box.lightmap.memory.values()), len(tree), box.book.imbalance_share
    assert peak > 2 * first and len(sizes) > 2 and sizes == sorted(sizes), "the tile pool did not grow"
    grown = len(sizes)
    follow(box, **FEW)
    assert len(tree) < most / 3
    assert sizes[grown:] == [max(SMALL_ROOM // pool.tile**2, len(tree) * 3 // 2)]
    assert sum(box.lightmap.memory.values()) < peak / 2
    assert pool.tiles >= len(tree) and sorted(tree.slots.values()) == np.flatnonzero(pool.used).tolist()
    for depth in (2, 1, 2, 1):
        leaves = len(tree)
        follow(box, depth=depth)
        assert len(tree) != leaves
    assert len(sizes) <= grown + 2, "a slider dragged to and fro makes it anew each time"
    # shots since then are of the last tenth of the light, and strong ones are sound to 2 %
    assert box.book.imbalance_share == pytest.approx(imbalance, abs=2e-3)


def assert_same_energy(a: EnergyBalance, b: EnergyBalance) -> None:
    for name in ("absorbed", "escaped", "unshot"):  # the same sums of tiles, added up in another order
        np.testing.assert_allclose(getattr(a, name), getattr(b, name), rtol=1e-12)


def leaves_of(solution: Solution) -> list[dict[Tile, bytes] | set[Tile]]:
    """All that a solver knows of its leaves."""
    lightmap, tree, marks = solution.lightmap, refinement_of(solution).tree, solution.solver.batch.marks
    textures = [lightmap.texture(name) for name in leaf_textures(lightmap)] + [
        t for t, _ in replay_of(solution).carried
    ]
    held = [by_leaf(tree, texture) for texture in textures]
    finer = {t: marks.tiles[divmod(s, lightmap.columns)].tobytes() for t, s in tree.slots.items()}
    return [*held, finer, {tree.tile(slot) for slot in replay_of(solution).fresh}]


def test_a_solver_takes_along_what_it_knows_of_its_leaves(planted: Callable[..., Solution]) -> None:
    """Also those that are fresh, and the light of strong shots that is kept."""
    box = planted(**(MANY | {"depth": 2, "residual": 0.01}))
    box.settle()
    refinement, replay, marks = refinement_of(box), replay_of(box), box.solver.batch.marks
    tree = refinement.tree
    assert replay.carried, "no strong light is kept"
    box.refine(**FEW)
    fresh = tree.splits([slot for tile, slot in tree.slots.items() if tile[0] < 2], 3)
    refinement._make_room(4 * len(fresh) + 400)
    refinement._apply(tree.split(fresh))
    marks.tiles[:] = np.arange(marks.tiles.size).reshape(marks.tiles.shape) % 3
    siblings = tree.merges(np.flatnonzero(box.lightmap.pool.used))[::-2]
    refinement._apply(tree.merge(siblings))  # the last first: parents are in high slots, which a smaller pool has not
    before = leaves_of(box)
    for held in before:
        assert held and (isinstance(held, set) or len(set(held.values())) > 1), "nothing to be lost"
    slots = np.array(sorted(replay.fresh))
    refinement.drop_judgement()
    refinement._resize(len(tree) + 3)
    assert leaves_of(box) == before
    assert sorted(replay.fresh) != slots.tolist()


def twin(gpu: Gpu, solution: Solution) -> Solution:
    """Before the first shot, on the same leaves."""
    wanted, pool = refinement_of(solution).tree.slots, quadtree_pool(solution.lightmap.scene, solution.lightmap.charts)
    tree = Quadtree(pool)
    while splits := [slot for tile, slot in tree.slots.items() if tile not in wanted]:
        if tree.room < 4 * len(splits):
            tree.resize(pool.tiles + 4 * len(splits))
        tree.split(splits)
    lightmap = Lightmap(gpu, pool, solution.lightmap.options)
    return Solution(lightmap, Shooting(gpu, lightmap, solution.solver.options))


def test_further_shots_come_to_the_same_answer(gpu: Gpu, planted: Callable[..., Solution]) -> None:
    """As of a solver that kept its room: what either leaves unshot, at most 1 %, lies elsewhere, since the strongest patches are
    found bin by bin. As of one that had these leaves from the start: what patches of other leaves make of it is 1 %
    (test_adaptive.py), besides that."""
    box, roomy = (planted(**(MANY | {"density": 4.0, "residual": 0.5})) for _ in range(2))
    refinement_of(roomy)._give_room_back = lambda: None  # type: ignore[method-assign]
    for one in (box, roomy):
        one.settle()
        room = one.lightmap.pool.tiles
        follow(one, **FEW)
    assert box.lightmap.pool.tiles < room / 2 == roomy.lightmap.pool.tiles / 2
    others = roomy, twin(gpu, box)
    for one in (box, *others):
        refinement_of(one)._change = lambda *_: False  # type: ignore[method-assign]  # they keep these leaves
        one.solver.set_options(one.solver.options.replace(residual=0.01))
        one.settle()
    mine, here = collapse(box.lightmap.pool, box.lightmap.irradiance())
    for other, tolerance in zip(others, (0.005, 0.015), strict=True):
        assert refinement_of(other).tree.slots.keys() == refinement_of(box).tree.slots.keys()
        light, there = collapse(other.lightmap.pool, other.lightmap.irradiance())
        assert (here == there).all()
        assert np.sqrt(((mine - light)[here] ** 2).mean() / (light[here] ** 2).mean()) < tolerance
    others[1].release()


# -- what the user sees --------------------------------------------------------------------------------------------------


def test_the_picture_stays_and_the_panel_tells(gpu: Gpu) -> None:
    """Texels of a leaf lie elsewhere in a texture of another height: the sampler weighs them with a fraction of so many bits."""
    light = LightmapOptions(adaptive=True, **MANY)  # type: ignore[arg-type]
    options = ShootingOptions(resolution=64, residual=0.2)
    session = Session(gpu, options=options, atlas=AtlasOptions(texels=900), light=light)
    view = View(session)
    session.open_now("cornell-box")
    solver, refinement = session.solver, session.lightmap.refinement
    assert refinement is not None
    while not session.run.converged:
        session.work(8)
        session.run.poll(energy=False)
    peak = session.stats.memory_mib
    session.set_light(light.replace(**FEW))
    pictures, resize = [], refinement._resize

    def watched(slots: int) -> None:
        pictures.append(picture(view, (240, 160)))
        energy = solver.energy()
        resize(slots)
        assert_same_energy(solver.energy(), energy)
        assert energy.escaped.min() > 0
        pictures.append(picture(view, (240, 160)))

    refinement._resize = watched  # type: ignore[method-assign]
    session.work(8)
    while not session.run.converged:
        session.work(8)
        session.run.poll(energy=False)
    before, after = pictures
    assert np.abs(before.astype(int) - after).max() <= 1
    assert session.stats.memory_mib < peak / 2
    view.release()
    session.release()
