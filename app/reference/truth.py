"""The irradiance that a lightmap should have, at random points of a scene: what errors are measured from.

    closed-form   a closed shell that emits and reflects alike everywhere: B = E / (1 - ρ), H = (B - E) / ρ = B
    path-traced   tracer.py, in independent batches that tell its noise; any scene, needs mitsuba
    dense         the float64 matrix of app/reference [Goral84]; scenes of few triangles

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
from app.atlas.sides import scene_size, weld
from app.errors import UserError
from app.reference.dense import irradiance_at, solve_dense
from app.reference.metrics import lit_points, median_local
from app.reference.points import open_above
from app.scene.arrays import arrays_of
from app.scene.model import F64, Scene
from app.util import cache
from app.util.console import Tell

POINTS = 2000
POINTS_SEED, PATHS_SEED = 1, 2
BATCHES = 16
SAMPLES = 16384  # paths from each point: in a Cornell box 0.6 % of noise
PATCHES = (
    6000  # of the dense matrix: in a Cornell box 0.8 % RMS from a path tracer's with 0.5 % of noise; of 3000 2.9 %
)
DENSE_TRIANGLES = 60  # most for which it takes minutes
FORMAT = b"glowtree truth 1"  # changes when a reference or its file does
CACHE_FILES = 64  # kept, newest first


@dataclass(frozen=True, eq=False)
class Truth:
    """Irradiance E (n, 3) [W/m²] at points. deviation (n, 3): its standard error, None where it is not known by chance.

    reference: its name; made: how, in words; seconds: that making it took.
    """

    reference: str
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
            "reference": self.reference,
            "made": self.made,
            "noise": self.noise,
            "median_noise": self.median_noise,
            "points": len(self.points),
            "lit_points": int(self.lit.sum()),
            "points_seed": POINTS_SEED,
            "seconds": self.seconds,
        }


@dataclass(frozen=True)
class Reference:
    """unfit: why it cannot judge a scene, None if it can; make: the truth at its points."""

    unfit: Callable[[Scene], str | None]
    make: Callable[[Scene, int, Tell], Truth]


def choose(scene: Scene, name: str | None = None) -> str:
    """The first reference that can judge a scene, or the one asked for if it can. Raises UserError."""
    reasons = {}
    for candidate, reference in REFERENCES.items():
        if name in (None, candidate):
            reasons[candidate] = reference.unfit(scene)
            if reasons[candidate] is None:
                return candidate
    whys = "; ".join(f"{candidate}: {why}" for candidate, why in reasons.items())
    raise UserError(f"{scene.name}: there is nothing to compare with ({whys})")


def truth_of(scene: Scene, name: str, samples: int, tell: Tell) -> Truth:
    """By one of REFERENCES that can judge the scene; samples: paths from each point, where paths are traced. Raises UserError."""
    return REFERENCES[name].make(scene, samples, tell)


# -- closed form -------------------------------------------------------------------------------------------------------


def no_furnace(scene: Scene) -> str | None:
    """Why a scene is no furnace, None if it is one: every side alike, and one closed shell with its fronts inwards."""
    used = [scene.materials[k] for k in np.unique(scene.material_ids)]
    looks = {(m.albedo, m.emission, m.albedo_texture, m.emission_texture, m.double_sided) for m in used}
    albedo, _, *textures, double_sided = looks.pop()
    if looks or any(textures) or double_sided:
        return "not all surfaces are alike"
    if max(albedo) >= 1.0:
        return "nothing absorbs light"
    points, triangles = weld(scene)
    edges = {(int(t[k]), int(t[k - 2])) for t in triangles for k in range(3)}
    closed = len(edges) == 3 * len(triangles) and all((b, a) in edges for a, b in edges)
    corners = points[triangles]
    volume = np.einsum("mc,mc->m", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum()
    pieces = _pieces(triangles)
    return None if closed and volume < 0 and pieces == 1 else "not a single closed shell, seen from inside"


def _pieces(triangles: NDArray[np.int32]) -> int:
    """Connected ones."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    first, second = triangles[:, [0, 1]].ravel(), triangles[:, [1, 2]].ravel()
    used, label = np.unique(np.stack([first, second]), return_inverse=True)
    label = label.reshape(2, -1)
    graph = coo_array((np.ones(len(first)), tuple(label)), shape=(len(used), len(used)))
    return int(connected_components(graph, directed=False)[0])


def _closed_form(scene: Scene, samples: int, tell: Tell) -> Truth:
    material = scene.materials[scene.material_ids[0]]
    B = np.pi * np.array(material.emission) / (1 - np.array(material.albedo))
    points = random_points(scene, POINTS, POINTS_SEED)
    return Truth("closed-form", points, np.tile(B, (len(points), 1)), None, "closed form, B = E / (1 - ρ)", 0.0)


# -- dense -------------------------------------------------------------------------------------------------------------


def _too_many_triangles(scene: Scene) -> str | None:
    count = len(scene.triangles)
    return None if count <= DENSE_TRIANGLES else f"{count:,} triangles are more than {DENSE_TRIANGLES}"


def dense_truth(
    scene: Scene, tell: Tell = lambda text, share: None, *, count: int = POINTS, patches: int = PATCHES
) -> Truth:
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


def traced_truth(scene: Scene, samples: int, tell: Tell, *, count: int = POINTS) -> Truth:
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
    reference: str, scene: Scene, points: Points, made: str, make: Callable[[], dict[str, NDArray[Any]]]
) -> Truth:
    """From the cache, or made and put there: kept (n,), E and perhaps deviation (of those kept, 3)."""
    given = arrays_of(scene) | {"triangle": points.triangle, "back": points.back, "weights": points.weights}
    path = cache.entry("truth", cache.digest(FORMAT + made.encode(), given))
    found = cache.read(path)
    if found is None or not {"kept", "E", "seconds"} <= found.keys():
        start = time.perf_counter()
        found = make()
        found["seconds"] = np.array(time.perf_counter() - start)
        found["noise"] = np.array(
            Truth(reference, points.only(found["kept"]), found["E"], found.get("deviation"), made, 0.0).noise or np.nan
        )
        cache.store(cache.content(found), path, CACHE_FILES)
    kept = points.only(found["kept"])
    return Truth(reference, kept, found["E"], found.get("deviation"), made, float(found["seconds"]))


REFERENCES = {
    "closed-form": Reference(no_furnace, _closed_form),
    "path-traced": Reference(lambda scene: no_tracer(), traced_truth),
    "dense": Reference(_too_many_triangles, lambda scene, samples, tell: dense_truth(scene, tell)),
}
