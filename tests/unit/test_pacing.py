"""How much of a solve a frame does: a shot, or a band of one where it is slow; if fast as much as fits; less while a hand is at a
control."""

from __future__ import annotations

from collections.abc import Generator
from types import SimpleNamespace

import numpy as np
import pytest

from app.session import pacing
from app.session.history import History
from app.session.pacing import (
    EVEN_FAST,
    INTERACTIVE_FRAME,
    LEAST_BUDGET,
    LONG_FRAME,
    LONGEST_FAST,
    MOST,
    MOST_BANDS,
    SHORTEST_FAST,
    WATCH_BUDGET,
    Pacer,
)
from app.ui.state import WATCH_SECONDS, Pace

PART = 3.0  # ms of a part of a shot
PARTS = 40


class Clockwork:
    """A solver and its clock: a part takes so many milliseconds."""

    def __init__(self) -> None:
        self.now, self.calls, self.left = 1.0, [], PARTS

    def perf_counter(self) -> float:
        return self.now

    def work(self, amount: int, bands: int = 1) -> Generator[None, None, int]:
        if bands == 1:
            self.calls.append(("step", amount))
            return amount
        while self.left > 0:
            self.calls.append(("part", bands))
            self.now += PART * 1e-3
            self.left -= 1
            yield
        return amount


@pytest.fixture
def clockwork(monkeypatch: pytest.MonkeyPatch) -> Clockwork:
    work = Clockwork()
    monkeypatch.setattr(pacing, "time", work)
    return work


def pacer() -> Pacer:
    return Pacer(SimpleNamespace(ctx=SimpleNamespace(finish=lambda: None)))  # type: ignore[arg-type]


def frame(
    pace: Pacer, work: Clockwork, seconds: float, *, interactive: bool, fast: bool = False
) -> list[tuple[str, int]]:
    """What a frame that begins so long after the last one does."""
    work.now += seconds
    pace.drawn()
    work.calls.clear()
    pace.advance(work, fast=fast, interactive=interactive)  # type: ignore[arg-type]
    return list(work.calls)


