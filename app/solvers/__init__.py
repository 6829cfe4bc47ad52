"""Ways to solve for the light. Explicit beats discovery: one line for each solver."""

from collections.abc import Callable

from app.gpu import Gpu
from app.lightmap.lightmap import Lightmap
from app.solvers.base import EnergyBalance, Solver, StepReport
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
    "EnergyBalance",
    "ShootingOptions",
    "Solver",
    "StepReport",
    "UniformShooting",
]
