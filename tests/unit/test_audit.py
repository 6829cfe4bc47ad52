"""What audits of shots teach: patches are divided where that helps, and only there."""

import numpy as np
import pytest

from app.solvers.shooting.audit import SOUND, Found
from app.solvers.shooting.records import SHOOTER


def patch(x: int, size: int, chart: int = 1, *, sees_from: float = 0.0, covers: float = 1.0) -> np.void:
    """16 texels are one unit along its edge; covers: the share of it that has texels."""
    record = np.zeros(1, SHOOTER.dtype)
    record["area"], record["origin"] = covers * (size / 16) ** 2, (sees_from, 0.0, 0.0)
    record["patch_x"], record["signed_size"], record["chart"] = x, size, chart
    return record[0]  # type: ignore[no-any-return]


@pytest.fixture
def found() -> Found:
    """A patch of 16 texels has lost 5 % of its light; nothing is known of its quarters."""
    found = Found()
    found.enter(patch(0, 16), -0.05)
    return found


def test_a_patch_that_loses_light_by_its_extent_is_divided(found: Found) -> None:
    found.enter(patch(0, 8), -0.001)
    found.enter(patch(8, 8), -0.05)
    found.learn(patch(0, 16), [patch(0, 8), patch(8, 8)])
    assert found.fails(patch(0, 16)) and found.fails(patch(8, 8)) and not found.fails(patch(0, 8))


def test_what_all_quarters_lose_is_allowed_to_patches_of_that_chart_alone(found: Found) -> None:
    for x in (0, 8):
        found.enter(patch(x, 8), -0.048)
    found.learn(patch(0, 16), [patch(0, 8), patch(8, 8)])
    assert not found.fails(patch(0, 16))
    for k, (off, chart, fails) in enumerate(
        ((-0.06, 1, False), (0.0, 1, False), (0.03, 1, True), (-0.048 - 1.1 * SOUND, 1, True), (-0.06, 2, True)), 1
    ):
        found.enter(patch(16 * k, 16, chart), off)
        assert found.fails(patch(16 * k, 16, chart)) == fails, (off, chart)


def test_a_patch_without_quarters_that_shoot_is_divided(found: Found) -> None:
    found.learn(patch(0, 16), [])
    assert found.fails(patch(0, 16))


def test_a_quarter_that_holds_all_of_a_patch_tells_nothing(found: Found) -> None:
    corner = patch(0, 16, covers=0.2)
    found.enter(corner, -0.05)
    found.enter(patch(0, 8, covers=0.8), -0.05)
    found.learn(corner, [patch(0, 8, covers=0.8)])
    assert found.fails(corner)


def test_a_patch_that_sees_from_elsewhere_is_audited_again(found: Found) -> None:
    assert found.knows(patch(0, 16)) and found.knows(patch(0, 16, sees_from=0.1))
    assert not found.knows(patch(0, 16, sees_from=0.2))


@pytest.mark.parametrize(("off", "near"), [(-0.05, False), (-0.3, True), (0.3, True)])
def test_a_chart_whose_patch_is_far_off_has_something_near(off: float, near: bool) -> None:
    found = Found()
    found.enter(patch(0, 16), off)
    found.learn(patch(0, 16), [])
    assert (1 in found.near) == near


def test_what_was_found_is_kept(found: Found) -> None:
    found.enter(patch(16, 16, sees_from=0.5), 0.3)
    found.learn(patch(16, 16), [])
    again = Found()
    again.restore(found.state())
    assert again.near == {1} and again.fails(patch(0, 16))
    assert again.knows(patch(16, 16, sees_from=0.5)) and not again.knows(patch(16, 16))
