"""A session is one open scene and its solution: the window steps it frame by frame, shot and bake from first to last.

A session has a scene on its way (opening), a solve (run), a comparison with a reference (compared) and an error estimate. It
knows no window, no picture and no imgui; whoever draws reads ``lightmap``. Here is how a scene is opened and cut anew; its light
is in solved_scene.py, edits of it in editable_scene.py.
"""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.atlas.options import AtlasOptions
from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.carry_over import carry_over
from app.lightmap.options import LightmapOptions
from app.options import Options
from app.scene.area_lamps import Surfaces, keys_of, with_surfaces
from app.scene.lights import Light
from app.scene.model import Scene
from app.scene.options import FileOptions
from app.scene.sky import Sky
from app.session.editable_scene import EditableScene
from app.session.loading import Loading, load
from app.session.opening import Opened, Opening, Prepare, Ready
from app.session.solver_choice import SolverChoice
from app.session.versions import Version, with_edits
from app.solvers import DEFAULT_SOLVER, SOLVERS
from app.util.background import BackgroundTask

# Solving in coarse texels ends after so many seconds, but not before so much work, which takes longer beside other programs; in
# any case after the longest, or once this share of what is emitted remains: the processor makes better ones
COARSE_SECONDS, COARSE_WORK, COARSE_LONGEST, COARSE_LEFT = 1.0, 6, 4.0, 0.2


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


