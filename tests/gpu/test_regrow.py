"""Light that moves with the leaves: what splits and merges keep, that nothing leaks, and that no edge shows."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray
from solver_scenes import grey, quads_scene, room, table_room
from test_session import forgotten, held

from app.atlas.charts import DEFAULT_TILE, TILES
from app.atlas.lightmap import LIGHT, STORAGE, Lightmap
from app.atlas.parametrize import parametrize
from app.atlas.quadtree import MAX_DEPTH, Quadtree, quadtree_nodes
from app.atlas.regrow import Regrowth
from app.gpu import Gpu
from app.render import edge_texels, resolve
from app.render.ages import LeafAges
from app.render.edges import unequal_edges
from app.render.options import INTERPOLATIONS, DisplayOptions
from app.render.resolve import BORDER, DisplayTexels
from app.scene.load import load_scene
from app.scene.model import F64, Scene

__all__ = ["forgotten"]

DEPTH = 3
# How far storage may be off for each texel, as a share of its light or in stored units: float sums; a half float has 11 bits and
# llvmpipe cuts them off; 8 bits are steps of 1/255, rounded or cut
RELATIVE = {"rgba32f": 1e-4, "rgba16f": 2.0**-9, "fixed8": 0.0}
ABSOLUTE = {"rgba32f": 0.0, "rgba16f": 0.0, "fixed8": 2 / 255}
OTHER_TILES = tuple(tile for tile in TILES if tile != DEFAULT_TILE)
SCENES: dict[str, Callable[[], Scene]] = {"table": table_room, "textured": lambda: load_scene("textured-room")}


class Forest:
    """A lightmap on quadtrees with some light in it, no solver."""

    def __init__(
        self, gpu: Gpu, scene: Scene, *, texels: int = 3000, tile: int = DEFAULT_TILE, storage: str = "rgba32f"
    ) -> None:
        charts = parametrize(scene, texels=texels, tile=tile)
        self.lightmap = Lightmap(gpu, quadtree_nodes(scene, charts), storage=storage)
        self.lightmap.clear()
        self.nodes, self.storage = self.lightmap.nodes, storage
        self.tree, self.regrowth = Quadtree(self.nodes), Regrowth(gpu, self.lightmap)

    def write(self, light: dict[str, F64]) -> None:
        """Tiles (slots, t, t, 3) [stored units] by name of the texture, nothing where nothing is covered."""
        for name, tiles in light.items():
            covered = np.where((self.nodes.surfaces.area > 0)[..., None], tiles, 0.0)
            image = self.nodes.image_from_tiles(np.concatenate([covered, covered[..., :1] * 0], -1))
            raw = image * 255 + 0.5 if self.storage == "fixed8" else image
            dtype = {"rgba32f": np.float32, "rgba16f": np.float16, "fixed8": np.uint8}[self.storage]
            self.lightmap.texture(name).write(np.ascontiguousarray(raw.astype(dtype)).tobytes())

    def write_noise(self, rng: np.random.Generator, *, negative: bool = False) -> None:
        noise = rng.uniform(0.2, 1.0, (2, self.nodes.tiles, self.nodes.tile, self.nodes.tile, 3))
        if negative:
            noise[1] = 2 * noise[1] - 1  # r: light that is to be taken back
        self.write(dict(zip(LIGHT, noise, strict=True)))

    def grow(self, share: float = 1.0, rng: np.random.Generator | None = None) -> None:
        used = np.flatnonzero(self.nodes.used)
        some = used if rng is None else used[rng.random(len(used)) < share]
        if self.tree.room < 4 * len(used):
            self.lightmap.resize(self.tree.resize(self.nodes.tiles + 4 * len(used)))
        self.regrowth.apply(self.tree.split(self.tree.splits(some.tolist(), DEPTH)))

    def shrink(self) -> None:
        families = self.tree.merges(np.flatnonzero(self.nodes.used))
        self.regrowth.apply(self.tree.merge(families))

    @property
    def light(self) -> dict[str, F64]:
        """H and r by name (slots, t, t, 3) [stored units]."""
        read = (self.lightmap.irradiance(), self.lightmap.residual())
        return {n: t.astype(np.float64) / self.lightmap.unit for n, t in zip(LIGHT, read, strict=True)}

    @property
    def shot(self) -> F64:
        """R = E + ρH - r, what texels have shot (slots, t, t, 3) [stored units]."""
        H, r = self.light.values()
        E, rho = self.lightmap.emission().astype(np.float64), self.lightmap.albedo().astype(np.float64)
        return np.asarray((E / self.lightmap.unit + rho * H - r) * (self.nodes.surfaces.area > 0)[..., None])

    @property
    def energy(self) -> F64:
        """Σ H A and Σ R A, (2, 3)."""
        area = self.nodes.surfaces.area[..., None]
        return np.array([(tiles * area).sum((0, 1, 2)) for tiles in (self.light["t_irradiance"], self.shot)])

    def by_tile(self) -> dict[tuple[int, int, int], F64]:
        """What is in the covered texels of each leaf, H and r."""
        H, r = self.light.values()
        covered = (self.nodes.surfaces.area > 0)[..., None]
        both = np.concatenate([H * covered, r * covered], -1)
        return {tile: both[slot] for tile, slot in self.tree.slots.items()}


@pytest.fixture
def forest(gpu: Gpu) -> Iterator[Callable[..., Forest]]:
    made: list[Forest] = []

    def plant(scene: Scene, **options: object) -> Forest:
        made.append(Forest(gpu, scene, **options))  # type: ignore[arg-type]
        return made[-1]

    yield plant
    for one in made:
        one.lightmap.release()


# -- push and pull -----------------------------------------------------------------------------------------------------


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
    area = trees.nodes.surfaces.area.sum()
    weight = trees.nodes.surfaces.area[..., None]
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
    trees.shrink()
    after = trees.by_tile()
    assert after.keys() == before.keys()
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
    covered = trees.nodes.surfaces.area > 0
    rect = trees.nodes.charts.chart_rects[0]
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
            covered = trees.nodes.surfaces.area[slot] > 0
            np.testing.assert_allclose(shot[slot][covered], half.repeat(2, 0).repeat(2, 1)[covered], atol=2**-11)
            split += 1
    assert split > 10


def places(trees: Forest) -> F64:
    """(slots, t, t, 2) middle of every texel in the atlas [texels of level 0]."""
    leaves, tile = trees.nodes.leaves, trees.nodes.tile
    inside = np.stack(np.meshgrid(np.arange(tile), np.arange(tile)), -1) + 0.5
    corner = np.stack([leaves.x, leaves.y], -1)[:, None, None] * tile
    return (corner + inside) * np.exp2(-leaves.level.astype(float))[:, None, None, None]


def test_what_was_sent_to_a_texel_is_known_to_its_children(forest: Callable[..., Forest]) -> None:
    """In the residual's a: with that of H, it tells whether a texel lies in shadow."""
    trees = forest(table_room())
    residual = trees.lightmap.texture("t_residual")
    residual.write(np.full((*residual.size[::-1], 4), 0.7, np.float32).tobytes())
    for change in (trees.grow, trees.shrink):
        change()
        raw = np.frombuffer(residual.read(), np.float32).reshape(*residual.size[::-1], 4)
        sent = trees.nodes.tiles_from_image(raw)[..., 3]
        np.testing.assert_allclose(sent[trees.nodes.surfaces.area > 0], 0.7, rtol=1e-5)


