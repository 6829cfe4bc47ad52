"""Light from outside, of the sky, the sun and lamps without area, is one queue of shots, the strongest first.

Patches shoot in between, where they are stronger than what comes next. How much is still to come counts as unshot: of points it
is known; of directions, which send out what texels receive of them, it is about what the box around the scene would, times the
share of that which texels have received until now. An edit shoots the difference, negative too [Chen90], in turns with what is
positive.
"""

from __future__ import annotations

from collections.abc import Generator, Mapping
from dataclasses import asdict, dataclass
from itertools import takewhile
from typing import Any

import numpy as np

from app.gpu import Framebuffer, Mesh
from app.scene.lights import Light
from app.scene.model import F64
from app.solvers.shooting.direction_shots import DirectionShots
from app.solvers.shooting.equipment import Equipment
from app.solvers.shooting.ledger import Ledger
from app.solvers.shooting.options import ShootingOptions
from app.solvers.shooting.outside_sources import (
    KINDS,
    POINTS,
    SKY,
    SUNS,
    OutsideShot,
    Sources,
    difference,
    in_turns,
    light_of,
    share_of_shot,
    shots_of,
    sources_of,
)
from app.solvers.shooting.point_shots import PointShots
from app.solvers.shooting.records import BATCH
from app.util.parts import run_to_end
from app.util.state import State, StateError

# px: maps of what is sharp are so many times as fine, up to that; of the sun on a floor, edges would have teeth
FINER, FINEST = 4, 1024


@dataclass(frozen=True)
class Sent:
    """How far the queue was when a batch was over. to_come: of each kind, summed over RGB whatever its sign, of directions what
    would be sent to the box [W]. kind, power: the same of the batch, where it was directions."""

    to_come: Mapping[str, float]
    kind: str = POINTS
    power: float = 0.0

    @property
    def values(self) -> list[Any]:
        return [dict(self.to_come), self.kind, self.power]

    @staticmethod
    def of(values: list[Any]) -> Sent:
        """The one that has these ``values``."""
        to_come, kind, power = values
        return Sent({name: float(to_come[name]) for name in KINDS}, KINDS[KINDS.index(kind)], float(power))


