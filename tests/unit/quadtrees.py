"""Trees over small scenes, and how tests let them grow and shrink."""

from __future__ import annotations

import numpy as np
from atlas_scenes import box_room, scene_of
from solver_scenes import grey, quads_scene, room, table_room

from app.atlas.charts import DEFAULT_TILE, TILES
from app.atlas.parametrize import parametrize
from app.lightmap.quadtree import Change, Quadtree, quadtree_pool
from app.scene import shapes
from app.scene.model import Material, Scene

UNEVEN = ("ball", "crumbs")  # charts that are no rectangles of whole texels: texels on a chart's border may be shared
DEPTH = 3  # of the random trees


def ball_room() -> Scene:
    return scene_of([box_room(), shapes.icosphere(1.0, 2).moved(2, 1.2, 2)])


def small_lamp_room() -> Scene:
    """Both far smaller than a tile."""
    lamp = [[1.9, 2.9, 1.9], [2.1, 2.9, 1.9], [2.1, 2.9, 2.1], [1.9, 2.9, 2.1]]
    panel = [[1.0, 1.0, 1.0], [1.0, 1.0, 1.1], [1.1, 1.0, 1.1], [1.1, 1.0, 1.0]]
    return quads_scene([*room((4.0, 3.0, 4.0)), lamp, panel], [grey(0.5), grey(0.5, 5.0)], [0] * 6 + [1, 0])


def crumbs_room() -> Scene:
    """Charts of any outline, with tiny lamps between them: finer leaves in the middle of large charts from the start."""
    lamps = [shapes.quad((1, 0.1 + 0.05 * k, 1), (0.07, 0, 0), (0, 0, 0.07)) for k in range(40)]
    sails = [shapes.polygon([(0, 2 + 0.1 * k, 0), (2.3, 2 + 0.1 * k, 0.2), (0.4, 2 + 0.1 * k, 1.9)]) for k in range(8)]
    return scene_of([box_room(), *sails, *lamps], [Material("grey")] * 9 + [Material("lamp", emission=(1, 1, 1))])


SCENES = {
    "walls": lambda: quads_scene(room((4.0, 3.0, 4.0)), [grey(0.5)]),
    "table": table_room,
    "ball": ball_room,
    "small lamp": small_lamp_room,
    "crumbs": crumbs_room,
}
OTHER_TILES = tuple(tile for tile in TILES if tile != DEFAULT_TILE)
WITH_TILES = [*((name, DEFAULT_TILE) for name in SCENES), *(("small lamp", tile) for tile in OTHER_TILES)]


def tree_of(name: str, density: float = 10.0, tile: int = DEFAULT_TILE) -> Quadtree:
    scene = SCENES[name]()
    return Quadtree(quadtree_pool(scene, parametrize(scene, density=density, tile=tile)))


def grow(tree: Quadtree, slots: list[int], depth: int = DEPTH) -> Change | None:
    """Split these leaves and what must split with them, whatever room that takes."""
    more = 4 * len(tree)
    if tree.room < more:
        tree.resize(tree.pool.tiles + more)
    splits = tree.splits(slots, depth)
    return tree.split(splits) if splits else None


def shuffle(tree: Quadtree, rng: np.random.Generator, rounds: int = 6) -> None:
    """Random splits and merges, two rounds of splits for each of merges."""
    for k in range(rounds):
        used = np.flatnonzero(tree.pool.used)
        if k % 3 < 2:
            grow(tree, used[rng.random(len(used)) < rng.uniform(0.1, 0.3)].tolist())
        elif siblings := [family for family in tree.merges(used) if rng.random() < 0.5]:
            tree.merge(siblings)
