"""An audit tries a shot before it is made; where it would make or lose light, its patch is divided.

Σ_j A_j F_ji V_ji plus what leaves the scene should be A_i. Where a patch sees from its middle what its edges do not, in a coffer
or beside a box, it is not. Most light is shot by few patches, so only strong ones are audited, each once from where it sees.

What dividing does not mend is no fault of the patch: maps are coarse for a scene of many small triangles, and all shots lose as
much. So quarters of a patch are tried before it is divided, and what all of them lose as well is allowed to patches of its chart.
"""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.gpu import Gpu, Pass
from app.lightmap.lightmap import Lightmap
from app.scene.model import F64
from app.solvers.shooting.ledger import Ledger
from app.solvers.shooting.receive import Receive
from app.solvers.shooting.records import Shot, powers_of, sizes_of
from app.solvers.shooting.see import See
from app.solvers.shooting.shooters import ShooterBatch
from app.util.state import State

# Shots of so large a share of the emitted power are audited; where one would make or lose more than this share of its own, its
# patch is divided: a hall under skylights in coffers gains 5.8 % without.
AUDITED, SOUND = 0.005, 0.02
# Emitters do not shoot from less than two texels: each texel of their own takes four times the shots before anything is lit.
SMALL = 2
# Where something is nearer than a patch is wide, as the back of a lamp under a ceiling, its middle tells nothing of its edges: it
# makes or loses more than this share, and its quarters may, too, until they are as small as it is near. Weaker shots of that
# chart are audited as well: of all charts, a staircase of 37,000 triangles takes a third longer and is no better for it.
NEAR, AUDITED_NEAR = 0.1, 0.001
# The middle of what a patch shoots moves as other light comes: by so much of its edge, and it is audited again.
MOVED = 0.125
# What a patch makes or loses because of its extent falls as its edge, to half in its quarters: where more than this share of it
# is left in all of them, it has other causes. A quarter that holds more than half of a patch, where a chart ends in it, tells
# nothing: it is as wide.
MENDED, SMALLER = 0.75, 0.5

Patch = tuple[int, int, int]  # column, row, edge


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


