"""A bake from the window: the open session solves on until its light is as good as asked, and then it is written.

It is the light that one sees. Nothing waits: surfaces are cut, checkpoints and files written in threads of their own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from app.atlas.options import AtlasOptions
from app.bake import check_options, prepare_directory
from app.bake.options import BakeOptions
from app.errors import UserError
from app.options import Options, option
from app.session.bake import Baked, check_parts, take_light, write_taken
from app.session.checkpoint import CHECKPOINT_NAME, Checkpoint, CheckpointOptions
from app.session.error_estimate import SECONDS
from app.session.goal import options_for_error
from app.session.light_state import restore_light, settings_of
from app.session.run import Stop
from app.session.session import Session
from app.util.background import BackgroundTask
from app.util.state import State, fitting
from app.util.state_file import read_state

NEVER = Stop()
ORDER = "order"  # of a bake, in its checkpoint
FIXED = "they are being baked; stop the bake first"
ASK_AGAIN = 1.5  # times as long as until the error was last estimated, when it is again
FIRST_LOOK = 5.0  # s of solving, before the first
ASK_SHARE = 0.5  # of the time that was solved for, that one estimate may take
CUTTING, READING, SOLVING, JUDGING, WRITING, DONE, STOPPED = (
    "cutting into texels",
    "reading the checkpoint",
    "solving",
    "estimating the error",
    "writing",
    "done",
    "stopped",
)


@dataclass(frozen=True)
class Goal(Options):
    """When a bake is done, besides when as little remains as the solver's options ask for."""

    error: float | None = option(
        None,
        "write the light once its expected error, the median, is so much",
        unit="%",
        minimum=0.05,
        maximum=50,
        logarithmic=True,
        label="Error at most",
        tip="The bake is done once half of all texels are expected to be off by no more than this; without it, once as little "
        "remains as is asked for above. Half the error takes up to four times as long",
    )


@dataclass(frozen=True)
class Order:
    """What is asked of a bake. atlas: how surfaces are to be cut; None as they are. look: how the files are to be shown, see
    ``report.look_of``; None as the viewer would at first."""

    folder: Path
    goal: Goal = field(default_factory=Goal)
    files: BakeOptions = field(default_factory=BakeOptions)
    keep: CheckpointOptions = field(default_factory=CheckpointOptions)
    atlas: AtlasOptions | None = None
    look: Mapping[str, Any] | None = None


