"""The virtual atlas as a picture: light where it is, frames of leaves in the colour of their level, new leaves shine."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from types import SimpleNamespace

import numpy as np
import pytest
from forests import Forest, forest, places
from numpy.typing import NDArray
from pictures import framing
from solver_scenes import grey, quads_scene, room, table_room

from app.atlas.charts import DEFAULT_TILE as TILE
from app.gpu import Gpu
from app.render import ages
from app.render.ages import NEVER, LeafAges
from app.render.frame import FrameRenderer
from app.render.options import DisplayOptions
from app.render.tone_mapping import encode_srgb
from app.scene.model import F64
from app.session.picking import leaf_at

__all__ = ["forest"]

IRRADIANCE = DisplayOptions(layer="irradiance", tone_map="clamp", interpolation="nearest")
NOTHING = np.array([0.114, 0.114, 0.122])
STEP = 1.01 / 255


class Viewer:
    """Frames of one lightmap, and its atlas as a picture with row 0 at v = 0."""

    def __init__(self, gpu: Gpu) -> None:
        self.renderer = FrameRenderer(gpu)
        self._colour = gpu.texture((16, 16), 4, "f1")
        self._target, self._gpu = gpu.target(self._colour), gpu

    def frame(self, trees: Forest, *, whole: bool = True) -> None:
        view = framing(np.full(3, -1.0), np.full(3, 1.0))
        self.renderer.render(self._target, (16, 16), trees.lightmap, view, IRRADIANCE, whole=whole)

    def atlas(self, trees: Forest, scale: int, *, turned: bool = False) -> NDArray[np.float64]:
        """(height, width, 3) of 0 to 1, ``scale`` pixels per texel of level 0."""
        width, height = (side * scale for side in trees.pool.charts.size)
        size = (height, width) if turned else (width, height)
        image = self.renderer.atlas(trees.lightmap, size, turned=turned)
        assert image is not None and image.size == size
        return np.frombuffer(image.read(), np.uint8).reshape(*size[::-1], 4)[..., :3] / 255

    def release(self) -> None:
        self.renderer.release()
        self._gpu.release_all(self._target, self._colour)


@pytest.fixture
def viewer(gpu: Gpu) -> Iterator[Viewer]:
    viewer = Viewer(gpu)
    yield viewer
    viewer.release()


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[float]]:
    """What time it is [s], to be set."""
    now = [100.0]
    monkeypatch.setattr(ages, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    yield now


def hue(level: int) -> F64:
    """As in app/shaders/render/level_colour.glsl."""
    return np.asarray(0.5 + 0.45 * np.cos(6.2831853 * (0.72 - 0.12 * level + np.array([0.0, 0.33, 0.67]))))


def test_light_is_where_it_is_in_the_atlas(
    forest: Callable[..., Forest], viewer: Viewer, rng: np.random.Generator
) -> None:
    trees = forest(table_room(), texels=1500)
    trees.grow(0.4, rng)
    light = rng.uniform(0.1, 1.0, (trees.pool.tiles, TILE, TILE, 3))
    trees.write({"t_irradiance": light * np.pi / trees.lightmap.unit})
    assert viewer.renderer.atlas(trees.lightmap, (8, 8), turned=False) is None, "nothing has been shown yet"
    viewer.frame(trees)
    scale = 8  # pixels per texel of level 0, one per finest
    assert trees.pool.leaves.level.max() == 3
    image, turned = viewer.atlas(trees, scale), viewer.atlas(trees, scale, turned=True)
    assert (turned == image.swapaxes(0, 1)).all()
    pool, tested = trees.pool, 0
    inner = np.arange(2, TILE - 2)  # without frames
    for slot in np.flatnonzero(pool.used):
        covered = pool.surfaces.area[slot] > 0
        for row, column in np.argwhere(covered)[::7]:
            if row in inner and column in inner:
                u, v = places(trees)[slot, row, column] * scale
                assert image[int(v), int(u)] == pytest.approx(encode_srgb(light[slot, row, column]), abs=STEP)
                tested += 1
    assert tested > 100
    nowhere = (pool.slot_tables["t_pages"][..., 0] == 0).repeat(scale * TILE >> pool.depth, 0)
    nowhere = nowhere.repeat(scale * TILE >> pool.depth, 1)
    assert nowhere.any()
    assert np.abs(image[nowhere] - NOTHING).max() < STEP


def test_leaves_are_framed_in_the_colour_of_their_level(
    forest: Callable[..., Forest], viewer: Viewer, rng: np.random.Generator
) -> None:
    trees = forest(table_room(), texels=1500)
    trees.grow(0.4, rng)
    viewer.frame(trees)
    scale = 8
    image, leaves, levels = viewer.atlas(trees, scale), trees.pool.leaves, set()
    for slot in np.flatnonzero(trees.pool.used):
        level = int(leaves.level[slot])
        edge = scale * TILE >> level
        x, y = leaves.x[slot] * edge, leaves.y[slot] * edge
        frame = image[y : y + edge, x]
        # nine tenths of the frame, and a twentieth less for the pixel's distance from the edge
        assert np.abs(frame - hue(level)).max() < 0.2
        assert np.abs(image[y + 2 : y + edge - 2, x + 2] - hue(level)).max() > 0.2
        levels.add(level)
    assert len(levels) > 2


def test_leaves_shine_for_a_second_after_a_split(
    forest: Callable[..., Forest], viewer: Viewer, clock: list[float]
) -> None:
    trees = forest(quads_scene([room((4.0, 4.0, 4.0))[0]], [grey(0.5, 1.0)]), texels=32 * 32)
    trees.grow()
    viewer.frame(trees)
    before = viewer.atlas(trees, 4)
    first = next(iter(trees.tree.slots))
    clock[0] += 10.0
    trees.transfer.apply(trees.tree.split([trees.tree.slots[first]]))
    viewer.frame(trees)
    alone = viewer.atlas(trees, 4)
    viewer.frame(trees, whole=False)
    (_, x, y), edge = first, 4 * TILE >> first[0]
    fresh = np.zeros(before.shape[:2], bool)
    fresh[y * edge : (y + 1) * edge, x * edge : (x + 1) * edge] = True
    brightness = []
    for seconds in (0.0, 0.5, 0.9, 1.0, 5.0):
        clock[0] = 110.0 + seconds
        image = viewer.atlas(trees, 4)
        assert (image[~fresh] == before[~fresh]).all()
        brightness.append(image[fresh].mean())
    assert brightness[0] > brightness[1] > brightness[2] > brightness[3] == brightness[4]
    assert brightness[0] > brightness[4] + 0.1
    assert (alone == image).all(), "a picture that stands for itself"


def test_only_what_was_split_is_new(
    forest: Callable[..., Forest], clock: list[float], rng: np.random.Generator
) -> None:
    trees = forest(table_room())
    known = LeafAges(trees.pool)
    assert (known.born(trees.pool) == NEVER).all()
    clock[0] += 7.0
    before = dict(trees.tree.slots)
    trees.grow(0.3, rng)
    born = known.born(trees.pool).copy()
    for tile, slot in trees.tree.slots.items():
        assert born[slot] == (NEVER if tile in before else np.float32(7.0))
    clock[0] += 1.0
    assert (known.born(trees.pool) == born).all(), "nothing has changed"
    while trees.tree.merges(np.flatnonzero(trees.pool.used)):
        trees.shrink()
    assert (known.born(trees.pool) == NEVER).all(), "a merge is no split"


def test_the_leaf_under_the_pointer(forest: Callable[..., Forest], rng: np.random.Generator) -> None:
    trees = forest(table_room())
    trees.grow(0.5, rng)
    for (level, x, y), slot in trees.tree.slots.items():
        edge = TILE * 0.5**level
        leaf = leaf_at(trees.lightmap, ((x + 0.3) * edge, (y + 0.9) * edge))
        assert leaf is not None
        assert leaf.level == level
        assert leaf.rect == (x * edge, y * edge, (x + 1) * edge, (y + 1) * edge)
        assert leaf.texels == (trees.pool.surfaces.face[slot] >= 0).sum()
        assert leaf.texel * trees.pool.charts.density * 2**level == pytest.approx(1.0)
    assert leaf_at(trees.lightmap, (-1.0, 5.0)) is None