class Outside:
    """The queue of one lightmap. Whoever makes it releases it.

    made: shots so far; sent: as it was after the last of its batches.
    """

    def __init__(self, equipment: Equipment, ledger: Ledger) -> None:
        self._equipment, self._lightmap, self._ledger = equipment, equipment.lightmap, ledger
        self._points: dict[bool, PointShots] = {}  # by whether they are sharp, see OutsideShot
        self._directions: dict[bool, DirectionShots] = {}
        low, high = self._lightmap.scene.bounds
        self._box = high - low

    def set_options(self, options: ShootingOptions, resolution: int) -> None:
        """Use other knobs from the next shot on."""
        self.release()
        self._options, self._resolution = options, resolution

    def begin(self) -> None:
        """Nothing has been shot."""
        self._given: Sources = {}
        self._queue: list[OutsideShot] = []
        self._at = self.made = 0
        self._received, self._box_sent = dict.fromkeys(KINDS, 0.0), dict.fromkeys(KINDS, 0.0)  # of directions [W],
        self._box_out = dict.fromkeys(KINDS, 0.0)  # and of all that were shot, also where no report of it is there
        self.change()

    def change(self) -> None:
        """There is other light outside: the difference to what was given is to come."""
        self._given = self._given_now()
        wanted = sources_of(self._lightmap.scene, self._lightmap)
        self._line_up(in_turns(shots_of(difference(wanted, self._given), self._box)))

    def _line_up(self, queue: list[OutsideShot]) -> None:
        """These are to come, besides what was given."""
        before = (s.solid_angle * light for s, light in self._given.items() if not s.from_afar)
        self._points_before = np.asarray(sum(before, np.zeros(3)))
        self._queue, self._at, self._in_turns = queue, 0, len({shot.gives for shot in queue}) == 2
        flux = np.array([shot.flux for shot in self._queue]).reshape(-1, 3)
        kinds = np.array([shot.kind for shot in self._queue], object)
        self._to_come = {kind: _from_each_on(flux * (kinds == kind)[:, None]) for kind in KINDS}
        self._power_to_come = {kind: _from_each_on(np.abs(flux).sum(1) * (kinds == kind)) for kind in KINDS}
        self.sent = Sent(self._powers)
        self._enter()

    def _given_now(self) -> Sources:
        """What has been given so far."""
        given = dict(self._given)
        for shot in self._queue[: self._at]:
            given[shot.source] = given.get(shot.source, np.zeros(3)) + shot.light * share_of_shot(shot.source)
        return {source: light for source, light in given.items() if light.any()}

    # -- kept for later ------------------------------------------------------------------------------------------------

    def state(self) -> State:
        """What has been given so far, and what is to come, to be kept for later."""
        received = {kind: [self._received[kind], self._box_sent[kind]] for kind in KINDS}
        state = State({"made": self.made, "at": self._at, "received": received, "sent": self.sent.values})
        state.values["given"] = [[asdict(source), light.tolist()] for source, light in self._given.items()]
        state.values["queue"] = [shot.values for shot in self._queue]
        return state

    def restore(self, state: State) -> None:
        """Go on as from a ``state`` of the same scene. Raises StateError."""
        known: dict[Light, Light] = {}
        self._given = {light_of(source, known): np.array(light) for source, light in state.values["given"]}
        self._line_up([OutsideShot.of(values, known) for values in state.values["queue"]])
        self._at, self.made = int(state.values["at"]), int(state.values["made"])
        if not 0 <= self._at <= len(self._queue):
            raise StateError(f"{self._at} of {len(self._queue)} shots")
        received = state.values["received"]
        self._received, self._box_sent = ({kind: float(received[kind][i]) for kind in KINDS} for i in (0, 1))
        self.sent = Sent.of(state.values["sent"])
        self._enter()

    # -- what is to come -----------------------------------------------------------------------------------------------

    @property
    def left(self) -> int:
        """Shots that are to come."""
        return len(self._queue) - self._at

    @property
    def _powers(self) -> dict[str, float]:
        return {kind: float(power[self._at]) for kind, power in self._power_to_come.items()}

    def power_to_come(self, sent: Sent | None = None) -> float:
        """Summed over RGB, whatever its sign [W]; now, or as it was."""
        to_come = self._powers if sent is None else sent.to_come
        return sum(self._share_received(kind) * power for kind, power in to_come.items())

    @property
    def next_power(self) -> float:
        """The power of the next shot [W]; 0 after the last."""
        if not self.left:
            return 0.0
        shot = self._queue[self._at]
        return float(np.abs(shot.flux).sum()) * self._share_received(shot.kind)

    def _share_received(self, kind: str) -> float:
        """About how much of what is sent to the box texels receive: of its kind, or where that has yet to begin, of the other."""
        kinds = [kind] if kind == POINTS or self._box_sent[kind] > 0 else [SUNS, SKY]
        sent = sum(self._box_sent[k] for k in kinds)
        return sum(self._received[k] for k in kinds) / sent if sent > 0 else 1.0

    def follow(self, directions: F64, sent: Sent) -> None:
        """Take in what directions have sent out when a batch was over, RGB [W]."""
        received, self._ledger.directions = directions - self._ledger.directions, directions
        if sent.power > 0:
            self._received[sent.kind] += float(abs(received.sum()))
            self._box_sent[sent.kind] += sent.power
            self._enter()

    def _enter(self) -> None:
        """Enter in the ledger what was sent out, and what is to come."""
        to_come = {kind: flux[self._at] for kind, flux in self._to_come.items()}
        arriving = {kind: self._share_received(kind) * flux for kind, flux in to_come.items()}
        self._ledger.to_come = sum(arriving.values(), np.zeros(3))
        begun = [kind for kind in KINDS if kind == POINTS or self._box_sent[kind] > 0]  # a sun tells little of a sky
        out, kind = sum(self._box_out.values()), self.sent.kind
        alone = out > 0 and out == self._box_out[kind] and begun == [POINTS] and not self._in_turns
        self._ledger.ahead = self._powers[kind] / out if alone else 0.0
        self._ledger.estimated = any(to_come[kind].any() for kind in (SUNS, SKY))
        self._ledger.foreseen = np.zeros(3) if self._in_turns else sum((arriving[k] for k in begun), np.zeros(3))
        self._ledger.points = self._points_before + self._to_come[POINTS][0] - to_come[POINTS]

    # -- shots ---------------------------------------------------------------------------------------------------------

    def shoot(self, shots: int, bands: int) -> Generator[None, None, int]:
        """The next ones of a kind, up to so many, in parts. Returns how many; whole lights, so that what was given is known."""
        first = self._queue[self._at]
        like = list(takewhile(first.is_like, self._queue[self._at : self._at + BATCH + 1]))
        count = min(max(shots, 2) if first.kind == POINTS else shots, BATCH, len(like))
        if count < len(like) and like[count - 1].source is like[count].source:
            count -= 1
        now = like[:count]
        yield from (self._for_points if first.kind == POINTS else self._for_directions)(first.sharp).shoot(
            now, self._ledger, bands
        )
        self._at += count
        self.made += count
        power = 0.0 if first.kind == POINTS else float(sum(np.abs(shot.flux).sum() for shot in now))
        self.sent = Sent(self._powers, first.kind, power)
        self._box_out[first.kind] += power
        self._enter()
        return count

    def given(self) -> list[OutsideShot]:
        """Shots that would give at once all that was given so far."""
        return shots_of(self._given_now(), self._box)

    def replay(
        self,
        shots: list[OutsideShot],
        target: Framebuffer,
        receivers: Mapping[bool, Mesh],
        rects: Mesh,
        bands: int,
    ) -> Generator[None, None, int]:
        """Add the first of these to a target, on some receivers, of which rects are the texels, in parts. How many."""
        now = list(takewhile(shots[0].is_like, shots[:BATCH]))
        if now[0].kind == POINTS:
            yield from self._for_points(now[0].sharp).replay(now, target, receivers, bands)
        else:
            yield from self._for_directions(now[0].sharp).replay(now, target, rects)
        return len(now)

    def _for_points(self, sharp: bool) -> PointShots:
        if sharp not in self._points:
            self._points[sharp] = PointShots(self._equipment, self._options, self._pixels(sharp))
        return self._points[sharp]

    def _for_directions(self, sharp: bool) -> DirectionShots:
        if sharp not in self._directions:
            self._directions[sharp] = DirectionShots(self._equipment, self._pixels(sharp))
        return self._directions[sharp]

    def _pixels(self, sharp: bool) -> int:
        """Resolution of maps [px]: what is sharp casts the edges of its shadows in one shot."""
        return max(self._resolution, min(FINER * self._resolution, FINEST)) if sharp else self._resolution

    def warm_up(self) -> Generator[None, None, None]:
        """One shot of each kind that there is. Spoils the light."""
        for kind in {(shot.kind, shot.sharp) for shot in self._queue}:
            self._at = next(nth for nth, shot in enumerate(self._queue) if (shot.kind, shot.sharp) == kind)
            with self._equipment.gpu.only_compiling():
                run_to_end(self.shoot(1, 1))
            yield

    def release(self) -> None:
        for points in self._points.values():
            points.release()
        for directions in self._directions.values():
            directions.release()
        self._points, self._directions = {}, {}


def _from_each_on(values: F64) -> F64:
    """Sums of values (n, …) from each on to the last; 0 after it."""
    return np.concatenate([np.cumsum(values[::-1], axis=0)[::-1], np.zeros_like(values, shape=(1, *values.shape[1:]))])


__all__ = ["Outside"]
