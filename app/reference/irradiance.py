"""Reference irradiance at random points of a scene, which errors of a lightmap are measured from.

    closed-form   a closed shell that emits and reflects alike everywhere: B = E / (1 - ρ), H = (B - E) / ρ = B; closed_form.py
    path-traced   path_tracer.py, in independent batches that tell its noise; any scene, needs mitsuba
    dense         the float64 matrix of dense.py [Goral84]; scenes of few triangles

What takes long is cached under a digest of scene, points and parameters. Left out are points in gaps so narrow that the reference
itself goes wrong there.
"""

from __future__ import annotations

import importlib.util
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.atlas.points import Points, random_points
from app.atlas.sides import scene_size
from app.errors import UserError
from app.reference.closed_form import furnace_irradiance, no_furnace
from app.reference.dense import irradiance_at, solve_dense
from app.reference.gaps import open_above
from app.reference.metrics import lit_points, median_local
from app.scene.arrays import arrays_of
from app.scene.model import F64, Scene
from app.util import cache
from app.util.console import Tell

POINTS = 2000
POINTS_SEED, PATHS_SEED = 1, 2
BATCHES = 16
SAMPLES = 16384  # paths from each point: in a Cornell box 0.6 % of noise
# of the dense matrix: in a Cornell box 0.8 % RMS from a path tracer's with 0.5 % of noise; of 3000 2.9 %
PATCHES = 6000
DENSE_TRIANGLES = 60  # most for which it takes minutes
FORMAT = b"glowtree truth 2"  # changes when a reference or its file does
CACHE_FILES = 64  # kept, newest first


@dataclass(frozen=True, eq=False)
class ReferenceIrradiance:
    """Irradiance E (n, 3) [W/m²] at points. deviation (n, 3): its standard error, None where it is not known by chance.

    name: of its method; made: how, in words; seconds: that making it took.
    """

    name: str
    points: Points
    E: F64
    deviation: F64 | None
    made: str
    seconds: float

    @property
    def lit(self) -> NDArray[np.bool_]:
        """(n,) points that are not dark."""
        return lit_points(self.E)

    @property
    def noise(self) -> float | None:
        """Relative RMS that the exact solution would be found to have, over lit points."""
        if self.deviation is None:
            return None
        lit = self.lit
        return float(np.sqrt((self.deviation[lit] ** 2).mean()) / self.E[lit].mean())

    @property
    def median_noise(self) -> float | None:
        """Median over lit points of the standard error over the irradiance there."""
        if self.deviation is None:
            return None
        lit = self.lit
        return median_local(self.E[lit] + self.deviation[lit], self.E[lit])

    def as_dict(self) -> dict[str, Any]:
        """For reports."""
        return {
            "reference": self.name,
            "made": self.made,
            "noise": self.noise,
            "median_noise": self.median_noise,
            "points": len(self.points),
            "lit_points": int(self.lit.sum()),
            "points_seed": POINTS_SEED,
            "seconds": self.seconds,
        }


@dataclass(frozen=True)
class ReferenceMethod:
    """unfit: why it cannot judge a scene, None if it can; make: the irradiance at points of it."""

    unfit: Callable[[Scene], str | None]
    make: Callable[[Scene, int, Tell], ReferenceIrradiance]


def choose_reference(scene: Scene, name: str | None = None) -> str:
    """The first reference that can judge a scene, or the one asked for if it can. Raises UserError."""
    reasons = {}
    for candidate, reference in REFERENCES.items():
        if name in (None, candidate):
            reasons[candidate] = reference.unfit(scene)
            if reasons[candidate] is None:
                return candidate
    whys = "; ".join(f"{candidate}: {why}" for candidate, why in reasons.items())
    raise UserError(f"{scene.name}: there is nothing to compare with ({whys})")


def reference_irradiance(scene: Scene, name: str, samples: int, tell: Tell) -> ReferenceIrradiance:
    """By one of REFERENCES that can judge the scene; samples: paths from each point, where paths are traced. Raises UserError."""
    return REFERENCES[name].make(scene, samples, tell)


# -- closed form -------------------------------------------------------------------------------------------------------


def _closed_form(scene: Scene, samples: int, tell: Tell) -> ReferenceIrradiance:
    points = random_points(scene, POINTS, POINTS_SEED)
    H = np.tile(furnace_irradiance(scene), (len(points), 1))
    return ReferenceIrradiance("closed-form", points, H, None, "closed form, B = E / (1 - ρ)", 0.0)


