"""Shot by shot, shooting shows more than a solver must: what each shooter sees, and what becomes of what it sends out.

Benches and tests that take shots apart ask for this protocol; everything else is content with Solver.
"""

from __future__ import annotations

from typing import Protocol

from app.gpu import Texture
from app.lightmap.lightmap import Lightmap
from app.solvers.base import Solver
from app.solvers.shooting.audit import Audit
from app.solvers.shooting.batch import Batch
from app.solvers.shooting.options import ShootingOptions
from app.solvers.shooting.records import Shot


class InspectableShooting(Solver[ShootingOptions], Protocol):
    """batch: the parts that make shots. last_shot: the last that was reported."""

    lightmap: Lightmap
    batch: Batch
    last_shot: Shot | None

    def patch_edge(self, texel: tuple[int, int]) -> int:
        """Texels along the edge of the largest patch that a texel (column, row) of the tile pool may shoot from now."""

    def sight(self, shot: Shot | None = None) -> dict[str, Texture]:
        """What ``last_shot`` or another one sees: ``items`` and ``depth``, nothing before the first."""

    def vanished(self, shot: Shot | None = None) -> int:
        """Triangles that ``last_shot`` or another one sees only because each is drawn as one sample at least. Waits for the
        GPU."""

    def audit(self, corner: tuple[int, int]) -> Audit:
        """What becomes of a shot from the patch with this lower corner [texels of the tile pool] if it shot now. Changes no
        light. The patch must hold some residual."""

    def try_one(self) -> None:
        """Audit the first shot of the batch that was chosen last, to be timed."""
