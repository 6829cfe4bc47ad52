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
from app.solvers.shooting.stages import EMITTER, ShotBuffers


@pytest.fixture
def marked(gpu: Gpu) -> Iterator[Callable[[], tuple[Quadtree, ShotBuffers]]]:
    made: list[ShotBuffers | Lightmap] = []

    def make() -> tuple[Quadtree, ShotBuffers]:
        scene = table_room()
        pool = quadtree_pool(scene, parametrize(scene, density=4.0))
        lightmap = Lightmap(gpu, pool)
        made.extend((buffers := ShotBuffers(gpu, lightmap), lightmap))
        return Quadtree(pool), buffers

    yield make
    for one in made:
        one.release()


def test_a_mark_stays_where_it_was(marked: Callable[[], tuple[Quadtree, ShotBuffers]]) -> None:
    tree, buffers = marked()
    slot = tree.splits([min(tree.slots.values())], 2)[0]
    columns = buffers._tiles.shape[1]
    marks = buffers._tiles[divmod(slot, columns)]
    marks[0, 1], marks[3, 3] = 3, EMITTER + 1
    held = marks.copy()
    split = tree.split([slot])
    buffers.hand_down(split)
    for child, (u, v) in zip(split.children.tolist(), split.corner.tolist(), strict=True):
        quarter = held[2 * v : 2 * v + 2, 2 * u : 2 * u + 2]
        np.testing.assert_array_equal(buffers._tiles[divmod(child, columns)], quarter.repeat(2, 0).repeat(2, 1))
    finer = buffers._tiles[divmod(int(split.children[0]), columns)]
    first = tuple(split.corner[0])
    assert first == (0, 0)
    finer[0, 2] = EMITTER + 2  # of what is one block below: the finer and the flag
    merged = tree.merge([split.children.tolist()])
    buffers.hand_down(merged)
    held[0, 1] = EMITTER + 3
    np.testing.assert_array_equal(buffers._tiles[divmod(int(merged.parents[0]), columns)], held)
    assert buffers.finer.read() == buffers.finer_levels.tobytes()
    buffers.finest_is(1)
    assert buffers._tiles[divmod(int(merged.parents[0]), columns)][3, 3] == EMITTER + 2
    buffers.finest_is(-4)
    assert buffers._tiles[divmod(int(merged.parents[0]), columns)][0, 1] == EMITTER + 1
