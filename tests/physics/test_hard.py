"""The hard cases in their small size: see app/validation/cases.py for what is expected and why. Quadtrees with the hemicube only,
and other maps only where what hides what is what makes the case hard: ``glowtree bench hard`` solves all by all. What the rim of
a stereographic map lets out is measured by test_energy.py's furnace, in less time."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from constant_solver import FAMILY

from app.cli import run
from app.gpu import Gpu
from app.solvers import SOLVERS
from app.validation import run as hard
from app.validation.case import HEMICUBE, Controls, HardCase, Method, methods_of, near
from app.validation.cases import CASES
from app.validation.run import allowed

HIDING = (
    "corner",
    "small-lamp",
    "lamp-at",
    "boxes",
    "thin-walls",
    "sliver",
    "tiny",
    "t-junctions",
    "slit",
    "labyrinth",
)


@pytest.fixture(scope="module")
def controls() -> Controls:
    """Solved so far."""
    return {}


@pytest.mark.parametrize(
    ("case", "method"),
    [
        pytest.param(case, method, id=f"{case.name} {method.name}")
        for case in CASES
        for method in case.methods_by(None)
        if method.projection in (None, HEMICUBE) or (not method.adaptive and case.name.startswith(HIDING))
    ],
)
def test_hard_case(gpu: Gpu, controls: Controls, case: HardCase, method: Method) -> None:
    _, checks = case.run(gpu, method, "small", controls)
    broken = [c for c in checks if not c.holds]
    assert not broken, "; ".join(f"{c.what}: {c.measured:.6g}, not {c.expected:.4g} {allowed(c)}" for c in broken)


@pytest.mark.parametrize("solver", [None, *SOLVERS])
def test_one_solver_or_all_but_those_that_are_slow(solver: str | None) -> None:
    solvers = {m.solver for case in CASES for m in case.methods_by(solver)}
    assert solvers == ({solver} if solver else {"shooting", "gathering"})


def test_command_solves_by_one_solver(gpu: Gpu, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["bench", "hard", "--solver", "gathering", "--only", "corner-90", "--json"]) == 0
    values = json.loads(capsys.readouterr().out)
    assert [(c["way"]["solver"], c["way"]["adaptive"]) for c in values["cases"]] == [
        ("gathering", False),
        ("gathering", True),
    ]
    assert all(c["rays"] > 0 for c in values["cases"])
    assert run(["bench", "hard", "--solver", "pairs", "--only", "corner-90", "--json"]) == 0
    [pairs] = json.loads(capsys.readouterr().out)["cases"]
    assert pairs["way"]["solver"] == "pairs" and pairs["bounces"] > 0
    assert run(["bench", "hard", "--solver", "gathering", "--only", "many-shots"]) == 2
    assert "none of these cases" in capsys.readouterr().err


def test_any_family_of_solvers_has_its_methods(gpu: Gpu, monkeypatch: pytest.MonkeyPatch) -> None:
    """One without projections is solved on uniform texels and quadtrees, by options that it has, and its light is checked."""
    monkeypatch.setitem(SOLVERS, "constant", FAMILY)
    uniform, adaptive = methods_of("constant")
    assert (uniform.name, adaptive.name) == ("constant uniform", "constant adaptive")
    case = next(c for c in CASES if c.name == "furnace-0.99")
    solution, checks = case.run(gpu, uniform, "small", {})
    assert solution.work == 6 and np.allclose(solution.H, 2.0), "until a fiftieth remains"
    assert [c.what for c in checks if not c.holds] == ["mean B, once all is shot, x (1 - ρ) / E"], "as dark as it is"


def test_command_prints_what_holds_and_fails_where_one_does_not(
    gpu: Gpu, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    case = dataclasses.replace(
        next(c for c in CASES if c.name == "corner-90"), methods=(Method(), Method(storage="fixed8"))
    )
    monkeypatch.setattr(hard, "CASES", (case,))
    assert run(["bench", "hard", "--only", "corner-90"]) == 0
    text = capsys.readouterr().out
    assert "| corner-90 |" in text and "FAILED" not in text
    assert case.about in text and "of the light here" in text
    wrong = dataclasses.replace(
        case, methods=(Method(),), checks=lambda light, control: [near("light", 1.0, 2.0, 0.5, "no reason")]
    )
    monkeypatch.setattr(hard, "CASES", (wrong,))
    assert run(["bench", "hard", "--json"]) == 1
    values = json.loads(capsys.readouterr().out)
    assert values["failed"] == 1 and values["cases"][0]["claims"][-1]["holds"] is False
    assert run(["bench", "hard", "--only", "none"]) == 2
    assert "there are: corner-90" in capsys.readouterr().err