@pytest.mark.parametrize("storage", STORAGE)
def test_what_has_shot_all_makes_no_light(
    forest: Callable[..., Forest], rng: np.random.Generator, storage: str
) -> None:
    """r = 0 everywhere: as much below zero as above it in children that receive more and less than their parent did, or, where
    nothing can be negative, zero."""
    trees = forest(table_room(), storage=storage)
    noise = rng.uniform(0.2, 1.0, (*trees.nodes.surfaces.face.shape, 3))
    trees.write({"t_irradiance": noise, "t_residual": 0 * noise})
    trees.grow()
    area = trees.nodes.surfaces.area[..., None]
    unshot, light = ((tiles * area).sum() for tiles in reversed(trees.light.values()))
    assert abs(unshot) <= RELATIVE[storage] * light


def test_light_is_never_made_negative(forest: Callable[..., Forest], rng: np.random.Generator) -> None:
    """Single bright texels among black ones: what is interpolated must not go below zero."""
    trees = forest(table_room())
    spots = (rng.random((*trees.nodes.surfaces.area.shape, 1)) < 0.05) * np.ones(3)
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
    trees.lightmap.resize(trees.tree.resize(2 * trees.nodes.tiles))
    assert trees.lightmap.rows > rows
    after = trees.by_tile()
    for tile, values in before.items():
        np.testing.assert_array_equal(after[tile], values)
    assert np.count_nonzero(trees.light["t_irradiance"][~trees.nodes.used]) == 0


