"""From a file, or a scene that is open, to a node set, in a thread of its own: the window never waits for it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from app.atlas.charts import Charts
from app.atlas.node_set import Array, NodeSet
from app.atlas.options import AtlasOptions
from app.atlas.parametrize import parametrize
from app.atlas.quadtree import quadtree_nodes
from app.errors import UserError
from app.render.exposure import first_exposure
from app.scene.load import load_scene
from app.scene.model import Scene

Progress = Callable[[str, float], None]  # stage, share done


class CancelledError(Exception):
    """The user stopped it."""


@dataclass(frozen=True, eq=False)
class Loaded:
    """A node set and what of it is uploaded, how it was cut, the exposure to open it with [EV] if that was asked for, and how
    long each stage took [s]."""

    nodes: NodeSet
    arrays: dict[str, Array]
    atlas: AtlasOptions
    exposure: float | None
    seconds: dict[str, float]


def read_and_unfold(
    source: str | Path | Scene, atlas: AtlasOptions, default_light: bool, tell: Progress
) -> tuple[Scene, Charts, dict[str, float]]:
    """The scene, its charts, and the seconds of both stages. Raises UserError (SceneError)."""
    start = time.perf_counter()
    tell("reading", 0.0)
    scene = source if isinstance(source, Scene) else load_scene(source, default_light=default_light)
    middle = time.perf_counter()
    tell("unfolding", 0.1)
    charts = parametrize(
        scene,
        density=atlas.density,
        texels=atlas.texels,
        tile=atlas.tile,
        roots=atlas.adaptive,
        progress=lambda stage, share: tell(stage, 0.1 + 0.5 * share),
    )
    return scene, charts, {"read": middle - start, "unfold": time.perf_counter() - middle}


def load(
    source: str | Path | Scene,
    atlas: AtlasOptions,
    *,
    default_light: bool = False,
    expose: bool = False,
    progress: Progress | None = None,
) -> Loaded:
    """Read a scene, or take one as it is; unfold it, cut it into texels, and with ``expose`` find its exposure. Raises UserError
    (SceneError)."""
    tell: Progress = progress or (lambda stage, share: None)
    scene, charts, seconds = read_and_unfold(source, atlas, default_light, tell)
    start = time.perf_counter()
    tell("cutting into texels", 0.6)
    nodes = quadtree_nodes(scene, charts) if atlas.adaptive else NodeSet(scene, charts)
    exposure, arrays = first_exposure(nodes) if expose else None, nodes.arrays
    _ = nodes.emission_weights, nodes.drawn  # cached here: the window, which reads them next, does not wait
    tell("done", 1.0)
    return Loaded(nodes, arrays, atlas, exposure, seconds | {"texels": time.perf_counter() - start})


class Loading:
    """A load under way. ``ended`` says whether it is over; ``result`` gives it or raises what went wrong.

    cancelled: by the user. Whoever waits for the result gives up then; the thread ends at its next stage.
    """

    def __init__(
        self, source: str | Path | Scene, atlas: AtlasOptions, *, default_light: bool = False, expose: bool = False
    ) -> None:
        self.source = source
        self.stage, self.fraction = "reading", 0.0
        self.cancelled = False
        self._loaded: Loaded | None = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, args=(atlas, default_light, expose), daemon=True)
        self._thread.start()

    @property
    def name(self) -> str:
        """What is loaded, for messages."""
        return self.source.name if isinstance(self.source, Scene) else str(self.source)

    @property
    def ended(self) -> bool:
        return not self._thread.is_alive()

    @property
    def result(self) -> Loaded:
        """What was loaded. Raises UserError, or CancelledError."""
        self._thread.join()
        if self._error is not None:
            raise self._error
        assert self._loaded is not None
        return self._loaded

    def cancel(self) -> None:
        """Stop; the scene that is open stays."""
        self.cancelled = True

    def _run(self, atlas: AtlasOptions, default_light: bool, expose: bool) -> None:
        try:
            self._loaded = load(self.source, atlas, default_light=default_light, expose=expose, progress=self._progress)
        except (UserError, CancelledError, MemoryError) as error:
            self._error = UserError("not enough memory for this scene") if isinstance(error, MemoryError) else error
        except Exception as error:  # shown by the main thread, with its traceback
            self._error = error

    def _progress(self, stage: str, share: float) -> None:
        if self.cancelled:
            raise CancelledError
        self.stage, self.fraction = stage, share
