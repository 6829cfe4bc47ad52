"""A solve ends when it is to end: its pieces of work get smaller towards that."""

from __future__ import annotations

import pytest

from app.session.time_left import TimeLeft

BATCH, FIRST, GRAIN = 16, 8, 4  # as rays are gathered


@pytest.mark.parametrize("seconds", [14.0, 25.0, 31.7, 60.0])
@pytest.mark.parametrize("extra", [0.0, 4.5])
def test_the_last_pieces_fit_into_the_time_that_is_left(seconds: float, extra: float) -> None:
    """Within half a group. extra: seconds that the first piece takes besides."""
    each, now, issued = 0.8, 0.0, 0
    left = TimeLeft(seconds, GRAIN)
    pieces = []
    left.piece(0, 0.0)
    while not left.over:
        more = -(-min(left.room(1 << 30), BATCH if issued else FIRST) // GRAIN) * GRAIN
        now, issued = now + each * more + (0.0 if issued else extra), issued + more
        left.piece(issued, now)
        pieces.append(more)
    assert abs(now - seconds) <= each * GRAIN / 2 + 1e-9
    assert len(pieces) <= seconds / each / BATCH + 5, "not smaller than they need to be"


def test_the_first_piece_is_made_whole() -> None:
    left = TimeLeft(1.0, GRAIN)
    left.piece(0, 0.0)
    assert left.room(BATCH) == BATCH and not left.over
    left.piece(FIRST, 5.0)
    assert left.over
