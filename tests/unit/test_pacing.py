"""How much of a solve a frame does: whole shots where they are fast, else bands of one; less while a hand is at a control."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from app.session import pacing
from app.session.pacing import BRISK_BUDGET, BRISK_FRAME, LONG_FRAME, MOST_BANDS, Pacer

PART = 3.0  # ms of a part of a shot
PARTS = 40


class Clockwork:
    """A solver and its clock: a part takes so many milliseconds."""

    def __init__(self) -> None:
        self.now, self.calls, self.left = 1.0, [], PARTS

    def perf_counter(self) -> float:
        return self.now

    def step(self, shots: int) -> int:
        self.calls.append(("step", shots))
        return shots

    def step_part(self, bands: int) -> bool:
        self.calls.append(("part", bands))
        self.now += PART * 1e-3
        self.left -= 1
        return self.left == 0


@pytest.fixture
def clockwork(monkeypatch: pytest.MonkeyPatch) -> Clockwork:
    work = Clockwork()
    monkeypatch.setattr(pacing, "time", work)
    return work


def pacer() -> Pacer:
    return Pacer(SimpleNamespace(ctx=SimpleNamespace(finish=lambda: None)))  # type: ignore[arg-type]


def frame(pace: Pacer, work: Clockwork, seconds: float, *, brisk: bool, shots: int = 1) -> list[tuple[str, int]]:
    """What a frame that begins so long after the last one does."""
    work.now += seconds
    work.calls.clear()
    pace.advance(work, 20.0, shots, brisk=brisk)  # type: ignore[arg-type]
    return list(work.calls)


@pytest.mark.parametrize(("brisk", "longest"), [(False, LONG_FRAME), (True, BRISK_FRAME)])
def test_short_frames_make_whole_shots_and_long_ones_bands(clockwork: Clockwork, brisk: bool, longest: float) -> None:
    pace = pacer()
    for _ in range(3):
        assert frame(pace, clockwork, 0.9 * longest, brisk=brisk) == [("step", 1)]
    bands = [frame(pace, clockwork, 1.1 * longest, brisk=brisk)[0][1] for _ in range(5)]
    assert bands == [2, 4, 8, MOST_BANDS, MOST_BANDS]
    clockwork.left = 1
    assert frame(pace, clockwork, 0.3 * longest, brisk=brisk) == [("part", MOST_BANDS // 2)]


def test_a_hand_gets_all_but_a_little_of_a_frame(clockwork: Clockwork) -> None:
    pace = pacer()
    frame(pace, clockwork, 0.0, brisk=False)
    idle = frame(pace, clockwork, 2 * LONG_FRAME, brisk=False)
    held = frame(pace, clockwork, 2 * LONG_FRAME, brisk=True)
    assert PART * len(idle) >= 20.0 > PART * (len(idle) - 1)
    assert PART * len(held) >= BRISK_BUDGET > PART * (len(held) - 1)
    assert frame(pace, clockwork, 2 * LONG_FRAME, brisk=True, shots=8)[0][0] == "part"
