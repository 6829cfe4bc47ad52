"""A session is one open scene and its solution: the window steps it frame by frame, shot and bake from first to last.

A session has a scene on its way (opening), a solve (run), a comparison with a reference (compared) and an error estimate. It
knows no window, no picture and no imgui; whoever draws reads ``lightmap``.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.atlas.charts import Charts
from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.estimate.error import ErrorEstimate
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.lightmap.options import LightmapOptions
from app.options import Options
from app.scene.lights import Light
from app.scene.model import F64, Material, Scene
from app.scene.options import FileOptions
from app.scene.sky import Sky
from app.session.compared import Compared
from app.session.error_estimate import SECONDS, RunningEstimate
from app.session.flicker import flickering
from app.session.loading import Loading, load
from app.session.opening import Opened, Opening, Prepare, Ready
from app.session.run import Keeper, Run, Stop
from app.session.solver_choice import SolverChoice
from app.session.stats import Stats, stats_of
from app.session.versions import Version
from app.solvers import DEFAULT_SOLVER, SOLVERS, Family, Solver
from app.util.background import BackgroundTask
from app.util.state import State


@dataclass(frozen=True)
class Reading:
    """How a scene is read: its file's unit and axes, guessed if None; with a ceiling light where nothing in it emits; with which
    sky where it has none."""

    file: FileOptions | None = None
    default_light: bool = False
    sky: Sky | None = None


@dataclass(frozen=True)
class Cut:
    """How a scene is cut, held and solved."""

    atlas: AtlasOptions
    light: LightmapOptions
    solver: str


class Session:
    """The open scene with its lightmap and solver. Raises UserError (SceneError, GpuError) from ``open_now``; ``open`` reports
    through ``message`` instead. Whoever makes it releases it.

    options: of the solver that is at work. atlas, light: how scenes are cut, and how their light is held. expose_on_open:
    whether the exposure is forecast of a scene that opens. unedited: the open scene as it was read, the same through edits and
    however it is cut. edited: what edits are of: another object where those of before are not edits of what is open now.
    reading: how it was read. has_own_surfaces: whether it has others than its file. load_seconds: of each stage of opening.
    message: what the user should know.
    """

    def __init__(
        self,
        gpu: Gpu,
        *,
        solver: str = DEFAULT_SOLVER,
        options: Options | None = None,
        atlas: AtlasOptions | None = None,
        light: LightmapOptions | None = None,
        default_light: bool = False,
        sky: Sky | None = None,
        expose_on_open: bool = False,
    ) -> None:
        """options: of that solver, its defaults if None; default_light: give scenes a ceiling light; sky: give it to scenes
        that have none."""
        self.gpu, self._choice = gpu, SolverChoice(solver, options)
        self.atlas, self.light = atlas or AtlasOptions(), light or LightmapOptions()
        self.default_light, self.sky, self.expose_on_open = default_light, sky, expose_on_open
        self.message: str | None = None
        self.load_seconds: dict[str, float] = {}
        self.run, self.compared, self.estimate = Run(gpu), Compared(gpu), RunningEstimate(gpu)
        self.lightmap: Lightmap
        self.solver: Solver[Any]
        self.unedited: Scene
        self.source: str | Path
        self._opening = Opening(gpu)
        self._on_open: Opened | None = None
        self._opened = self._busy = False
        self.edited: object = None
        self.has_own_surfaces = False
        self._steady: Scene | None = None  # as it was edited, while its lamps flicker
        self._then_reference: Path | None = None
        self.reading = self._reading = Reading()

    def follow(self, prepare: Prepare, opened: Opened) -> None:
        """Call a view to prepare for each lightmap before it is shown, and once it is open."""
        self._opening.prepare, self._on_open = prepare, opened

    # -- opening -------------------------------------------------------------------------------------------------------

    def open(
        self,
        source: str | Path,
        file: FileOptions | None = None,
        *,
        reference: Path | None = None,
        reading: Reading | None = None,
        cut: Cut | None = None,
    ) -> None:
        """Start to load in the background; ``poll`` swaps the scene when it is there. file: its unit and axes,
        guessed if None. reference: a bake to open then. reading, cut: instead of the session's own."""
        self._then_reference = reference
        self._reading = reading or Reading(file, self.default_light, self.sky)
        cut = cut or Cut(self.atlas, self.light, self.chosen_solver)
        more: dict[str, Any] = {"default_light": self._reading.default_light, "expose": self.expose_on_open}
        self._opening.begin(
            Loading(source, cut.atlas, cut.light, cut.solver, file=self._reading.file, sky=self._reading.sky, **more)
        )

    def open_now(
        self,
        source: str | Path | Scene,
        progress: Callable[[str, float], None] | None = None,
        file: FileOptions | None = None,
    ) -> None:
        """Load and wait. file: as of ``open``."""
        solver, self._reading = self.chosen_solver, Reading(file, self.default_light, self.sky)
        rays = SOLVERS[solver].rays
        more: dict[str, Any] = {"default_light": self.default_light, "expose": self.expose_on_open, "rays": rays}
        loaded = load(source, self.atlas, self.light, file=file, sky=self.sky, **more, progress=progress)
        self._take_over(self._opening.at_once(loaded, solver, self._choice.options))

    def cut_anew(self, atlas: AtlasOptions, *, adaptive: bool | None = None) -> None:
        """Cut the open scene anew, in the background; its materials as edited, exposure and camera stay. adaptive: whether into
        quadtrees, as it is if None. Raises UserError while another scene is on its way."""
        if self.loading is not None and not (self._opened and self.loading.source is self.unedited):
            raise UserError(f"{self.loading.name} is loading: cut {self.name or 'it'} anew before or after that")
        light = self.light if adaptive is None else self.light.replace(adaptive=adaptive)
        self._opening.begin(Loading(self.unedited, atlas, light, self.chosen_solver))

    def change_surfaces(self, version: Version) -> None:
        """Let the open scene have other surfaces, cut in the background: its edits, exposure and camera stay, light begins again.
        Raises UserError while another scene is on its way."""
        if self.loading is not None:
            raise UserError(f"{self.loading.name} is loading: change {self.name} before or after that")
        dark = not self.edited_scene.emits
        self._opening.begin(
            Loading(version.of, self.atlas, self.light, self.chosen_solver, expose=dark, version=version)
        )

    def _open_to_the_sky(self, before: Scene) -> None:
        """Cut the scene anew where it has a sky or lights now and had none ``before``: sides that face nothing may be lit now."""
        now = self.edited_scene
        if before.open_to_lights or not now.open_to_lights or not self.charts.dark_faces or self.loading is not None:
            return
        sky, lights = now.sky, now.lights
        same = tuple(range(len(self.unedited.materials)))
        self.change_surfaces(Version(self.unedited, lambda scene: scene.with_sky(sky).with_lights(lights), same))

    @property
    def asked_cut(self) -> tuple[AtlasOptions, bool]:
        """How the open scene is cut, and whether into quadtrees; as it was asked for last, where that is on its way."""
        cuts = self._opened and self.loading is not None and self.loading.source is self.unedited
        cut = self.loading if cuts and self.loading is not None else self
        return cut.atlas, cut.light.adaptive

    def poll(self, *, interactive: bool = False) -> None:
        """Once per frame: take in what the GPU reports, and swap in a scene that has finished loading, a part of it per frame.
        interactive: a hand is at the controls, what can wait does."""
        self._busy = False
        if self.loading is not None and (self.loading.ended or self.loading.cancelled):
            self._busy = True
            self._open_part(self.loading)
        elif self._opened:
            self._busy = self.run.poll(interactive=interactive)
            self._flicker()
        if self._choice.has_arrived:
            self._busy = True
            self._end_switching()
        if self._opened:
            self.compare()
            if self._idle and not self._busy and not interactive:
                self._estimate_part()

    def _open_part(self, loading: Loading) -> None:
        """The next part of opening what was loaded; the scene that is open stays until the last."""
        if loading.cancelled:
            self._opening.stop()
            self._then_reference = None
            self.message = f"{loading.name}: stopped" + (f"; {self.name} stays as it is" if self._opened else "")
            return
        try:
            ready = self._opening.part(self._choice.options)
            if ready is not None:
                self._take_over(ready, loading.version)
        except UserError as error:
            self.message = str(error)

    def _take_over(self, ready: Ready, version: Version | None = None) -> None:
        """Put what was opened, or a version of what is open, in its place. Raises UserError, also where it is open but the solver
        that has been chosen since cannot be had."""
        loaded, lightmap, solver = ready.loaded, ready.lightmap, ready.solver
        scene, chosen = loaded.pool.scene, self.chosen_solver
        try:
            ready.catch_up(self.light, self._choice.options[ready.solver_name])
        except UserError:
            solver.release()
            lightmap.release()
            raise
        version = version if self._opened and version is not None and version.of is self.unedited else None
        same_scene = self._opened and (scene is self.unedited or version is not None)
        flickers = same_scene and self.flickers
        if not same_scene or (version is not None and not version.keeps_materials):
            self.edited, self.has_own_surfaces = object(), same_scene
        if same_scene and self.scene is not scene:
            lightmap.set_materials(self.materials if version is None else version.materials(scene, self.materials))
            lightmap.set_sky(self.scene.sky)
            lightmap.set_lights(self.scene.lights)
            solver.reset()
        self.close()
        self.reading = self.reading if same_scene else self._reading
        self.lightmap, self.solver, self.unedited = lightmap, solver, scene
        self._choice.at_work = ready.solver_name
        self.atlas, self.light = loaded.atlas, lightmap.options
        self.load_seconds = loaded.seconds | {"upload": time.perf_counter() - ready.began}
        self.source = self.scene.source or self.scene.name
        self.message = None
        self._opened = True
        reference_gone = self.compared.begin(lightmap, scene)
        self._begin()
        if self._on_open is not None:
            self._on_open(loaded.exposure, same_scene=same_scene, reference_gone=reference_gone)
        if self._then_reference is not None:
            self.compared.open(self._then_reference)
            self._then_reference = None
        self.set_flicker(flickers)
        self.set_solver(chosen)

    def close(self) -> None:
        """Release the open scene; the session can open another."""
        self._choice.stop()
        if self._opened:
            self.estimate.release()
            self.solver.release()
            self.lightmap.release()
            self._opened, self._steady = False, None

    def release(self) -> None:
        self._opening.stop()
        self.close()
        self.compared.release()

    # -- what is open --------------------------------------------------------------------------------------------------

    @property
    def loading(self) -> Loading | None:
        """The scene that is on its way."""
        return self._opening.loading

    @property
    def on_its_way(self) -> BackgroundTask[Any] | None:
        """What is waited for: the scene that is loading, or the rays of the solver that was chosen."""
        return self.loading or self._choice.switching

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
    def at_rest(self) -> bool:
        """Whether nothing changes by itself: neither light nor numbers, and no scene is on its way."""
        known = not self._can_estimate or self.estimate.knows(self.state)
        return self._idle and known and not self.compared.busy

    @property
    def solving(self) -> bool:
        """Whether ``advance`` has something to do."""
        return self._opened and self.run.goes_on

    @property
    def _idle(self) -> bool:
        """Whether the light stays as it is by itself, and neither another scene nor solver is on its way."""
        return self.on_its_way is None and not self.solving and self.run.settled

    def advance(self, *, fast: bool = False, interactive: bool = False) -> int:
        """Do one unit of work, or if ``fast`` as much as a frame has time for; how much was issued. None when paused or
        converged, nor in a frame that has already done something long. interactive: a hand is at the controls, see
        ``Pacer.advance``."""
        if self._busy or not self.solving:
            return 0
        self.estimate.changed()
        return self.run.advance(fast=fast, interactive=interactive)

    def work(self, amount: int = 1) -> int:
        """Up to so much work, of one batch at most, also when paused or converged; how much was issued."""
        self.estimate.changed()
        return self.run.work(amount)

    def solve(self, stop: Stop, tell: Callable[[Stats], None] | None = None, keeper: Keeper | None = None) -> None:
        """Work until ``stop``, or until converged, see ``Run.solve``. Raises NotFiniteError."""
        self.estimate.changed()

        def good(seconds: float) -> bool:
            self.estimate_now(lambda share: None, seconds=seconds)
            error = self.expected
            return error is not None and error.within(median=stop.error, rms=stop.rms)

        self.run.solve(
            stop, None if tell is None else lambda: tell(self.stats), good if stop.by_error else None, keeper
        )

    def restart(self) -> None:
        """Forget all light and begin again."""
        self.run.restart()
        self._light_begins()

    def light_restored(self, state: State) -> None:
        """Lightmap and solver hold light that was kept, see light_state.py; and the run was there. Raises StateError."""
        self._begin()
        self.run.restore(state)

    # -- edits ---------------------------------------------------------------------------------------------------------

    @property
    def family(self) -> Family:
        """The row of the table of solvers that is at work."""
        return self._choice.family

    @property
    def solver_name(self) -> str:
        """The name in SOLVERS of the solver at work."""
        return self._choice.at_work

    @property
    def chosen_solver(self) -> str:
        """The name of the solver that was chosen last: the one at work, or one that waits for its rays."""
        return self._choice.latest

    @property
    def options(self) -> Any:
        """Of the solver that is at work."""
        return self._choice.options[self.solver_name]

    @property
    def solver_options(self) -> Mapping[str, Options]:
        """Of each solver, by name."""
        return self._choice.options

    def set_solver_options(self, options: Mapping[str, Options]) -> None:
        """Of all solvers, each to be had when it is chosen. Raises UserError as ``set_options``."""
        self._choice.options |= {name: other for name, other in options.items() if name != self.solver_name}
        if options[self.solver_name] != self.options:
            self.set_options(options[self.solver_name])

    def set_options(self, options: Options) -> None:
        """Other options of the solver, from its next piece of work on. Raises UserError, and keeps those that it has."""
        if self._opened:
            self.solver.set_options(options)
        self._choice.options[self.solver_name] = options
        if self._opened:
            self.run.options_changed()

    def set_options_of(self, solver: str, options: Options) -> None:
        """The same of any solver, also one that is to be chosen."""
        if solver == self.solver_name:
            self.set_options(options)
        else:
            self._choice.options[solver] = options

    def set_solver(self, name: str) -> None:
        """Another solver, live. It begins with the light that is there if its method can, else from nothing. One that needs a
        tree for its rays is waited for in the background, and all goes on as it was until then. Raises UserError."""
        if self._choice.choose(name, self.lightmap.pool if self._opened else None):
            self._switch(name)

    def _end_switching(self) -> None:
        try:
            self._switch(self._choice.arrived())
        except UserError as error:
            self.message = str(error)

    def _switch(self, name: str) -> None:
        if self._opened:
            if not SOLVERS[name].relights:
                self.set_flicker(False)
            solver = SOLVERS[name].make(self.gpu, self.lightmap, self._choice.options[name])
            self.solver.release()  # only now: the other one might not have been had
            self.solver = solver
            if not SOLVERS[name].keeps_light:
                solver.reset()
        self._choice.at_work = name
        if self._opened:
            self._begin()

    def observe(self, position: F64) -> None:
        """The eye is at ``position`` (3,) [m]: told before each piece of work, for solvers that light what is near."""
        if self._opened:
            self.solver.set_observer(position)
            self.run.progress = self.solver.poll()

    def set_light(self, light: LightmapOptions) -> None:
        """Other ways to hold the light: thresholds of quadtrees act on the next work, another format begins again, and quadtrees
        instead of uniform texels, or the reverse, cut the scene anew in the background. Raises UserError as ``cut_anew``."""
        if light.adaptive != self.light.adaptive and (self._opened or self.loading is not None):
            self.cut_anew(self.atlas, adaptive=light.adaptive)
            light = light.replace(adaptive=self.light.adaptive)  # as long as it is not cut
        storage, self.light = self.light.storage, light
        if self._opened:
            self.lightmap.set_options(light)
            if light.storage != storage:
                self.solver.reset()
                self._begin()
            else:
                self.run.options_changed()

    def hold_leaves(self) -> None:
        """Leave the leaves of quadtrees as they are, see ``Refinement.hold``."""
        if self._opened and self.lightmap.refinement is not None:
            self.lightmap.refinement.hold()
            self.run.progress = self.solver.poll()

    @property
    def materials(self) -> tuple[Material, ...]:
        """Of ``edited_scene``."""
        return self.edited_scene.materials

    @property
    def edited_scene(self) -> Scene:
        """The open scene as it was edited; that of the lightmap may flicker."""
        return self._steady or self.scene

    def set_material(self, index: int, material: Material) -> None:
        """Another albedo or emission: charts and texels stay, and the light where the solver can solve for the difference."""
        materials = list(self.materials)
        materials[index] = material
        self.set_materials(tuple(materials))

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        """The same for all of them at once."""
        if self._steady is not None:
            self._steady = self._steady.with_materials(materials)
        self.run.set_materials(materials)
        if self.solver.issued == 0:
            self._light_begins()

    def set_sky(self, sky: Sky | None) -> None:
        """Another sky, or none. Raises UserError where the solver cannot light by one."""
        before = self.edited_scene
        self.run.set_sky(sky)
        if self._steady is not None:
            self._steady = self._steady.with_sky(sky)
        if self.solver.issued == 0:
            self._light_begins()
        self._open_to_the_sky(before)

    def set_lights(self, lights: tuple[Light, ...]) -> None:
        """Other lamps without area. Raises UserError where the solver cannot light by them."""
        before = self.edited_scene
        self.run.set_lights(lights)
        if self._steady is not None:
            self._steady = self._steady.with_lights(lights)
        if self.solver.issued == 0:
            self._light_begins()
        self._open_to_the_sky(before)

    @property
    def flickers(self) -> bool:
        """Whether lamps flicker."""
        return self._steady is not None

    def set_flicker(self, on: bool) -> None:
        """Let all lamps flicker from frame to frame, where the solver at work follows within one; or let them be as they were
        edited again."""
        if on and not self.flickers and self.family.relights:
            self._steady = self.scene
        elif not on and self._steady is not None:
            steady, self._steady = self._steady, None
            self.run.flicker(steady.materials)

    def _flicker(self) -> None:
        """Once per frame: lamps as bright as they are now, once there is light."""
        if self._steady is not None and self.run.running and self.solver.issued > 0:
            self.estimate.changed()
            self.run.flicker(flickering(self._steady.materials, time.perf_counter()))

    def _begin(self) -> None:
        """With a solver that has done no work."""
        self.run.begin(self.solver, self.family, self._not_finite)
        self._light_begins()

    def _light_begins(self) -> None:
        self.estimate.changed()
        self.compared.restart()

    def _not_finite(self, work: str) -> str:
        return f"{self.name}: the light is not finite after {work}; parameters {self.parameters}"

    # -- how good it is ------------------------------------------------------------------------------------------------

    def compare(self, *, wait: bool = False) -> None:
        """Bring the comparison with a reference up to date, with ``wait`` to the last work."""
        trouble = self.compared.poll(self.solver.issued, self.run.seconds, self.state, wait=wait)
        self.message = trouble or self.message

    @property
    def expected(self) -> ErrorEstimate | None:
        """How far off the light is expected to be: None as long as it is not known, or nothing is lit."""
        return self.estimate.error if self._opened and self.estimate.knows(self.state) else None

    def estimate_now(self, tell: Callable[[float], None], *, seconds: float = SECONDS) -> None:
        """Work out ``expected`` whole, of settled light; ``tell`` is given the share done. seconds: after which fewer points are
        enough."""
        self.estimate.seconds = seconds
        while self._can_estimate and not self.estimate.knows(self.state):
            self._estimate_part(wait=True)
            tell(self.estimate.share)

    @property
    def _can_estimate(self) -> bool:
        """Whether there is light to judge."""
        return self._opened and self.solver.issued > 0 and self.scene.emits

    def _estimate_part(self, *, wait: bool = False) -> None:
        """Some of the points, or none where there is nothing to do."""
        if self._can_estimate and not self.estimate.knows(self.state):
            self.estimate.part(self.lightmap, self.state, wait=wait)

    @property
    def state(self) -> object:
        """All that the light depends on: another one where the light is another."""
        shown = tuple(getattr(self.solver.options, name) for name in self.family.shows)
        return self.solver.issued, self.lightmap.version, self.edited_scene, shown

    # -- what is known -------------------------------------------------------------------------------------------------

    @property
    def stats(self) -> Stats:
        """Where the solution stands."""
        return stats_of(self.run, self.lightmap)

    @property
    def timings(self) -> dict[str, float]:
        """Mean GPU milliseconds per call by pass; empty unless ``gpu.timers.enabled``."""
        return self.gpu.timers.mean_ms()

    @property
    def parameters(self) -> dict[str, Any]:
        """Every knob that shaped the solution."""
        solver = self.options.as_dict() | dict(self.solver.resolved)
        return {
            "solver": self.solver_name,
            self.solver_name: solver,
            "lightmap": self.light.as_dict(),
            "atlas": self.atlas.as_dict(),
            "light": self.default_light,
            "sky": None if self.scene.sky is None else self.scene.sky.as_dict(),
        }
