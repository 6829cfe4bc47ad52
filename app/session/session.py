"""One open scene and its solution: what window, headless shot, bake and bench all step.

A session owns scene, charts, lightmap and solver. It knows no window and no imgui; whoever draws reads ``lightmap``.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from app.atlas.charts import Charts
from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.estimate.error import ExpectedError
from app.gpu import Gpu
from app.render.options import DisplayOptions
from app.scene.model import Material, Scene
from app.session.comparing import Comparing
from app.session.energy import Books, Effort
from app.session.error_estimate import Expecting
from app.session.history import History
from app.session.loading import Loading, load
from app.session.opening import Opening, Ready
from app.session.pacing import Pacer
from app.session.solve import not_finite, solve
from app.session.stats import Stats, Stop, stats_of
from app.solvers import EnergyBalance, ShootingOptions


class Session(Comparing):
    """Raises UserError (SceneError, GpuError) from ``open_now``; ``open`` reports through ``message`` instead.

    expose_on_open: whether a scene that opens sets the exposure.
    """

    def __init__(
        self,
        gpu: Gpu,
        *,
        shooting: ShootingOptions | None = None,
        atlas: AtlasOptions | None = None,
        display: DisplayOptions | None = None,
        default_light: bool = False,
        expose_on_open: bool = False,
    ) -> None:
        super().__init__(gpu, display or DisplayOptions())
        self.shooting = shooting or ShootingOptions()
        self.atlas = atlas or AtlasOptions()
        self.default_light = default_light
        self.expose_on_open = expose_on_open
        self.running = True
        self.message: str | None = None
        self.load_seconds: dict[str, float] = {}
        self.history = History()
        self.interrupted, self.effort = False, Effort()
        self.seconds, self._pace = 0.0, Pacer(gpu)
        self._books = Books()
        self._settled, self._busy, self._opened = True, False, False
        self._opening = Opening(gpu, self.renderer)
        self.expecting = Expecting(gpu)
        self._then_reference: Path | None = None
        self.unedited: Scene  # the open one as it was read: the same through edits, and however it is cut

    # -- opening -------------------------------------------------------------------------------------------------------

    def open(self, source: str | Path, *, reference: Path | None = None) -> None:
        """Start to load in the background; ``poll`` swaps the scene when it is there. reference: a bake to open then."""
        self._then_reference = reference
        light, expose = self.default_light, self.expose_on_open
        self._opening.begin(Loading(source, self.atlas, default_light=light, expose=expose))

    def open_now(self, source: str | Path | Scene, progress: Callable[[str, float], None] | None = None) -> None:
        """Load and wait."""
        light, expose = self.default_light, self.expose_on_open
        loaded = load(source, self.atlas, default_light=light, expose=expose, progress=progress)
        self._take_over(self._opening.at_once(loaded, self.shooting, self.display.interpolation))

    def set_atlas(self, atlas: AtlasOptions) -> None:
        """Cut the open scene anew, in the background; its materials as edited, exposure and camera stay. Raises UserError
        while another scene is on its way."""
        if self.loading is not None and self.loading.source is not self.unedited:
            raise UserError(f"{self.loading.name} is loading: cut {self.name} anew before or after that")
        self._opening.begin(Loading(self.unedited, atlas))

    def poll(self, *, brisk: bool = False) -> None:
        """Once per frame: hear from the GPU, and swap in a scene that has finished loading, a part of it per frame. brisk: a hand
        is at the controls, what can wait does."""
        self._busy = False
        if self.loading is not None and (self.loading.ended or self.loading.cancelled):
            self._busy = True
            self._open_part(self.loading)
        elif self._opened:
            self.hear()
        if self._opened:
            self._compare()
            if self._quiet and not self._busy and not brisk:
                self._expect()

    def _open_part(self, loading: Loading) -> None:
        """The next part of opening what was loaded; the scene that is open stays until the last."""
        if loading.cancelled:
            self._opening.stop()
            self.message = f"{loading.name}: stopped" + (f"; {self.name} stays as it is" if self._opened else "")
            return
        try:
            ready = self._opening.part(self.shooting, self.display.interpolation)
            if ready is not None:
                self._take_over(ready)
        except UserError as error:
            self.message = str(error)

    def _take_over(self, ready: Ready) -> None:
        """In place of what is open."""
        loaded, lightmap, solver = ready.loaded, ready.lightmap, ready.solver
        scene = loaded.pool.scene
        if solver.options != self.shooting:  # changed between two parts
            solver.set_options(self.shooting)
        cut_anew = self._opened and scene is self.unedited
        if cut_anew and self.scene is not scene:
            lightmap.set_materials(self.scene.materials)
            solver.reset()
        self.close()
        self.lightmap, self.solver, self.unedited, self.atlas = lightmap, solver, scene, loaded.atlas
        self.load_seconds = loaded.seconds | {"upload": time.perf_counter() - ready.began}
        self.source = self.scene.source or self.scene.name
        if not cut_anew:
            self.look_through(self.scene.cameras[0])
        if loaded.exposure is not None:
            self.display = self.display.replace(exposure=loaded.exposure)
        self.message = None if self.scene.emits else f"{self.scene.name} has no light: try --light for a ceiling light"
        self._opened = True
        self._books.begin(self.solver.books())
        self._compare_anew()
        if self._then_reference is not None:
            self.open_reference(self._then_reference)
            self._then_reference = None
        self._begin()

    def close(self) -> None:
        """Release the open scene; the session can open another."""
        if self._opened:
            self.expecting.forget()
            self.solver.release()
            self.lightmap.release()
            self._opened = False

    def release(self) -> None:
        self._opening.stop()
        self.close()
        super().release()

    # -- what is open --------------------------------------------------------------------------------------------------

    @property
    def loading(self) -> Loading | None:
        """The scene that is on its way."""
        return self._opening.loading

    @property
    def opened(self) -> bool:
        return self._opened

    @property
    def scene(self) -> Scene:
        return self.lightmap.scene

    @property
    def charts(self) -> Charts:
        return self.lightmap.charts

    @property
    def name(self) -> str:
        return self.scene.name if self._opened else ""

    # -- solving -------------------------------------------------------------------------------------------------------

    @property
    def converged(self) -> bool:
        return bool(self.solver.report.residual <= self.shooting.residual) and self.solver.settled

    @property
    def shooting_goes_on(self) -> bool:
        """Whether ``advance`` has something to do."""
        return self._opened and self.running and not self.converged

    @property
    def at_rest(self) -> bool:
        """Whether nothing changes by itself: neither light nor numbers, and no scene is on its way."""
        known = not self._can_expect or self.expecting.knows(self._light)
        return self._quiet and known and not self.comparing

    @property
    def _quiet(self) -> bool:
        """Whether the light stays as it is by itself, and no other scene is on its way."""
        return self.loading is None and not self.shooting_goes_on and self._settled

    def advance(self, *, budget_ms: float, shots: int = 1, brisk: bool = False) -> int:
        """Make up to ``shots`` shots within ``budget_ms``; returns how many. None when paused or converged, nor in a frame that
        has already done something long. brisk: a hand is at the controls, see ``Pacer.advance``."""
        if not self._opened or self._busy or not self.shooting_goes_on:
            return 0
        self._settled = False
        self.expecting.changed()
        made = self._pace.advance(self.solver, budget_ms, shots, brisk=brisk)
        self.seconds += self._pace.lap()
        return made

    def shoot(self, shots: int = 1) -> int:
        """Up to ``shots`` shots, of one batch at most, also when paused or converged; how many."""
        self._settled = False
        self.expecting.changed()
        return self.solver.step(shots)

    def solve(self, stop: Stop, progress: Callable[[Stats], None] | None = None) -> None:
        """Shoot until ``stop``, or until converged, see ``solving.solve``. Raises NotFiniteError."""
        solve(self, stop, progress)

    def settle(self) -> None:
        """Wait for the GPU and bring report, book and history up to the last shot. Raises NotFiniteError, once."""
        known = np.isfinite(self.solver.report.residual)
        self.solver.poll(wait=True)
        self._books.make(self.solver)
        self._settled = True
        if self.books.emitted.sum() > 0:
            unshot = self.solver.unshot_share()
            self.solver.report = replace(self.solver.report, residual=unshot)
            self.history.add(self.solver.shots, self.seconds, unshot, self._escaped_share)
            if known and not np.isfinite(unshot + float(self.books.absorbed.sum())):
                raise not_finite(self)

    def restart(self) -> None:
        """Forget all light and begin again."""
        self.solver.reset()
        self._begin_again()

    def set_shooting(self, options: ShootingOptions) -> None:
        """Other knobs, from the next shot on; only another storage format begins again."""
        begins = options.storage != self.shooting.storage
        self.shooting = options
        self.effort.turned()
        if self._opened:
            self.solver.set_options(options)
            if begins:
                self._books.begin(self.solver.books())
                self._begin()

    def set_material(self, index: int, material: Material) -> None:
        """Another albedo or emission: charts, texels and light stay, and the difference is shot."""
        materials = list(self.scene.materials)
        materials[index] = material
        rested = self.converged
        self.solver.set_materials(tuple(materials))
        if self.solver.shots == 0:
            self._begin_again()
        else:
            self.effort.edited(self.solver.shots, rested=rested)
        self.history.add(self.solver.shots, self.seconds, self.solver.report.residual, self._escaped_share)
        self._books.edited()
        self._settled = False

    def measure(self) -> None:
        """Wait for the GPU and bring ``comparison`` up to the last shot."""
        self._compare(wait=True)

    @property
    def expected(self) -> ExpectedError | None:
        """How far off the light is expected to be: None as long as it is not known, see ``expecting``, or nothing is lit."""
        return self.expecting.error if self._opened and self.expecting.knows(self._light) else None

    def expect(self, progress: Callable[[float], None]) -> None:
        """Work out ``expected`` whole, of settled light."""
        while self._can_expect and not self.expecting.knows(self._light):
            self._expect()
            progress(self.expecting.share)

    @property
    def _can_expect(self) -> bool:
        """Whether there is light to judge."""
        return self._opened and self.solver.shots > 0 and self.scene.emits

    def _expect(self) -> None:
        """Some of the points, or none where there is nothing to do."""
        if self._can_expect and not self.expecting.knows(self._light):
            self.expecting.part(self.lightmap, self.books.returned, self._light)

    def _begin_again(self) -> None:
        self._books.begin_again()
        self._begin()

    def _begin(self) -> None:
        self.seconds, self._settled = 0.0, True
        self.effort.begin()
        self.expecting.changed()
        self._pace.begin()
        self.gpu.timers.reset()
        self.history = History()
        if self.comparison is not None:
            self.comparison.begin()
        self.history.add(0, 0.0, self.solver.report.residual, 0.0)

    def hear(self, *, books: bool = True, wait: bool = False) -> None:
        """Take in what the solver reports, with ``wait`` up to its last step; the energy book now and then, and once when
        shooting has stopped. Raises NotFiniteError and pauses."""
        before = self.solver.report.shots
        report = self.solver.poll(wait=wait)
        if self.running and not np.isfinite(report.residual):
            self.running = False
            raise not_finite(self)
        if not self.shooting_goes_on:
            self._pace.pause()
            if books and self._books.quiet and not self._settled:
                self._busy = True
                self.settle()
        elif books and self._books.due:
            self._busy = True
            self._books.make(self.solver)
        if self.converged:
            self.effort.converged(self.solver.report.shots)
        if report.shots != before and not self._settled:
            self.history.add(report.shots, self.seconds, report.residual, self._escaped_share)

    @property
    def _escaped_share(self) -> float:
        return float(self.solver.report.escaped.sum()) / max(float(self.books.emitted.sum()), 1e-300)

    # -- what is known -------------------------------------------------------------------------------------------------

    @property
    def books(self) -> EnergyBalance:
        """The last energy book that was made."""
        return self._books.book

    @property
    def stats(self) -> Stats:
        """Where the solution stands."""
        return stats_of(self)

    @property
    def timings(self) -> dict[str, float]:
        """Mean GPU milliseconds per call by pass; empty unless ``gpu.timers.enabled``."""
        return self.gpu.timers.mean_ms()

    @property
    def parameters(self) -> dict[str, Any]:
        """Every knob that shaped the solution."""
        chosen = {"level": self.solver.level, "resolution": self.solver.resolution}
        shooting = self.shooting.as_dict() | chosen
        return {"shooting": shooting, "atlas": self.atlas.as_dict(), "light": self.default_light}


__all__ = ["Session", "Stats", "Stop"]
