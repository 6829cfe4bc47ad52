"""From a file, or a scene that is open, to a tile pool, in a thread of its own: the window never waits for it."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.atlas.charts import Charts
from app.atlas.charts_cache import charts_of
from app.atlas.coarse import coarse_charts
from app.atlas.mesh_cache import kept_mesh
from app.atlas.options import MAX_TEXELS, AtlasOptions
from app.atlas.parametrize import check, default_texels
from app.atlas.visible_mesh import Drawn, coarse_mesh
from app.errors import UserError
from app.lightmap.carry_over import TexelPlaces
from app.lightmap.options import LightmapOptions
from app.lightmap.quadtree import quadtree_pool
from app.lightmap.tile_pool import Array, SolverSpace, TilePool
from app.render.exposure import forecast_of
from app.render.flat import FlatScene
from app.render.seen import seen_texels
from app.scene.load import load_scene
from app.scene.model import F32, F64, Scene
from app.scene.options import FileOptions
from app.scene.sky import Sky
from app.session.ray_tree import SORTING
from app.session.versions import Version
from app.solvers import SOLVERS
from app.util import cache
from app.util.background import BackgroundTask, Progress, Report
from app.util.threads import threads
from app.visibility.rays import tree_of

UPLOADING, LOADED = "copying to the GPU", 0.9  # what comes after loading, and the share of opening that is done then
COARSE_FROM = 32_768  # triangles: charts of fewer are there within about two seconds


@dataclass(frozen=True, eq=False)
class Loaded:
    """A scene in texels, ready to be uploaded.

    read: the scene as it was read. pool: its texels, as it was made and cut. arrays: what is uploaded of them. atlas, options:
    how it was cut, and how its light is held. exposure: to open it with [EV], where that was asked for. seconds: that each stage
    took. notes: what went wrong beside it. places: where its blocks are in the coarse texels that were there before, of which
    light may be carried over.
    """

    read: Scene
    pool: TilePool
    arrays: dict[str, Array]
    atlas: AtlasOptions
    options: LightmapOptions
    exposure: float | None
    seconds: dict[str, float]
    notes: tuple[str, ...] = ()
    places: F32 | None = None


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
    waiting: Callable[[Scene, Scene], None] | None = None,
    cut: Callable[[Scene], None] | None = None,
) -> tuple[Scene, Scene, Charts, dict[str, float]]:
    """The scene as it was read, what ``make`` makes of it, cut where its surfaces meet, its charts, and the seconds of both
    stages. file: its unit and axes, guessed if None. roots: whether texels are the coarsest of quadtrees. show: is given what can
    be drawn as soon as the scene is read; waiting: the scene as read and as made, where its charts will take a while, and cut:
    the scene as cut, before these are there. Raises UserError (SceneError)."""
    start = time.perf_counter()

    def reading(share: float) -> None:
        tell("reading the file", 0.1 * share)

    reading(0.0)
    if isinstance(source, Scene):
        read = source
    else:
        read = load_scene(source, file, default_light=default_light, sky=sky, report=reading)
    reading(1.0)
    scene = read if make is None else make(read)
    seconds = {"read": time.perf_counter() - start}
    if show is not None:
        start = time.perf_counter()
        show(FlatScene.of(scene))
        seconds["flat"] = time.perf_counter() - start
    start = time.perf_counter()
    tell("unfolding surfaces", 0.1)
    uncut = scene
    scene, charts = charts_of(
        scene,
        atlas,
        roots=roots,
        progress=lambda stage, share: tell(stage, 0.1 + 0.5 * share),
        waiting=None if waiting is None else lambda: waiting(read, uncut),
        cut=cut,
    )
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
    foresees: bool = False,
    make: Callable[[Scene], Scene] | None = None,
    progress: Progress | None = None,
    show: Callable[[FlatScene], None] | None = None,
    coarse: Callable[[Loaded], None] | None = None,
) -> Loaded:
    """Read a scene, or take one as it is; unfold it, cut it into texels, with ``expose`` find its exposure, and with ``rays``
    build the tree that they walk. file, make, show: as of ``read_and_unfold``. coarse: is given the scene in coarse texels, from
    another thread, where better ones will take a while and there is light to show. foresees: whether that will be carried over.
    Raises UserError (SceneError)."""
    tell = _Telling(progress or (lambda stage, share: None))
    options = options or LightmapOptions()
    check(atlas.density, atlas.texels)
    with cache.written_beside() as failures:
        with threads(1) as beside, threads(1) as meanwhile:
            early: list[Future[tuple[Loaded, TexelPlaces] | None]] = []
            drawn: list[Future[Drawn]] = []

            def drawing(scene: Scene) -> None:
                drawn.append(meanwhile.submit(Drawn.of, _local(scene), scene.triangles))

            def waiting(read: Scene, scene: Scene) -> None:
                if coarse is not None and scene.emits and len(scene.triangles) >= COARSE_FROM:
                    early.append(
                        beside.submit(_show_coarse, read, scene, atlas, options, expose, rays, tell.again, coarse)
                    )

            read, scene, charts, seconds = read_and_unfold(
                source,
                atlas,
                default_light,
                tell,
                file=file,
                sky=sky,
                roots=options.adaptive,
                make=make,
                show=show,
                waiting=waiting,
                cut=drawing,
            )
            shown, known = (early[0].result() if early else None) or (None, None)
        start = time.perf_counter()

        def cutting(share: float) -> None:
            tell("cutting into texels", 0.6 + 0.2 * share)

        cutting(0.0)
        known = known if foresees else None
        more: dict[str, Any] = {"expose": expose and shown is None, "drawn": drawn[0].result if drawn else None}
        pool, arrays, exposure, places = _in_texels(scene, charts, options, cutting, known=known, **more)
        exposure = exposure if shown is None else shown.exposure
        seconds["texels"] = time.perf_counter() - start
        if rays:
            start = time.perf_counter()
            tree_of(pool, lambda share: tell(SORTING, 0.8 + (LOADED - 0.8) * share))
            seconds["rays"] = time.perf_counter() - start
        tell(UPLOADING, LOADED)
    notes = tuple(f"what took long is not kept for next time: {failure}" for failure in failures[:1])
    return Loaded(read, pool, arrays, atlas, options, exposure, seconds, notes, places)


class _Telling:
    """A progress that is told in one thread, and ``again`` in others, so that they end, too, where it raises."""

    def __init__(self, progress: Progress) -> None:
        self._progress, self._last = progress, ("starting", 0.0)

    def __call__(self, stage: str, share: float) -> None:
        self._last = stage, share
        self._progress(stage, share)

    def again(self, _share: float = 0.0) -> None:
        self._progress(*self._last)


def _show_coarse(
    read: Scene,
    scene: Scene,
    atlas: AtlasOptions,
    options: LightmapOptions,
    expose: bool,
    rays: bool,
    alive: Report,
    show: Callable[[Loaded], None],
) -> tuple[Loaded, TexelPlaces] | None:
    """Show a scene in coarse texels, unless it has too many small pieces for that, or they cannot be had: better ones come all
    the same. Where they are, as long as none of them has changed. alive: raises to end the work."""
    start = time.perf_counter()
    texels = min(atlas.texels or MAX_TEXELS, default_texels(len(scene.triangles), True))
    try:
        charts = coarse_charts(scene, atlas.tile, texels, alive)
        if charts is None:
            return None
        alive(0.0)
        pool, arrays, exposure, _ = _in_texels(scene, charts, options, alive, expose=expose, coarse=True)
        if rays:
            tree_of(pool, alive)
    except (UserError, MemoryError):
        return None
    loaded = Loaded(read, pool, arrays, atlas, options, exposure, {"coarse": time.perf_counter() - start})
    places = TexelPlaces(pool)
    show(loaded)
    return loaded, places


def _in_texels(
    scene: Scene,
    charts: Charts,
    options: LightmapOptions,
    report: Report,
    *,
    expose: bool,
    coarse: bool = False,
    known: TexelPlaces | None = None,
    drawn: Callable[[], Drawn] | None = None,
) -> tuple[TilePool, dict[str, Array], float | None, F32 | None]:
    """A scene cut into texels, as it is uploaded, with ``expose`` the exposure that its light will need [EV], and where its
    blocks are in the texels that are ``known``. coarse: texels that are not there for long, nothing of which is kept on disk.
    drawn: as of ``kept_mesh``."""
    exposure = None
    with threads(2) as beside:
        make_mesh = coarse_mesh if coarse else functools.partial(kept_mesh, drawn=drawn)
        mesh = beside.submit(make_mesh, scene, charts, _local(scene))
        seams = beside.submit(lambda: charts.seam_texels)
        pool = quadtree_pool(scene, charts, report) if options.adaptive else TilePool(scene, charts, report=report)
        report(1.0)
        # cached in pool and charts: the window, which reads them next, does not wait
        pool.visible_mesh = mesh.result()
        seams.result()
        arrays = beside.submit(lambda: (pool.arrays, pool.emission_weights)[0])
        places = None if known is None else known.of_blocks(pool)
        if expose:
            camera = scene.cameras[0]
            exposure, pool.usual_light = forecast_of(pool, seen_texels(pool, camera.world_from_camera, camera.yfov))
        return pool, arrays.result(), exposure, places


def _local(scene: Scene) -> F64:
    """Its positions in the solver space."""
    return SolverSpace.of(scene).local_from_world(scene.positions)


class Loading(BackgroundTask[Loaded]):
    """A scene on its way, see ``load``. solver: by name, what it is made ready for. atlas, light: how it is cut and held.
    version: what is made of it, if anything. flat: what can be drawn of a scene as soon as it is read. coarse: the scene in
    coarse texels, once it is there and until it is taken."""

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
        coarse: bool = False,
    ) -> None:
        """coarse: whether coarse texels are asked for where better ones will take a while."""
        self.source, self.solver, self.atlas, self.light = source, solver, atlas, options
        self.flat: FlatScene | None = None
        self.coarse: Loaded | None = None
        self.version, make = version, None if version is None else version.make
        more: dict[str, Any] = {"default_light": default_light, "expose": expose, "rays": SOLVERS[solver].rays}
        more |= {"foresees": SOLVERS[solver].foresees}
        more |= {"show": self._show, "coarse": self._show_coarse if coarse else None}
        super().__init__(
            "this scene",
            lambda tell: load(source, atlas, options, file=file, sky=sky, make=make, **more, progress=tell),
        )

    def _show(self, flat: FlatScene) -> None:
        self.flat = flat

    def _show_coarse(self, loaded: Loaded) -> None:
        self.coarse = loaded

    @property
    def name(self) -> str:
        """What is loaded, for messages."""
        return self.source.name if isinstance(self.source, Scene) else str(self.source)
