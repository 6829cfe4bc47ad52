"""A solver at work: paced in a window, or from the first piece of work to the last without one.

A run knows how long its solver has worked, how far it is, where the energy is, and how it came there. It draws nothing.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from app.errors import UserError
from app.gpu import Gpu
from app.scene.lights import Light
from app.scene.model import Material
from app.scene.sky import Sky
from app.session.energy import Effort, EnergyWatch
from app.session.history import COLUMNS, History
from app.session.pacing import Pacer
from app.session.time_left import TimeLeft
from app.solvers import EnergyBalance, Family, Progress, Solver
from app.solvers.run import solve_until
from app.util.interrupt import held_back
from app.util.parts import run_to_end
from app.util.rows import CAPACITY
from app.util.state import State, StateError

TELL_SECONDS = 0.2  # between two calls of progress
ASK_AGAIN = 1.5  # times as long as until the error was last estimated, when it is again
ASK_SHARE = 0.5  # of the time that was solved for, that one estimate may take
NEARLY = 0.99  # done, by what remains: something else may still change
NO_LIMIT = 1 << 30  # of work: a piece of it ends at its solver's own batch


class NotFiniteError(UserError):
    """The light has become infinite or no number."""


@dataclass(frozen=True)
class Stop:
    """When a solve ends, besides when it has converged; whichever comes first. work: in the solver's unit. error, rms: once the
    expected error, the median of local ones and the relative RMS, is as little as asked for [-]: both, where both are."""

    work: int | None = None
    seconds: float | None = None
    error: float | None = None
    rms: float | None = None

    @property
    def by_error(self) -> bool:
        return self.error is not None or self.rms is not None


class Keeper(Protocol):
    """Keeps the light of a solve that goes on: see checkpoint.py."""

    def between(self) -> None:
        """Between two pieces of work."""

    def write(self) -> None:
        """The solve is about to be stopped."""


NEVER = Stop()


class Run:
    """The solve of the open scene. ``begin`` gives it a solver; it releases nothing.

    running: whether ``advance`` works; resting: whether it does not for now, since something better to work on is on its way.
    seconds: of solving; earlier: of these, before the light was kept that it goes on from.
    interrupted: whether Ctrl-C ended the last ``solve``.
    furthest: share of the way down to what may remain, that the solve has come since it began or was edited. What remains grows
    for a while where light overshoots or leaves of quadtrees come; this does not. settled: whether progress, energy and history
    are those of the last piece of work.
    """

    def __init__(self, gpu: Gpu) -> None:
        self._gpu = gpu
        self.running, self.interrupted, self.settled = True, False, True
        self.resting = False
        self.seconds = self.earlier = 0.0
        self.history, self.effort = History(), Effort()
        self.solver: Solver[Any]
        self.family: Family
        self.progress = Progress(0, 1.0, np.zeros(3))
        self._pace, self._energy = Pacer(gpu), EnergyWatch()
        self._message: Callable[[str], str] = str
        self._noted = 0

    def begin(self, solver: Solver[Any], family: Family, message: Callable[[str], str]) -> None:
        """With another solver, from the light that there is now. message: of a solve whose light is
        not finite after so much work."""
        self.solver, self.family, self._message = solver, family, message
        self._energy.begin(solver.energy())
        self._start_clock()

    def restart(self) -> None:
        """Forget all light and begin again."""
        self.solver.reset()
        self._begin_again()

    def _begin_again(self) -> None:
        self._energy.begin_again()
        self._start_clock()

    def _start_clock(self) -> None:
        self.seconds = self.earlier = self.furthest = 0.0
        self.settled = True
        self.effort.begin()
        self._pace.begin()
        self._gpu.timers.reset()
        self.history = History()
        self.progress = self.solver.poll()
        self._noted = self.progress.done  # others ask the solver, too: what was heard is not what history has
        self.history.add(0, 0.0, self.progress.remaining, 0.0)

    # -- kept for later ------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """How long it has taken, and how it went."""
        return State({"seconds": self.seconds}, {"history": self.history.rows})

    def restore(self, state: State) -> None:
        """Count on from a ``state``, with the light that was restored. Waits for no report of it: they arrive when they would
        have. Raises StateError."""
        rows = state.array("history", np.float64, -1, len(COLUMNS))
        if len(rows) > CAPACITY:
            raise StateError(f"a history of {len(rows)} rows")
        self.history.rows = rows
        self.seconds = self.earlier = float(state.values["seconds"])
        self.progress = self.solver.poll()
        self._noted = self.progress.done
        self.effort.options_changed()
        self._energy.edited()
        self.settled = False

    # -- edits ---------------------------------------------------------------------------------------------------------

    def options_changed(self) -> None:
        """Other options of the solver, or of the leaves of its lightmap: what is left to do may be another."""
        self.effort.options_changed()
        self.progress, self.furthest = self.solver.poll(), 0.0

    def set_materials(self, materials: tuple[Material, ...]) -> None:
        """Other albedos and emissions: the light that is there stays where the solver can solve for the difference."""
        self._edit(lambda: self.solver.set_materials(materials))

    def set_sky(self, sky: Sky | None) -> None:
        """Another sky. Raises UserError."""
        self._edit(lambda: self.solver.set_sky(sky))

    def set_lights(self, lights: tuple[Light, ...]) -> None:
        """Other lamps without area. Raises UserError."""
        self._edit(lambda: self.solver.set_lights(lights))

    def _edit(self, edit: Callable[[], None]) -> None:
        converged, counts = self.converged, self.solver.inspect().counts
        edit()
        self.progress, self.furthest = self.solver.poll(), 0.0
        if self.solver.issued == 0:
            self._begin_again()
        else:
            self.effort.edited(self.solver.issued, counts, converged=converged)
        self.history.add(self.solver.issued, self.seconds, self.progress.remaining, self.escaped_share)
        self._energy.edited()
        self.settled = False

    def flicker(self, materials: tuple[Material, ...]) -> None:
        """Other emissions for this frame, of lamps that flicker: no edit that history and effort are told of, and the energy
        balance waits for the last."""
        self.solver.set_materials(materials)
        self.progress = self.solver.poll()
        self._energy.edited()
        self.settled = False

    # -- where it stands -----------------------------------------------------------------------------------------------

    @property
    def energy(self) -> EnergyBalance:
        """The last energy balance that was measured."""
        return self._energy.balance

    @property
    def converged(self) -> bool:
        return self.progress.converged

    @property
    def goes_on(self) -> bool:
        """Whether ``advance`` has something to do."""
        return self.running and not self.resting and not self.converged

    @property
    def escaped_share(self) -> float:
        return float(self.progress.escaped.sum()) / max(float(self.energy.emitted.sum()), 1e-300)

    def share_done(self, stop: Stop) -> float:
        """Of a solve: of the work or seconds asked for, or of the decades of what remains down to the threshold, 0 to 1."""
        threshold = min(float(getattr(self.solver.options, self.family.threshold)), 0.999999)
        remaining = min(max(self.progress.remaining, 1e-12), 1.0)
        way = float(np.log(remaining) / np.log(threshold)) + 0.0  # not -0
        shares = [1.0 if self.converged else min(way, NEARLY)]
        if stop.work is not None:
            shares.append(self.solver.issued / stop.work)
        if stop.seconds is not None:
            shares.append(self.seconds / stop.seconds)
        return float(min(max(shares), 1.0))

    # -- in a window ---------------------------------------------------------------------------------------------------

    def advance(self, *, fast: bool, interactive: bool) -> int:
        """Do one unit of work, or as much as a frame has time for, see ``Pacer.advance``; how much was issued."""
        self.settled = False
        to_end = self._energy.due and self._energy.may_measure(interactive=interactive)
        made = self._pace.advance(self.solver, fast=fast, interactive=interactive, to_end=to_end)
        self.seconds += self._pace.lap()
        return made

    def hold(self) -> None:
        """Something else has the time until the next ``advance``: it is none of solving."""
        self._pace.pause()

    @property
    def between(self) -> bool:
        """Whether no piece of work is under way."""
        return self._pace.between

    def drawn(self) -> None:
        """The frame is drawn, see ``Pacer.drawn``."""
        self._pace.drawn()

    def work(self, amount: int) -> int:
        """Up to so much work, of one batch at most, also when paused or converged; how much was issued."""
        self.settled = False
        return run_to_end(self.solver.work(amount))

    def poll(self, *, energy: bool = True, interactive: bool = False) -> bool:
        """Take in what the solver reports; the energy balance now and then, and once when solving has stopped. interactive: a
        hand is at the controls, what can wait does. Whether that took long. Raises NotFiniteError and pauses."""
        slow = False
        wanted = energy and self._energy.may_measure(interactive=interactive)
        self.progress = self.solver.poll()
        if self.running and not np.isfinite(self.progress.remaining):
            self.running = False
            raise self._not_finite()
        if not self.goes_on:
            self._pace.pause()
            if wanted and not self.settled:
                slow = True
                self.settle()
        elif wanted and self._energy.due and self._pace.between:
            slow = True
            self._energy.measure(self.solver)
            self.progress = self.solver.poll()  # of the moment of the balance: panels show both beside each other
        self.furthest = max(self.furthest, self.share_done(NEVER))
        if self.converged:
            self.effort.converged(self.progress.done)
        if self.progress.done != self._noted and not self.settled:
            self._noted = self.progress.done
            self.history.add(self.progress.done, self.seconds, self.progress.remaining, self.escaped_share)
        return slow

    def settle(self) -> None:
        """Wait for the GPU and bring progress, energy and history up to the last piece of work. Raises NotFiniteError, once."""
        known = np.isfinite(self.progress.remaining)
        self.progress = self.solver.settle()
        self.furthest = max(self.furthest, self.share_done(NEVER))
        self._energy.measure(self.solver)
        self.settled = True
        if self.energy.emitted.sum() > 0:
            self.history.add(self.solver.issued, self.seconds, self.progress.remaining, self.escaped_share)
            if known and not np.isfinite(self.progress.remaining + float(self.energy.absorbed.sum())):
                raise self._not_finite()

    # -- without a window ----------------------------------------------------------------------------------------------

    def solve(
        self,
        stop: Stop,
        tell: Callable[[], None] | None = None,
        good: Callable[[float], bool] | None = None,
        keeper: Keeper | None = None,
    ) -> None:
        """Work until ``stop``, or until converged; ``tell`` is called a few times a second. Ctrl-C ends it after the piece of
        work under way, a second one at once, and is noted as ``interrupted``. good: says whether settled light is as good as
        ``stop`` asks for, and may take about so many seconds; it is asked again once the solve has taken half as long again.
        keeper: of the light between pieces of work. Raises NotFiniteError; progress and energy are those of the last piece of
        work then, too."""
        start, failure = time.perf_counter() - self.earlier, None
        self.interrupted = False
        try:
            with held_back() as asked:
                self._solve(stop, start, tell, good, asked, keeper)
        except KeyboardInterrupt:
            self.interrupted = True
        except NotFiniteError as error:
            failure = error
        self._gpu.ctx.finish()
        self.seconds = time.perf_counter() - start
        self.settle()
        if failure is not None:
            raise failure

    def _solve(
        self,
        stop: Stop,
        start: float,
        tell: Callable[[], None] | None,
        good: Callable[[float], bool] | None,
        asked: Callable[[], bool],
        keeper: Keeper | None,
    ) -> None:
        told, ask_at, self.settled = start, 0.0, False
        left = None if stop.seconds is None else TimeLeft(stop.seconds, self.family.grain)

        def over(_: Progress) -> bool:
            nonlocal told, ask_at
            if left is not None and left.waits:
                self._gpu.ctx.finish()
            now = time.perf_counter()
            self.seconds = now - start
            self.poll(energy=False)
            if keeper is not None:
                (keeper.write if asked() else keeper.between)()
            if asked():
                self.interrupted = True
                return True
            if tell and now - told > TELL_SECONDS:
                told = now
                tell()
            if left is not None:
                left.piece(self.solver.issued, self.seconds)
                if left.over:
                    return True
            if self.converged:
                self.progress = (
                    self.solver.settle()
                )  # what had arrived is a piece of work old: the last may say otherwise
                return self.converged
            if good is None or self.solver.issued == 0 or self.seconds < ask_at:
                return False
            self.settle()
            enough = good(ASK_SHARE * self.seconds)
            self.seconds = time.perf_counter() - start
            if left is not None:
                left.piece(self.solver.issued, self.seconds)
            ask_at, self.settled = ASK_AGAIN * self.seconds, False
            return enough

        def batch() -> int:
            return NO_LIMIT if left is None else left.room(NO_LIMIT)

        solve_until(self.solver, batch, over, most=stop.work)

    def _not_finite(self) -> NotFiniteError:
        return NotFiniteError(self._message(self.family.words(self.progress.done)))
