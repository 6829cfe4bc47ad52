"""The local matrix is measured by size and way to bounce, on a walk through the village, beside its paper's numbers
[Shcherbakov19].

The paper gives numbers of one size alone (figure 3), and a curve of plain radiosity beside the matrix of several reflections over
sizes (figure 4) without any.
"""

from __future__ import annotations

import statistics
import time
from dataclasses import replace
from functools import partial

from app.atlas.options import AtlasOptions
from app.bench.papers.local_walk import EVERY, FORESEEN, NEAR, PICTURE, STEPS, LocalWalk, steps_of, walk
from app.bench.papers.published import SHCHERBAKOV, SHCHERBAKOV_LOCAL, SHCHERBAKOV_WHOLE
from app.bench.papers.shcherbakov_verdicts import verdicts
from app.bench.papers.table import Plot, Table
from app.bench.papers.whole_solution import find_direct, whole_solution
from app.bench.speed.edits import edits_of
from app.bench.speed.rank_one import median_ms, rank_one_times
from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.render.camera_path import load_path
from app.scene.model import Scene
from app.session.batch import opened
from app.solvers.gathering.options import GatheringOptions
from app.solvers.gathering.solver import Gathering
from app.solvers.local.lighting import SWEEPS
from app.solvers.local.options import BOUNCES, LocalOptions
from app.solvers.local.solver import Local
from app.util.parts import run_to_end
from app.util.tables import Column, Row

SCENE = PATH = "village"
DENSITY = 1.0  # texels along a metre: each unit face is a patch, as in the paper
SIZES = (512, 1024, 2048, 4096)
SHADOW_RAYS = 16
PLAIN_SWEEPS = 3  # multiplications of plain radiosity, at least [Shcherbakov19, 3]
FILLING = 64  # swaps in a piece of work, until the set is full
FORETOLD = 8  # part of a set that has entered when it is known how long the rest will take
LONGEST = 30  # times as long as another measurement that a set may take to be filled, and the walk again
CONSTANT = 1024  # patches of the set beyond which light is taken as its mean
RAYS = 64  # of each texel, of which all hits are kept
EDITS = 5  # that a median is of


def measure_row(
    gpu: Gpu,
    seconds: float,
    size: int,
    bounces: str,
    scene: str | Scene = SCENE,
    steps: int = STEPS,
    every: int = EVERY,
    outside: str = "cascade",
) -> Row:
    """A row has the milliseconds of a swap and of lighting, and differences from the whole solution on the walk. Raises UserError
    where it would take more than LONGEST times the seconds to fill the set."""
    options = LocalOptions(
        patches=size,
        patch_level=0,
        bounces=bounces,
        outside=outside,
        shadow_rays=SHADOW_RAYS,
        swaps=FILLING,
        missing=0.0,
    )
    cameras = steps_of(load_path(PATH).cameras, steps)
    with opened(gpu, scene, AtlasOptions(density=DENSITY), LightmapOptions(), options, "local") as (_, made):
        assert isinstance(made, Local)
        find_direct(made)
        whole = whole_solution(made)
        made.set_observer(cameras[0].eye)
        fill(gpu, made, LONGEST * seconds)
        made.set_options(replace(options, swaps=LocalOptions().swaps))
        walked = walk(gpu, made, whole, cameras, LONGEST * seconds, every)
        row = times(gpu, made, seconds)
    row |= differences(walked)
    way = bounces if outside == "cascade" else f"{bounces}, {outside} outside"
    row |= {"size": size, "bounces": way, "patches": made.patches.count, "factors": whole.factors}
    if way == "inverse":
        row |= update_bound(gpu, size, seconds)
    if (size, bounces) == (SHCHERBAKOV_LOCAL.patches, "series"):
        theirs = SHCHERBAKOV_LOCAL
        row |= {"their_ms": theirs.ms, "their_mb": theirs.megabytes, "their_difference": theirs.difference}
    return row


def fill(gpu: Gpu, made: Local, seconds: float) -> None:
    """All nodes that are wanted enter the set. Raises UserError where that would take more than so many seconds."""
    start, begun, wanted = time.perf_counter(), 0, len(made.wanted)
    while not made.poll().converged:
        run_to_end(made.work(1))
        gpu.ctx.finish()
        if not begun:  # what comes before the first node enters is not of nodes
            start, begun = time.perf_counter(), made.issued
        elif made.issued >= wanted / FORETOLD:
            foreseen = (time.perf_counter() - start) * max(wanted / max(made.issued - begun, 1), 1.0)
            if foreseen > seconds:
                raise UserError(f"to fill the set would take about {foreseen:,.0f} s, more than {seconds:,.0f}")


def times(gpu: Gpu, made: Local, seconds: float) -> Row:
    """A swap is timed, lighting as the solver does it, and lighting as the paper compares it: one product with the matrix of
    several reflections, or the multiplications of plain radiosity."""
    swap = made.passes(1)["swap"]
    direct, multiplied = made.direct.light, not made.matrix.coloured
    light = median_ms(gpu, lambda: made.lighting.light(made.matrix, direct), seconds)
    plain = light
    if multiplied:
        plain = median_ms(gpu, lambda: made.lighting.light(made.matrix, direct, sweeps=PLAIN_SWEEPS), seconds)
    swap_ms = median_ms(gpu, swap, seconds)
    return {
        "swap_ms": swap_ms,
        "light_ms": light,
        "lit_ms": plain,
        "frame_ms": plain + swap_ms,
        "matrix_mb": made.matrix.memory / 2**20,
    }


