"""A shot that is made in parts, over several frames, is the same shot."""

from __future__ import annotations

import numpy as np
import pytest
from solver_scenes import begin, table_room

from app.gpu import Gpu
from app.util.parts import run_to_end

SHOTS = 5


@pytest.mark.usefixtures("undivided")  # small patches are not audited
@pytest.mark.parametrize("bands", [1, 3, 16])
def test_parts_add_up_to_the_shot(gpu: Gpu, bands: int) -> None:
    whole, cut = (begin(gpu, table_room(), texels=3000) for _ in range(2))
    parts = 0
    for _ in range(SHOTS):
        whole.step(1)
        parts += 1
        parts += sum(1 for _ in cut.solver.work(1, bands))
    assert parts == SHOTS * (2 * bands + 4)  # patches, audit, zero, see, receivers, the rest
    assert cut.solver.issued == whole.solver.issued == SHOTS
    # bands share no texel: each gets the same numbers, added in the same order
    np.testing.assert_array_equal(cut.H, whole.H)
    np.testing.assert_array_equal(cut.r, whole.r)
    np.testing.assert_array_equal(cut.book.escaped, whole.book.escaped)
    whole.release()
    cut.release()


@pytest.mark.parametrize("bands", [1, 3, 16])
def test_rays_in_parts_are_the_same_rays(gpu: Gpu, bands: int) -> None:
    whole, cut = (begin(gpu, table_room(), texels=3000, solver="gathering") for _ in range(2))
    for _ in range(3):
        whole.step(8)
        parts = sum(1 for _ in cut.solver.work(8, bands))
        assert parts >= 8 * min(bands, cut.lightmap.rows)
    assert cut.rays.traced == whole.rays.traced
    np.testing.assert_array_equal(cut.H, whole.H)
    whole.release()
    cut.release()


def test_so_do_the_parts_of_a_growing_tree(gpu: Gpu) -> None:
    """Leaves split, shots are made again into them, and leaves are judged: all in parts."""
    options = {"density": 4.0, "level": 1, "resolution": 64, "residual": 0.05, "depth": 2, "gradient": 0.3}
    whole, cut = (begin(gpu, table_room(), adaptive=True, **options) for _ in range(2))
    redone, most = 0, 0
    for _ in range(400):
        whole.step(1)
        parts = 1 + sum(1 for _ in cut.solver.work(1, 3))
        most = max(most, parts)
        redone += cut.solver.batch.replay.under_way is not None  # type: ignore[attr-defined]
        whole.solver.poll(wait=True)
        cut.solver.poll(wait=True)
    assert redone > 3 and whole.lightmap.tiles > 20, "nothing grew"
    assert most > 2 * 3 + 4, "leaves were judged in one part with something else"
    assert cut.solver.issued == whole.solver.issued
    np.testing.assert_array_equal(cut.H, whole.H)
    np.testing.assert_array_equal(cut.r, whole.r)
    whole.release()
    cut.release()


def test_what_needs_whole_shots_finishes_them(gpu: Gpu) -> None:
    """In the middle of a shot the shooter's residual is gone and not yet received: the book would be off by it."""
    room = begin(gpu, table_room(), texels=3000)
    work = room.solver.work(1, 8)
    for _ in range(3):
        next(work)
    ledger = room.solver.batch.ledger
    absorbed, unshot, _ = ledger.tile_sums()
    off = abs(absorbed.sum() + unshot.sum() - ledger.emitted.sum())
    assert off > 0.01 * ledger.emitted.sum(), "nothing was under way"
    book = room.book
    assert abs(book.imbalance_share) < 5e-3  # form factors
    assert room.solver.issued == 1
    assert next(work, None) is None, "it is over"
    next(room.solver.work(1, 8))
    room.solver.reset()
    assert room.solver.issued == 0 and room.H.max() == 0
    assert run_to_end(room.solver.work(1, 2)) == 1
    assert room.solver.issued == 1
    room.release()
