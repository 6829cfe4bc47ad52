"""A session for tests of the interface: fixed numbers, no light, and a record of what was asked of it."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from app.atlas.options import AtlasOptions
from app.estimate.error import ErrorEstimate
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.render.camera import CameraView
from app.render.false_colour import Scale, false_colour_scale
from app.render.options import LAYERS, DisplayOptions
from app.scene.area_lamps import Key, Surfaces
from app.scene.lights import Light
from app.scene.model import Material
from app.scene.sky import Sky
from app.session.versions import edits_of, with_edits
from app.solvers import DEFAULT_SOLVER, SOLVERS, EnergyBalance, Inspection, Progress, ShootingOptions

EMITTED = 34.6  # W
MATERIALS = (
    Material("white wall", (0.73, 0.73, 0.73)),
    Material("red wall", (0.63, 0.06, 0.05)),
    Material("green wall", (0.14, 0.45, 0.09)),
    Material("lamp", (0.78, 0.78, 0.78), emission=(17.0, 12.0, 4.0)),
)


class FakeSpace:
    """World and solver space are the same."""

    centre, scale = np.zeros(3), 1.0

    def local_from_world(self, points: np.ndarray) -> np.ndarray:
        return points


class FakeScene(SimpleNamespace):
    """What lights it follows from what is set. Two are never the same, as of scenes."""

    __eq__, __hash__ = object.__eq__, object.__hash__
    lit_by_sky = property(lambda self: self.sky is not None and self.sky.emits)
    lit_by_lights = property(lambda self: any(light.emits for light in self.lights))
    emits = property(lambda self: self.lit_by_sky or self.lit_by_lights or any(m.emits for m in self.materials))


class FakeHistory:
    """Sixty shots, each of which leaves 93 % of the residual."""

    work_per_second = 212.0

    def column(self, name: str) -> np.ndarray:
        shots = np.arange(60.0)
        residual = 0.93**shots
        return {
            "work": shots,
            "seconds": shots / 200,
            "remaining": residual,
            "absorbed": 0.9 * (1 - residual),
            "escaped": 0.1 * (1 - residual),
        }[name]


class FakeErrors:
    """Thirty looks, of which each finds 90 % of the error."""

    def column(self, name: str) -> np.ndarray:
        shots = 2 * np.arange(30.0)
        return {"work": shots, "seconds": shots / 200, "rms": 0.9**shots, "median": 0.5 * 0.9**shots}[name]


class FakeCompared:
    """What the interface uses of a comparison."""

    def __init__(self, calls: list[tuple[object, ...]]) -> None:
        self.comparison: SimpleNamespace | None = None
        self.fetching: SimpleNamespace | None = None
        self.reference_texels = 124816
        self._calls = calls

    def irradiance_at(self, texel: tuple[int, int]) -> tuple[float, float, float] | None:
        return None if self.comparison is None else (16.125, 11.0, 3.0)

    def open(self, path: Path) -> None:
        self._calls.append(("open_reference", str(path)))

    def solve(self, options: object, scene: object) -> None:
        self._calls.append(("solve_reference", options))

    def stop_fetching(self) -> None:
        self._calls.append(("stop_fetching",))


class FakeSession:
    """What the interface uses of a view, of its session and of the session's run, all in one. ``calls`` lists what it was asked
    to do, ``insets`` the pictures of the atlas."""

    def __init__(self, *, opened: bool = True, gpu: Gpu | None = None) -> None:
        self.gpu, self.opened, self.running, self.name, self.message = gpu, opened, True, "fake box", None
        self.loading: SimpleNamespace | None = None
        self.coarse, self.state, self.finer_maps = False, "of this light", None
        self.seconds = 0.3  # of solving
        self.surfaces, self.fixed = Surfaces(), None
        self.calls: list[tuple[object, ...]] = []
        self.session = self.run = self
        self.seconds = 0.3
        self.compared = FakeCompared(self.calls)
        self.solver_name, self.family = DEFAULT_SOLVER, SOLVERS[DEFAULT_SOLVER]
        self.expected = ErrorEstimate(0.016, -0.003, 0.006, 240)
        self.estimate = SimpleNamespace(share=1.0)
        cameras = (SimpleNamespace(name="front", world_from_camera=np.eye(4), yfov=0.7),)
        warnings = ("3 degenerate triangles dropped",)
        self.scene = FakeScene(materials=MATERIALS, warnings=warnings, cameras=cameras, sky=None, lights=())
        self.scene.source = self.scene.colours = None
        self.scene.corners = np.zeros((len(MATERIALS), 3, 3))
        self.scene.bounds, self.scene.material_ids = (np.zeros(3), np.ones(3)), np.arange(len(MATERIALS))
        self.scene.normals_areas = np.zeros((len(MATERIALS), 3)), np.ones(len(MATERIALS))
        self.read = self.unedited = FakeScene(**vars(self.scene))
        self.source, self.reading = "fake box", object()
        self.charts = SimpleNamespace(density=40.0, tile=16, size=(160, 96))
        self.lightmap = SimpleNamespace(space=FakeSpace())
        self.options, self.display = ShootingOptions(), DisplayOptions()
        self.atlas, self.light = AtlasOptions(), LightmapOptions()
        self.camera = CameraView(np.eye(4), 0.7, 2.0)
        self.bookmarks: dict[int, CameraView] = {}
        self.history = FakeHistory()
        self.timings = {
            "shooting/visibility": 1.1,
            "shooting/receive": 0.7,
            "render/surface": 3.2,
            "imgui": 1.4,
        }
        self.image, self.imbalance = None, 0.0002
        self.flickers = False
        self.picked = None
        self.done = 60
        self.scale: tuple[float, float] | None = None
        self.insets: list[tuple[tuple[int, int], bool]] = []

    @property
    def layers(self) -> tuple[str, ...]:
        return LAYERS[:9]

    def false_colour_scale(self) -> Scale:
        if self.scale is not None:
            return Scale(*self.scale, "lx")
        return false_colour_scale(self.display, self.lightmap)

    @property
    def still(self) -> tuple[object, ...] | None:
        return None if self.running else (self.display, self.reading)

    @property
    def shown(self) -> DisplayOptions:
        return self.display

    def compare(self) -> None:
        """There is a reference."""
        light = SimpleNamespace(name="bake reference", texels=124816, unshot=1e-4)
        error = SimpleNamespace(rms=0.0412, median=0.0093, q90=0.0714, bias=-0.0031)
        self.compared.comparison = SimpleNamespace(
            light=light, error=error, lit=4001, errors=FakeErrors(), notes=lambda lightmap: ["a note"]
        )

    @property
    def edited(self) -> object:
        """Edits of another scene are others."""
        return self.unedited

    @property
    def edited_scene(self) -> SimpleNamespace:
        return self.scene

    @property
    def materials(self) -> tuple[Material, ...]:
        return self.scene.materials

    def set_flicker(self, on: bool) -> None:
        self.flickers = on
        self.calls.append(("set_flicker", on))

    @property
    def chosen_solver(self) -> str:
        return self.solver_name

    @property
    def on_its_way(self) -> SimpleNamespace | None:
        return self.loading

    @property
    def texel_note(self) -> str | None:
        return "texels: too few on red wall (23 px wide, light off by 6.0% between them)"

    def drop_reference(self) -> None:
        self.calls.append(("drop_reference",))

    @property
    def stats(self) -> SimpleNamespace:
        energies = {"emitted": EMITTED, "absorbed": 30.1, "escaped": 3.4, "unshot": 1.1, "imbalance": self.imbalance}
        counts = {
            "texels": 31204,
            "tiles": 160,
            "triangles": 32,
            "charts": 18,
            "memory_mib": 7.3,
            "unit": "shots",
            "remains": "unshot",
            "done": self.done,
            "refining": False,
            "leaves": "",
            "note": None,
            "doing": "",
            "uniform_texels": 40000,
            "figures": {},
            "counts": {},
            "counts_in_edit": {},
            "resolved": {"level": 2, "resolution": 256},
        }
        rates = {"progress": 0.25, "remaining": 0.0318, "seconds": 0.3, "per_second": 212.0, "converged": False}
        rates |= {"edit_work": None, "fresh_work": None}
        return SimpleNamespace(**energies, **counts, **rates)

    @property
    def warnings(self) -> tuple[str, ...]:
        return tuple(self.scene.warnings)

    @property
    def energy(self) -> EnergyBalance:
        stats = self.stats
        powers = (np.full(3, getattr(stats, name) / 3) for name in ("emitted", "absorbed", "escaped", "unshot"))
        return EnergyBalance(*powers, np.full(3, 0.5), 1.0)

    @property
    def progress(self) -> Progress:
        return Progress(self.done, self.stats.remaining, self.energy.escaped)

    def poll(self) -> None:
        pass

    def advance(self, *, fast: bool = False) -> int:
        self.calls.append(("advance",)) if self.running else None
        return 1 if self.running else 0

    def draw(self, target, size, *, scale=None, samples=1, add=False, whole=True) -> bool:
        target.clear(0.2, 0.3, 0.4, 1.0)
        return True

    def wait_for_light(self) -> None:
        pass

    def forget_samples(self) -> None:
        pass

    def draw_flat(self, target, size) -> bool:
        return False

    def atlas_image(self, size, *, turned=False):
        self.insets.append((size, turned))
        return self.image

    @property
    def solver(self) -> SimpleNamespace:
        caption = next(iter(self.family.pictures))
        shown = Inspection(
            {} if self.image is None else {caption: self.image}, {}, {"Smaller than a sample": "3 triangles"}
        )
        return SimpleNamespace(inspect=lambda texel=None, *, images=False: shown)

    def inspect(self, texel: tuple[int, int] | None = None) -> Inspection:
        return self.solver.inspect(texel, images=True)

    def under(self, x_px: int, y_px: int):
        return self.picked

    def read_again(self, picked: object) -> object:
        self.calls.append(("read_again",))
        return picked

    def pick(self, x_px: int, y_px: int):
        self.calls.append(("pick", x_px, y_px))
        return self.picked

    def work(self) -> None:
        self.calls.append(("work",))

    def expose(self) -> None:
        self.calls.append(("expose",))

    def restart(self) -> None:
        self.calls.append(("restart",))

    def open(self, source: str | Path) -> None:
        self.calls.append(("open", str(source)))

    @property
    def solver_options(self) -> dict[str, ShootingOptions]:
        return {self.solver_name: self.options}

    def set_solver_options(self, options: dict[str, ShootingOptions]) -> None:
        self.set_options(options[self.solver_name])

    def set_options(self, options: ShootingOptions) -> None:
        self.options = options
        self.calls.append(("set_options",))

    @property
    def asked_cut(self) -> tuple[AtlasOptions, bool]:
        return self.atlas, self.light.adaptive

    def set_light(self, light: LightmapOptions) -> None:
        self.light = light
        self.calls.append(("set_light",))

    def set_solver(self, name: str) -> None:
        self.calls.append(("set_solver", name))

    def cut_anew(self, atlas: AtlasOptions, *, adaptive: bool) -> None:
        self.calls.append(("cut_anew",))

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        self.scene.materials = materials

    def set_lights(self, lights: tuple[Light, ...]) -> None:
        self.scene.lights = lights

    def set_material(self, index: int, material: Material) -> None:
        materials = list(self.scene.materials)
        materials[index] = material
        self.set_materials(tuple(materials))
        self.calls.append(("set_material", index, dataclasses.replace(material)))

    @property
    def material_edits(self) -> dict[Key, Material]:
        return edits_of(self.unedited.materials, self.materials)

    def set_material_edits(self, edits: dict[Key, Material]) -> None:
        self.set_materials(with_edits(self.unedited.materials, edits))

    @property
    def asked_surfaces(self) -> Surfaces:
        return self.surfaces

    def change_surfaces(self, surfaces: Surfaces) -> None:
        self.surfaces = surfaces
        self.calls.append(("change_surfaces", surfaces))

    def expose_for_light_to_come(self) -> None:
        self.calls.append(("expose_for_light_to_come",))

    def set_sky(self, sky: Sky | None) -> None:
        self.scene.sky = sky
        self.calls.append(("set_sky", sky))

    def release(self) -> None:
        self.calls.append(("release",))