def differences(walked: LocalWalk) -> Row:
    """The columns of a row that a walk fills in."""
    return {
        "step_ms": statistics.median(walked.step_ms),
        "swaps": walked.swapped / len(walked.step_ms),
        "indirect_inside": walked.indirect_inside.mean,
        "indirect_inside_p99": walked.indirect_inside.p99,
        "indirect_near": walked.indirect_near.mean,
        "indirect_near_p99": walked.indirect_near.p99,
        "indirect": walked.indirect.mean,
        "indirect_p99": walked.indirect.p99,
        "total_near": walked.total_near.mean,
        "total_near_p99": walked.total_near.p99,
        "total": walked.total.mean,
        "total_p99": walked.total.p99,
        "picture": walked.picture,
        "walk": walked.text,
    }


def update_bound(gpu: Gpu, size: int, seconds: float) -> Row:
    """An update of rank one is timed, and what may bound it."""
    found = rank_one_times(gpu, size, seconds)
    return {
        "update_ms": found.update,
        "copy_ms": found.copy,
        "constant_ms": found.constant,
        "vector_ms": found.vector,
    }


def measure_whole(gpu: Gpu, seconds: float, scene: str | Scene = SCENE, rays: int = RAYS) -> Row:
    """All patches are lit anew after a lamp was edited, by what the rays of each have hit."""
    options = GatheringOptions()
    with opened(gpu, scene, AtlasOptions(density=DENSITY), LightmapOptions(), options, "gathering") as (lightmap, made):
        assert isinstance(made, Gathering)
        while made.issued < rays:
            run_to_end(made.work(rays - made.issued))
        gpu.ctx.finish()
        both, taken = [edits_of(lightmap.scene)["emission"], lightmap.scene.materials], list[float]()
        for _ in range(EDITS + 1):
            start = time.perf_counter()
            made.set_materials(both[0])
            run_to_end(made.work(1))
            gpu.ctx.finish()
            taken.append((time.perf_counter() - start) * 1e3)
            both.reverse()
        theirs = SHCHERBAKOV_WHOLE
        return {
            "bounces": f"all, by kept hits of {made.hits.count} rays",
            "patches": lightmap.texel_count,
            "light_ms": statistics.median(taken[1:]),  # the first compiles what only edits draw
            "matrix_mb": made.hits.memory / 2**20,
            "their_ms": theirs.ms,
            "their_mb": theirs.megabytes,
        }


TABLE = Table(
    "shcherbakov",
    "The local matrix: village",
    SHCHERBAKOV,
    (
        f"Patches are unit faces, {SHADOW_RAYS} shadow rays from each. Swap: one node leaves and one enters, and the update of "
        f"the matrix. Lighting: one product with the matrix, of iterate {SWEEPS} sweeps; all patches: the light of an edited "
        "lamp, in all bounces. As theirs (figure 4): iterate is plain radiosity, "
        f"{PLAIN_SWEEPS} multiplications from nothing; frame: that, or the product, and one swap.",
        f"Walk: a piece of work for each of {STEPS} steps, every {EVERY}th compared with the whole solution, of all patches, the "
        "same rays and the same direct light: mean of |ΔH|, and what 99 % of texels are below, over the mean of H; in the set: "
        "of patches that are not in a cluster; near: within "
        f"{NEAR:g} m. Pixels: mean |Δ| of pictures of {PICTURE[0]}×{PICTURE[1]} as displayed, in [0, 1], all pixels. Left out: "
        f"what would take more than {LONGEST} times as long as another measurement, as the first {FORESEEN} steps foresee.",
        "Update: what waits of one leaving and one entering node, added to the half of the matrix that is kept; copy: as many "
        "bytes; constant: one colour blended over the same triangle; vector: what each vector more that waits adds.",
    ),
    (
        Column("size", "M", ","),
        Column("bounces", "bounces"),
        Column("patches", "patches of the world", ","),
        Column("swap_ms", "swap ms", ".2f"),
        Column("light_ms", "lighting ms", ".2f"),
        Column("their_ms", "their ms", "g"),
        Column("matrix_mb", "MiB", ".1f"),
        Column("their_mb", "their MB", ",g"),
        Column("lit_ms", "as theirs: lighting ms", ".2f"),
        Column("frame_ms", "and a swap", ".2f"),
        Column("step_ms", "step of the walk ms", ".1f"),
        Column("swaps", "swaps in it", ".1f"),
        Column("indirect_inside", "indirect, in the set", ".2%"),
        Column("indirect_inside_p99", "99 %", ".1%"),
        Column("indirect_near", "indirect, near", ".2%"),
        Column("indirect_near_p99", "99 %", ".1%"),
        Column("indirect", "indirect, all", ".2%"),
        Column("indirect_p99", "99 %", ".1%"),
        Column("total_near", "H, near", ".2%"),
        Column("total_near_p99", "99 %", ".1%"),
        Column("total", "H, all", ".2%"),
        Column("total_p99", "99 %", ".1%"),
        Column("picture", "pixels", ".4f"),
        Column("their_difference", "their pixels, below", "g"),
        Column("walk", "walk"),
        Column("update_ms", "update ms", ".2f"),
        Column("copy_ms", "copy ms", ".2f"),
        Column("constant_ms", "constant ms", ".2f"),
        Column("vector_ms", "vector ms", ".2f"),
    ),
    (
        *(
            (f"{size} {bounces}", partial(measure_row, size=size, bounces=bounces))
            for size in SIZES
            for bounces in BOUNCES
        ),
        ("constant outside", partial(measure_row, size=CONSTANT, bounces="inverse", outside="constant")),
        ("all patches", measure_whole),
    ),
    Plot("size", ("lit_ms", "frame_ms"), "bounces", ("M", "ms: lighting as theirs, and with a swap")),
    verdicts=verdicts,
)
