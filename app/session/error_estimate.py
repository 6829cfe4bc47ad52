"""The error estimate of the light as it is: some points per frame, while nothing else is to be done."""

from __future__ import annotations

from collections.abc import Generator

from app.estimate.error import ErrorEstimate, ErrorEstimator
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.session.ray_tree import RayTree

SECONDS = 10.0  # that are spent on it, unless fewer points would be too few
NODES = 32  # per part: 20 ms of a Cornell box in software
MANY = 20_000  # triangles from which on it is a quarter of them


class RunningEstimate:
    """The error estimate of the open scene's light, worked out in parts. Whoever makes it calls ``release`` before the lightmap
    is released.

    error: None as long as it is not known, or where nothing is lit; share: of the points that have been looked from. seconds:
    that the next one may take, unless fewer points would be too few.
    """

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self._tree: RayTree | None = None
        self._expectation: ErrorEstimator | None = None
        self._parts: Generator[float, None, ErrorEstimate | None] | None = None
        self._of: object = None
        self.error: ErrorEstimate | None = None
        self.share, self.seconds = 0.0, SECONDS

    def knows(self, state: object) -> bool:
        """Whether all is known of the light in this state."""
        return self._of == state and self._parts is None

    def part(self, lightmap: Lightmap, state: object, *, wait: bool = False) -> None:
        """Some points of the light in this state; of another state than the last one's from the first point on. The first of a
        scene need a tree of its triangles, which is built in the background; wait: for that."""
        if self._tree is None:
            self._tree = RayTree(lightmap.pool)
        if self._of != state:
            if not (wait or self._tree.ended):
                return
            self.changed()
            if self._expectation is None:
                nodes = NODES if len(lightmap.scene.triangles) < MANY else NODES // 4
                _ = self._tree.result  # waited for, if need be
                self._expectation = ErrorEstimator(self._gpu, lightmap, nodes)
            self._of, self._parts = state, self._expectation.parts(self.seconds)
        elif self._parts is not None:
            try:
                self.share = next(self._parts)
            except StopIteration as end:
                self.error, self._parts = end.value, None

    def changed(self) -> None:
        """The light is another one."""
        if self._parts is not None:
            self._parts.close()
        self._of, self._parts, self.error, self.share = None, None, None, 0.0

    def release(self) -> None:
        """The lightmap is going."""
        self.changed()
        if self._tree is not None:
            self._tree.cancel()
            self._tree = None
        if self._expectation is not None:
            self._expectation.release()
            self._expectation = None
