"""How far pictures by the hemispheres are from the hemicube's, beside the RMS of lightmaps in [Wallner10, table 2]."""

from __future__ import annotations

from functools import partial

import numpy as np

from app.atlas.options import AtlasOptions
from app.bench.papers.published import WALLNER, WALLNER_TABLE_2, RmsRow
from app.bench.papers.table import SOLVE, Table
from app.gpu import Gpu
from app.lightmap.options import LightmapOptions
from app.session.run import Stop
from app.session.session import Session
from app.session.view import View
from app.solvers import ShootingOptions
from app.util.tables import FLIP, Column, Row, missing
from app.viewer.picture import picture
from app.visibility.projections import PROJECTIONS

SCENE = "cornell-box"
PICTURE = (640, 480)
CONVERGED = 0.01  # share unshot
ROOT_TEXELS = 2000 / 32**2  # of the Cornell box for each texel of a texture in [Wallner10, table 2]


def measure_row(gpu: Gpu, seconds: float, theirs: RmsRow) -> Row:
    """RMS and FLIP of the picture against the hemicube's for both hemispheres, at the same residual; none where time ran out, and
    no FLIP where it is not installed."""
    roots = round(ROOT_TEXELS * theirs.size**2) if theirs.level else round(ROOT_TEXELS * theirs.size**2 / 4)
    adaptive = theirs.subdivision == "adaptive"
    atlas = AtlasOptions(texels=roots if adaptive else roots << 2 * theirs.level)
    light = LightmapOptions(adaptive=adaptive, depth=theirs.level)
    row: Row = {"subdivision": theirs.subdivision, "level": theirs.level, "size": theirs.size}
    pictures, converged = {}, True
    session = Session(gpu, atlas=atlas, light=light)
    view = View(session)
    try:
        for name in PROJECTIONS:
            session.set_options(ShootingOptions(projection=name, residual=CONVERGED))
            session.open_now(SCENE)
            session.solve(Stop(seconds=SOLVE * seconds))
            if session.run.interrupted:
                raise KeyboardInterrupt
            converged = converged and session.run.converged
            pictures[name] = picture(view, PICTURE).astype(np.float64) / 255
            row |= {f"{name}_s": session.run.seconds, f"{name}_texels": session.lightmap.texel_count}
            row[f"{name}_unshot"] = session.run.progress.remaining
    finally:
        view.release()
        session.release()
    if converged:  # else the pictures differ by their shots
        for name in ("stereographic", "nonlinear"):
            row[f"{name}_rms"] = rms(pictures[name] - pictures["hemicube"])
            if not missing(FLIP):
                from app.bench.flip import flip

                row[f"{name}_flip"] = flip(pictures["hemicube"], pictures[name])
    return row | {"their_stereographic": theirs.stereographic, "their_nonlinear": theirs.nonlinear}


def rms(difference: np.ndarray) -> float:
    return float(np.sqrt(np.mean(difference**2)))


TABLE = Table(
    "wallner2",
    "Hemispheres against the hemicube: Cornell box",
    WALLNER.format("table 2: RMS of lightmaps"),
    (
        f"Ours: RMS and mean FLIP of the picture, sRGB from 0 to 1, each solved to {CONVERGED:.0%} unshot or, without them, for "
        f"{SOLVE} times the seconds of other measurements. Regular: uniform texels as fine as the finest leaves of adaptive "
        "ones. Theirs: RMS.",
    ),
    (
        Column("subdivision", "subdivision"),
        Column("level", "level"),
        Column("size", "their px"),
        Column("hemicube_texels", "texels", ","),
        Column("stereographic_rms", "stereographic", ".6f"),
        Column("nonlinear_rms", "nonlinear", ".6f"),
        Column("stereographic_flip", "stereographic FLIP", ".4f", FLIP),
        Column("nonlinear_flip", "nonlinear FLIP", ".4f", FLIP),
        *(Column(f"{name}_s", f"{name} s", ".1f") for name in PROJECTIONS),
        *(Column(f"{name}_unshot", "unshot", ".1%") for name in PROJECTIONS),
        Column("their_stereographic", "their stereographic", ".6f"),
        Column("their_nonlinear", "their nonlinear", ".6f"),
    ),
    tuple((f"{r.subdivision} {r.level}, {r.size} px", partial(measure_row, theirs=r)) for r in WALLNER_TABLE_2),
)
