"""``glowtree bake``: solve and write scene.glb, irradiance.exr and report.json."""

from __future__ import annotations

import argparse

from app.bake import check_options
from app.bake.options import BakeOptions
from app.commands.steps import estimate, open_scene, session_options, solve
from app.errors import UserError
from app.gpu import gpu_context
from app.options import from_flags
from app.session.bake import bake_folder, write_light
from app.session.checkpoint import CHECKPOINT_NAME, Checkpoint, CheckpointOptions
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
    console, how = Console(quiet=flags.json), from_flags(BakeOptions, flags)
    check_options(how)
    with bake_folder(flags.output), gpu_context() as gpu:
        session = Session(gpu, **session_options(flags))
        open_scene(session, flags, console)
        checkpoint = _checkpoint(session, flags, console)
        failure = solve(session, flags, console, checkpoint)
        stopped = failure is not None or session.run.interrupted
        whole = stopped or estimate(session, flags, console)
        baked = write_light(session, flags.output, how, unwrap=flags.unwrap)
        if not stopped:
            checkpoint.remove()
        session.release()
    for note in baked.notes:
        console.warn(note)
    if failure is not None:
        raise UserError(f"{failure}; {flags.output} has the light of all texels but {baked.lost}")
    result = {"output": [str(path) for path in baked.files.paths], **baked.result}
    console.result(result, f"{flags.output}: {baked.line}")
    return 130 if result["interrupted"] or not whole else 0


def _checkpoint(session: Session, flags: argparse.Namespace, console: Console) -> Checkpoint:
    """What keeps the light; with --resume the session goes on from what was kept before. Raises UserError."""
    seconds = from_flags(CheckpointOptions, flags).checkpoint
    checkpoint = Checkpoint(session, flags.output / CHECKPOINT_NAME, seconds, console.warn)
    if not flags.resume:
        if checkpoint.path.exists():
            console.warn(f"{flags.output} has a bake that was not finished: this one begins anew, --resume goes on")
    elif checkpoint.resume():
        run = session.run
        done = f"{run.progress.done} {session.family.unit}, {run.progress.remaining:.2%} {session.family.remains}"
        console.warn(f"goes on after {run.seconds:.0f} s: {done}")
    else:
        console.warn(f"{flags.output} has no bake to go on with: this one begins")
    return checkpoint
