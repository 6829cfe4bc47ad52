"""What an energy imbalance says of a solution, in one sentence, the same in the window, on the console and in reports.

Measured on 40 solves of 11 scenes by shooting and gathering, on 3000, 12,000 and 50,000 texels, that had less than 3 % of their
work left: within FINE local errors were 1 to 2 % in the median (median over solves), up to TOO_MUCH 3 to 4 %, and beyond 6 %,
with the mean of all light off by 4 %, at worst 14 %: what is lost or made is not reflected either. Smaller patches and texels,
and gathering, brought down what was too much (12.5 % to 6.5, 3.7 and 0.05 %), maps of higher resolution did not.
"""

from __future__ import annotations

from dataclasses import dataclass

from app.options import specs
from app.solvers import Family

FINE, TOO_MUCH = 0.005, 0.02  # of the emitted power


@dataclass(frozen=True)
class Verdict:
    """Of an imbalance. level: 0 is fine, 1 worth a look, 2 too much. text: what it is and what to do, unless it is fine."""

    level: int
    text: str | None = None


def verdict_of(imbalance: float, family: Family, remaining: float = 0.0, *, coarse: bool = False) -> Verdict:
    """imbalance: of the emitted power, above 0 where light is lost. family: of the solver. remaining: what is noise or missing
    in a solution that goes on: where no light is shot, it is in the imbalance, of which less says nothing yet. coarse: in
    texels that better ones are about to replace, of which there is nothing to do about it."""
    if abs(imbalance) < FINE:
        return Verdict(0)
    if coarse or (not family.distributes and abs(imbalance) < remaining):
        return Verdict(1)
    what = "is lost" if imbalance > 0 else "comes from nothing"
    return Verdict(
        2 if abs(imbalance) >= TOO_MUCH else 1, f"{abs(imbalance):.1%} of the light {what}: {_remedy(family)}"
    )


def _remedy(family: Family) -> str:
    """Why light is lost or comes from nothing, and what would do."""
    if not family.everywhere:
        return "what is far from the observer is known coarsely, or as a mean; --solver gathering lights all of it"
    why, smaller = "texels are", "--density"
    if not family.distributes:
        why = f"it is {family.remains}, or {why}"
    elif "level" in {spec.name for spec in specs(family.options)}:
        why, smaller = f"patches and {why}", "--density, --level"
    other = " or --solver gathering" if family.distributes else ""
    return f"{why} large beside what stands between them; smaller ones ({smaller}){other} would do"


__all__ = ["FINE", "TOO_MUCH", "Verdict", "verdict_of"]
