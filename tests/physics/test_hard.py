"""The hard cases in their small size: see app/bench/hard_cases.py for what is expected and why. Quadtrees with the hemicube only:
``glowtree bench hard`` solves them with the hemispheres too."""

from __future__ import annotations

import pytest

from app.bench.hard import allowed
from app.bench.hard_case import HardCase, Twins, Way
from app.bench.hard_cases import CASES
from app.gpu import Gpu
from app.solvers import DEFAULT_SOLVER


@pytest.fixture(scope="module")
def twins() -> Twins:
    """Solved so far."""
    return {}


@pytest.mark.parametrize(
    ("case", "way"),
    [
        pytest.param(case, way, id=f"{case.name} {way.name}", marks=() if way == Way() else pytest.mark.long)
        for case in CASES
        for way in case.ways
        if way.solver == DEFAULT_SOLVER or way.projection == "hemicube"
    ],
)
def test_hard_case(gpu: Gpu, twins: Twins, case: HardCase, way: Way) -> None:
    _, claims = case.run(gpu, way, "small", twins)
    broken = [c for c in claims if not c.holds]
    assert not broken, "; ".join(f"{c.what}: {c.measured:.6g}, not {c.expected:.4g} {allowed(c)}" for c in broken)
