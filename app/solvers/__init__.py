"""Ways to solve for the light. Explicit beats discovery: one line for each solver."""

from app.solvers.base import EnergyBook, Solver, StepReport
from app.solvers.shooting.options import ShootingOptions
from app.solvers.shooting.uniform import UniformShooting

SOLVERS = {"shooting": UniformShooting}

__all__ = ["SOLVERS", "EnergyBook", "ShootingOptions", "Solver", "StepReport", "UniformShooting"]
