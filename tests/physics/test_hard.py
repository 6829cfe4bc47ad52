"""The hard cases in their small size: see app/bench/hard_cases.py for what is expected and why. Quadtrees with the hemicube only:
``glowtree bench hard`` solves them with the hemispheres too."""

from __future__ import annotations

import dataclasses
import json

import pytest

from app.cli import run
from app.gpu import Gpu
from app.solvers import DEFAULT_SOLVER
from app.validation import run as hard
from app.validation.case import HardCase, Twins, Way, near
from app.validation.cases import CASES
from app.validation.run import allowed


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


def test_command_prints_what_holds_and_fails_where_one_does_not(
    gpu: Gpu, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    case = dataclasses.replace(next(c for c in CASES if c.name == "corner-90"), ways=(Way(), Way(storage="fixed8")))
    monkeypatch.setattr(hard, "CASES", (case,))
    assert run(["bench", "hard", "--only", "corner-90"]) == 0
    text = capsys.readouterr().out
    assert "| corner-90 |" in text and "FAILED" not in text
    assert case.about in text and "of the light here" in text
    wrong = dataclasses.replace(
        case, ways=(Way(),), claims=lambda light, twin: [near("light", 1.0, 2.0, 0.5, "no reason")]
    )
    monkeypatch.setattr(hard, "CASES", (wrong,))
    assert run(["bench", "hard", "--json"]) == 1
    values = json.loads(capsys.readouterr().out)
    assert values["failed"] == 1 and values["cases"][0]["claims"][-1]["holds"] is False
    assert run(["bench", "hard", "--only", "none"]) == 2
    assert "there are: corner-90" in capsys.readouterr().err
