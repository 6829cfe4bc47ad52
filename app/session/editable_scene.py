"""Live edits of the open scene: its materials, sky and lamps, and which solver lights it with which options."""

from __future__ import annotations

import time
from collections.abc import Mapping

from app.errors import UserError
from app.options import Options
from app.scene.area_lamps import Key, keys_of
from app.scene.lights import Light
from app.scene.model import F64, Material, Scene
from app.scene.sky import Sky
from app.session.flicker import flickering
from app.session.solved_scene import SolvedScene
from app.session.versions import MaterialEdits, edits_of, with_edits
from app.solvers import SOLVERS


class EditableScene(SolvedScene):
    """A solved scene that can be edited: charts and texels stay, and the light where its solver can solve for the difference.

    unedited: the scene as it was cut, with materials as they came.
    """

    unedited: Scene
    _away: Mapping[Key, Material]  # edits of lamps that are not there, but may come back

    # -- the solver ----------------------------------------------------------------------------------------------------

    @property
    def chosen_solver(self) -> str:
        """The name of the solver that was chosen last: the one at work, or one that waits for its rays."""
        return self._choice.latest

    def set_solver_options(self, options: Mapping[str, Options]) -> None:
        """Other options of all solvers, each to be had when it is chosen. Raises UserError as ``set_options``."""
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

    def hold_leaves(self) -> None:
        """Leave the leaves of quadtrees as they are, see ``Refinement.hold``."""
        if self._opened and self.lightmap.refinement is not None:
            self.lightmap.refinement.hold()
            self.run.progress = self.solver.poll()

    # -- materials, sky and lamps --------------------------------------------------------------------------------------

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

    @property
    def material_edits(self) -> dict[Key, Material]:
        """Materials that were edited, also of lamps that are not there now."""
        return {**self._away, **edits_of(self.unedited.materials, self.materials)}

    def set_material_edits(self, edits: MaterialEdits) -> None:
        """Have these edits of materials, and no others."""
        known = set(keys_of(self.unedited.materials))
        self._away = {key: material for key, material in edits.items() if key not in known}
        self.set_materials(with_edits(self.unedited.materials, edits))

    def set_sky(self, sky: Sky | None) -> None:
        """Another sky, or none. Raises UserError where the solver cannot light by one."""
        self.run.set_sky(sky)
        if self._steady is not None:
            self._steady = self._steady.with_sky(sky)
        if self.solver.issued == 0:
            self._light_begins()

    def set_lights(self, lights: tuple[Light, ...]) -> None:
        """Other lamps without area. Raises UserError where the solver cannot light by them."""
        self.run.set_lights(lights)
        if self._steady is not None:
            self._steady = self._steady.with_lights(lights)
        if self.solver.issued == 0:
            self._light_begins()

    # -- lamps that flicker --------------------------------------------------------------------------------------------

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
