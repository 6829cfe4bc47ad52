"""From a source to a lightmap and its solver on the GPU: loaded in the background, then uploaded in parts, one per frame."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Generator
from dataclasses import dataclass

from app.errors import UserError
from app.gpu import Gpu, Texture
from app.lightmap.lightmap import Lightmap, upload
from app.render.frame import FrameRenderer
from app.session.loading import Loaded, Loading
from app.solvers import DEFAULT_SOLVER, SOLVERS, ShootingOptions, Solver
from app.util.parts import run_to_end


@dataclass(frozen=True, eq=False)
class Ready:
    """What can take the place of what is open: its light is as before the first shot. began: when its upload did [s], of
    ``time.perf_counter``."""

    loaded: Loaded
    lightmap: Lightmap
    solver: Solver[ShootingOptions]
    began: float


class Opening:
    """At most one scene on its way, ``loading``. What is open stays as it is until the other is Ready."""

    def __init__(self, gpu: Gpu, renderer: FrameRenderer) -> None:
        self._gpu, self._renderer = gpu, renderer
        self.loading: Loading | None = None
        self._parts: Generator[None, None, Ready] | None = None

    def begin(self, loading: Loading) -> None:
        """This one instead of any other."""
        self.stop()
        self.loading = loading

    def stop(self) -> None:
        """None at all; nothing of it stays on the GPU."""
        if self.loading is not None:
            self.loading.cancel()
        if self._parts is not None:
            self._parts.close()
        self.loading = self._parts = None

    def part(self, options: ShootingOptions, interpolation: str) -> Ready | None:
        """The next part of what was loaded; all of it after the last. Raises UserError, and ends then."""
        assert self.loading is not None
        try:
            if self._parts is None:
                self._parts = self._upload(self.loading.result, options, interpolation)
            next(self._parts)
        except StopIteration as last:
            self.loading = self._parts = None
            ready: Ready = last.value
            return ready
        except UserError:
            self.loading = self._parts = None
            raise
        return None

    def at_once(self, loaded: Loaded, options: ShootingOptions, interpolation: str) -> Ready:
        """All of what was loaded elsewhere. Raises UserError."""
        return run_to_end(self._upload(loaded, options, interpolation))

    def _upload(self, loaded: Loaded, options: ShootingOptions, interpolation: str) -> Generator[None, None, Ready]:
        """Upload what was loaded, and draw once with each program, since drivers compile it then; yields after each part.
        interpolation: that pictures will be drawn with. Raises UserError; then, and when given up between two parts, nothing
        stays on the GPU."""
        began, gpu = time.perf_counter(), self._gpu
        with contextlib.ExitStack() as undo:
            textures: dict[str, Texture] = {}
            uploads = undo.enter_context(contextlib.ExitStack())
            for name, array in loaded.arrays.items():
                textures[name] = upload(gpu, array)
                uploads.callback(gpu.release_all, textures[name])
                yield
            lightmap = Lightmap(gpu, loaded.pool, storage=options.storage, textures=textures)
            uploads.pop_all()
            undo.callback(lightmap.release)
            gpu.ctx.finish()
            yield
            solver = SOLVERS["adaptive" if loaded.atlas.adaptive else DEFAULT_SOLVER](gpu, lightmap, options)
            undo.callback(solver.release)
            yield
            yield from solver.warm_up(1)
            solver.reset()
            yield
            self._renderer.prepare(lightmap, interpolation)
            undo.callback(self._renderer.give_up)
            gpu.ctx.finish()
            yield
            undo.pop_all()
        return Ready(loaded, lightmap, solver, began)