class Session(EditableScene):
    """The open scene with its lightmap and solver. Raises UserError (SceneError, GpuError) from ``open_now``; ``open`` reports
    through ``message`` instead. Whoever makes it releases it.

    options: of the solver that is at work. atlas, light: how scenes are cut, and how their light is held. expose_on_open:
    whether the exposure is forecast of a scene that opens. read: the open scene as it was read. surfaces: that were added to it,
    moved and removed; unedited: it with these as it was cut, the same through other edits. edited: what edits are of: another
    object where those of before are not edits of what is open now. fixed: why its surfaces have to stay as they are, if so.
    reading: how it was read. load_seconds: of each stage of opening. message: what the user should know.
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
        choice = SolverChoice(solver, options)
        super().__init__(gpu, choice, atlas or AtlasOptions(), light or LightmapOptions(), default_light=default_light)
        self.sky, self.expose_on_open = sky, expose_on_open
        self.load_seconds: dict[str, float] = {}
        self.read: Scene
        self.surfaces = Surfaces()
        self.fixed: str | None = None
        self.source: str | Path
        self._opening = Opening(gpu)
        self._on_open: Opened | None = None
        self.edited: object = None
        self._then_reference: Path | None = None
        self._coarse: Loading | None = None  # of what is open in coarse texels, until it is there in better ones
        self._remained = math.inf  # of the light to be distributed, in coarse texels, until better ones have caught up
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
        version: Version | None = None,
    ) -> None:
        """Start to load in the background; ``poll`` swaps the scene when it is there. file: its unit and axes,
        guessed if None. reference: a bake to open then. reading, cut: instead of the session's own. version: of what is read.
        Where charts take a while, the scene is open in coarse texels until they are there, unless ``cut`` is given."""
        self._then_reference = reference
        self._reading = reading or Reading(file, self.default_light, self.sky)
        own, cut = cut is None, cut or Cut(self.atlas, self.light, self.chosen_solver)
        more: dict[str, Any] = {"default_light": self._reading.default_light, "expose": self.expose_on_open}
        more |= {"file": self._reading.file, "sky": self._reading.sky, "version": version, "coarse": own}
        self._opening.begin(Loading(source, cut.atlas, cut.light, cut.solver, **more))

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

    def _open_part(self, loading: Loading) -> None:
        """The next part of opening what was loaded; the scene that is open stays until the last."""
        if loading.cancelled:
            self._opening.stop()
            self._then_reference = None
            stays = "it stays in coarse texels" if loading is self._coarse else f"{self.name} stays as it is"
            self.message = f"{loading.name}: stopped" + (f"; {stays}" if self._opened else "")
            self._stays_coarse(loading)
            return
        try:
            ready = self._opening.part(self._choice.options)
            if ready is not None:
                self._take_over(ready, loading)
        except UserError as error:
            self.message = str(error)
            self._stays_coarse(loading)

    def _stays_coarse(self, loading: Loading) -> None:
        """No better texels come from there. A solver that took less care, since they would, gives way to one that takes all."""
        if loading is self._coarse and self.loading is None:
            self._coarse = None
            if self.family.for_coarse is not None:
                self._switch(self.solver_name)

    def _take_over(self, ready: Ready, loading: Loading | None = None) -> None:
        """Put what was opened, or a version of what is open, in its place. loading: where it was loaded in the background.
        Raises UserError, also where it is open but the solver that has been chosen since cannot be had."""
        version = None if loading is None else loading.version
        refined = loading is not None and loading is self._coarse
        loaded, lightmap, solver = ready.loaded, ready.lightmap, ready.solver
        scene, chosen = loaded.pool.scene, self.chosen_solver
        try:
            ready.catch_up(self.light, self._choice.options[ready.solver_name])
        except UserError:
            solver.release()
            lightmap.release()
            raise
        surfaces = Surfaces() if version is None else version.surfaces
        same_scene = self._opened and (scene is self.unedited or (version is not None and version.of is self.read))
        flickers = same_scene and self.flickers
        edits = self.material_edits if same_scene else {}
        self._away = {key: material for key, material in edits.items() if key not in keys_of(scene.materials)}
        if not same_scene:
            self.edited = object()
        if same_scene and (edits or self.scene.sky is not scene.sky or self.scene.lights is not scene.lights):
            lightmap.set_materials(with_edits(scene.materials, edits))
            lightmap.set_sky(self.scene.sky)
            lightmap.set_lights(self.scene.lights)
            solver.reset()
        if refined and loaded.places is not None and self.solver.issued > 0:
            with contextlib.suppress(UserError):
                carry_over(self.gpu, self.lightmap, lightmap, loaded.places)
        self._remained = self.run.progress.remaining if refined else math.inf
        self.close()
        self.reading = self.reading if same_scene else self._reading
        self.lightmap, self.solver, self.unedited, self.surfaces = lightmap, solver, scene, surfaces
        self.read = self.read if same_scene else loaded.read
        self._choice.at_work = ready.solver_name
        self.atlas, self.light = loaded.atlas, lightmap.options
        self._load_notes = loaded.notes
        self.load_seconds = loaded.seconds | {"upload": time.perf_counter() - ready.began}
        self.source = self.scene.source or self.scene.name
        self.message = None
        self._opened = True
        self._coarse = None if loading is None else self.loading
        if self._coarse is not None:  # what comes is of the same scene
            self._coarse.version = Version(self.surfaces, lambda scene: scene, self.read)
        reference_gone = self.compared.begin(lightmap, scene)
        self._begin()
        if self._on_open is not None:
            exposure = None if refined else loaded.exposure
            self._on_open(exposure, same_scene=same_scene, reference_gone=reference_gone)
        if self._then_reference is not None and self.loading is None:
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

    @property
    def loading(self) -> Loading | None:
        """The scene that is on its way."""
        return self._opening.loading

    @property
    def on_its_way(self) -> BackgroundTask[Any] | None:
        """What is waited for: the scene that is loading, or the rays of the solver that was chosen."""
        return self.loading or self._choice.switching

    @property
    def uploading(self) -> bool:
        """Whether the next ``poll`` uploads a part of what is on its way."""
        return self._opening.has_part

    def advance(self, *, fast: bool = False, interactive: bool = False) -> int:
        """As of any solved scene; always fast in coarse texels, for they are not there for long, and in those that take their
        place until as little remains as before."""
        fast |= self.coarse or self._remained < math.inf
        issued = super().advance(fast=fast, interactive=interactive)
        if self.run.converged or self.run.progress.remaining <= self._remained:
            self._remained = math.inf  # caught up: what follows has the pace that was chosen
        return issued

    @property
    def coarse(self) -> bool:
        """Whether what is open is in coarse texels, and better ones are on their way."""
        return self._coarse is not None and self._coarse is self.loading

    # -- the same scene, cut anew --------------------------------------------------------------------------------------

    def cut_anew(self, atlas: AtlasOptions, *, adaptive: bool | None = None) -> None:
        """Cut the open scene anew, in the background; its materials as edited, exposure and camera stay. adaptive: whether into
        quadtrees, as it is if None. Raises UserError while another scene is on its way."""
        light = self.light if adaptive is None else self.light.replace(adaptive=adaptive)
        self._cut(atlas, light, self.asked_surfaces)

    @property
    def asked_cut(self) -> tuple[AtlasOptions, bool]:
        """How the open scene is cut, and whether into quadtrees; as it was asked for last, where that is on its way."""
        cut = self._next or self
        return cut.atlas, cut.light.adaptive

    def _cut(self, atlas: AtlasOptions, light: LightmapOptions, surfaces: Surfaces, *, afresh: bool = False) -> None:
        """Cut the open scene anew. afresh: also its own surfaces, which may have other sides that are lit."""
        if self.loading is not None and self._next is None:
            raise UserError(f"{self.loading.name} is loading: cut {self.name or 'it'} anew before or after that")
        same, now = surfaces == self.surfaces and not afresh, self.edited_scene

        def make(scene: Scene) -> Scene:
            return with_surfaces(scene, surfaces).with_sky(now.sky).with_lights(now.lights)

        version = Version(surfaces, (lambda scene: scene) if same else make, self.read)
        source = self.unedited if same else self.read
        dark = not same and not now.emits
        self._opening.begin(Loading(source, atlas, light, self.chosen_solver, expose=dark, version=version))

    @property
    def _next(self) -> Loading | None:
        """What is on its way, if it is a version of what is open."""
        loading = self.loading if self._opened else None
        of_this = loading is not None and loading.version is not None and loading.version.of is self.read
        return loading if of_this else None

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

    # -- with other surfaces -------------------------------------------------------------------------------------------

    def change_surfaces(self, surfaces: Surfaces) -> None:
        """Let the open scene have these surfaces beside its own, cut in the background: its edits, exposure and camera stay,
        light begins again. Raises UserError where its surfaces are ``fixed``, and as ``cut_anew``."""
        if self.fixed is not None:
            raise UserError(f"the surfaces of {self.name} stay as they are: {self.fixed}")
        self._cut_as_asked(surfaces)

    def _cut_as_asked(self, surfaces: Surfaces, *, afresh: bool = False) -> None:
        """``_cut`` as finely as it was asked for last."""
        atlas, adaptive = self.asked_cut
        self._cut(atlas, self.light.replace(adaptive=adaptive), surfaces, afresh=afresh)

    @property
    def asked_surfaces(self) -> Surfaces:
        """What was added to the open scene and removed; as it was asked for last, where that is on its way."""
        version = None if self._next is None else self._next.version
        return self.surfaces if version is None else version.surfaces

    def set_sky(self, sky: Sky | None) -> None:
        """Another sky, or none; where nothing from outside lit the scene before, it is cut anew. Raises UserError where the
        solver cannot light by one, or surfaces are ``fixed`` that it needs cut."""
        opens = self._opens(sky, self.edited_scene.lights)
        super().set_sky(sky)
        if opens:
            self._cut_as_asked(self.asked_surfaces, afresh=True)

    def set_lights(self, lights: tuple[Light, ...]) -> None:
        """Other lamps without area; as another sky, they may have the scene cut anew. Raises UserError as ``set_sky``."""
        opens = self._opens(self.edited_scene.sky, lights)
        super().set_lights(lights)
        if opens:
            self._cut_as_asked(self.asked_surfaces, afresh=True)

    def _opens(self, sky: Sky | None, lights: tuple[Light, ...]) -> bool:
        """Whether sides that face nothing may be lit by these alone, and were not cut for that. Raises UserError where they
        cannot be now."""
        closed = not self.edited_scene.open_to_lights and self.charts.dark_faces > 0
        free = self.loading is None or self._next is not None
        opens = closed and free and (sky is not None or bool(lights))
        if opens and self.fixed is not None:
            raise UserError(f"sides that only it lights would have to be cut: {self.fixed}")
        return opens

    # -- frame by frame ------------------------------------------------------------------------------------------------

    def poll(self, *, interactive: bool = False) -> None:
        """Once per frame: take in what the GPU reports, and swap in a scene that has finished loading, a part of it per frame.
        interactive: a hand is at the controls, what can wait does."""
        self._busy = False
        self.run.resting = self.coarse and self._lit_coarsely and self.run.between
        if self.loading is not None and (self._opening.has_part or self.loading.cancelled):
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

    @property
    def _lit_coarsely(self) -> bool:
        """Whether there is as much light as coarse texels are given."""
        run = self.run
        enough = COARSE_SECONDS if self.solver.issued >= COARSE_WORK else COARSE_LONGEST
        return run.seconds >= enough or run.progress.remaining <= COARSE_LEFT

    @property
    def at_rest(self) -> bool:
        """Whether nothing changes by itself: neither light nor numbers, and no scene is on its way."""
        known = not self._can_estimate or self.estimate.knows(self.state)
        return self._idle and known and not self.compared.busy

    @property
    def _idle(self) -> bool:
        """Whether the light stays as it is by itself, and neither another scene nor solver is on its way."""
        return self.on_its_way is None and not self.solving and self.run.settled