class AuditTargets:
    """What a shot that is only tried writes: light on texels, and the power on each tile. Gone when the audit is."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap) -> None:
        self._gpu = gpu
        self.light = gpu.texture(lightmap.size, 4, "f4")
        self.powers = gpu.texture((lightmap.columns, lightmap.rows), 1, "f4")
        self.light_target, self.power_target = gpu.target(self.light), gpu.target(self.powers)

    def __enter__(self) -> AuditTargets:
        return self

    def __exit__(self, *_: object) -> None:
        self._gpu.release_all(self.light_target, self.power_target, self.light, self.powers)


class Found:
    """What audits found: by how much of its power each patch is off, and what dividing does not mend in a chart.

    near: charts that have something nearer than their patches are wide.
    """

    def __init__(self) -> None:
        self._off, self._unmended = dict[Patch, float](), dict[int, float]()
        self._seen_from = dict[Patch, F64]()  # (3,) [solver space]
        self.near = set[int]()

    def clear(self) -> None:
        for known in (self._off, self._unmended, self._seen_from, self.near):
            known.clear()

    def state(self) -> State:
        off = [[*patch, off, *self._seen_from[patch]] for patch, off in self._off.items()]
        unmended = [[chart, left] for chart, left in self._unmended.items()]
        arrays = {"off": np.array(off).reshape(-1, 7), "unmended": np.array(unmended).reshape(-1, 2)}
        return State(arrays=arrays | {"near": np.array(sorted(self.near), np.int64)})

    def restore(self, state: State) -> None:
        """Know what is in a ``state``. Raises StateError."""
        self.clear()
        for x, y, edge, off, *origin in state.array("off", np.float64, -1, 7).tolist():
            patch = int(x), int(y), int(edge)
            self._off[patch], self._seen_from[patch] = off, np.array(origin)
        self._unmended |= {int(chart): left for chart, left in state.array("unmended", np.float64, -1, 2).tolist()}
        self.near |= set(state.array("near", np.int64, -1).tolist())

    def enter(self, shooter: np.void, off: float) -> None:
        """A patch, SHOOTER, makes that share of its power, or loses it."""
        patch = _patch_of(shooter)
        self._off[patch], self._seen_from[patch] = off, shooter["origin"].astype(np.float64)

    def knows(self, shooter: np.void) -> bool:
        """Whether that is known of a patch, from about where it sees now."""
        patch = _patch_of(shooter)
        if patch not in self._off:
            return False
        way = shooter["origin"] - self._seen_from[patch]
        return bool(way @ way <= MOVED**2 * shooter["area"])

    def fails(self, shooter: np.void) -> bool:
        """Whether a known patch is off by more than dividing leaves."""
        off, allowed = self._off[_patch_of(shooter)], self._unmended.get(int(shooter["chart"]), 0.0)
        return max(off - max(allowed, 0.0), min(allowed, 0.0) - off) > SOUND

    def learn(self, shooter: np.void, quarters: list[np.void]) -> None:
        """See whether a known patch is off as much in quarters of it, which are known, too, or has something near."""
        smaller = [quarter for quarter in quarters if quarter["area"] <= SMALLER * shooter["area"]]
        left = min((self._off[_patch_of(quarter)] for quarter in smaller), key=abs, default=0.0)
        off = self._off[_patch_of(shooter)]
        if abs(off) > NEAR:
            self.near.add(int(shooter["chart"]))
        elif abs(left) > MENDED * abs(off):
            self._unmended[int(shooter["chart"])] = left


class Auditor:
    """Tries shots. wanted: whether batches are still strong enough to be audited; never, unless ``enabled``. found: so far."""

    def __init__(self, gpu: Gpu, lightmap: Lightmap, shooters: ShooterBatch, ledger: Ledger, *, enabled: bool) -> None:
        self._gpu, self._lightmap, self._shooters, self._ledger = gpu, lightmap, shooters, ledger
        self._sum = Pass(gpu, "solvers/shooting/audit", defines=lightmap.defines("TILE"))
        self._enabled = enabled
        self.found = Found()
        self.begin()

    def begin(self) -> None:
        """Audit batches again: they may be strong again, and others may emit."""
        scene, charts = self._lightmap.scene, self._lightmap.charts
        emits = np.array([material.emits for material in scene.materials])[scene.material_ids[charts.face_triangle]]
        self._emitters = np.unique(charts.face_chart[emits])
        self.wanted = self._enabled

    def forget(self) -> None:
        """Patches may be others now."""
        self.found.clear()

    def failed(self, see: See, receive: Receive, shots: int) -> Generator[None, None, list[np.void]]:
        """The shooters of the batch, SHOOTER, that would make or lose light and can shoot from finer patches. After the first
        batch without any that is strong enough, none is audited any more. In parts; waits for the GPU."""
        shooters, near = self._shooters.read(shots), self.found.near
        power, emitted = powers_of(shooters) * self._ledger.watt, self._ledger.emitted.sum()
        self.wanted = bool((power > emitted * (AUDITED_NEAR if near else AUDITED)).any())
        strong = power > emitted * np.where(np.isin(shooters["chart"], list(near)), AUDITED_NEAR, AUDITED)
        least = np.where(np.isin(shooters["chart"], self._emitters), SMALL, 1)
        divisible = np.flatnonzero(strong & (sizes_of(shooters) > least)).tolist()
        yield from self.audit(see, receive, divisible, shooters)
        return [shooters[shot] for shot in divisible if self.found.fails(shooters[shot])]

    def audit(
        self, see: See, receive: Receive, shots: list[int], shooters: NDArray[np.void]
    ) -> Generator[None, None, None]:
        """Find out what those shots of the batch would make or lose, unless that is known. In parts; waits for the GPU."""
        tried = [shot for shot in shots if not self.found.knows(shooters[shot])]
        if not tried:
            return
        with AuditTargets(self._gpu, self._lightmap) as targets:
            for shot in tried:
                shares = self.shares(targets, see, receive, shot, float(powers_of(shooters[shot])))
                self.found.enter(shooters[shot], sum(shares) - 1)
                yield

    def shares(
        self, targets: AuditTargets, see: See, receive: Receive, shot: int, power: float
    ) -> tuple[float, float, float]:
        """What would become of a shot of the batch and its power: its shares received, open and black, see Audit. Changes no
        light. Waits for the GPU."""
        targets.light_target.clear()
        see.draw(shot, 1)
        receive.draw_into(targets.light_target, shot, 1)
        see.add_escaped(shot, 1)
        area = self._lightmap.textures("t_position_area")
        self._sum.draw(targets.power_target, textures=area | {"t_received": targets.light})
        received = np.frombuffer(targets.powers.read(), np.float32).astype(np.float64).sum()
        return float(received / power), *see.maps.escaped_shares(shot)

    def once(self, see: See, receive: Receive, shot: int, power: float) -> tuple[float, float, float]:
        """``shares`` with targets of its own."""
        with AuditTargets(self._gpu, self._lightmap) as targets:
            return self.shares(targets, see, receive, shot, power)


def _patch_of(shooter: np.void) -> Patch:
    return int(shooter["patch_x"]), int(shooter["patch_y"]), int(sizes_of(shooter))