def test_the_textures_follow_the_node_set(forest: Callable[..., Forest], rng: np.random.Generator) -> None:
    """What is written tile by tile is what a new lightmap would hold."""
    trees = forest(load_scene("textured-room"))
    trees.grow(0.4, rng)
    trees.shrink()
    area = trees.nodes.surfaces.area
    held_ones = {"t_position_area", "t_albedo", "t_normal_ids"}
    for name, array in trees.nodes.arrays.items():
        texture = trees.lightmap.texture(name)
        read = np.frombuffer(texture.read(), array.dtype).reshape(array.shape)
        if name in held_ones:
            mine = area > 0
            read, array = trees.nodes.tiles_from_image(read)[mine], trees.nodes.tiles_from_image(array)[mine]
        np.testing.assert_array_equal(read, array, err_msg=name)


def test_splitting_and_merging_everything_leaves_no_objects(
    gpu: Gpu, forest: Callable[..., Forest], forgotten: Callable[[], list[object]]
) -> None:
    trees = forest(table_room(), texels=1000)
    trees.grow()  # makes room
    trees.shrink()
    counts, rooms = [], []
    for _ in range(20):
        trees.grow()
        trees.shrink()
        counts.append(held(gpu))
        rooms.append(trees.tree.room)
    assert len(set(counts)) == 1 and len(set(rooms)) == 1, counts
    assert not forgotten()


# -- edges between levels ----------------------------------------------------------------------------------------------


def weights(interpolation: str, t: F64) -> F64:
    """Of the texels -1, 0, 1 and 2 at t (2,) between 0 and 1: (4, 2)."""
    if interpolation == "bilinear":
        return np.array([t * 0, 1 - t, t, t * 0])
    s = 1 - t
    return np.array([s**3, 3 * t**3 - 6 * t**2 + 4, 3 * s**3 - 6 * s**2 + 4, t**3]) / 6


