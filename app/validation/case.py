"""A hard case: a scene, how it is solved, and the checks that its light must pass, each with a tolerance and its reason."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.lightmap.options import STORAGE, LightmapOptions
from app.options import Options, specs
from app.scene.model import F32, F64, Scene
from app.session.batch import opened
from app.solvers import DEFAULT_SOLVER, SOLVERS, EnergyBalance, Family
from app.solvers.run import solve_until
from app.solvers.shooting.choose import ROOT_LEVEL
from app.solvers.shooting.coarse_to_fine import LEVEL
from app.solvers.shooting.options import MAX_LEVEL

SIZES = ("small", "large")
ENOUGH = 2_000_000  # units of work: a solve that needs more does not converge
FULL, HEMICUBE = "rgba32f", "hemicube"
LEAST = 1e-9  # residual that can be asked for
NOISE = {"small": 0.02, "large": 5e-3}  # that may remain where light is gathered, RMS over all surfaces, over the mean
FEW_RAYS = 64  # of each texel: the noise of fewer is itself not known
IMBALANCE = "of single shots' sums, on average: a texel is sampled at its centroid, its shooter's sight at one point"
EACH = "and each bounce may lose what grazes, (4/R)²"
NO_NUMBER = "every texel holds a finite number"
NEGATIVE = (
    "what was shot ahead is taken back by the same patch, seen from another point of it or from finer ones: two samples of the "
    "map, 1/R² of the sky each, may see it the one time and not the other"
)
ROUNDED = 2.0**-11  # of what a half float holds, either way
STORED = (
    "adding to a half float cuts off up to 2^-10 of what is there, to 8 bits all below 1/510: a limit of the format"
)


@dataclass(frozen=True)
class Method:
    """One way to solve a case: by which solver, on uniform texels or quadtrees, by which projection if any, stored how."""

    solver: str = DEFAULT_SOLVER
    adaptive: bool = False
    projection: str | None = HEMICUBE
    storage: str = FULL

    @property
    def name(self) -> str:
        words = (self.solver, "adaptive" if self.adaptive else "uniform", self.projection)
        return " ".join(word for word in words if word) + ("" if self.storage == FULL else f" {self.storage}")

    @property
    def family(self) -> Family:
        return SOLVERS[self.solver]

    def options(self, map_size: int, threshold: float) -> Options:
        """Of the solver, as far as it has such: pixels of its visibility maps, and how little may remain."""
        wanted = {"projection": self.projection, "resolution": map_size, self.family.threshold: threshold}
        if self.adaptive:  # levels count from the root, whose texels are those of a uniform lightmap
            wanted["level"] = min(LEVEL + ROOT_LEVEL, MAX_LEVEL)
        known = {spec.name: spec.minimum for spec in specs(self.family.options)}
        wanted[self.family.threshold] = max(threshold, known[self.family.threshold] or 0.0)
        return self.family.options().replace(**{name: value for name, value in wanted.items() if name in known})


def projections_of(solver: str) -> tuple[str | None, ...]:
    """Those that it can draw its maps by, the hemicube first; (None,) where it draws none."""
    choices = (spec.choices for spec in specs(SOLVERS[solver].options) if spec.name == "projection")
    return tuple(str(name) for name in next(choices, ())) or (None,)


def methods_of(solver: str) -> tuple[Method, ...]:
    """Every lightmap by every projection; no quadtrees where texels are compared two by two, or patches are squares of them."""
    lightmaps = (False,) if SOLVERS[solver].quadratic or not SOLVERS[solver].everywhere else (False, True)
    return tuple(Method(solver, adaptive, by) for adaptive in lightmaps for by in projections_of(solver))


METHODS = (
    *(method for solver in SOLVERS for method in methods_of(solver)),
    *(Method(storage=storage) for storage in STORAGE if storage != FULL),
)
# where how a shooter sees, and how light is stored, plays no part
ONE_PROJECTION = tuple(m for m in METHODS if m.projection == projections_of(m.solver)[0] and m.storage == FULL)


@dataclass(frozen=True)
class Check:
    """One number of the solution, and what it must be but for what the reason allows: from expected - less to expected + more.

    exact: whether only storage in 32 bits is held to it."""

    what: str
    measured: float
    expected: float
    less: float
    more: float
    reason: str
    exact: bool = True

    @property
    def holds(self) -> bool:
        return self.expected - self.less <= self.measured <= self.expected + self.more  # never, if it is no number


def near(what: str, measured: float, expected: float, tolerance: float, reason: str) -> Check:
    return Check(what, measured, expected, tolerance, tolerance, reason)


def dark(what: str, measured: float, most: float, reason: str) -> Check:
    """No light, or no more than so much, in every format."""
    return Check(what, measured, 0.0, 0.0, most, reason, exact=False)


@dataclass(frozen=True, eq=False)
class Solution:
    """The light of a solved case.

    map: pixels of visibility maps. position (n, 3) [m], normal (n, 3), area (n,) [m²], object (n,), and H (n,) [W/m²] of the
    texels that cover a surface; the scenes are grey.
    """

    scene: Scene
    method: Method
    map: int
    position: F64
    normal: F32
    area: F64
    object: NDArray[np.int32]
    H: F64
    energy: EnergyBalance
    work: int
    seconds: float

    @property
    def emitted(self) -> float:
        """[W]"""
        return float(self.energy.emitted[0])

    def share(self, part: str) -> float:
        """A part of the energy balance over the emitted power."""
        return float(getattr(self.energy, part)[0]) / self.emitted

    def on(self, *names: str) -> NDArray[np.bool_]:
        """(n,) whether texels are of these objects."""
        return np.isin(self.object, [self.scene.objects.index(name) for name in names])

    def mean(self, where: NDArray[np.bool_]) -> float:
        """Area-weighted mean irradiance [W/m²]; 0 where there is no texel."""
        return float(np.average(self.H[where], weights=self.area[where])) if where.any() else 0.0

    @property
    def sample(self) -> float:
        """Share of the sky of one sample of the map; rays have none."""
        return 0.0 if self.method.projection is None else 1 / self.map**2

    @property
    def grazing(self) -> float:
        """Cosine-weighted share of a receiver's sky lower than two samples of the map, 2/R wide each: sin² of that angle."""
        return 16 * self.sample

    @property
    def bounces(self) -> float:
        """How often light has met a surface."""
        return self.flux(self.area > 0)

    def flux(self, where: NDArray[np.bool_]) -> float:
        """Power received there, as a share of the emitted."""
        return float((self.H * self.area)[where].sum()) / self.emitted


