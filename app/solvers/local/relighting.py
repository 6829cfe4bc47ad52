"""Relighting finds the indirect light of the set as it is, in one piece of work or bounce by bounce in several."""

from __future__ import annotations

import numpy as np

from app.gpu import Texture
from app.solvers.local.form_factors import LocalSet
from app.solvers.local.lighting import SWEEPS, Lighting
from app.solvers.local.matrix import LocalMatrix
from app.solvers.local.members import DRIFT, Members

LEFT, MOST_REFLECTED = 1e-4, 0.99  # of light, that bounces may leave; mean albedo that their number allows for
OUTSIDE_BOUNCES = 8  # between the set and what is outside of it


class Relighting:
    """Of one set and its matrix. left: how often the light is still to be found until too little is missing to matter."""

    def __init__(self, lighting: Lighting, matrix: LocalMatrix, held: LocalSet, members: Members) -> None:
        self._lighting, self._matrix, self._held, self._members = lighting, matrix, held, members
        self._lit, self._other_direct, self.left = False, True, 0

    @property
    def done(self) -> bool:
        """Whether the light is that of the set as it is."""
        return self._lit and self.left == 0

    def changed(self, *, direct: bool = True) -> None:
        """The set is another one, and the direct light of texels or what they reflect of it, unless that is as it was."""
        self._lit, self._other_direct = False, self._other_direct or direct

    def forget(self) -> None:
        """There is no light any more."""
        self._lit, self._other_direct, self.left = False, True, 0

    def go_on(self, direct: Texture) -> None:
        """Find the light where it is not known yet: bounces that are done one after the other, and light from outside that
        follows from that inside, go on the next time."""
        if not self._lit:
            held, members = self._held, self._members
            albedo = members.albedo[held.node]
            self._lighting.set_nodes(held.node, held.area, albedo, held.outside, members.entered)
            self.left = self._bounces
        elif not self.left:
            return
        self._lighting.light(self._matrix, direct, other=self._other_direct)
        self._other_direct = False
        self._lit, self.left = True, max(self.left - 1, 0)

    @property
    def _bounces(self) -> int:
        """How often light is found until no more than LEFT of it is missing."""
        if self._matrix.coloured:
            return OUTSIDE_BOUNCES if np.abs(self._held.outside).max() > DRIFT else 0
        reflected = min(self._members.mean_albedo, MOST_REFLECTED)
        return int(np.ceil(np.log(LEFT) / np.log(reflected) / SWEEPS)) if reflected > 0 else 0


__all__ = ["Relighting"]