def sampled(display: NDArray[np.float64], nodes: object, interpolation: str, slot: int, uv: F64) -> float:
    """What is interpolated at a place of the atlas [texels of level 0] in one leaf's display texels."""
    leaves, columns, tile = nodes.leaves, nodes.columns, nodes.tile  # type: ignore[attr-defined]
    border = BORDER[interpolation]
    inside = uv * 2.0 ** leaves.level[slot] - np.array([leaves.x[slot], leaves.y[slot]]) * tile
    at = np.array([slot % columns, slot // columns]) * (tile + 2 * border) + border + inside - 0.5
    base = np.floor(at).astype(int)
    w = weights(interpolation, at - base)
    rows, columns = (np.clip(base[axis] + np.arange(-1, 3), 0, display.shape[1 - axis] - 1) for axis in (1, 0))
    return float(w[:, 1] @ display[np.ix_(rows, columns)] @ w[:, 0])


def edge_points(nodes: object) -> list[tuple[int, int, F64]]:
    """Places where two leaves of different level meet, four along the edge of a leaf of MAX_DEPTH."""
    pages = nodes.slot_tables["t_pages"][..., 0].astype(np.int64) - 1  # type: ignore[attr-defined]
    level, cell = nodes.leaves.level, 1 / nodes.pages_per_texel  # type: ignore[attr-defined]
    found, count = [], 4 << (MAX_DEPTH - nodes.depth)  # type: ignore[attr-defined]
    for step, along in (((0, 1), (0, 1)), ((1, 0), (1, 0))):
        a, b = pages[: len(pages) - step[0], : pages.shape[1] - step[1]], pages[step[0] :, step[1] :]
        met = (a >= 0) & (b >= 0) & (level[a] != level[b])
        for y, x in np.argwhere(met):
            for t in (np.arange(count) + 0.5) / count:
                uv = np.array([x + along[1] + t * (1 - along[1]), y + along[0] + t * (1 - along[0])]) * cell
                found.append((int(a[y, x]), int(b[y, x]), uv))
    return found


def shown(gpu: Gpu, trees: Forest, interpolation: str, light: F64) -> NDArray[np.float64]:
    """The display texels, 0 to 1, of light that they show as it is: sRGB undone."""
    linear = np.where(light <= 0.04045, light / 12.92, ((np.maximum(light, 0.04045) + 0.055) / 1.055) ** 2.4)
    trees.write({"t_irradiance": np.repeat(linear[..., None], 3, -1) * np.pi / trees.lightmap.unit})
    display = DisplayTexels(gpu, trees.lightmap, LeafAges(trees.nodes), BORDER[interpolation])
    options = DisplayOptions(layer="irradiance", tone_map="clamp", interpolation=interpolation)
    textures = display.resolve("irradiance", options, scale=None, ambient=(0, 0, 0), whole=True)
    texture = textures["t_display"]
    raw = np.frombuffer(texture.read(), np.uint8).reshape(texture.height, texture.width, 4)[..., 0] / 255
    display.release()
    return raw


SMOOTH = [name for name in INTERPOLATIONS if name != "nearest"]
ROUNDING = 1 / 255  # half a step of 8 bits on either side


@pytest.fixture(params=TILES)
def uneven(forest: Callable[..., Forest], rng: np.random.Generator, request: pytest.FixtureRequest) -> Forest:
    """One square of 64 texels, with leaves of three levels."""
    trees = forest(quads_scene([room((4.0, 4.0, 4.0))[0]], [grey(0.5, 1.0)]), texels=64 * 64, tile=request.param)
    for _ in range(2):
        trees.grow(0.3, rng)
    return trees


@pytest.mark.parametrize("interpolation", SMOOTH)
def test_linear_light_stays_linear_where_levels_meet(gpu: Gpu, uneven: Forest, interpolation: str) -> None:
    """On both sides of every edge, and there is no step."""
    nodes = uneven.nodes
    slope, middle = np.array([0.006, 0.005]), nodes.charts.chart_rects[0][:2] + 32
    raw = shown(gpu, uneven, interpolation, 0.5 + (places(uneven) - middle) @ slope)
    tested = 0
    for a, b, uv in edge_points(nodes):
        if (np.abs(uv - middle) < 30).all():
            exact = 0.5 + (uv - middle) @ slope
            both = np.array([sampled(raw, nodes, interpolation, slot, uv) for slot in (a, b)])
            assert np.abs(both - exact).max() < ROUNDING, (uv, both, exact)
            assert np.ptp(both) < ROUNDING
            tested += 1
    assert tested > 100


@pytest.mark.parametrize("interpolation", SMOOTH)
def test_curved_light_has_no_step_where_levels_meet(gpu: Gpu, uneven: Forest, interpolation: str) -> None:
    """Waves of 8 texels of level 0. What is left is how a row of fine texels follows a coarser one along the edge: where that
    bends, it is off by 1/8 of the second difference, by 5/32 at the end of a leaf, and by a quarter more since sRGB bends too.
    Across the edge nothing is left."""
    nodes = uneven.nodes
    middle = nodes.charts.chart_rects[0][:2] + 32
    second_difference = 0.25 * (2 * np.sin(np.pi / 8)) ** 2
    for direction in ((1.0, 0.0), (0.6, 0.8)):
        wave = np.sin(places(uneven) @ np.array(direction) * 2 * np.pi / 8)
        raw = shown(gpu, uneven, interpolation, 0.5 + 0.25 * wave)
        steps = [
            abs(sampled(raw, nodes, interpolation, a, uv) - sampled(raw, nodes, interpolation, b, uv))
            for a, b, uv in edge_points(nodes)
            if (np.abs(uv - middle) < 30).all()
        ]
        assert max(steps) < 1.25 * 5 / 32 * second_difference + 2 * ROUNDING, (direction, np.array(steps).max() * 255)
        # the ends are half of the edge of a small leaf
        assert np.mean(steps) < (1.0 if nodes.tile == 8 else 0.6) * ROUNDING


def test_edges_that_one_texture_cannot_hold(
    gpu: Gpu, forest: Callable[..., Forest], rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Many small leaves have more of them than a texture has rows: their border texels are made in several."""
    trees = forest(quads_scene([room((4.0, 4.0, 4.0))[0]], [grey(0.5, 1.0)]), texels=160 * 160, tile=8)
    trees.grow(0.3, rng)
    light = 0.5 + 0.25 * np.sin(places(trees).sum(-1))
    whole = shown(gpu, trees, "bicubic", light)
    longest = max(whole.shape)  # as short as the display texels allow
    monkeypatch.setattr(resolve, "TABLE_WIDTH", longest)
    monkeypatch.setattr(edge_texels, "IN_A_ROW", 1)
    monkeypatch.setattr(gpu, "limits", dataclasses.replace(gpu.limits, max_texture=longest))
    found = unequal_edges(trees.nodes, BORDER["bicubic"], np.flatnonzero(trees.nodes.used))
    assert max(len(some) for some in found.values()) > longest
    np.testing.assert_array_equal(shown(gpu, trees, "bicubic", light), whole)


# -- what follows the leaves ---------------------------------------------------------------------------------------------


def tables(display: DisplayTexels) -> dict[str, NDArray[np.generic]]:
    """What is shown where, without the ages of leaves."""
    nodes, bordered = display._lightmap.nodes, display._lightmap.nodes.tile + 2 * display._border
    raw = {name: np.frombuffer(display._tables[name].read(), np.uint32) for name in ("t_source", "t_shown_pages")}
    places = np.frombuffer(display._tables["t_places"].read(), np.float32).reshape(-1, 4)[:, :3]
    cells = raw["t_source"].reshape(nodes.rows, bordered, nodes.columns, bordered).swapaxes(1, 2)
    colours = np.frombuffer(display._colour.read(), np.uint32).reshape(cells.swapaxes(1, 2).shape).swapaxes(1, 2)
    used = nodes.used
    tiles = {"source": cells, "colours": colours}
    shown = {name: image.reshape(-1, bordered, bordered)[: nodes.tiles][used] for name, image in tiles.items()}
    return shown | {"pages": raw["t_shown_pages"], "places": places[1 : 1 + nodes.tiles][used]}


@pytest.mark.parametrize("interpolation", SMOOTH)
@pytest.mark.parametrize("name", SCENES)
def test_display_texels_follow_the_leaves(
    gpu: Gpu, forest: Callable[..., Forest], rng: np.random.Generator, name: str, interpolation: str
) -> None:
    """A frame that brings only those of changed leaves up to date shows what one does that begins anew."""
    trees = forest(SCENES[name](), texels=12000)
    trees.lightmap.resize(trees.tree.resize(3000))
    options = DisplayOptions(layer="irradiance", tone_map="clamp", interpolation=interpolation)
    known = DisplayTexels(gpu, trees.lightmap, LeafAges(trees.nodes), BORDER[interpolation])
    depths = set()
    for change in ("none", "grow", "grow", "both", "shrink", "grow", "shrink", "shrink", "shrink", "shrink"):
        if change in ("grow", "both"):
            trees.grow(0.3, rng)
        if change in ("shrink", "both") and trees.tree.merges(np.flatnonzero(trees.nodes.used)):
            trees.shrink()
        depths.add(trees.nodes.depth)
        trees.write_noise(np.random.default_rng(len(depths)))
        known.resolve("irradiance", options, scale=None, ambient=(0, 0, 0), whole=change == "none")
        for _ in range(-(-known.size[1] * known.size[0] // resolve.TEXELS_PER_FRAME)):
            known.resolve("irradiance", options, scale=None, ambient=(0, 0, 0), whole=False)
        fresh = DisplayTexels(gpu, trees.lightmap, LeafAges(trees.nodes), BORDER[interpolation])
        fresh.resolve("irradiance", options, scale=None, ambient=(0, 0, 0), whole=True)
        for what, expected in tables(fresh).items():
            np.testing.assert_array_equal(tables(known)[what], expected, err_msg=f"{what} after {change}")
        fresh.release()
    assert known.fits(BORDER[interpolation]), "or it would have begun anew"
    known.release()
    assert len(depths) > 1, "the page table has been both coarser and finer"


def test_pages_follow_the_finest_leaf(forest: Callable[..., Forest]) -> None:
    """The table of a tree that has grown and shrunk is that of one made at once, and no finer than it must be."""
    trees = forest(table_room(), texels=12000)
    first = trees.nodes.depth
    for _ in range(DEPTH):
        trees.grow()
    assert trees.nodes.depth == DEPTH == trees.nodes.leaves.level.max() > first
    height, width = trees.nodes.slot_tables["t_pages"].shape[:2]
    assert (width, height) == tuple(side << DEPTH for side in np.array(trees.nodes.charts.size) // trees.nodes.tile)
    while trees.tree.merges(np.flatnonzero(trees.nodes.used)):
        trees.shrink()
    assert trees.nodes.depth <= trees.nodes.leaves.level.max() + 1 < DEPTH
    pages = trees.lightmap.texture("t_pages")
    held = np.frombuffer(pages.read(), np.uint32).reshape(pages.height, pages.width, 1)
    np.testing.assert_array_equal(held, trees.nodes.slot_tables["t_pages"])
    for slot in np.flatnonzero(trees.nodes.used):
        k = 1 << (trees.nodes.depth - trees.nodes.leaves.level[slot])
        x, y = trees.nodes.leaves.x[slot] * k, trees.nodes.leaves.y[slot] * k
        assert (held[y : y + k, x : x + k] == slot + 1).all()
    assert len(np.unique(held)) == trees.nodes.used.sum() + (held == 0).any()
