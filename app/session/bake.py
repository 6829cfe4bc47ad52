"""The light of an open session as the files of a bake: the command writes them, and so does the window."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from app.bake import BakeFiles, prepare_directory, write_bake
from app.bake.options import BakeOptions
from app.bake.own_layout import Laid, laid_out, why_not_kept
from app.errors import UserError
from app.lightmap.collapse import collapse
from app.lightmap.gutter import fill_gutter
from app.lightmap.seams import jumps
from app.scene.model import Scene
from app.session.report import picture, report, summary
from app.session.session import Session
from app.session.texel_use import texel_note, texel_use
from app.solvers import SOLVERS, Family

__all__ = ["Baked", "Taken", "bake_folder", "check_parts", "take_light", "write_light", "write_taken"]


@dataclass(frozen=True, eq=False)
class Taken:
    """The light of a session at one moment, ready to be written: what is to be read of the GPU has been. scene: as edited;
    unedited: its surfaces, but materials, lights and sky as they were read. result, line: the report so far, and that in a line.
    notes: what the user should know; lost: texels whose light is no number."""

    scene: Scene
    unedited: Scene
    light: Laid
    result: dict[str, Any]
    line: str
    notes: tuple[str, ...]
    lost: int


@dataclass(frozen=True, eq=False)
class Baked:
    """The files of a bake, its report, that in a line, what the user should know, and how many texels' light is no number."""

    files: BakeFiles
    result: dict[str, Any]
    line: str
    notes: tuple[str, ...]
    lost: int


def write_light(session: Session, folder: Path, how: BakeOptions, *, unwrap: bool = False) -> Baked:
    """Write the light as it is now, with the scene as it was edited. unwrap: not by the file's own layout. Waits for the GPU.
    Raises UserError."""
    return write_taken(take_light(session, parts=how.parts), folder, how, unwrap=unwrap)


def check_parts(family: Family, options: BakeOptions) -> None:
    """Raise UserError where the parts of the light are asked for that the solver does not know."""
    if options.parts and "direct" not in family.layers:
        able = " or ".join(other.title for other in SOLVERS.values() if other.everywhere and "direct" in other.layers)
        raise UserError(f"--parts: {family.title} does not know direct and indirect light apart, {able} does")


def take_light(session: Session, *, parts: bool = False, look: Mapping[str, Any] | None = None) -> Taken:
    """The light as it is now, with the scene as it was edited. parts: its direct part, too. look: how it is to be shown, as the
    viewer would if None. Waits for the GPU."""
    clock = time.perf_counter()
    lightmap = session.lightmap
    lightmap.refresh_ambient(wait=True)
    session.run.progress = session.solver.poll()  # which tells where there can be no ambient term
    light = [lightmap.irradiance(ambient=True)]
    if parts:
        light.append(np.clip(lightmap.light_of(session.solver.layers["direct"]), 0, light[0]))
    irradiance, covered = collapse(lightmap.pool, np.concatenate(light, axis=-1))
    session.load_seconds["read back"] = time.perf_counter() - clock
    finite = np.asarray(np.isfinite(irradiance).all(-1))
    lost = int((covered & ~finite).sum())
    result = report(session) | dict(look or picture(session)) | {"texels_not_finite": lost}
    uses = texel_use(session, light[0])
    notes = tuple(note for note in (texel_note(uses),) if note is not None)
    result["texel_use"] = [dataclasses.asdict(use) for use in uses]
    result["warnings"] = [*result["warnings"], *notes]
    irradiance = np.where(finite[..., None], np.maximum(irradiance, 0), np.float32(0))  # no light is still owed
    laid = Laid(session.charts, irradiance, covered & finite)
    unedited = _as_read(session)
    return Taken(session.edited_scene, unedited, laid, result, summary(session, result), notes, lost)


def _as_read(session: Session) -> Scene:
    """The surfaces that are open, with materials, lights and sky as they were read."""
    scene, read = session.unedited, session.read
    materials = (*read.materials, *scene.materials[len(read.materials) :])
    return scene.with_materials(materials).with_lights(read.lights).with_sky(read.sky)


def write_taken(taken: Taken, folder: Path, how: BakeOptions, *, unwrap: bool = False) -> Baked:
    """Write light that was taken, in any thread. Raises UserError."""
    laid, result = taken.light, dict(taken.result)
    result |= _seams(laid)
    result["parameters"] = {**result["parameters"], "bake": {**how.as_dict(), "unwrap": unwrap}}
    notes = taken.notes
    if not unwrap and taken.scene.uv1 is not None:
        laid, of_layout = _own_layout(taken.scene, laid)
        result["warnings"], notes = [*result["warnings"], *of_layout], (*notes, *of_layout)
    light = laid.charts, laid.irradiance, laid.covered
    files = write_bake(folder, taken.scene, *light, result, how, unedited=taken.unedited)
    result |= {"atlas": list(files.atlas), "pages": files.pages, "warnings": [*result["warnings"], *files.notes]}
    return Baked(files, result, taken.line + _at_seams(result), (*notes, *files.notes), taken.lost)


def _own_layout(scene: Scene, laid: Laid) -> tuple[Laid, tuple[str, ...]]:
    """The light as the file's own layout has it, where that will do, and what there is to say of it."""
    against = why_not_kept(scene, laid)
    if against is not None:
        return laid, (f"the file's own layout, TEXCOORD_1, is not kept: {against}",)
    own = laid_out(scene, laid)
    squares = f"the squares that {own.squares} objects have in TEXCOORD_1 are placed side by side"
    return own, (squares,) if own.squares > 1 else ()


def _seams(laid: Laid) -> dict[str, Any]:
    """How far light jumps at seams, before and after it was made one there, and beside them from texel to texel: over its mean,
    median and 90 % quantile. Nothing where there are none."""
    if not len(laid.charts.seams):
        return {}
    before = jumps(fill_gutter(laid.irradiance[..., :3], laid.covered), laid.charts)
    after = jumps(laid.image[..., :3], laid.charts)
    return {"seams": {"places": after.places, "before": before.across, "after": after.across, "beside": before.within}}


def _at_seams(result: dict[str, Any]) -> str:
    """The same, in words."""
    if "seams" not in result:
        return ""
    before, after, beside = (result["seams"][name][0] for name in ("before", "after", "beside"))
    return f", light jumps by {after:.1%} at seams ({before:.1%} before, {beside:.1%} between texels beside them)"


@contextlib.contextmanager
def bake_folder(path: Path) -> Iterator[None]:
    """A folder that can be written to; what was made of it is gone again if nothing came of it. Raises UserError."""
    made = list(itertools.takewhile(lambda folder: not folder.exists(), (path, *path.parents)))
    prepare_directory(path)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):  # not empty: that is the normal case
            for folder in made:
                folder.rmdir()
