"""Lightmaps on quadtrees with some light in them and no solver, and what is shown of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray
from solver_scenes import table_room

from app.atlas.charts import DEFAULT_TILE, TILES
from app.atlas.parametrize import parametrize
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.lightmap.options import LightmapOptions
from app.lightmap.quadtree import Quadtree, quadtree_pool
from app.lightmap.textures import LIGHT
from app.lightmap.transfer import LightTransfer
from app.render.options import INTERPOLATIONS
from app.render.resolve import DisplayTexels
from app.scene.load import load_scene
from app.scene.model import F64, Scene

DEPTH = 3
OTHER_TILES = tuple(tile for tile in TILES if tile != DEFAULT_TILE)
SCENES: dict[str, Callable[[], Scene]] = {"table": table_room, "textured": lambda: load_scene("textured-room")}
SMOOTH = [name for name in INTERPOLATIONS if name != "nearest"]


class Forest:
    """A lightmap on quadtrees with some light in it, no solver."""

    def __init__(
        self, gpu: Gpu, scene: Scene, *, texels: int = 3000, tile: int = DEFAULT_TILE, storage: str = "rgba32f"
    ) -> None:
        charts = parametrize(scene, texels=texels, tile=tile)
        self.lightmap = Lightmap(gpu, quadtree_pool(scene, charts), LightmapOptions(adaptive=True, storage=storage))
        self.lightmap.clear()
        self.pool, self.storage = self.lightmap.pool, storage
        self.tree, self.transfer = Quadtree(self.pool), LightTransfer(gpu, self.lightmap)

    def write(self, light: dict[str, F64]) -> None:
        """Tiles (slots, t, t, 3) [stored units] by name of the texture, nothing where nothing is covered."""
        for name, tiles in light.items():
            covered = np.where((self.pool.surfaces.area > 0)[..., None], tiles, 0.0)
            image = self.pool.image_from_tiles(np.concatenate([covered, covered[..., :1] * 0], -1))
            raw = image * 255 + 0.5 if self.storage == "fixed8" else image
            dtype = {"rgba32f": np.float32, "rgba16f": np.float16, "fixed8": np.uint8}[self.storage]
            self.lightmap.texture(name).write(np.ascontiguousarray(raw.astype(dtype)).tobytes())

    def write_noise(self, rng: np.random.Generator, *, negative: bool = False) -> None:
        noise = rng.uniform(0.2, 1.0, (2, self.pool.tiles, self.pool.tile, self.pool.tile, 3))
        if negative:
            noise[1] = 2 * noise[1] - 1  # r: light that is to be taken back
        self.write(dict(zip(LIGHT, noise, strict=True)))

    def grow(self, share: float = 1.0, rng: np.random.Generator | None = None) -> None:
        used = np.flatnonzero(self.pool.used)
        some = used if rng is None else used[rng.random(len(used)) < share]
        if self.tree.room < 4 * len(used):
            self.lightmap.resize(self.tree.resize(self.pool.tiles + 4 * len(used)))
        self.transfer.apply(self.tree.split(self.tree.splits(some.tolist(), DEPTH)))

    def shrink(self) -> None:
        siblings = self.tree.merges(np.flatnonzero(self.pool.used))
        self.transfer.apply(self.tree.merge(siblings))

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
        return np.asarray((E / self.lightmap.unit + rho * H - r) * (self.pool.surfaces.area > 0)[..., None])

    @property
    def energy(self) -> F64:
        """Σ H A and Σ R A, (2, 3)."""
        area = self.pool.surfaces.area[..., None]
        return np.array([(tiles * area).sum((0, 1, 2)) for tiles in (self.light["t_irradiance"], self.shot)])

    def by_tile(self) -> dict[tuple[int, int, int], F64]:
        """What is in the covered texels of each leaf, H and r."""
        H, r = self.light.values()
        covered = (self.pool.surfaces.area > 0)[..., None]
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


def places(trees: Forest) -> F64:
    """(slots, t, t, 2) middle of every texel in the atlas [texels of level 0]."""
    leaves, tile = trees.pool.leaves, trees.pool.tile
    inside = np.stack(np.meshgrid(np.arange(tile), np.arange(tile)), -1) + 0.5
    corner = np.stack([leaves.x, leaves.y], -1)[:, None, None] * tile
    return (corner + inside) * np.exp2(-leaves.level.astype(float))[:, None, None, None]


def tables(display: DisplayTexels) -> dict[str, NDArray[np.generic]]:
    """What is shown where, without the ages of leaves."""
    pool, bordered = display._lightmap.pool, display._lightmap.pool.tile + 2 * display._border
    raw = {name: np.frombuffer(display._tables[name].read(), np.uint32) for name in ("t_source", "t_shown_pages")}
    places = np.frombuffer(display._tables["t_places"].read(), np.float32).reshape(-1, 4)[:, :3]
    cells = raw["t_source"].reshape(pool.rows, bordered, pool.columns, bordered).swapaxes(1, 2)
    colours = np.frombuffer(display._colour.read(), np.uint32).reshape(cells.swapaxes(1, 2).shape).swapaxes(1, 2)
    used = pool.used
    tiles = {"source": cells, "colours": colours}
    shown = {name: image.reshape(-1, bordered, bordered)[: pool.tiles][used] for name, image in tiles.items()}
    return shown | {"pages": raw["t_shown_pages"], "places": places[1 : 1 + pool.tiles][used]}
