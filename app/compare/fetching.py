"""A reference on its way, in a thread of its own: the window never waits for it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np

from app.atlas.node_set import NodeSet
from app.atlas.points import random_points
from app.bake.read import read_bake
from app.compare.comparison import POINTS, POINTS_SEED, Found
from app.compare.light import ReferenceLight, light_of_bake
from app.errors import UserError
from app.loading import CancelledError, Progress
from app.scene.model import Scene

TILES_AT_ONCE = 256  # looked up: bounds the memory that it takes
Work = Callable[[Progress], ReferenceLight]


def bake_light(path: Path, scene: Scene, tell: Progress) -> ReferenceLight:
    """Raises UserError where there is no bake, or one of another scene."""
    tell("reading", 0.0)
    bake = read_bake(path)
    tell("looking for its surfaces", 0.5)
    return light_of_bake(bake, scene)


def looked_up(light: ReferenceLight, nodes: NodeSet) -> Found:
    """With all that can be known of it in any thread: the leaves of a quadtree may change meanwhile. Raises UserError for a
    reference without light."""
    points = random_points(nodes.scene, POINTS, POINTS_SEED)
    if not light.at(points).max() > 0:
        raise UserError(f"{light.name}: holds no light")
    tiles = None
    if not nodes.adaptive:
        parts = np.array_split(np.arange(nodes.tiles), -(-nodes.tiles // TILES_AT_ONCE))
        tiles = np.concatenate([light.on_tiles(nodes, part) for part in parts])
    return Found(light, points, nodes, tiles)


class Fetching:
    """``ended`` says whether it is over; ``result`` gives what was found or raises what went wrong.

    stage, fraction: how far it is. cancelled: by the user; the thread ends soon.
    """

    def __init__(self, nodes: NodeSet, work: Work) -> None:
        self.nodes = nodes
        self.stage, self.fraction = "starting", 0.0
        self.cancelled = False
        self._found: Found | None = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, args=(work,), daemon=True)
        self._thread.start()

    @property
    def ended(self) -> bool:
        return not self._thread.is_alive()

    @property
    def result(self) -> Found:
        """Raises UserError, or CancelledError."""
        self._thread.join()
        if self._error is not None:
            raise self._error
        assert self._found is not None
        return self._found

    def cancel(self) -> None:
        self.cancelled = True

    def _run(self, work: Work) -> None:
        try:
            self._found = looked_up(work(self._progress), self.nodes)
        except MemoryError:
            self._error = UserError("not enough memory for this reference")
        except OSError as error:
            self._error = UserError(f"the reference: {error.strerror or error}")
        except Exception as error:  # raised again by the main thread, with its traceback
            self._error = error

    def _progress(self, stage: str, share: float) -> None:
        if self.cancelled:
            raise CancelledError
        self.stage, self.fraction = stage, share