# -- dense -------------------------------------------------------------------------------------------------------------


def _too_many_triangles(scene: Scene) -> str | None:
    if scene.lit_by_sky:
        return "its matrix knows no sky"
    if any(light.emits and (light.radius or light.angle) for light in scene.lights):
        return "its lights cast no soft shadows"
    count = len(scene.triangles)
    return None if count <= DENSE_TRIANGLES else f"{count:,} triangles are more than {DENSE_TRIANGLES}"


def dense_irradiance(
    scene: Scene, tell: Tell = lambda text, share: None, *, count: int = POINTS, patches: int = PATCHES
) -> ReferenceIrradiance:
    """At so many random points, less those in gaps narrower than a patch: over a lamp 0.1 mm below its ceiling, that is no
    reference. Takes minutes."""
    points = random_points(scene, count, POINTS_SEED)
    made = f"dense float64 matrix of {patches:,} patches"

    def solve() -> dict[str, NDArray[Any]]:
        tell("dense reference", 0.0)
        edge = np.sqrt(scene.normals_areas[1].sum() / patches)
        kept = open_above(scene, points, edge)
        return {
            "kept": kept,
            "E": irradiance_at(solve_dense(scene, patches, 1), scene, *points.only(kept).positions_normals(scene)),
        }

    return _cached("dense", scene, points, made, solve)


# -- path tracing ------------------------------------------------------------------------------------------------------


def no_tracer() -> str | None:
    """Why no paths can be traced here, None if they can."""
    if importlib.util.find_spec("mitsuba") is None:
        return "needs mitsuba: pip install 'glowtree[peers]'"
    from app.reference import path_tracer as tracer

    try:
        tracer.description()
    except UserError as error:
        return str(error)
    return None


def path_traced_irradiance(scene: Scene, samples: int, tell: Tell, *, count: int = POINTS) -> ReferenceIrradiance:
    """At so many random points, less those in gaps that rays start beyond. samples: paths from each point. Raises UserError."""
    from app.reference import path_tracer as tracer

    points = random_points(scene, count, POINTS_SEED)
    batch = max(round(np.sqrt(samples / BATCHES)), 1) ** 2
    made = f"{tracer.description()}: {BATCHES * batch:,} paths from each point, seed {PATHS_SEED}"

    def trace() -> dict[str, NDArray[Any]]:
        traced = tracer.Tracer(scene)
        kept = open_above(scene, points, 2 * tracer.GAP * scene_size(scene))
        place = points.only(kept).positions_normals(scene)
        batches = []
        for k in range(BATCHES):
            tell("path-traced reference", k / BATCHES)
            batches.append(traced.irradiance(*place, batch, BATCHES * PATHS_SEED + k))
        return {
            "kept": kept,
            "E": np.mean(batches, axis=0),
            "deviation": np.std(batches, axis=0, ddof=1) / np.sqrt(BATCHES),
            "seed": np.array(PATHS_SEED),
        }

    return _cached("path-traced", scene, points, made, trace)


# -- what they have in common ------------------------------------------------------------------------------------------


def _cached(
    name: str, scene: Scene, points: Points, made: str, make: Callable[[], dict[str, NDArray[Any]]]
) -> ReferenceIrradiance:
    """From the cache, or made and put there: kept (n,), E and perhaps deviation (of those kept, 3)."""
    given = arrays_of(scene) | {"triangle": points.triangle, "back": points.back, "weights": points.weights}
    path = cache.entry("truth", cache.digest(FORMAT + made.encode(), given))
    found = cache.read(path)
    if found is None or not {"kept", "E", "seconds"} <= found.keys():
        start = time.perf_counter()
        found = make()
        found["seconds"] = np.array(time.perf_counter() - start)
        result = ReferenceIrradiance(name, points.only(found["kept"]), found["E"], found.get("deviation"), made, 0.0)
        found["noise"] = np.array(result.noise or np.nan)
        cache.store(found, path, CACHE_FILES)
    kept = points.only(found["kept"])
    return ReferenceIrradiance(name, kept, found["E"], found.get("deviation"), made, float(found["seconds"]))


REFERENCES = {
    "closed-form": ReferenceMethod(no_furnace, _closed_form),
    "path-traced": ReferenceMethod(lambda scene: no_tracer(), path_traced_irradiance),
    "dense": ReferenceMethod(_too_many_triangles, lambda scene, samples, tell: dense_irradiance(scene, tell)),
}
