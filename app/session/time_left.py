"""How much work there is time for until a solve is to end: pieces of work become smaller towards the end."""

from __future__ import annotations

NEAR_END = 2  # times as long as the last piece of work took: from there on the GPU is waited for,
LONG = 0.1  # s: and after pieces that took longer, which it costs little


class TimeLeft:
    """Of a solve that has ``seconds``, whose solver works in groups of ``grain`` units."""

    def __init__(self, seconds: float, grain: int) -> None:
        self._seconds, self._grain = seconds, grain
        self._issued, self._now, self._last = 0, 0.0, 0.0
        self._rates = (0.0, 0.0)  # seconds that a unit took in the last two pieces of work that issued any

    def piece(self, issued: int, now: float) -> None:
        """A piece of work is over: so much has been issued until now [s]."""
        more, self._last = issued - self._issued, now - self._now
        if more > 0:
            self._rates = self._rates[1], self._last / more
        self._issued, self._now = issued, now

    @property
    def _each(self) -> float:
        """Seconds that a unit takes: some pieces have more to do than others."""
        return max(self._rates)

    @property
    def waits(self) -> bool:
        """Whether the GPU is to be waited for after the next piece, so that it is timed well: else it may be one behind."""
        return self._each == 0.0 or self._last > LONG or self._seconds - self._now < NEAR_END * self._last

    @property
    def over(self) -> bool:
        """Whether the end is no farther than half a group, by the last piece: one before it may have had more to begin with."""
        return self._seconds - self._now <= self._grain * self._rates[1] / 2

    def room(self, most: int) -> int:
        """How much there is time for, to the nearest group; ``most`` while nothing is known."""
        if self._each == 0.0:
            return most
        groups = round((self._seconds - self._now) / self._each / self._grain)
        return min(max(groups, 1) * self._grain, most)