@pytest.mark.parametrize(("interactive", "longest"), [(False, LONG_FRAME), (True, INTERACTIVE_FRAME)])
def test_short_frames_make_whole_shots_and_long_ones_bands(
    clockwork: Clockwork, interactive: bool, longest: float
) -> None:
    pace = pacer()
    for _ in range(3):
        assert frame(pace, clockwork, 0.9 * longest, interactive=interactive) == [("step", 1)]
    bands = []
    for _ in range(5):
        clockwork.left = 1  # the last part of a shot: the next one is cut into other bands
        bands.append(frame(pace, clockwork, 1.1 * longest, interactive=interactive)[0][1])
    assert bands == [2, 4, 8, MOST_BANDS, MOST_BANDS]
    clockwork.left = 1
    assert frame(pace, clockwork, 0.3 * longest, interactive=interactive) == [("part", MOST_BANDS // 2)]


def test_a_hand_gets_all_but_a_little_of_a_frame(clockwork: Clockwork) -> None:
    pace = pacer()
    frame(pace, clockwork, 0.0, interactive=False)
    idle = frame(pace, clockwork, 2 * LONG_FRAME, interactive=False)
    held = frame(pace, clockwork, 2 * LONG_FRAME, interactive=True)
    assert PART * len(idle) >= WATCH_BUDGET > PART * (len(idle) - 1)
    assert PART * len(held) >= LEAST_BUDGET > PART * (len(held) - 1)
    assert frame(pace, clockwork, 2 * LONG_FRAME, interactive=True, fast=True)[0][0] == "part"


@pytest.mark.parametrize("seconds", [0.02, 0.4, 3.0])
def test_work_per_second_is_that_of_late(seconds: float) -> None:
    """Whether a piece of work takes longer than the second or not, and with a last row that adds nothing."""
    history = History()
    for nth in range(10):
        history.add(16 * nth, seconds * nth, 0.5, 0.0)
    history.add(16 * 9, seconds * 9 + 1e-4, 0.4, 0.0)
    assert history.work_per_second() == pytest.approx(16 / seconds, rel=0.05)
    later = [history.work_per_second(9 * seconds + wait) for wait in (0.0, 20.0, 200.0)]
    assert later[0] >= later[1] >= later[2] and later[2] < 0.1 * later[0], "nothing was heard of since"


class Long:
    """A solver of which each unit is ten parts. parts: how many of them in this frame."""

    def __init__(self, clock: Clockwork) -> None:
        self.clock, self.parts = clock, 0

    def work(self, amount: int, bands: int = 1) -> Generator[None, None, int]:
        for _ in range(10):
            self.clock.now += PART * 1e-3
            self.parts += 1
            yield
        return amount


def held_frames(clock: Clockwork, rest: float, count: int) -> list[tuple[int, int]]:
    """Parts and units of each frame while a hand is at the controls, of which drawing takes so long [s]."""
    pace, solver, found = pacer(), Long(clock), []
    for _ in range(count):
        solver.parts = 0
        made = pace.advance(solver, fast=False, interactive=True)  # type: ignore[arg-type]
        found.append((solver.parts, made))
        clock.now += rest
        pace.drawn()
        clock.now += 0.004  # a screen that is waited for is not drawing
    return found


@pytest.mark.parametrize(("rest", "fits"), [(0.010, 7), (0.020, 4), (0.040, 2)])
def test_a_frame_with_a_hand_gets_what_drawing_leaves(clockwork: Clockwork, rest: float, fits: int) -> None:
    """The first two may take too long: nothing is known of units and parts."""
    parts = [parts for parts, _ in held_frames(clockwork, rest, 40)][2:]
    assert max(parts) <= fits, "a frame ends in time"
    assert np.mean(parts[5:]) > fits - 2, "and is used"


def test_a_frame_goes_on_with_the_next_unit(clockwork: Clockwork) -> None:
    """With one at most that it begins itself."""
    frames = held_frames(clockwork, 0.010, 40)[5:]
    short = [parts for parts, made in frames if made]
    assert len(short) > 5 and min(short) >= 5
    assert all(made <= 1 for _, made in frames)


class Batches:
    """A solver whose batches of eight take so many milliseconds, in so many parts; over: units after which it has converged."""

    def __init__(self, clock: Clockwork, batch: float, parts: int = 4, over: int = 1 << 30) -> None:
        self.clock, self.batch, self.parts, self.over = clock, batch, parts, over
        self.made, self.asked = 0, set[int]()

    def work(self, amount: int, bands: int = 1) -> Generator[None, None, int]:
        self.asked.add(amount)
        shots = min(amount, 8)
        for _ in range(self.parts * bands):
            self.clock.now += self.batch * 1e-3 / (self.parts * bands)
            yield
        self.made += shots
        return shots

    def poll(self) -> SimpleNamespace:
        return SimpleNamespace(converged=self.made >= self.over)


def fast_frames(clock: Clockwork, solver: Batches, rest: float, count: int = 60) -> tuple[float, float]:
    """Milliseconds of the longest of so many fast frames, of which drawing takes so long, and the share of them that solves."""
    pace, longest, solved, whole = pacer(), 0.0, 0.0, 0.0
    for nth in range(count):
        start = clock.now
        pace.advance(solver, fast=True)  # type: ignore[arg-type]
        worked = clock.now - start
        clock.now += rest * 1e-3
        pace.drawn()
        if nth >= 10:  # nothing is known of drawing and batches at first
            longest, solved, whole = max(longest, clock.now - start), solved + worked, whole + clock.now - start
    return longest * 1e3, solved / whole


@pytest.mark.parametrize("batch", [0.4, 3.0, 20.0, 300.0])
@pytest.mark.parametrize(
    ("rest", "share", "longest"), [(1.0, 0.9, SHORTEST_FAST), (12.0, 0.7, 4 * 12.0), (30.0, 0.5, LONGEST_FAST)]
)
def test_fast_frames_solve_for_most_of_their_time(
    clockwork: Clockwork, batch: float, rest: float, share: float, longest: float
) -> None:
    """Whether a batch is a small part of a frame or takes several."""
    solver = Batches(clockwork, batch, parts=4 if batch < 100 else 60)
    took, solved = fast_frames(clockwork, solver, rest)
    assert solved >= share
    assert took <= longest + 6.0, "no longer than a part more"
    assert solver.asked == {1, MOST}, "first one unit, then batches as large as the solver makes them"


def test_solving_gets_as_long_as_drawing_where_that_is_slow(clockwork: Clockwork) -> None:
    took, solved = fast_frames(clockwork, Batches(clockwork, 8.0), 45.0)
    assert 0.45 <= solved <= 0.55 and took <= EVEN_FAST + 3.0


def test_a_fast_frame_ends_with_the_solve(clockwork: Clockwork) -> None:
    for batch in (0.4, 20.0):
        pace, solver = pacer(), Batches(clockwork, batch, over=24)
        for _ in range(6):
            pace.advance(solver, fast=True)  # type: ignore[arg-type]
            clockwork.now += 0.001
        assert 24 <= solver.made <= 24 + 5 * 8, "one batch for each frame that asks once more"


def test_a_frame_begins_no_piece_where_somebody_waits_for_the_end_of_one(clockwork: Clockwork) -> None:
    pace, solver = pacer(), Batches(clockwork, 20.0)
    pace.advance(solver, fast=True)  # type: ignore[arg-type]
    assert not pace.between and solver.made == 0
    for _ in range(8):
        pace.advance(solver, fast=True, to_end=True)  # type: ignore[arg-type]
        if pace.between:
            break
    assert pace.between and solver.made == 1, "the unit that comes first"


def test_one_watches_first_and_then_it_is_fast() -> None:
    assert not Pace().is_fast(0.9 * WATCH_SECONDS) and Pace().is_fast(WATCH_SECONDS)
    assert Pace("fast").is_fast(0.0) and not Pace("watch").is_fast(100.0)
