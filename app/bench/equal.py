"""Texels and seconds for equal error: uniform and adaptive lightmaps against the dense float64 reference.

At random points of all lit sides, even in area: E from the lightmap, bilinear as it is drawn, against E gathered from the dense
solution, B = E + ρ F B [Goral84]. The lightmap that is judged is the flat one that a bake writes. Left out are points in gaps
that are narrower than a patch of the reference: over the lamp, 0.1 mm below its ceiling, that is no reference.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.atlas.charts import Charts
from app.atlas.collapse import collapse
from app.atlas.lightmap import Lightmap
from app.atlas.options import AtlasOptions
from app.bake.gutter import fill_gutter
from app.bench.measure import opened, shoot
from app.bench.report import Row
from app.gpu import Gpu
from app.loading import load
from app.metrics import median_local, quantile_local, relative_rms
from app.reference.dense import irradiance_at, solve_dense
from app.reference.visibility import visible
from app.scene.load import load_scene
from app.scene.model import F64, Scene
from app.solvers import ShootingOptions

SCENE = "cornell-box"
PATCHES = 6000  # of the reference: 0.8 % RMS from a path tracer's with 0.5 % of noise; 3000 are 2.9 % from it
POINTS = 1500
SEED = 1
CONVERGED = 1e-3  # residual, far below the errors that are compared


@dataclass(frozen=True, eq=False)
class Points:
    """On surfaces: triangle (n,) and whether its back; weights (n, 3) of its corners."""

    triangle: NDArray[np.int32]
    back: NDArray[np.bool_]
    weights: F64

    def only(self, which: NDArray[np.bool_]) -> Points:
        return Points(self.triangle[which], self.back[which], self.weights[which])

    def positions_normals(self, scene: Scene) -> tuple[F64, F64]:
        """(n, 3) [m] and (n, 3)."""
        normal = scene.normals_areas[0][self.triangle] * np.where(self.back, -1.0, 1.0)[:, None]
        return np.einsum("nk,nkc->nc", self.weights, scene.corners[self.triangle]), normal


def random_points(scene: Scene, charts: Charts, count: int, seed: int) -> Points:
    """Even in area on all sides that have texels."""
    random = np.random.default_rng(seed)
    area = scene.normals_areas[1][charts.face_triangle]
    order = np.lexsort((charts.face_back, charts.face_triangle))  # whatever the atlas
    face = random.choice(order, count, p=area[order] / area.sum())
    return Points(charts.face_triangle[face], charts.face_back[face], random.dirichlet((1, 1, 1), count))


def irradiance_of(lightmap: Lightmap, points: Points) -> F64:
    """(n, 3) [W/m²], bilinear."""
    nodes, charts = lightmap.nodes, lightmap.charts
    image = fill_gutter(*collapse(nodes, lightmap.irradiance())).astype(np.float64)
    face_of = {
        key: i for i, key in enumerate(zip(charts.face_triangle.tolist(), charts.face_back.tolist(), strict=True))
    }
    face = [face_of[key] for key in zip(points.triangle.tolist(), points.back.tolist(), strict=True)]
    finer = image.shape[0] // charts.size[1]
    place = np.einsum("nk,nkc->nc", points.weights, charts.face_uv[face]) * finer - 0.5
    first = np.floor(place).astype(np.int64)
    (x, y), (s, t) = first.T, (place - first).T[..., None]
    columns, rows = (np.clip([i, i + 1], 0, size - 1) for i, size in ((x, image.shape[1]), (y, image.shape[0])))
    below, above = ((1 - s) * image[row, columns[0]] + s * image[row, columns[1]] for row in rows)
    return np.asarray((1 - t) * below + t * above)


@functools.cache
def reference() -> tuple[Points, F64]:
    """Random points of the scene and their irradiance (n, 3) [W/m²]. Takes minutes."""
    scene = load_scene(SCENE)
    points = random_points(scene, load(scene, AtlasOptions()).nodes.charts, POINTS, SEED)
    position, normal = points.positions_normals(scene)
    edge = np.sqrt(scene.normals_areas[1].sum() / PATCHES)
    points = points.only(visible(position, position + edge * normal, scene.corners))
    return points, irradiance_at(solve_dense(scene, PATCHES, 1), scene, *points.positions_normals(scene))


def error_row(gpu: Gpu, atlas: AtlasOptions) -> Row:
    """Error, texels, shots and seconds of a solve, however long it takes."""
    points, truth = reference()
    with opened(gpu, SCENE, atlas, ShootingOptions(residual=CONVERGED)) as (lightmap, solver):
        run = shoot(gpu, solver, np.inf)
        E = irradiance_of(lightmap, points)
        texels = lightmap.texel_count
    row: Row = {"subdivision": "adaptive" if atlas.adaptive else "uniform", "tile": atlas.tile, "texels": texels}
    row |= {"shots": run.shots, "seconds": run.seconds, "rms": relative_rms(E, truth), "median": median_local(E, truth)}
    return row | {"q90": quantile_local(E, truth, 0.9)}


def compared(rows: list[Row]) -> None:
    """Enter in each adaptive row what uniform texels would take for its RMS: between the measured ones, straight in logarithms;
    nothing where its error is beyond theirs."""
    uniform = sorted((row for row in rows if row["subdivision"] == "uniform"), key=lambda row: -float(row["rms"]))
    if len(uniform) < 2:
        return
    errors = np.log([row["rms"] for row in uniform])[::-1]
    for row in rows:
        at = np.log(row["rms"])
        if row["subdivision"] != "adaptive" or not errors[0] <= at <= errors[-1]:
            continue
        for key in ("texels", "seconds"):
            equal = float(np.exp(np.interp(at, errors, np.log([u[key] for u in uniform])[::-1])))
            row |= {f"equal_{key}": equal, f"{key}_share": row[key] / equal}
