"""Seconds per bounce and error of Kahl's modes by lightmap, window and visibility, and what they say of his conclusions [Kahl22].

His slides show pictures of a Cornell box in RTRad and state what he found; numbers there are none.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from app.atlas.cuts import cut_at_contacts
from app.atlas.options import AtlasOptions
from app.bench.papers.kahl_verdicts import verdicts
from app.bench.papers.published import KAHL
from app.bench.papers.table import SOLVE, Plot, Table
from app.errors import UserError
from app.gpu import Gpu
from app.lightmap.at_points import irradiance_of
from app.lightmap.options import LightmapOptions
from app.reference.irradiance import SAMPLES, ReferenceIrradiance, choose_reference, reference_irradiance
from app.reference.metrics import bias, median_local, relative_rms
from app.scene.load import load_scene
from app.scene.model import F64
from app.session.batch import opened
from app.solvers.pairs.options import BALANCED, PairsOptions
from app.solvers.pairs.solver import Pairs
from app.util.parts import run_to_end
from app.util.tables import Column, Row

SCENE = "cornell-box"
START = PairsOptions(
    senders="directional", directions=32
)  # every row begins with this light: a bounce averages its errors
START_BOUNCES = 6
BOUNCES = (
    3  # of a row from there: what a mode adds to or takes from all light has then come to nine tenths of what it will
)
CELLS = 5  # along the scene's longest edge: points of a cell are averaged, so that chance goes and artefacts stay
SMALL, LARGE = (64, 128), (256, 512)


@functools.cache
def reference() -> ReferenceIrradiance:
    """At random points of the scene. Takes a minute or more the first time."""
    scene = cut_at_contacts(load_scene(SCENE)).scene
    return reference_irradiance(scene, choose_reference(scene), SAMPLES, lambda text, share: None)


def measure_row(gpu: Gpu, seconds: float, size: int, options: PairsOptions) -> Row:
    """Seconds per bounce, and errors after BOUNCES of them. Raises UserError with what they would take where that is more than
    SOLVE times the seconds."""
    right = reference()
    with opened(gpu, SCENE, AtlasOptions(texels=size**2), LightmapOptions(), options, "pairs") as (lightmap, made):
        assert isinstance(made, Pairs)
        while made.issued == 0 and (made.foreseen is None or options.keep_pairs):  # to look up is cheaper than to find
            run_to_end(made.work(1))
        if (foreseen := BOUNCES * (made.foreseen or 0.0)) > SOLVE * seconds:
            raise UserError(f"{BOUNCES} bounces would take about {foreseen:,.0f} s, more than {SOLVE * seconds:,.0f}")
        made.reset()
        made.set_options(START)
        for _ in bounces(made, START_BOUNCES):
            pass
        made.set_options(options)
        times = list(bounces(made, BOUNCES))
        bounce = min(times[1:])  # the other one may have had to wait for something else
        facts = made.inspect().facts
        E = irradiance_of(lightmap, right.points)
        row: Row = {"size": size, "texels": lightmap.texel_count, "pairs": made.pairs}
        window = dict(made.resolved).get("window") if options.windowed else 1
    cells = cell_of(right)
    row |= {
        "mode": mode_name(options),
        "senders": options.senders,
        "window": window,
        "occlusion": occlusion_name(options),
        "kept": facts.get("Kept pairs"),
        "bounce_s": bounce,
        "once_s": max(times[0] - bounce, 0.0) if options.keep_pairs else None,
        "rms": relative_rms(E, right.E),
        "median": median_local(E[right.lit], right.E[right.lit]),
        "bias": bias(E, right.E),
        "even": relative_rms(means(E, cells), means(right.E, cells)),
    }
    other = "kept pairs" if options.keep_pairs else options.occlusion
    return row | {"series": f"{size}² {options.senders if other == 'rays' else other}"}


def bounces(solver: Pairs, count: int) -> Iterator[float]:
    """Make so many whole ones; the seconds of each."""
    for _ in range(count):
        start, before = time.perf_counter(), solver.issued
        while solver.issued == before:
            run_to_end(solver.work(1))
        yield time.perf_counter() - start


def cell_of(right: ReferenceIrradiance) -> Any:
    """(n,) a number for each cell of the room, and way that a surface faces, of the points."""
    scene = cut_at_contacts(load_scene(SCENE)).scene
    positions, normals = right.points.positions_normals(scene)
    lower, upper = scene.bounds
    cells = np.floor((positions - lower) / (upper - lower).max() * CELLS * 0.999).astype(np.int64)
    return np.unique(np.column_stack([cells, np.round(4 * normals).astype(np.int64)]), axis=0, return_inverse=True)[
        1
    ].ravel()


def means(values: F64, cells: Any) -> F64:
    """(c, 3) of the points of each cell."""
    counts = np.bincount(cells)
    return np.stack([np.bincount(cells, v) / counts for v in values.T], -1)


def mode_name(options: PairsOptions) -> str:
    return f"directional {options.directions}" if options.senders == "directional" else options.senders


def occlusion_name(options: PairsOptions) -> str:
    name = f"voxels {options.voxels}" if options.occlusion == "voxels" else options.occlusion
    return f"{name}, kept" if options.keep_pairs else name


def modes(size: int) -> Iterator[PairsOptions]:
    """What is measured of a lightmap of size² texels."""
    if size in SMALL:
        yield PairsOptions(senders="all")
    for window in (2, 4, 8) if size in SMALL else (max(size // BALANCED, 1), 16):
        for senders in ("stride", "monte-carlo", "mipmapped"):
            yield PairsOptions(senders=senders, window=window)
    window = 2 * size // SMALL[0]  # the same number of windows in all
    if size in SMALL:
        for cells in (64, 128):
            yield PairsOptions(senders="stride", window=window, occlusion="voxels", voxels=cells)
        yield PairsOptions(senders="stride", window=window, occlusion="hemicube")
        yield PairsOptions(senders="stride", window=window, keep_pairs=True)
        yield PairsOptions(senders="quadtree", window=window)
    for directions in (64, 256, 1024) if size in SMALL else (64, 256):
        yield PairsOptions(senders="directional", directions=directions)


def label(size: int, options: PairsOptions) -> str:
    window = f" {options.window}" if options.windowed else ""
    return f"{size}² {mode_name(options)}{window}, {occlusion_name(options)}"


TABLE = Table(
    "kahl",
    "Senders, windows and visibility: Cornell box",
    KAHL,
    (
        f"Seconds of a bounce, and errors of {BOUNCES} bounces that begin with the light along {START.directions} directions, at "
        "random points against the path-traced reference, or the dense one where Mitsuba is not installed. Modes are as in "
        "RTRad, without its constants: see app/solvers/pairs/solver.py.",
        f"Cells: RMS of means over cells, {CELLS} along the room: noise averages out, artefacts and lost light stay. Once: "
        "seconds to find what is kept of pairs. Left out: what would take longer than a solve may.",
    ),
    (
        Column("size", "lightmap²"),
        Column("texels", "texels", ","),
        Column("mode", "senders"),
        Column("window", "window"),
        Column("occlusion", "visibility"),
        Column("pairs", "pairs", ","),
        Column("bounce_s", "bounce s", ".2f"),
        Column("once_s", "once s", ".2f"),
        Column("kept", "kept"),
        Column("rms", "RMS", ".2%"),
        Column("median", "median", ".2%"),
        Column("even", "cells", ".2%"),
        Column("bias", "bias", "+.2%"),
    ),
    tuple(
        (label(size, options), partial(measure_row, size=size, options=options))
        for size in (*SMALL, *LARGE)
        for options in modes(size)
    ),
    Plot("bounce_s", ("rms",), "series", ("s per bounce", "relative RMS")),
    verdicts=verdicts,
)