class Baking:
    """One bake of the open session. ``poll`` is called once per frame.

    stage: one of those above. baked: what was written. note: what the user should know, if anything. Raises UserError where it
    cannot begin.
    """

    def __init__(self, session: Session, order: Order, *, resume: bool = False) -> None:
        """resume: go on with the bake that was not finished in the folder, with its settings."""
        self._session, self.order = session, order
        self.baked: Baked | None = None
        self.note: str | None = None
        self._writing: BackgroundTask[Baked] | None = None
        self._reading: BackgroundTask[State] | None = None
        self._kept: State | None = None
        self._scene = session.unedited
        self._ask_at, self._whole = FIRST_LOOK, False
        why = why_not(session)
        if why is not None:
            raise UserError(why)
        check_options(order.files)
        check_parts(session.family, order.files)
        prepare_directory(order.folder)
        session.fixed = FIXED
        path = order.folder / CHECKPOINT_NAME
        self._checkpoint = Checkpoint(
            session, path, order.keep.checkpoint, self._say, aside=True, beside=_kept_of(order)
        )
        if resume:
            self._reading, self.stage = BackgroundTask(str(path), lambda tell: read_state(path)), READING
        else:
            self._cut(order.atlas)

    def _say(self, note: str) -> None:
        self.note = note

    # -- once per frame ------------------------------------------------------------------------------------------------

    def poll(self) -> None:
        """Do what there is to do next."""
        try:
            if self.active and not (self._session.opened and self._session.unedited is self._scene):
                self._end("another scene was opened")
            elif self.stage == READING:
                self._take_settings()
            elif self.stage == CUTTING:
                self._wait_for_texels()
            elif self.stage == SOLVING:
                self._solve()
            elif self.stage == JUDGING:
                self._judge()
            elif self.stage == WRITING:
                self._wait_for_files()
        except UserError as error:
            self._end(str(error))

    def _take_settings(self) -> None:
        """Solve by the settings of the light that was kept."""
        assert self._reading is not None
        if not self._reading.ended:
            return
        session, state = self._session, self._reading.result
        settings = settings_of(state)
        session.set_options_of(settings.solver, settings.options)
        session.set_solver(settings.solver)
        session.set_light(settings.light.replace(adaptive=session.light.adaptive))
        self._kept, self.order = state, _order_of(state, self.order)
        self._checkpoint.beside = _kept_of(self.order)
        check_options(self.order.files)
        self._cut(settings.atlas, adaptive=settings.light.adaptive)

    def _cut(self, atlas: AtlasOptions | None, *, adaptive: bool | None = None) -> None:
        session = self._session
        other = adaptive is not None and adaptive != session.light.adaptive
        if (atlas is not None and atlas != session.atlas) or other:
            session.cut_anew(atlas or session.atlas, adaptive=adaptive)
        self.stage = CUTTING

    def _wait_for_texels(self) -> None:
        """Until surfaces are cut and the solver is there; then go on from what was kept, if anything was."""
        session = self._session
        if session.on_its_way is not None:
            return
        wanted = self.order.atlas if self._kept is None else settings_of(self._kept).atlas
        if wanted is not None and wanted != session.atlas:
            raise UserError("surfaces were not cut as it asks for")
        if self._kept is not None:
            restore_light(session, self._kept)
            self._kept = None
        if self.order.goal.error is not None:
            session.set_options(options_for_error(session.family, session.options, self.order.goal.error / 100))
        session.run.running, session.run.interrupted = True, False
        self._ask_at = max(ASK_AGAIN * session.run.seconds, FIRST_LOOK)
        self._checkpoint.begin()
        self.stage = SOLVING

    def _solve(self) -> None:
        run = self._session.run
        if not np.isfinite(run.progress.remaining):
            raise UserError("the light is not finite")
        if run.converged:
            self._whole, self.stage = True, JUDGING
        elif self.order.goal.error is not None and run.running and run.seconds >= self._ask_at:
            run.running, self._whole, self.stage = False, False, JUDGING
            self._session.estimate.seconds = ASK_SHARE * run.seconds
        elif run.running:
            self._checkpoint.between()

    def _judge(self) -> None:
        """Wait until the error is known; write the light if it is good, or if it does not become any better."""
        session, goal = self._session, self.order.goal.error
        if not session.at_rest:
            return
        good = session.expected is not None and goal is not None and session.expected.within(median=goal / 100)
        if not (good or self._whole):
            self._ask_at = ASK_AGAIN * session.run.seconds
            session.run.running, self.stage = True, SOLVING
            return
        if goal is not None and not good and session.expected is not None:
            end = f"{session.family.remains} and texels end at"
            self._say(f"an error of {goal:g} % was not reached: {end} {session.expected.median:.1%}")
        self._write()

    def _write(self) -> None:
        taken, order = take_light(self._session, parts=self.order.files.parts, look=self.order.look), self.order
        self._writing = BackgroundTask("this bake", lambda tell: write_taken(taken, order.folder, order.files))
        self.stage = WRITING

    def _wait_for_files(self) -> None:
        assert self._writing is not None
        if self._writing.ended:
            self.baked = self._writing.result
            self._session.estimate.seconds = SECONDS
            if self.baked.result["interrupted"]:
                self._checkpoint.close()
            else:
                self._checkpoint.remove()
            self.stage, self._session.fixed = DONE, None
            self.note = "; ".join((*([self.note] if self.note else ()), *self.baked.notes)) or None

    # -- how far it is -------------------------------------------------------------------------------------------------

    @property
    def active(self) -> bool:
        return self.stage not in (DONE, STOPPED)

    @property
    def share(self) -> float:
        """The share of the solve that is done."""
        return 1.0 if self.stage in (JUDGING, WRITING) and self._whole else self._session.run.share_done(NEVER)

    # -- ending it early -----------------------------------------------------------------------------------------------

    def stop(self) -> None:
        """Solve and write no further. The light stays as it is, in the session and in a checkpoint."""
        if self.stage in (SOLVING, JUDGING):
            self._session.run.running = False
            self._checkpoint.write()
            self._end("stopped: its light is kept, and Go on goes on with it")
        elif self.stage == CUTTING and self._session.loading is not None:
            self._session.loading.cancel()
            self._end("stopped")
        elif self.stage != WRITING:
            self._end("stopped")

    def write_now(self) -> None:
        """Write the light as it is."""
        if self.stage in (SOLVING, JUDGING):
            self._session.run.running, self._session.run.interrupted = False, True
            self._checkpoint.write()
            self._write()

    def _end(self, why: str) -> None:
        self._checkpoint.close()
        self.stage, self.note, self._session.fixed = STOPPED, why, None

    def release(self) -> None:
        """Wait for what is being written."""
        if self._writing is not None:
            _ = self._writing.ended or self._writing.result
        self._checkpoint.close()


def _kept_of(order: Order) -> dict[str, Any]:
    """What of an order is kept with the light: when to stop, and which files."""
    return {ORDER: {"goal": order.goal.as_dict(), "files": order.files.as_dict()}}


def _order_of(state: State, order: Order) -> Order:
    """The order that light was kept of, in the folder and as often as this one says; this one where none was kept, as by a
    command. Raises UserError for one that is damaged."""
    if ORDER not in state.values:
        return order
    with fitting():
        kept = state.values[ORDER]
        return replace(order, goal=Goal(**kept["goal"]), files=BakeOptions(**kept["files"]))


def why_not(session: Session) -> str | None:
    """Why the open session cannot bake, if so."""
    if not session.family.everywhere:
        return f"{session.family.title} lights what is around an observer, and a bake is seen from everywhere"
    return None if session.edited_scene.emits else "nothing emits light"


__all__ = ["Baking", "Goal", "Order", "why_not"]
