"""One open scene and its solution: what window, headless shot, bake and bench all step.

A session owns scene, charts, lightmap and solver. It knows no window and no imgui; whoever draws reads ``lightmap``.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from app.atlas.charts import Charts
from app.atlas.lightmap import Lightmap
from app.atlas.options import AtlasOptions
from app.bookkeeping import Books, Effort
from app.errors import UserError
from app.gpu import Framebuffer, Gpu, Texture
from app.history import History
from app.loading import Loaded, Loading, load
from app.opening import prepare
from app.pacing import Pacer
from app.picking import Picked, picked_from_hit
from app.projections import PROJECTIONS
from app.render.camera import CameraView
from app.render.exposure import exposure_of
from app.render.false_colour import Scale
from app.render.frame import FrameRenderer
from app.render.items import ItemImage
from app.render.options import DisplayOptions
from app.render.surfaces import Rect
from app.scene.model import RGB, Camera, Material, Scene
from app.solvers import DEFAULT_SOLVER, EnergyBook, ShootingOptions, Solver
from app.solving import not_finite, solve
from app.stats import Stats, Stop, stats_of


class Session:
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
        self.gpu = gpu
        self.shooting = shooting or ShootingOptions()
        self.atlas = atlas or AtlasOptions()
        self.display = display or DisplayOptions()
        self.default_light = default_light
        self.expose_on_open = expose_on_open
        self.renderer = FrameRenderer(gpu)
        self.items = ItemImage(gpu)
        self.running = True
        self.message: str | None = None
        self.loading: Loading | None = None
        self.load_seconds: dict[str, float] = {}
        self.history = History()
        self.interrupted, self.effort = False, Effort()
        self.seconds, self._pace = 0.0, Pacer(gpu)
        self._books = Books()
        self._settled, self._busy, self._opened = True, False, False
        self._swapping: Generator[None, None, None] | None = None
        self.lightmap: Lightmap
        self.solver: Solver[ShootingOptions]
        self.unedited: Scene  # the open one as it was read: the same through edits, and however it is cut

    # -- opening -------------------------------------------------------------------------------------------------------

    def open(self, source: str | Path) -> None:
        """Start to load in the background; ``poll`` swaps the scene when it is there."""
        self._stop_loading()
        self.loading = Loading(source, self.atlas, default_light=self.default_light, expose=self.expose_on_open)

    def open_now(self, source: str | Path, progress: Callable[[str, float], None] | None = None) -> None:
        """Load and wait."""
        light, expose = self.default_light, self.expose_on_open
        for _ in self._swap(load(source, self.atlas, default_light=light, expose=expose, progress=progress)):
            pass

    def set_atlas(self, atlas: AtlasOptions) -> None:
        """Cut the open scene anew, in the background; its materials as edited, exposure and camera stay. Raises UserError
        while another scene is on its way."""
        if self.loading is not None and self.loading.source is not self.unedited:
            raise UserError(f"{self.loading.name} is loading: cut {self.name} anew before or after that")
        self._stop_loading()
        self.loading = Loading(self.unedited, atlas)

    def poll(self) -> None:
        """Once per frame: hear from the GPU, and swap in a scene that has finished loading, a part of it per frame."""
        self._busy = False
        if self.loading is not None and (self.loading.ended or self.loading.cancelled):
            self._busy = True
            self._swap_some(self.loading)
        elif self._opened:
            self.hear()

    def _swap_some(self, loading: Loading) -> None:
        """The next part of opening what was loaded; the scene that is open stays until the last."""
        if loading.cancelled:
            self._stop_loading()
            self.message = f"{loading.name}: stopped" + (f"; {self.name} stays as it is" if self._opened else "")
            return
        try:
            if self._swapping is None:
                self._swapping = self._swap(loading.result)
            next(self._swapping)
        except StopIteration:
            self.loading = self._swapping = None
        except UserError as error:
            self.message = str(error)
            self.loading = self._swapping = None

    def _swap(self, loaded: Loaded) -> Generator[None, None, None]:
        """Open what was loaded, in parts that each take a fraction of it. Raises UserError; what is open stays then."""
        clock, scene = time.perf_counter(), loaded.nodes.scene
        lightmap, solver = yield from prepare(
            self.gpu,
            loaded.nodes,
            loaded.arrays,
            self.shooting,
            self.renderer,
            self.display.interpolation,
            solver_name="adaptive" if loaded.atlas.adaptive else DEFAULT_SOLVER,
        )
        if solver.options != self.shooting:  # changed between two parts
            solver.set_options(self.shooting)
        cut_anew = self._opened and scene is self.unedited
        if cut_anew and self.scene is not scene:
            lightmap.set_materials(self.scene.materials)
            solver.reset()
        self.close()
        self.lightmap, self.solver, self.unedited, self.atlas = lightmap, solver, scene, loaded.atlas
        self.load_seconds = loaded.seconds | {"upload": time.perf_counter() - clock}
        self.source = self.scene.source or self.scene.name
        if not cut_anew:
            self.look_through(self.scene.cameras[0])
        if loaded.exposure is not None:
            self.display = self.display.replace(exposure=loaded.exposure)
        self.message = None if self.scene.emits else f"{self.scene.name} has no light: try --light for a ceiling light"
        self._opened = True
        self._books.begin(self.solver.books())
        self._begin()

    def _stop_loading(self) -> None:
        if self.loading is not None:
            self.loading.cancel()
        if self._swapping is not None:
            self._swapping.close()
        self.loading = self._swapping = None

    def close(self) -> None:
        """Release the open scene; the session can open another."""
        if self._opened:
            self.solver.release()
            self.lightmap.release()
            self._opened = False

    def release(self) -> None:
        self._stop_loading()
        self.close()
        self.renderer.release()
        self.items.release()

    # -- what is open --------------------------------------------------------------------------------------------------

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
        return self.loading is None and not self.shooting_goes_on and self._settled

    def advance(self, *, budget_ms: float, shots: int = 1) -> int:
        """Make up to ``shots`` shots within ``budget_ms``; returns how many. None when paused or converged, nor in a frame that
        has already done something long."""
        if not self._opened or self._busy or not self.shooting_goes_on:
            return 0
        self._settled = False
        made = self._pace.advance(self.solver, budget_ms, shots)
        self.seconds += self._pace.lap()
        return made

    def shoot(self, shots: int = 1) -> int:
        """Up to ``shots`` shots, of one batch at most, also when paused or converged; how many."""
        self._settled = False
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

    def _begin_again(self) -> None:
        self._books.begin_again()
        self._begin()

    def _begin(self) -> None:
        self.seconds, self._settled = 0.0, True
        self.effort.begin()
        self._pace.begin()
        self.gpu.timers.reset()
        self.history = History()
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
    def books(self) -> EnergyBook:
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
        shooting = self.shooting.as_dict() | {"resolution": self.solver.resolution}
        return {"shooting": shooting, "atlas": self.atlas.as_dict(), "light": self.default_light}

    def pick(self, x_px: int, y_px: int) -> Picked | None:
        """What surface is at that pixel of the last frame, and the light on it."""
        hit = self.renderer.pick(x_px, y_px)
        return None if hit is None else picked_from_hit(self.lightmap, hit, self.solver.patch_edge)

    def look_through(self, camera: Camera) -> None:
        """Stand where a camera of the scene stands; orbit around the scene's middle from there."""
        distance = float(np.linalg.norm(np.asarray(camera.world_from_camera)[:3, 3] - self.lightmap.frame.centre))
        self.view = CameraView.from_camera(camera, distance)

    def draw(
        self,
        target: Framebuffer,
        size: tuple[int, int],
        *,
        scale: Scale | None = None,
        samples: int = 1,
        whole: bool = True,
    ) -> None:
        """The picture of the solution as it is now; if not ``whole``, brought up to date over several frames."""
        self.renderer.render(
            target,
            size,
            self.lightmap,
            self.view,
            self.display,
            ambient=self._ambient,
            shooter=self._shooter_rect,
            scale=scale,
            samples=samples,
            whole=whole,
        )

    def expose(self) -> None:
        """Set the exposure from the light of the scene."""
        mean_residual = self.books.unshot / max(self.books.area, 1e-300)
        self.display = self.display.replace(exposure=exposure_of(self.lightmap, mean_residual))

    @property
    def _ambient(self) -> RGB | None:
        """Ambient radiosity of the light not yet shot [W/m²], for display only."""
        if not self.display.ambient:
            return None
        red, green, blue = self.books.ambient
        return float(red), float(green), float(blue)

    @property
    def _shooter_rect(self) -> Rect | None:
        """The last shooter's patch in atlas texels."""
        shot = self.solver.last_shot
        return shot.rect if shot and self.display.last_shooter else None

    def atlas_image(self, size: tuple[int, int], *, turned: bool = False) -> Texture | None:
        """The virtual atlas with what was drawn last, v up or to the right; None before the first picture."""
        return self.renderer.atlas(self.lightmap, size, turned=turned)

    def vanished(self) -> int:
        """Triangles that lie between the samples of the last shooter's map."""
        return self.solver.vanished()

    def hemicube_image(self) -> Texture:
        """The last shooter's visibility map, in one colour per facet."""
        seen, projection = self.solver.inspect(), PROJECTIONS[self.shooting.projection]
        return self.items.draw(seen["items"], seen["depth"], projection.size(self.solver.resolution))


__all__ = ["Session", "Stats", "Stop"]
