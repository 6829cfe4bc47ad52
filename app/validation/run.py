"""``glowtree bench hard``: scenes that are hard on a light solver, each with the answer it must give and how far off it may be.

Every case is solved by every method that suits it: uniform texels and quadtrees, all projections, and storage in fewer bits; with
``--solver`` by those of one solver.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Sequence
from typing import Any

from app.errors import UserError
from app.gpu import gpu_context
from app.util.console import Console
from app.util.tables import markdown
from app.validation.case import FULL, Check, Controls, HardCase, Method, Solution
from app.validation.cases import CASES


def bench_hard(flags: argparse.Namespace) -> int:
    """Print the table; 1 if a check does not hold. Raises UserError."""
    console = Console(quiet=flags.json)
    work = [(case, method) for case in chosen(flags.only) for method in case.methods_by(flags.solver)]
    if not work:
        raise UserError(f"--solver {flags.solver}: none of these cases is for it")
    results, controls = [], Controls()
    with gpu_context() as gpu, console.progress("hard cases") as tell:
        for i, (case, method) in enumerate(work):
            tell(f"{case.name}, {method.name}", i / len(work))
            results.append((case, method, *case.run(gpu, method, flags.size, controls)))
        failed = sum(not check.holds for *_, checks in results for check in checks)
        values = {"renderer": gpu.limits.renderer, "size": flags.size, "failed": failed}
    values["cases"] = [_values(*result) for result in results]
    console.result(values, _text(values, results))
    return 1 if failed else 0


def chosen(names: Sequence[str] | None) -> list[HardCase]:
    """The cases with these names, or all. Raises UserError."""
    known = {case.name: case for case in CASES}
    if unknown := [name for name in names or () if name not in known]:
        raise UserError(f"no hard case '{unknown[0]}'; there are: {', '.join(known)}")
    return [known[name] for name in names] if names else list(CASES)


def _values(case: HardCase, method: Method, light: Solution, checks: Sequence[Check]) -> dict[str, Any]:
    return {
        "case": case.name,
        "about": case.about,
        "way": dataclasses.asdict(method),
        "texels": len(light.area),
        method.family.unit: light.work,
        "seconds": light.seconds,
        "claims": [dataclasses.asdict(check) | {"holds": check.holds} for check in checks],
    }


def _text(values: dict[str, Any], results: Sequence[tuple[HardCase, Method, Solution, list[Check]]]) -> str:
    """A table, then what the cases are and the reasons of their tolerances, each once."""
    rows, reasons = [], dict[str, int]()
    for case, method, _, checks in results:
        for check in checks:
            note = reasons.setdefault(check.reason, len(reasons) + 1)
            numbers = f"{check.expected:.4g}", f"{check.measured:.6g}", allowed(check)
            rows.append([case.name, method.name, check.what, *numbers, f"[{note}]", "ok" if check.holds else "FAILED"])
    head = ["case", "method", "what", "expected", "measured", "tolerance", "reason", "verdict"]
    abouts = [f"- {case.name}: {case.about}" for case in dict.fromkeys(result[0] for result in results)]
    notes = [f"[{note}] {reason}" for reason, note in reasons.items()]
    lost = [checks[2].measured for _, method, _, checks in results if method.storage != FULL]
    limit = [f"storage in fewer bits loses up to {max(lost):.1%} of the light here"] if lost else []
    end = f"{len(rows) - values['failed']} of {len(rows)} hold"
    return "\n".join([values["renderer"], "", *abouts, "", markdown(head, rows), "", *notes, *limit, end])


def allowed(check: Check) -> str:
    """The tolerance, as it is printed."""
    if check.less == check.more:
        return f"±{check.less:.2g}"
    return f"-{check.less:.2g} +{check.more:.2g}"
