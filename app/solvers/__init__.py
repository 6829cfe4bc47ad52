"""Ways to solve for the light. Explicit beats discovery: one line for each solver."""

from collections.abc import Callable

from app.atlas.lightmap import Lightmap
from app.gpu import Gpu
from app.solvers.base import EnergyBook, Solver, StepReport
from app.solvers.shooting.adaptive import AdaptiveShooting
from app.solvers.shooting.options import TREE, ShootingOptions
from app.solvers.shooting.uniform import UniformShooting

SOLVERS: dict[str, Callable[[Gpu, Lightmap, ShootingOptions], Solver[ShootingOptions]]] = {
    "shooting": UniformShooting,
    "adaptive": AdaptiveShooting,
}
DEFAULT_SOLVER = "shooting"

__all__ = [
    "DEFAULT_SOLVER",
    "SOLVERS",
    "TREE",
    "EnergyBook",
    "ShootingOptions",
    "Solver",
    "StepReport",
    "UniformShooting",
]
