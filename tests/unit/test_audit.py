"""What audits of shots know: which patches are off by too much, each by its place and size."""

import numpy as np

from app.solvers.shooting.audit import SOUND, Found
from app.solvers.shooting.records import SHOOTER


def patch(x: int, size: int) -> np.void:
    record = np.zeros(1, SHOOTER.dtype)
    record["patch_x"], record["signed_size"] = x, size
    return record[0]  # type: ignore[no-any-return]


def test_a_patch_fails_that_makes_or_loses_too_much() -> None:
    found = Found()
    for x, off in ((0, -1.1 * SOUND), (16, 1.1 * SOUND), (32, -0.9 * SOUND), (48, 0.9 * SOUND)):
        found.enter(patch(x, 16), off)
        assert found.fails(patch(x, 16)) == (abs(off) > SOUND)
    assert found.knows(patch(0, 16)) and not found.knows(patch(0, 8)) and not found.knows(patch(8, 16))
    again = Found()
    again.restore(found.state())
    assert again.fails(patch(0, 16)) and not again.fails(patch(48, 16))
