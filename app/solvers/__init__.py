"""Ways to solve for the light. Explicit beats discovery: one row of SOLVERS for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.options import Options
from app.solvers.base import HEMISPHERE, EnergyBalance, Inspection, Progress, Rays, Rect, Solver
from app.solvers.gathering.hits import GROUP
from app.solvers.gathering.inspectable import SEEN
from app.solvers.gathering.options import GatheringOptions
from app.solvers.gathering.solver import BATCH as RAYS
from app.solvers.gathering.solver import Gathering
from app.solvers.local.options import LocalOptions
from app.solvers.local.solver import BATCH as UPDATES
from app.solvers.local.solver import Local
from app.solvers.pairs.options import PairsOptions
from app.solvers.pairs.solver import Pairs
from app.solvers.shooting.options import ShootingOptions
from app.solvers.shooting.records import BATCH
from app.solvers.shooting.solver import PICTURES, Shooting


@dataclass(frozen=True)
class Family:
    """A row of the table of solvers.

    title: what the viewer calls it. options: the class of its options, each a flag and a widget. make: makes one for a
    lightmap, or raises UserError before it has touched the light there. unit: of its work, in the plural, as in ``--shots``;
    each: what does so many, where that is not all, as in "56 rays a texel".
    remains: what is left of what it has to do, as in "0.1 % unshot"; part_of: of what that is a share. batch: work that it does
    at once when nothing waits for it; grain: it works in whole groups of so many. keeps_light: whether it can begin with light
    that another solver has left in the lightmap; else it begins anew. threshold: the option that says how little may remain when
    it has converged. pictures: captions of the images of its Inspection, and what they show.
    shows: options that change the light that is shown without any work. layers: names of what its solvers know of every texel.
    distributes: whether what remains is light that is still to be distributed, in the energy balance; else it is an error.
    per_error: how little may remain where an expected error is asked for, as a share of that.
    relights: whether its next piece of work shows all light of other lamps, so that they may flicker from frame to frame.
    for_coarse: makes one for coarse texels that better ones replace soon, where that is another; it takes less care.
    foresees: whether it shows light that is still to come, and may be told of it, see LightTextures.
    rays: whether it looks along rays, and so needs a tree of the scene's triangles (visibility/rays.py) before it is made.
    everywhere: whether it lights all surfaces alike, wherever they are seen from; else what is far is known roughly.
    quadratic: whether its work grows with the square of the texels.
    """

    title: str
    help: str
    options: type[Options]
    make: Callable[[Gpu, Lightmap, Any], Solver[Any]]
    unit: str
    remains: str
    batch: int
    threshold: str
    each: str = ""
    grain: int = 1
    keeps_light: bool = False
    pictures: Mapping[str, str] = field(default_factory=dict)
    shows: tuple[str, ...] = ()
    layers: tuple[str, ...] = ()
    distributes: bool = True
    quadratic: bool = False
    part_of: str = "mean"
    per_error: float | None = None
    relights: bool = False
    for_coarse: Callable[[Gpu, Lightmap, Any], Solver[Any]] | None = None
    foresees: bool = False
    rays: bool = False
    everywhere: bool = True

    def words(self, work: int | str) -> str:
        """So much work: ``1 shot``, ``56 rays a texel``."""
        count = work if isinstance(work, str) else f"{work:,}"
        return f"{count} {self.unit.removesuffix('s') if work == 1 else self.unit}{self.each and f' a {self.each}'}"


SOLVERS: dict[str, Family] = {
    "shooting": Family(
        title="Shooting",
        help="progressive radiosity: one patch after the other shoots its light (Cohen et al. 1988, Coombe et al. 2003)",
        options=ShootingOptions,
        make=Shooting,
        for_coarse=partial(Shooting, audits=False, coarse=True),
        unit="shots",
        remains="unshot",
        batch=BATCH,
        threshold="residual",
        pictures=PICTURES,
        shows=("ambient",),
        foresees=True,
        layers=("residual",),
    ),
    "gathering": Family(
        title="Gathering",
        help="every texel gathers along rays that are traced once (Kahl 2022)",
        options=GatheringOptions,
        make=Gathering,
        unit="rays",
        each="texel",
        remains="noise",
        batch=RAYS,
        grain=GROUP,
        threshold="noise",
        shows=("smooth",),
        layers=("direct", "variance", "rays"),
        pictures={HEMISPHERE: SEEN},
        distributes=False,
        per_error=0.25,
        relights=True,
        rays=True,
    ),
    "local": Family(
        title="Local matrix",
        help="what is around the observer is lit by a matrix of all reflections: for large worlds (Shcherbakov & Frolov 2019)",
        options=LocalOptions,
        make=Local,
        unit="updates",
        remains="missing",
        batch=UPDATES,
        threshold="missing",
        part_of="all",
        layers=("direct", "local"),
        distributes=False,
        relights=True,
        rays=True,
        everywhere=False,
    ),
    "pairs": Family(
        title="Texel pairs",
        help="every texel gathers from every other, or from windows of them: slow, to compare (Kahl 2022)",
        options=PairsOptions,
        make=Pairs,
        unit="bounces",
        remains="changed",
        batch=1,
        threshold="change",
        quadratic=True,
        rays=True,
    ),
}
DEFAULT_SOLVER = "shooting"

__all__ = [
    "DEFAULT_SOLVER",
    "HEMISPHERE",
    "SOLVERS",
    "EnergyBalance",
    "Family",
    "Inspection",
    "Progress",
    "Rays",
    "Rect",
    "ShootingOptions",
    "Solver",
]
