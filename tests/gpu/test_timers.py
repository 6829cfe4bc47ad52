"""Of each pass, the first draws and then some are timed."""

from __future__ import annotations

from app.gpu import Gpu
from app.gpu.timers import EVERY, LAG, Timers


def test_after_a_reset_the_first_draws_are_timed_again(gpu: Gpu) -> None:
    """A pass that is drawn once has a time, whatever was drawn before."""
    timers = Timers(gpu.ctx)
    timers.enabled = True

    def draw(times: int) -> int:
        for _ in range(times):
            with timers.measure("a pass"):
                gpu.ctx.finish()
        timers.flush()
        return timers.calls["a pass"]

    assert draw(LAG + EVERY) == LAG + 1
    timers.reset()
    assert draw(1) == 1 and set(timers.mean_ms()) == {"a pass"}
    timers.release()
