"""From a source to a lightmap and its solver on the GPU: loaded in the background, then uploaded in parts, one per frame."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from app.errors import UserError
from app.gpu import Gpu, Texture
from app.lightmap.lightmap import Lightmap
from app.lightmap.options import LightmapOptions
from app.lightmap.textures import upload
from app.options import Options
from app.session.loading import LOADED, UPLOADING, Loaded, Loading
from app.solvers import SOLVERS, Solver
from app.util.parts import run_to_end

# Stages, after UPLOADING
COMPILING, DRAWING, LIGHTING = "making the solver ready", "making the picture ready", "first light"
LIGHT_BANDS = 16  # parts of the first light, with frames of the window between them
Prepare = Callable[
    [Lightmap], Callable[[], None]
]  # what else a lightmap needs before it is shown; returns what undoes it


class Opened(Protocol):
    """Called when another lightmap is open, of the same scene cut anew or of another one."""

    def __call__(self, exposure: float | None, *, same_scene: bool, reference_gone: bool) -> None: ...


@dataclass(frozen=True, eq=False)
class Ready:
    """What can take the place of what is open: its light is as before any work, or after the first piece, where it takes the
    place of a picture. solver_name: of the table of solvers. began: when its upload did [s], of ``time.perf_counter``."""

    loaded: Loaded
    lightmap: Lightmap
    solver: Solver[Any]
    solver_name: str
    began: float

    def catch_up(self, light: LightmapOptions, options: Options) -> None:
        """Take over what has been chosen since: how light is held, options of the solver. Raises UserError."""
        light = light.replace(adaptive=self.loaded.options.adaptive)
        if self.lightmap.options != light:
            self.lightmap.set_options(light)
            self.solver.reset()
        if self.solver.options != options:
            self.solver.set_options(options)


class Opening:
    """The scene that is on its way, ``loading``; at most one. What is open stays as it is until the other is Ready.

    prepare: done with every new lightmap before it is Ready.
    """

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self.prepare: Prepare | None = None
        self.loading: Loading | None = None
        self._parts: Generator[tuple[str, float], None, Ready] | None = None
        self._coarse = self._shows = False  # whether these parts are of coarse texels; whether coarse light is shown
        self._warm = set[tuple[int, str]]()  # solvers all of whose programs have drawn, since which reload of these

    def begin(self, loading: Loading) -> None:
        """This one instead of any other."""
        self.stop()
        self.loading, self._shows = loading, False

    def stop(self) -> None:
        """None at all; nothing of it stays on the GPU."""
        if self.loading is not None:
            self.loading.cancel()
        if self._parts is not None:
            self._parts.close()
        self.loading = self._parts = None

    @property
    def has_part(self) -> bool:
        """Whether there is something to upload: of what was loaded, or of coarse texels that come before it."""
        return self.loading is not None and (
            self.loading.ended or self._parts is not None or self.loading.coarse is not None
        )

    def part(self, options: Mapping[str, Options]) -> Ready | None:
        """The next part of what was loaded, with the options of its solver; all of it after the last. Of coarse texels, which may
        come first, ``loading`` goes on, also where they do not fit. Raises UserError, and ends then."""
        loading = self.loading
        assert loading is not None
        try:
            if loading.ended and self._coarse and self._parts is not None:  # better ones are there
                self._parts.close()
                self._parts = None
            if self._parts is None:
                coarse, loading.coarse = loading.coarse, None
                self._coarse = coarse is not None and not loading.ended
                of = coarse if coarse is not None and self._coarse else loading.result
                lights = self._coarse or self._shows
                self._parts = self._upload(of, loading.solver, options, coarse=self._coarse, lights=lights)
            stage, share = next(self._parts)
            if not self._coarse:
                loading.stage, loading.fraction = stage, LOADED + (1 - LOADED) * share
        except StopIteration as last:
            self._parts, self._shows = None, self._coarse
            if not self._coarse:
                self.loading = None
            ready: Ready = last.value
            return ready
        except UserError:
            self._parts = None
            if not self._coarse:
                self.loading = None
                raise
        return None

    def at_once(self, loaded: Loaded, solver_name: str, options: Mapping[str, Options]) -> Ready:
        """All of what was loaded elsewhere. Raises UserError."""
        return run_to_end(self._upload(loaded, solver_name, options))

    def _upload(
        self,
        loaded: Loaded,
        solver_name: str,
        options: Mapping[str, Options],
        *,
        coarse: bool = False,
        lights: bool = False,
    ) -> Generator[tuple[str, float], None, Ready]:
        """Upload what was loaded, and draw once with each program of the solver, since drivers compile it then, unless all have
        drawn; in coarse texels the first shot does. lights: whether a picture stays until there is light, of a solver that cannot
        be told what is to come. Yields, after each part, the stage of the next and the share that is done.
        Raises UserError; then, and when given up between two parts, nothing stays on the GPU."""
        began, gpu, family = time.perf_counter(), self._gpu, SOLVERS[solver_name]
        make = family.for_coarse if coarse and family.for_coarse is not None else family.make
        with contextlib.ExitStack() as undo:
            textures: dict[str, Texture] = {}
            uploads = undo.enter_context(contextlib.ExitStack())
            for name, array in loaded.arrays.items():
                textures[name] = upload(gpu, array)
                uploads.callback(gpu.release_all, textures[name])
                yield UPLOADING, 0.5 * len(textures) / len(loaded.arrays)
            lightmap = Lightmap(gpu, loaded.pool, loaded.options, textures=textures)
            uploads.pop_all()
            undo.callback(lightmap.release)
            gpu.ctx.finish()
            yield COMPILING, 0.5
            compiled = gpu.shaders.compiled
            solver = make(gpu, lightmap, options[solver_name])
            if gpu.shaders.compiled > compiled:
                self._warm.clear()  # solvers share programs: others may need these, too
            undo.callback(solver.release)
            yield COMPILING, 0.6
            warm = gpu.shaders.generation, solver_name
            if not coarse and warm not in self._warm:
                for done, _ in enumerate(solver.warm_up(), 1):
                    yield COMPILING, 0.9 - 0.3 / (1 + done)  # nobody knows of how many
                solver.reset()
                yield DRAWING, 0.9
                self._warm.add(warm)
            if self.prepare is not None:
                undo.callback(self.prepare(lightmap))
                gpu.ctx.finish()
                yield DRAWING, 0.95
            if lights and not family.foresees:
                for done, _ in enumerate(solver.work(family.batch, LIGHT_BANDS), 1):
                    gpu.ctx.finish()
                    yield LIGHTING, 1.0 - 0.05 / (1 + done)
            undo.pop_all()
        return Ready(loaded, lightmap, solver, solver_name, began)
