"""What an energy imbalance says of a solution, in one sentence, the same in the window, on the console and in reports.

Measured on 40 solves of 11 scenes by shooting and gathering, on 3000, 12,000 and 50,000 texels, that had less than 3 % of their
work left: within FINE local errors were 1 to 2 % in the median (median over solves), up to TOO_MUCH 3 to 4 %, and beyond 6 %,
with the mean of all light off by 4 %, at worst 14 %: what is lost or made is not reflected either. Smaller patches and texels,
and gathering, brought down what was too much (12.5 % to 6.5, 3.7 and 0.05 %), maps of higher resolution did not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from app.atlas.charts import Charts
from app.options import specs
from app.solvers import Family

FINE, TOO_MUCH = 0.005, 0.02  # of the emitted power
# Pixels: 10,000 boxes that are two wide lose 7 % of the sky's light, and those that are eight wide 1 %
FEW = 8
MOST = 2048  # that the option allows


@dataclass(frozen=True)
class Verdict:
    """Of an imbalance. level: 0 is fine, 1 worth a look, 2 too much. text: what it is and what to do, unless it is fine. known:
    whether it says anything of the solution yet."""

    level: int
    text: str | None = None
    known: bool = True


def verdict_of(
    imbalance: float, family: Family, remaining: float = 0.0, *, coarse: bool = False, finer: int | None = None
) -> Verdict:
    """imbalance: of the emitted power, above 0 where light is lost. family: of the solver. remaining: what is noise or missing
    in a solution that goes on: where no light is shot, it is in the imbalance, of which less says nothing yet. coarse: in
    texels that better ones are about to replace, of which there is nothing to do about it. finer: see ``finer_maps``."""
    if abs(imbalance) < FINE:
        return Verdict(0)
    if coarse:
        return Verdict(0, "coarse texels: better ones are on their way", known=False)
    if not family.distributes and abs(imbalance) < remaining:
        return Verdict(0, f"no more than the {family.remains} that is left", known=False)
    what = "is lost" if imbalance > 0 else "comes from nothing"
    level = 2 if abs(imbalance) >= TOO_MUCH else 1
    return Verdict(level, f"{per_cent(abs(imbalance))} of the light {what}: {_remedy(family, finer)}")


def per_cent(share: float, sign: str = "") -> str:
    """A share of the light as it reads everywhere: with two decimals, or one from 10 % on. sign: as of a format."""
    return f"{share:{sign}.{1 if abs(share) >= 0.1 else 2}%}"


def finer_maps(charts: Charts, across: float, resolution: int) -> int | None:
    """The resolution of maps in which no tenth of the area is on charts that are less than FEW pixels wide; None where that is so
    already, or options allow no finer. Maps of light from outside are twice as wide. across: what they show [m]."""
    needed = math.ceil(FEW * across / (2 * charts.narrow))
    return None if min(needed, MOST) <= resolution else min(1 << (needed - 1).bit_length(), MOST)


def _remedy(family: Family, finer: int | None) -> str:
    """Why light is lost or comes from nothing, and what would do."""
    if not family.everywhere:
        return "what is far from the observer is known coarsely, or as a mean; --solver gathering lights all of it"
    why, smaller = "texels are", "--density"
    if not family.distributes:
        why = f"it is {family.remains}, or {why}"
    elif "level" in {spec.name for spec in specs(family.options)}:
        why, smaller = f"patches and {why}", "--density, --level"
    other = " or --solver gathering" if family.distributes else ""
    pixels = "" if finer is None else f", finer maps (--resolution {finer})"
    return f"{why} large beside what stands between them; smaller ones ({smaller}){pixels}{other} would do"


__all__ = ["FINE", "TOO_MUCH", "Verdict", "finer_maps", "per_cent", "verdict_of"]
