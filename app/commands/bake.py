"""``glowtree bake``: solve and write scene.glb, irradiance.exr and report.json."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from app.bake import REPORT_NAME, check_options
from app.bake.options import BakeOptions
from app.commands.steps import estimate, open_scene, session_options, solve
from app.errors import UserError
from app.gpu import gpu_context
from app.options import from_flags
from app.scene.options import FileOptions
from app.session.bake import Baked, bake_folder, check_parts, write_light
from app.session.checkpoint import CHECKPOINT_NAME, Checkpoint, CheckpointOptions
from app.session.session import Session
from app.solvers import SOLVERS
from app.util.console import Console

__all__ = ["bake"]

LEFT = tuple({family.threshold for family in SOLVERS.values()})  # names of what remains, in a report


def bake(flags: argparse.Namespace) -> int:
    """Solve and write scene.glb, irradiance.exr and report.json; of several scenes, into a folder for each. Raises UserError."""
    if not SOLVERS[flags.solver].everywhere:
        raise UserError(
            f"--solver {flags.solver}: it lights what is around an observer, and a bake is seen from everywhere"
        )
    check_options(from_flags(BakeOptions, flags))
    check_parts(SOLVERS[flags.solver], from_flags(BakeOptions, flags))
    console = Console(quiet=flags.json)
    if len(flags.scenes) > 1:
        return _all(flags, console)
    only = _for_scene(flags, flags.scenes[0], flags.output)
    done = _done(only)
    if done is not None:
        *_, left, _, state = _row(flags.scenes[0], done)
        console.result(done, f"{flags.output}: finished already ({state}, {left}); without --resume it is baked anew")
        return 0
    baked, whole = _one(only, console)
    console.result(baked.result, f"{flags.output}: {baked.line}")
    _say_resume([flags.output], console)
    return _code(baked, whole)


def _say_resume(folders: Sequence[Path], console: Console) -> None:
    """That bakes which were stopped can go on, where that is so."""
    if any((folder / CHECKPOINT_NAME).exists() for folder in folders):
        console.warn("stopped: the same line with --resume goes on from here")


def _one(flags: argparse.Namespace, console: Console) -> tuple[Baked, bool]:
    """One scene; what was written, and whether all was done. Raises UserError."""
    with bake_folder(flags.output), gpu_context() as gpu:
        session = Session(gpu, **session_options(flags))
        try:
            open_scene(session, flags, console)
            checkpoint = _checkpoint(session, flags, console)
            failure = solve(session, flags, console, checkpoint)
            stopped = failure is not None or session.run.interrupted
            whole = stopped or estimate(session, flags, console)
            baked = write_light(session, flags.output, from_flags(BakeOptions, flags), unwrap=flags.unwrap)
            if not stopped:
                checkpoint.remove()
        finally:
            session.release()
    for note in baked.notes:
        console.warn(note)
    if failure is not None:
        raise UserError(f"{failure}; {flags.output} has the light of all texels but {baked.lost}")
    output = {"output": [str(path) for path in baked.files.paths]}
    return replace(baked, result={**output, **baked.result}), whole


def _all(flags: argparse.Namespace, console: Console) -> int:
    """Each scene in a folder of its name; one that cannot be baked is said, and the next follows. Ctrl-C ends all. Raises
    UserError for two of one name."""
    folders = [flags.output / Path(scene).stem for scene in flags.scenes]
    twice = next((folder for folder in folders if folders.count(folder) > 1), None)
    if twice is not None:
        raise UserError(f"{twice}: two of the scenes would have this folder; bake them one by one")
    rows: list[tuple[str, ...]] = [("scene", "texels", "seconds", "left", "expected error", "")]
    results, codes = [], []
    for scene, folder in zip(flags.scenes, folders, strict=True):
        done = _done(_for_scene(flags, scene, folder))
        if done is not None:
            results.append(done)
            rows.append((*_row(scene, done)[:-1], "finished already"))
            codes.append(0)
            continue
        try:
            baked, whole = _one(_for_scene(flags, scene, folder), console)
        except UserError as error:
            print(f"glowtree: {error}", file=sys.stderr)
            results.append({"scene": scene, "failed": str(error)})
            rows.append((scene, "", "", "", "", "failed"))
            codes.append(2)
            continue
        except KeyboardInterrupt:
            codes.append(130)
            break
        results.append(baked.result)
        rows.append(_row(scene, baked.result))
        codes.append(_code(baked, whole))
        if codes[-1] == 130:
            break
    for scene in flags.scenes[len(results) :]:
        rows.append((scene, "", "", "", "", "not baked"))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    table = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    console.result({"bakes": results}, "\n".join(table))
    _say_resume(folders, console)
    return max(codes)


def _done(flags: argparse.Namespace) -> dict[str, Any] | None:
    """With --resume, the report of a bake of this scene with these settings that was finished, whose files are there and newer
    than the scene's."""
    path = flags.output / REPORT_NAME
    if not flags.resume or (flags.output / CHECKPOINT_NAME).exists() or not path.exists():
        return None
    try:
        report = json.loads(path.read_text(encoding="utf-8"))
        asked, was = session_options(flags), report["parameters"]
        options = {name: value for name, value in asked["options"].as_dict().items() if value is not None}
        same = (
            not report["interrupted"]
            and (was["solver"], was["light"]) == (flags.solver, flags.light)
            and (was["atlas"], was["lightmap"]) == (asked["atlas"].as_dict(), asked["light"].as_dict())
            and options.items() <= was[flags.solver].items()
            and was["file"] == from_flags(FileOptions, flags).as_dict()
            and was["given_sky"] == (None if asked["sky"] is None else asked["sky"].as_dict())
            and was["bake"] == {**from_flags(BakeOptions, flags).as_dict(), "unwrap": flags.unwrap}
            and all((flags.output / name).is_file() for name in report["files"])
        )
        source = Path(report["source"])
        newer = source.exists() and source.stat().st_mtime > path.stat().st_mtime
        _row(flags.scene, report)
    except (OSError, ValueError, LookupError, TypeError, AttributeError, StopIteration):  # no report of ours
        return None
    return {**report, "done_before": True} if same and not newer else None


