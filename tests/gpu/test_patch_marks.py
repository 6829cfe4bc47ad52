"""How finely blocks of texels shoot goes from a leaf to its children, quarter by quarter, and back."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from solver_scenes import table_room

from app.atlas.parametrize import parametrize
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.lightmap.quadtree import Quadtree, quadtree_pool
from app.solvers.shooting.patch_marks import PatchMarks
from app.solvers.shooting.records import EMITTER


@pytest.fixture
def marked(gpu: Gpu) -> Iterator[Callable[[], tuple[Quadtree, PatchMarks]]]:
    made: list[PatchMarks | Lightmap] = []

    def make() -> tuple[Quadtree, PatchMarks]:
        scene = table_room()
        pool = quadtree_pool(scene, parametrize(scene, density=4.0))
        lightmap = Lightmap(gpu, pool)
        made.extend((patches := PatchMarks(gpu, lightmap), lightmap))
        return Quadtree(pool), patches

    yield make
    for one in made:
        one.release()


def test_a_mark_stays_where_it_was(marked: Callable[[], tuple[Quadtree, PatchMarks]]) -> None:
    tree, patches = marked()
    slot = tree.splits([min(tree.slots.values())], 2)[0]
    columns = patches.tiles.shape[1]
    marks = patches.tiles[divmod(slot, columns)]
    marks[0, 1], marks[3, 3] = 3, EMITTER + 1
    held = marks.copy()
    split = tree.split([slot])
    patches.follow(split)
    for child, (u, v) in zip(split.children.tolist(), split.corner.tolist(), strict=True):
        quarter = held[2 * v : 2 * v + 2, 2 * u : 2 * u + 2]
        np.testing.assert_array_equal(patches.tiles[divmod(child, columns)], quarter.repeat(2, 0).repeat(2, 1))
    finer = patches.tiles[divmod(int(split.children[0]), columns)]
    first = tuple(split.corner[0])
    assert first == (0, 0)
    finer[0, 2] = EMITTER + 2  # of what is one block below: the finer and the flag
    merged = tree.merge([split.children.tolist()])
    patches.follow(merged)
    held[0, 1] = EMITTER + 3
    np.testing.assert_array_equal(patches.tiles[divmod(int(merged.parents[0]), columns)], held)
    assert patches.texture.read() == patches.levels.tobytes()
    patches.shift(1)
    assert patches.tiles[divmod(int(merged.parents[0]), columns)][3, 3] == EMITTER + 2
    patches.shift(-4)
    assert patches.tiles[divmod(int(merged.parents[0]), columns)][0, 1] == EMITTER + 1
