"""Which solver works on the open scene, which one waits to take its place, and the options of each."""

from __future__ import annotations

from app.errors import UserError
from app.lightmap.tile_pool import TilePool
from app.options import Options
from app.session.ray_tree import RayTree
from app.solvers import SOLVERS, Family
from app.visibility.rays import tree_is_near


class Switching(RayTree):
    """The tree for a solver that takes the place of the one at work once it is there. solver: its name."""

    def __init__(self, pool: TilePool, solver: str) -> None:
        self.solver = solver
        super().__init__(pool)


class SolverChoice:
    """The solver at work, and at most one that waits for the tree of its rays. Raises UserError for a name that is none.

    at_work: its name; of no scene, the one that the next begins with. options: of each solver, by name. switching: to another.
    """

    def __init__(self, name: str, options: Options | None) -> None:
        """options: of that solver, its defaults if None."""
        self.at_work = _known(name)
        self.options = {other: family.options() for other, family in SOLVERS.items()}
        if options is not None:
            self.options[name] = options
        self.switching: Switching | None = None

    @property
    def family(self) -> Family:
        """The family of the solver at work."""
        return SOLVERS[self.at_work]

    @property
    def latest(self) -> str:
        """The name that was chosen last."""
        return self.at_work if self.switching is None else self.switching.solver

    def choose(self, name: str, pool: TilePool | None) -> bool:
        """This one instead of any other, for a scene's tile pool. Whether it can take its place now: else its tree is on its way.
        Raises UserError."""
        _known(name)
        self.stop()
        if name == self.at_work:
            return False
        if pool is None or not SOLVERS[name].rays or tree_is_near(pool):
            return True
        self.switching = Switching(pool, name)
        return False

    @property
    def has_arrived(self) -> bool:
        """Whether the waiting is over."""
        return self.switching is not None and (self.switching.ended or self.switching.cancelled)

    def arrived(self) -> str:
        """The solver that waited. Raises UserError where its tree cannot be had, or the user stopped it."""
        assert self.switching is not None
        switching, self.switching = self.switching, None
        if switching.cancelled:
            raise UserError(f"{SOLVERS[switching.solver].title}: stopped; {self.family.title} goes on")
        _ = switching.result
        return switching.solver

    def stop(self) -> None:
        """Wait for none."""
        if self.switching is not None:
            self.switching.cancel()
            self.switching = None


def _known(name: str) -> str:
    if name not in SOLVERS:
        raise UserError(f"--solver {name}: must be one of {', '.join(SOLVERS)}")
    return name