def _row(scene: str, result: dict[str, Any]) -> tuple[str, ...]:
    """A line of the table."""
    expected, seconds = result.get("expected_error"), sum(result["seconds"].values())
    state = "stopped early" if result["interrupted"] else "converged" if result["converged"] else "stopped as asked"
    left = next(f"{result[name]:.2%} {name}" for name in LEFT if name in result)
    error = "" if expected is None else f"{expected['median']:.1%} median, {expected['rms']:.1%} RMS"
    return scene, str(result["texels"]), f"{seconds:.1f}", left, error, state


def _for_scene(flags: argparse.Namespace, scene: str, folder: Path) -> argparse.Namespace:
    return argparse.Namespace(**{**vars(flags), "scene": scene, "output": folder})


def _code(baked: Baked, whole: bool) -> int:
    return 130 if baked.result["interrupted"] or not whole else 0


def _checkpoint(session: Session, flags: argparse.Namespace, console: Console) -> Checkpoint:
    """What keeps the light; with --resume the session goes on from what was kept before. Raises UserError."""
    seconds = from_flags(CheckpointOptions, flags).checkpoint
    checkpoint = Checkpoint(session, flags.output / CHECKPOINT_NAME, seconds, console.warn)
    if not flags.resume:
        if checkpoint.path.exists():
            console.warn(f"{flags.output} has a bake that was not finished: this one begins anew, --resume goes on")
    elif checkpoint.resume():
        run = session.run
        done = f"{session.family.words(run.progress.done)}, {run.progress.remaining:.2%} {session.family.remains}"
        console.warn(f"goes on after {run.seconds:.0f} s: {done}")
    else:
        console.warn(f"{flags.output} has no bake to go on with: this one begins")
    return checkpoint
