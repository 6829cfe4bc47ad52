"""A solved scene is the scene that is open with the light that its solver finds: how far that is, and how good."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from app.atlas.charts import Charts
from app.atlas.options import AtlasOptions
from app.estimate.error import ErrorEstimate
from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.lightmap.options import LightmapOptions
from app.options import Options
from app.scene.model import Material, Scene
from app.session.balance import finer_maps
from app.session.compared import Compared
from app.session.error_estimate import SECONDS, RunningEstimate
from app.session.run import Keeper, Run, Stop
from app.session.solver_choice import SolverChoice
from app.session.stats import Stats, stats_of
from app.solvers import Family, Solver
from app.util.state import State


class SolvedScene:
    """The open scene with its lightmap and solver, which a Session opens and releases.

    choice: the solver to begin with. atlas, light: how scenes are cut, and how their light is held. default_light: whether scenes
    are given a ceiling light. message: what the user should know.
    """

    def __init__(
        self, gpu: Gpu, choice: SolverChoice, atlas: AtlasOptions, light: LightmapOptions, *, default_light: bool
    ) -> None:
        self.gpu, self._choice = gpu, choice
        self.atlas, self.light, self.default_light = atlas, light, default_light
        self.message: str | None = None
        self.run, self.compared, self.estimate = Run(gpu), Compared(gpu), RunningEstimate(gpu)
        self.lightmap: Lightmap
        self.solver: Solver[Any]
        self._opened = self._busy = False
        self._load_notes: tuple[str, ...] = ()
        self._steady: Scene | None = None  # as it was edited, while its lamps flicker

    # -- what is open --------------------------------------------------------------------------------------------------

    @property
    def opened(self) -> bool:
        return self._opened

    @property
    def scene(self) -> Scene:
        return self.lightmap.scene

    @property
    def edited_scene(self) -> Scene:
        """The open scene as it was edited; that of the lightmap may flicker."""
        return self._steady or self.scene

    @property
    def materials(self) -> tuple[Material, ...]:
        """The materials of ``edited_scene``."""
        return self.edited_scene.materials

    @property
    def charts(self) -> Charts:
        return self.lightmap.charts

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was repaired, left out or could not be done as it was opened."""
        return (*self.scene.warnings, *self.charts.warnings, *self._load_notes)

    @property
    def name(self) -> str:
        return self.scene.name if self._opened else ""

    @property
    def family(self) -> Family:
        """The row of the table of solvers that is at work."""
        return self._choice.family

    @property
    def solver_name(self) -> str:
        """The name in SOLVERS of the solver at work."""
        return self._choice.at_work

    @property
    def options(self) -> Any:
        """The options of the solver that is at work."""
        return self._choice.options[self.solver_name]

    @property
    def solver_options(self) -> Mapping[str, Options]:
        """The options of each solver, by its name."""
        return self._choice.options

    # -- solving -------------------------------------------------------------------------------------------------------

    @property
    def solving(self) -> bool:
        """Whether ``advance`` has something to do."""
        return self._opened and self.run.goes_on

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
        self.run.restore(state)
        self._light_begins()

    def _begin(self) -> None:
        """Begin a run with a solver that has done no work."""
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

    @property
    def finer_maps(self) -> int | None:
        """The resolution that maps of light from outside would need, where they are coarse for what it falls on."""
        resolution = self.solver.resolved.get("resolution")
        beyond = self.scene.lit_by_sky or any(light.from_afar for light in self.scene.lights_and_sun)
        if resolution is None or not beyond or not self.family.distributes:
            return None
        return finer_maps(self.charts, 2 * self.lightmap.space.scale, resolution)

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
