"""What a hard case is: a scene, how it is solved, and what its light must be, within what and for which reason."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.options import AtlasOptions
from app.gpu import Gpu
from app.lightmap.options import STORAGE, LightmapOptions
from app.scene.model import F32, F64, Scene
from app.session.batch import opened, solve_until
from app.solvers import DEFAULT_SOLVER, SOLVERS, EnergyBalance, ShootingOptions
from app.solvers.shooting.options import MAX_LEVEL
from app.solvers.shooting.stages import LEVEL, ROOT_LEVEL
from app.visibility.projections import PROJECTIONS

SIZES = ("small", "large")
ENOUGH = 2_000_000  # shots: a solve that needs more does not converge
FULL = "rgba32f"
LEAST = 1e-9  # residual that can be asked for
BOOK = "of single shots' sums, on average: a texel is sampled at its centroid, its shooter's sight at one point"
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
class Way:
    """One way to solve."""

    solver: str = DEFAULT_SOLVER
    adaptive: bool = False
    projection: str = "hemicube"
    storage: str = FULL

    @property
    def name(self) -> str:
        return f"{self.solver} {'adaptive' if self.adaptive else 'uniform'} {self.projection}" + (
            "" if self.storage == FULL else f" {self.storage}"
        )


WAYS = tuple(Way(s, a, p) for s in SOLVERS for a in (False, True) for p in PROJECTIONS) + tuple(
    Way(storage=storage) for storage in STORAGE if storage != FULL
)
# Where how a shooter sees, and how light is stored, plays no part
SOLVERS_ONLY = tuple(Way(s, a) for s in SOLVERS for a in (False, True))


@dataclass(frozen=True)
class Claim:
    """That a measured number is the expected one, but for what the reason allows: from expected - less to expected + more.

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


def near(what: str, measured: float, expected: float, tolerance: float, reason: str) -> Claim:
    return Claim(what, measured, expected, tolerance, tolerance, reason)


def dark(what: str, measured: float, most: float, reason: str) -> Claim:
    """No light, or no more than so much, in every format."""
    return Claim(what, measured, 0.0, 0.0, most, reason, exact=False)


@dataclass(frozen=True, eq=False)
class Light:
    """A solution. map: pixels of visibility maps. position (n, 3) [m], normal (n, 3), area (n,) [m²], object (n,), and H
    and r (n,) [W/m²] of the texels that cover a surface; the scenes are grey."""

    scene: Scene
    way: Way
    map: int
    position: F64
    normal: F32
    area: F64
    object: NDArray[np.int32]
    H: F64
    r: F64
    book: EnergyBalance
    shots: int
    seconds: float

    @property
    def emitted(self) -> float:
        """[W]"""
        return float(self.book.emitted[0])

    def share(self, part: str) -> float:
        """A part of the energy book over the emitted power."""
        return float(getattr(self.book, part)[0]) / self.emitted

    def on(self, *names: str) -> NDArray[np.bool_]:
        """(n,) whether texels are of these objects."""
        return np.isin(self.object, [self.scene.objects.index(name) for name in names])

    def mean(self, where: NDArray[np.bool_]) -> float:
        """Area-weighted mean irradiance [W/m²]; 0 where there is no texel."""
        return float(np.average(self.H[where], weights=self.area[where])) if where.any() else 0.0

    @property
    def grazing(self) -> float:
        """Cosine-weighted share of a receiver's sky lower than two samples of the map, 2/R wide each: sin² of that angle."""
        return (4 / self.map) ** 2

    @property
    def bounces(self) -> float:
        """How often light has met a surface."""
        return self.flux(self.area > 0)

    def flux(self, where: NDArray[np.bool_]) -> float:
        """Power received there, as a share of the emitted."""
        return float((self.H * self.area)[where].sum()) / self.emitted


Twins = dict[object, Light]


