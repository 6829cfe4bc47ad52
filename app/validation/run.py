"""``glowtree bench hard``: scenes that are hard on a light solver, each with the answer it must give and how far off it may be.

Every case is solved in every way that it can be: uniform texels and quadtrees, all projections, and storage in fewer bits.
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
from app.validation.case import FULL, Claim, HardCase, Light, Twins, Way
from app.validation.cases import CASES


def bench_hard(flags: argparse.Namespace) -> int:
    """Print the table; 1 if a claim does not hold."""
    console = Console(quiet=flags.json)
    work = [(case, way) for case in chosen(flags.only) for way in case.ways]
    results, twins = [], Twins()
    with gpu_context() as gpu, console.progress("hard cases") as tell:
        for i, (case, way) in enumerate(work):
            tell(f"{case.name}, {way.name}", i / len(work))
            results.append((case, way, *case.run(gpu, way, flags.size, twins)))
        failed = sum(not claim.holds for *_, claims in results for claim in claims)
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


def _values(case: HardCase, way: Way, light: Light, claims: Sequence[Claim]) -> dict[str, Any]:
    return {
        "case": case.name,
        "about": case.about,
        "way": dataclasses.asdict(way),
        "texels": len(light.area),
        "shots": light.shots,
        "seconds": light.seconds,
        "claims": [dataclasses.asdict(claim) | {"holds": claim.holds} for claim in claims],
    }


def _text(values: dict[str, Any], results: Sequence[tuple[HardCase, Way, Light, list[Claim]]]) -> str:
    """A table, then what the cases are and the reasons of their tolerances, each once."""
    rows, reasons = [], dict[str, int]()
    for case, way, _, claims in results:
        for claim in claims:
            note = reasons.setdefault(claim.reason, len(reasons) + 1)
            numbers = f"{claim.expected:.4g}", f"{claim.measured:.6g}", allowed(claim)
            rows.append([case.name, way.name, claim.what, *numbers, f"[{note}]", "ok" if claim.holds else "FAILED"])
    head = ["case", "method", "what", "expected", "measured", "tolerance", "reason", "verdict"]
    abouts = [f"- {case.name}: {case.about}" for case in dict.fromkeys(result[0] for result in results)]
    notes = [f"[{note}] {reason}" for reason, note in reasons.items()]
    lost = [claims[2].measured for _, way, _, claims in results if way.storage != FULL]
    limit = [f"storage in fewer bits loses up to {max(lost):.1%} of the light here"] if lost else []
    end = f"{len(rows) - values['failed']} of {len(rows)} hold"
    return "\n".join([values["renderer"], "", *abouts, "", markdown(head, rows), "", *notes, *limit, end])


def allowed(claim: Claim) -> str:
    """The tolerance, as it is printed."""
    if claim.less == claim.more:
        return f"±{claim.less:.2g}"
    return f"-{claim.less:.2g} +{claim.more:.2g}"