Controls = dict[object, Solution]


@dataclass(frozen=True, eq=False)
class HardCase:
    """A scene that is hard to solve, and what is known of its light.

    scene: of a size. control: a clean scene, solved alike, whose answer it must have. checks: of a solution and of its control's,
    or of the same one twice where there is none. density: texels/m by size, of quadtrees the roots', for a scene that is
    ``scale`` times as large as its control; map: pixels of visibility maps by size. Solved until no more than ``residual``
    remains, or NOISE, or for so much ``work`` in the solver's unit, or so many ``rays`` where light is gathered. imbalance: of
    energy that there may be either way, and why; grazes: whether each bounce may lose a little more.
    """

    name: str
    about: str
    scene: Callable[[str], Scene]
    checks: Callable[[Solution, Solution], list[Check]]
    control: Callable[[str], Scene] | None = None
    density: tuple[float, float] = (8, 32)
    scale: float = 1.0
    map: tuple[int, int] = (64, 256)
    residual: tuple[float, float] = (0.05, 2e-3)
    work: tuple[int, int] | None = None
    rays: tuple[int, int] | None = None
    imbalance: float = 0.01
    imbalance_reason: str = IMBALANCE
    grazes: bool = True
    methods: tuple[Method, ...] = METHODS

    def methods_by(self, solver: str | None) -> list[Method]:
        """Those of one solver, or of all but those that take the square of the texels' time, or light what is near alone."""
        usual = {name for name, family in SOLVERS.items() if not family.quadratic and family.everywhere}
        return [m for m in self.methods if (m.solver in usual if solver is None else m.solver == solver)]

    def run(self, gpu: Gpu, method: Method, size: str, controls: Controls) -> tuple[Solution, list[Check]]:
        """Solve it by this method; its light, and the checks of every case before its own. controls: solved so far, by cases that
        share them."""
        light = control = self.solve(gpu, self.scene(size), method, size, self.scale)
        if self.control and method.storage == FULL:
            key = self.control, method, size, self.density, self.map
            if key not in controls:
                controls[key] = self.solve(gpu, self.control(size), method, size, 1.0)
            control = controls[key]
        checks = [*self.common_checks(light, method), *self.checks(light, control)]
        return light, [check for check in checks if method.storage == FULL or not check.exact]

    def common_checks(self, light: Solution, method: Method) -> Iterator[Check]:
        broken = np.count_nonzero(~np.isfinite(light.H)) + (not np.isfinite(light.energy.unshot).all())
        yield Check("texels without a finite number", float(broken), 0.0, 0.0, 0.0, NO_NUMBER, exact=False)
        brightest = max(float(light.H.max()), 1e-300)
        yield Check(
            "darkest texel / brightest",
            float(light.H.min()) / brightest,
            0.0,
            2 * light.sample,
            1.0,
            NEGATIVE,
            exact=False,
        )
        gained, lost, reason = self.imbalance, self.imbalance, self.imbalance_reason
        if self.grazes:
            lost, reason = lost + light.grazing * light.bounces, f"{reason}; {EACH}"
        if method.storage != FULL:
            gained, lost, reason = gained + ROUNDED * light.bounces, 1.0, STORED
        yield Check("energy lost", light.energy.imbalance_share, 0.0, gained, lost, reason, exact=False)

    def solve(self, gpu: Gpu, scene: Scene, method: Method, size: str, scale: float) -> Solution:
        """Until converged, or for so much work."""
        i = SIZES.index(size)
        gathers = method.family.remains == "noise"
        work = self.rays if gathers else self.work
        last, least = (
            (work[i], -1.0 if gathers else 0.0) if work else (ENOUGH, NOISE[size] if gathers else self.residual[i])
        )
        start = time.perf_counter()
        atlas = AtlasOptions(density=self.density[i] / scale)
        light = LightmapOptions(adaptive=method.adaptive, depth=1, storage=method.storage)
        options = method.options(self.map[i], least)
        if (
            method.family.remains == "changed"
        ):  # no less than what can be asked for: bounces change the last digits for ever
            least = getattr(options, method.family.threshold)
        with opened(gpu, scene, atlas, light, options, method.solver) as (lightmap, solver):
            batch = method.family.batch
            few = FEW_RAYS if gathers else 0
            solve_until(
                solver,
                batch,
                lambda now: now.done >= last or (now.done >= few and now.converged and now.remaining <= least),
            )
            done, energy = solver.poll(wait=True).done, solver.energy()
            surfaces = lightmap.pool.surfaces
            covered = surfaces.area > 0
            return Solution(
                scene=scene,
                method=method,
                map=self.map[i],
                position=surfaces.position[covered],
                normal=surfaces.normal[covered],
                area=surfaces.area[covered],
                object=lightmap.pool.scene.object_ids[lightmap.charts.face_triangle[surfaces.face[covered]]],
                H=lightmap.irradiance()[covered][:, 0].astype(np.float64),
                energy=energy,
                work=done,
                seconds=time.perf_counter() - start,
            )