@dataclass(frozen=True, eq=False)
class HardCase:
    """scene: of a size. claims: of a solution and of its twin's, if it has one: another scene, solved alike. density: texels/m
    by size, of quadtrees the roots', for a scene that is ``scale`` times as large as its twin; map: pixels of visibility maps by
    size. Solved until no more than ``residual`` of the emitted power is unshot, or for so many shots. book: imbalance that the
    energy book may show either way, and why; grazes: whether each bounce may lose a little more."""

    name: str
    about: str
    scene: Callable[[str], Scene]
    claims: Callable[[Light, Light], list[Claim]]
    twin: Callable[[str], Scene] | None = None
    density: tuple[float, float] = (8, 32)
    scale: float = 1.0
    map: tuple[int, int] = (64, 256)
    residual: tuple[float, float] = (0.05, 2e-3)
    shots: tuple[int, int] | None = None
    book: float = 0.01
    book_reason: str = BOOK
    grazes: bool = True
    ways: tuple[Way, ...] = WAYS

    def run(self, gpu: Gpu, way: Way, size: str, twins: Twins) -> tuple[Light, list[Claim]]:
        """Solve it this way; its light, and its claims, after those that every case makes. twins: solved so far, by cases that
        share them."""
        light = twin = self.solve(gpu, self.scene(size), way, size, self.scale)
        if self.twin and way.storage == FULL:
            key = self.twin, way, size, self.density, self.map
            if key not in twins:
                twins[key] = self.solve(gpu, self.twin(size), way, size, 1.0)
            twin = twins[key]
        claims = [*self.always(light, way), *self.claims(light, twin)]
        return light, [claim for claim in claims if way.storage == FULL or not claim.exact]

    def always(self, light: Light, way: Way) -> Iterator[Claim]:
        broken = np.count_nonzero(~np.isfinite(light.H) | ~np.isfinite(light.r))
        yield Claim("texels without a finite number", float(broken), 0.0, 0.0, 0.0, NO_NUMBER, exact=False)
        brightest = max(float(light.H.max()), 1e-300)
        yield Claim(
            "darkest texel / brightest",
            float(light.H.min()) / brightest,
            0.0,
            2 / light.map**2,
            1.0,
            NEGATIVE,
            exact=False,
        )
        gained, lost, reason = self.book, self.book, self.book_reason
        if self.grazes:
            lost, reason = lost + light.grazing * light.bounces, f"{reason}; {EACH}"
        if way.storage != FULL:
            gained, lost, reason = gained + ROUNDED * light.bounces, 1.0, STORED
        yield Claim("energy lost", light.book.imbalance_share, 0.0, gained, lost, reason, exact=False)

    def solve(self, gpu: Gpu, scene: Scene, way: Way, size: str, scale: float) -> Light:
        """Shoot until converged and settled, or so many shots."""
        i = SIZES.index(size)
        last, least = (self.shots[i], 0.0) if self.shots else (ENOUGH, self.residual[i])
        options = ShootingOptions(
            projection=way.projection,
            resolution=self.map[i],
            residual=max(least, LEAST),  # quadtrees shoot no further
        )
        if way.adaptive:  # levels count from the root, whose texels are those of a uniform lightmap
            options = options.replace(level=min(LEVEL + ROOT_LEVEL, MAX_LEVEL))
        start = time.perf_counter()
        atlas = AtlasOptions(density=self.density[i] / scale)
        light = LightmapOptions(adaptive=way.adaptive, depth=1, storage=way.storage)
        with opened(gpu, scene, atlas, light, options, way.solver) as (lightmap, solver):
            batch = SOLVERS[way.solver].batch
            solve_until(solver, batch, lambda now: now.done >= last or (now.remaining <= least and now.converged))
            shots, book = solver.poll(wait=True).done, solver.energy()
            surfaces = lightmap.pool.surfaces
            covered = surfaces.area > 0
            return Light(
                scene=scene,
                way=way,
                map=self.map[i],
                position=surfaces.position[covered],
                normal=surfaces.normal[covered],
                area=surfaces.area[covered],
                object=scene.object_ids[lightmap.charts.face_triangle[surfaces.face[covered]]],
                H=lightmap.irradiance()[covered][:, 0].astype(np.float64),
                r=lightmap.residual()[covered][:, 0].astype(np.float64),
                book=book,
                shots=shots,
                seconds=time.perf_counter() - start,
            )
