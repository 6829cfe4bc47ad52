"""An audit tries a shot before it is made; where it would make or lose light, its patch is divided.

Σ_j A_j F_ji V_ji plus what leaves the scene should be A_i. Where a patch sees from its middle what its edges do not, in a coffer
or beside a box, it is not. Most light is shot by few patches, so only strong ones are audited, each once.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np

from app.lightmap.lightmap import Lightmap
from app.solvers.shooting.deliver import Delivery
from app.solvers.shooting.ledger import Ledger
from app.solvers.shooting.receive import Receive
from app.solvers.shooting.records import Shot, powers_of, shot_of, sizes_of
from app.solvers.shooting.see import See
from app.solvers.shooting.shooters import ShooterBatch

# Shots of so large a share of the emitted power are audited; where one would make or lose more than this share of its own, its
# patch is divided: a hall under skylights in coffers gains 5.8 % without. A patch of two texels along its edge sees what its
# texels see.
AUDITED, SOUND, SMALL = 0.005, 0.02, 2


@dataclass(frozen=True)
class Audit:
    """What becomes of a shot, as shares of its power: received by texels, Σ A_j F_ji V_ji / A_i, sent out of the scene, and
    lost on black sides that have no texels. Their sum should be 1."""

    received: float
    open: float
    black: float
    shot: Shot

    @property
    def total(self) -> float:
        return self.received + self.open + self.black


class Auditor:
    """Tries shots. wanted: whether batches are still strong enough to be audited; never, unless ``enabled``."""

    def __init__(
        self, lightmap: Lightmap, shooters: ShooterBatch, delivery: Delivery, ledger: Ledger, *, enabled: bool
    ) -> None:
        self._lightmap, self._shooters, self._delivery, self._ledger = lightmap, shooters, delivery, ledger
        self._enabled, self._sound = enabled, set[tuple[int, int, int]]()  # patches that passed: column, row, edge
        self.begin()

    def begin(self) -> None:
        """Audit batches again: they may be strong again."""
        self.wanted = self._enabled

    def forget(self) -> None:
        """Patches may be others now."""
        self._sound.clear()

    def failed(self, see: See, receive: Receive, shots: int) -> Generator[None, None, list[np.void]]:
        """The shooters of the batch, SHOOTER, that would make or lose light and can shoot from finer patches. After the first
        batch without any strong one, none is audited any more. In parts; waits for the GPU."""
        shooters = self._shooters.read(shots)
        power, edge = powers_of(shooters), sizes_of(shooters)
        strong = power * self._ledger.watt > AUDITED * self._ledger.emitted.sum()
        self.wanted = bool(strong.any())
        corners = zip(shooters["patch_x"], shooters["patch_y"], edge, strict=True)
        patches = [(int(x), int(y), int(size)) for x, y, size in corners]
        tried = [k for k in np.flatnonzero(strong & (edge > SMALL)).tolist() if patches[k] not in self._sound]
        if not tried:
            return []
        failed = []
        for shot in tried:
            if abs(self.once(see, receive, shot).total - 1) > SOUND:
                failed.append(shooters[shot])
            else:
                self._sound.add(patches[shot])
            yield
        return failed

    def once(self, see: See, receive: Receive, shot: int) -> Audit:
        """What would become of a shot of the batch. Changes no light. Waits for the GPU."""
        self._delivery.clear()
        see.draw(shot, 1)
        receive.draw(shot, 1)
        see.add_escaped(shot, 1)
        self._delivery.weigh(see.maps, shot, 1)
        shooter = self._shooters.read(shot + 1)[shot]
        received, left, black = (float(shooter[name]) for name in ("received", "open", "black"))
        return Audit(received, left, black, shot_of(self._lightmap, shooter))
