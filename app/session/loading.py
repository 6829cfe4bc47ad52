"""From a file, or a scene that is open, to a tile pool, in a thread of its own: the window never waits for it."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.atlas.charts import Charts
from app.atlas.charts_cache import charts_of
from app.atlas.options import AtlasOptions
from app.lightmap.options import LightmapOptions
from app.lightmap.quadtree import quadtree_pool
from app.lightmap.tile_pool import Array, TilePool
from app.render.exposure import first_exposure
from app.render.flat import FlatScene
from app.render.seen import seen_texels
from app.scene.load import load_scene
from app.scene.model import Scene
from app.scene.options import FileOptions
from app.scene.sky import Sky
from app.session.ray_tree import SORTING
from app.session.versions import Version
from app.solvers import SOLVERS
from app.util.background import BackgroundTask, Progress
from app.visibility.rays import tree_of


@dataclass(frozen=True, eq=False)
class Loaded:
    """The scene as it was read, the tile pool of it as it was made and cut, what of that is uploaded, how it was cut and is held,
    the exposure to open it with [EV] if that was asked for, and how long each stage took [s]."""

    read: Scene
    pool: TilePool
    arrays: dict[str, Array]
    atlas: AtlasOptions
    options: LightmapOptions
    exposure: float | None
    seconds: dict[str, float]


def read_and_unfold(
    source: str | Path | Scene,
    atlas: AtlasOptions,
    default_light: bool,
    tell: Progress,
    *,
    file: FileOptions | None = None,
    sky: Sky | None = None,
    roots: bool = False,
    make: Callable[[Scene], Scene] | None = None,
    show: Callable[[FlatScene], None] | None = None,
) -> tuple[Scene, Scene, Charts, dict[str, float]]:
    """The scene as it was read, what ``make`` makes of it, cut where its surfaces meet, its charts, and the seconds of both
    stages. file: its unit and axes, guessed if None. roots: whether texels are the coarsest of quadtrees. show: is given what can
    be drawn as soon as the scene is read. Raises UserError (SceneError)."""
    start = time.perf_counter()
    tell("reading the file", 0.0)
    read = source if isinstance(source, Scene) else load_scene(source, file, default_light=default_light, sky=sky)
    scene = read if make is None else make(read)
    seconds = {"read": time.perf_counter() - start}
    if show is not None:
        start = time.perf_counter()
        show(FlatScene.of(scene))
        seconds["flat"] = time.perf_counter() - start
    start = time.perf_counter()
    tell("unfolding surfaces", 0.1)
    scene, charts = charts_of(scene, atlas, roots=roots, progress=lambda stage, share: tell(stage, 0.1 + 0.5 * share))
    return read, scene, charts, seconds | {"unfold": time.perf_counter() - start}


def load(
    source: str | Path | Scene,
    atlas: AtlasOptions,
    options: LightmapOptions | None = None,
    *,
    file: FileOptions | None = None,
    default_light: bool = False,
    sky: Sky | None = None,
    expose: bool = False,
    rays: bool = False,
    make: Callable[[Scene], Scene] | None = None,
    progress: Progress | None = None,
    show: Callable[[FlatScene], None] | None = None,
) -> Loaded:
    """Read a scene, or take one as it is; unfold it, cut it into texels, with ``expose`` find its exposure, and with ``rays``
    build the tree that they walk. file, make, show: as of ``read_and_unfold``. Raises UserError (SceneError)."""
    tell: Progress = progress or (lambda stage, share: None)
    options = options or LightmapOptions()
    read, scene, charts, seconds = read_and_unfold(
        source, atlas, default_light, tell, file=file, sky=sky, roots=options.adaptive, make=make, show=show
    )
    start = time.perf_counter()

    def cutting(share: float) -> None:
        tell("cutting into texels", 0.6 + 0.2 * share)

    cutting(0.0)
    pool = quadtree_pool(scene, charts, cutting) if options.adaptive else TilePool(scene, charts, report=cutting)
    tell("finding the exposure", 0.8)
    exposure = None
    with ThreadPoolExecutor(1) as beside:
        # cached in the pool: the window, which reads them next, does not wait
        mesh = beside.submit(lambda: (pool.visible_mesh, pool.emission_weights))
        arrays = pool.arrays
        if expose:
            camera = scene.cameras[0]
            exposure = first_exposure(pool, seen_texels(pool, camera.world_from_camera, camera.yfov))
        mesh.result()
    seconds["texels"] = time.perf_counter() - start
    if rays:
        start = time.perf_counter()
        tree_of(pool, lambda share: tell(SORTING, 0.8 + 0.2 * share))
        seconds["rays"] = time.perf_counter() - start
    tell("done", 1.0)
    return Loaded(read, pool, arrays, atlas, options, exposure, seconds)


class Loading(BackgroundTask[Loaded]):
    """A scene on its way, see ``load``. solver: by name, what it is made ready for. atlas, light: how it is cut and held.
    version: what is made of it, if anything. flat: what can be drawn of a scene as soon as it is read."""

    def __init__(
        self,
        source: str | Path | Scene,
        atlas: AtlasOptions,
        options: LightmapOptions,
        solver: str,
        *,
        file: FileOptions | None = None,
        default_light: bool = False,
        sky: Sky | None = None,
        expose: bool = False,
        version: Version | None = None,
    ) -> None:
        self.source, self.solver, self.atlas, self.light = source, solver, atlas, options
        self.flat: FlatScene | None = None
        self.version, make = version, None if version is None else version.make
        more: dict[str, Any] = {"default_light": default_light, "expose": expose, "rays": SOLVERS[solver].rays}
        super().__init__(
            "this scene",
            lambda tell: load(
                source, atlas, options, file=file, sky=sky, make=make, **more, progress=tell, show=self._show
            ),
        )

    def _show(self, flat: FlatScene) -> None:
        self.flat = flat

    @property
    def name(self) -> str:
        """What is loaded, for messages."""
        return self.source.name if isinstance(self.source, Scene) else str(self.source)
