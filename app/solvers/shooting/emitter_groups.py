"""An emitter group is four patches of a strong lamp, of which one, its representative, shoots for all at first.

A strong lamp is divided into many patches, so that their shadows add up to soft ones; but the room should be lit long before all
of them have shot. So a representative shoots what its whole group has to shoot. Later, all members shoot at once what they have
to, which is less than nothing where it was shot for them: the group settles.
"""

from __future__ import annotations

import numpy as np

from app.lightmap.lightmap import Lightmap
from app.solvers.shooting.coarse_to_fine import Phases
from app.solvers.shooting.ledger import Ledger
from app.solvers.shooting.patch_marks import PatchMarks
from app.solvers.shooting.records import GROUP

MOST = 0.02  # of the emitted power: emitters of more are divided, one lamp into 50 patches at least,
COARSE_MOST = 0.2  # or 5, of which few shoot for all of them, where better light takes the place of this soon
SETTLED = 1 / 16  # of that: groups that are off by no more may settle when others shoot as much
MEMBERS = GROUP**2
CONTACT = (
    2  # 1 + by how many levels patches at contacts are finer than the finest: they light what stands there from near
)


class EmitterGroups:
    """How lamps are divided. settled: power that groups may be off by [stored units · solver area]."""

    def __init__(self, lightmap: Lightmap, ledger: Ledger, marks: PatchMarks, *, coarse: bool) -> None:
        """coarse: whether they are divided into few patches."""
        self._lightmap, self._ledger, self._marks = lightmap, ledger, marks
        self._coarse, self.settled = coarse, 0.0

    @property
    def _most(self) -> float:
        return COARSE_MOST if self._coarse else MOST

    def weigh(self, at_least: float = 0.0) -> None:
        """For the emitters that there are now; at_least: power that counts as much, for what is dimmed."""
        power = SETTLED * self._most * float(self._ledger.emitted.sum()) / self._ledger.watt
        self.settled = float(np.float32(max(power, at_least)))

    def divide(self, phases: Phases) -> None:
        """Let no patch hold much of the light, but where 8 bits do not hold what a small one gives. What was divided stays so:
        its groups may have to settle."""
        if self._lightmap.storage == "fixed8":
            return
        slots = np.flatnonzero(self._lightmap.emits.any((1, 2)))
        power = self._lightmap.emitted_power(slots)
        largest, finest = (phases.levels_of(slots, choice) for choice in (phases.now, phases.finest))
        most = self._most * self._ledger.emitted.sum()
        self._marks.divide_emitters(slots, power, most, largest, finest, phases.coarser(slots))

    def divide_contacts(self) -> None:
        """Let patches be finer where something stands on them; not with 8 bits, as above."""
        if self._lightmap.storage != "fixed8":
            self._marks.divide_at(self._lightmap.pool.surfaces.cut, CONTACT)

    def whole_groups(self, shots: int) -> int:
        """So many shots, of whole groups that settle: at least one."""
        return max(shots // MEMBERS, 1) * MEMBERS
