"""``glowtree bake``: solve and write scene.glb, irradiance.exr and report.json."""

from __future__ import annotations

import argparse
import contextlib
import itertools
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from app.bake import prepare_directory, write_bake
from app.bake.options import BakeOptions
from app.bake.own_layout import Laid, laid_out, why_not_kept
from app.commands.report import picture, report, summary
from app.commands.steps import estimate, open_scene, session_options, solve
from app.errors import UserError
from app.gpu import gpu_context
from app.lightmap.collapse import collapse
from app.lightmap.gutter import fill_gutter
from app.lightmap.seams import jumps
from app.options import from_flags
from app.session.session import Session
from app.solvers import SOLVERS
from app.util.console import Console

__all__ = ["bake"]


def bake(flags: argparse.Namespace) -> int:
    """Solve and write scene.glb, irradiance.exr and report.json. Raises UserError."""
    if not SOLVERS[flags.solver].everywhere:
        raise UserError(
            f"--solver {flags.solver}: it lights what is around an observer, and a bake is seen from everywhere"
        )
    console, files_asked = Console(quiet=flags.json), from_flags(BakeOptions, flags)
    with _folder(flags.output), gpu_context() as gpu:
        session = Session(gpu, **session_options(flags))
        open_scene(session, flags, console)
        failure = solve(session, flags, console)
        stopped = failure is not None or session.run.interrupted
        whole = stopped or estimate(session, flags, console)
        clock = time.perf_counter()
        lightmap = session.lightmap
        irradiance, covered = collapse(lightmap.pool, lightmap.irradiance(ambient=True))
        session.load_seconds["read back"] = time.perf_counter() - clock
        finite = np.asarray(np.isfinite(irradiance).all(-1))
        lost = int((covered & ~finite).sum())
        result = report(session) | picture(session) | {"texels_not_finite": lost}
        irradiance = np.where(finite[..., None], np.maximum(irradiance, 0), np.float32(0))  # no light is still owed
        laid = Laid(session.charts, irradiance, covered & finite)
        result |= _seams(laid)
        if not flags.unwrap and session.scene.uv1 is not None:
            against = why_not_kept(session.scene, laid)
            if against is None:
                laid = laid_out(session.scene, laid)
                result["atlas"] = list(laid.charts.size)
                note = f"the squares that {laid.squares} objects have in TEXCOORD_1 are placed side by side"
            else:
                note = f"the file's own layout, TEXCOORD_1, is not kept: {against}"
            if against is not None or laid.squares > 1:
                console.warn(note)
                result["warnings"].append(note)
        light = laid.charts, laid.irradiance, laid.covered
        files = write_bake(flags.output, session.scene, *light, result, files_asked, unedited=session.unedited)
        for note in files.notes:
            console.warn(note)
            result["warnings"].append(note)
        line = summary(session, result) + _at_seams(result)
        session.release()
    if failure is not None:
        raise UserError(f"{failure}; {flags.output} has the light of all texels but {lost}")
    result = {"output": [str(path) for path in files.paths], **result}
    console.result(result, f"{flags.output}: {line}")
    return 130 if result["interrupted"] or not whole else 0


def _seams(laid: Laid) -> dict[str, Any]:
    """How far light jumps at seams, before and after it was made one there, and beside them from texel to texel: over its mean,
    median and 90 % quantile. Nothing where there are none."""
    if not len(laid.charts.seams):
        return {}
    before = jumps(fill_gutter(laid.irradiance, laid.covered), laid.charts)
    after = jumps(laid.image, laid.charts)
    return {"seams": {"places": after.places, "before": before.across, "after": after.across, "beside": before.within}}


def _at_seams(result: dict[str, Any]) -> str:
    """The same, in words."""
    if "seams" not in result:
        return ""
    before, after, beside = (result["seams"][name][0] for name in ("before", "after", "beside"))
    return f", light jumps by {after:.1%} at seams ({before:.1%} before, {beside:.1%} between texels beside them)"


@contextlib.contextmanager
def _folder(path: Path) -> Iterator[None]:
    """A folder that can be written to; what was made of it is gone again if nothing came of it. Raises UserError."""
    made = list(itertools.takewhile(lambda folder: not folder.exists(), (path, *path.parents)))
    prepare_directory(path)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):  # not empty: that is the normal case
            for folder in made:
                folder.rmdir()
